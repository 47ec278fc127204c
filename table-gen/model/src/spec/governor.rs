//! What the governors cannot do: a dead band, a limited rate, a limited output.

use serde::{Deserialize, Serialize};

/// Limits of the governors, section `plant.governor`; a key that is absent is no limit, and without
/// any the plant is linear. The equations are those of [`crate::governor`].
///
/// Keys that are absent are no part of the spec's hash: a spec without this section is the one that
/// it was before the section existed.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GovernorSpec {
    /// Deviation to either side that the governors do not see; past it they see what is beyond.
    ///
    /// Unit: Hz. Allowed: a number from 0 to 5, or none. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub deadband_hz: Option<f64>,
    /// Fastest change of the governors' output g, either way.
    ///
    /// Unit: GW/s. Allowed: a number from 0.000001 to 1000, or none. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_gw_per_s: Option<f64>,
    /// Least output g of the governors, as a change from before the event.
    ///
    /// Unit: GW. Allowed: a number from -1000 to 0, or none. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lower_gw: Option<f64>,
    /// Greatest output g of the governors: the response that is held.
    ///
    /// Unit: GW. Allowed: a number from 0 to 1000, or none. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub upper_gw: Option<f64>,
}

impl GovernorSpec {
    /// Whether no key is there.
    #[must_use]
    pub fn is_absent(&self) -> bool {
        *self == Self::default()
    }
}
