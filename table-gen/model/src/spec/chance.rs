//! What is drawn, where a bound holds with a probability instead of with certainty.

use serde::{Deserialize, Serialize};

use crate::participation::Participation;

/// Distributions, section `chance`; a key that is absent is no distribution, and what the spec
/// bounds elsewhere holds with certainty.
///
/// The command `prob` alone reads them: no table and no proof depends on them, so they stand in no
/// hash, and a flashed table can be asked about other distributions.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ChanceSpec {
    /// Sizes of the loss: `gb-synthetic`, or the path of a CSV of `loss_gw,weight`.
    ///
    /// Unit: -. Allowed: "gb-synthetic" or the path of a .csv file, or none. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loss: Option<String>,
    /// Error of the delivered participation, drawn anew each period.
    ///
    /// Unit: -. Allowed: "exact", "uniform:BOUND", "gaussian:SIGMA", "gaussian:SIGMA,DEVIATIONS",
    /// "truncated:SIGMA,BOUND" (relative, above 0, at most 1; deviations 1 to 8) or
    /// "bernoulli:CHARGERS" (1 to 10000000), or none. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub participation: Option<String>,
    /// Time from one draw of a response's participation to the next; absent: the period.
    ///
    /// Unit: s. Allowed: a number above 0 to 3600, or none. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub draw_interval_s: Option<f64>,
    /// Standard deviation of a normal error of each reading of f, beside the meter's own.
    ///
    /// Unit: Hz. Allowed: a number above 0 to 1, or none. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_hz: Option<f64>,
}

/// Name of the one distribution of losses that is built in.
pub const LOSS_SYNTHETIC: &str = "gb-synthetic";

impl ChanceSpec {
    /// Whether no key is there.
    #[must_use]
    pub fn is_absent(&self) -> bool {
        *self == Self::default()
    }

    /// The distribution of the participation; nothing where there is none, or where the text is
    /// none, which no checked spec has.
    #[must_use]
    pub fn drawn(&self) -> Option<Participation> {
        self.participation
            .as_deref()
            .and_then(|text| text.parse().ok())
    }
}

/// Whether a text names a distribution of losses: the built-in one, or a file that may be one.
pub(super) fn is_loss(text: &str) -> bool {
    let stem = text.strip_suffix(".csv");
    text == LOSS_SYNTHETIC || stem.is_some_and(|stem| !stem.is_empty())
}

#[cfg(test)]
mod tests {
    use super::super::Spec;

    #[test]
    fn distributions_are_read_and_others_are_refused_by_key() {
        let spec = |text: &str| Spec::from_toml(text, "a.toml", &[]);
        let good = spec(
            "[chance]\nloss = \"losses.csv\"\nparticipation = \"gaussian:0.05\"\nnoise_hz = 1e-3\n",
        )
        .unwrap();
        assert_eq!(good.chance.drawn(), "gaussian:0.05,5".parse().ok());
        assert_eq!(good.hash(), Spec::default().hash());
        let refused = |text: &str| spec(text).unwrap_err().to_string();
        assert_eq!(
            refused("[chance]\nloss = \"gb\"\n"),
            "a.toml: chance.loss: found \"gb\"; allowed: \"gb-synthetic\" or the path of a .csv file, or none"
        );
        let message = refused("[chance]\nparticipation = \"gauss:0.05\"\n");
        assert!(
            message.starts_with("a.toml: chance.participation: found \"gauss:0.05\"; allowed: ")
                && message.contains("\"gaussian:SIGMA\""),
            "{message}"
        );
        assert!(refused("[chance]\nnoise_hz = 0.0\n").contains("above 0 to 1"));
        assert!(refused("[chance]\nlosses = \"a.csv\"\n").contains("did you mean chance.loss?"));
    }
}
