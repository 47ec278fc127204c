//! The claims of a spec about f, along a trajectory.

use model::spec::Spec;
use model::verdict::ClaimName;

/// Distance past a limit that counts \[Hz\]: far above the arithmetic's error.
const MARGIN_HZ: f64 = 1e-6;

/// The claims of a spec about f.
pub(super) struct Judge<'s> {
    spec: &'s Spec,
    /// When f first left I1, since the loss last rose \[s\].
    left_s: Option<f64>,
    since_s: f64,
    /// The smallest distance from a limit so far \[Hz\].
    pub(super) margin_hz: f64,
}

impl<'s> Judge<'s> {
    /// Nothing has happened yet.
    pub(super) const fn new(spec: &'s Spec) -> Self {
        Self {
            spec,
            left_s: None,
            since_s: 0.0,
            margin_hz: f64::INFINITY,
        }
    }

    /// Takes f \[Hz\] at a time \[s\], with the time since which the loss stands \[s\]; the claim
    /// that is broken.
    pub(super) fn judge(&mut self, time_s: f64, since_s: f64, f: f64) -> Option<ClaimName> {
        let requirements = &self.spec.requirements;
        if let Some(limit) = requirements.containment_hz {
            self.margin_hz = self.margin_hz.min(f - limit);
            if f < limit - MARGIN_HZ {
                return Some(ClaimName::Containment);
            }
        }
        if since_s > self.since_s {
            (self.since_s, self.left_s) = (since_s, None);
        }
        let [outer_low, outer_high] = requirements.outer_hz;
        if self.left_s.is_none() && (f < outer_low || f > outer_high) {
            self.left_s = Some(time_s);
        }
        let due_s = self.left_s? + requirements.settle_within_s;
        if !requirements.stay || time_s < due_s {
            return None;
        }
        let [low, high] = requirements.inner_hz;
        self.margin_hz = self.margin_hz.min(f - low).min(high - f);
        let outside = f < low - MARGIN_HZ || f > high + MARGIN_HZ;
        outside.then_some(ClaimName::Settle)
    }
}
