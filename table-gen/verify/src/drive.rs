//! The net power while a level is held.

use model::interval::Interval;

/// Interval in which the net power `P u' - w` \[kW\] may vary while a level is held, as centre and
/// radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Drive {
    /// Centre \[kW\].
    pub(crate) mid: f64,
    /// Largest distance from the centre \[kW\]; 0 if the net power is known exactly.
    pub(crate) radius: f64,
}

impl Drive {
    pub(crate) fn of(range: Interval) -> Self {
        let mid = range.mid();
        let exact = range.low == range.high;
        let radius = if exact { 0.0 } else { range.radius() };
        Self { mid, radius }
    }

    /// The interval.
    pub(crate) fn range(self) -> Interval {
        if self.radius == 0.0 {
            return Interval::point(self.mid);
        }
        let radius = Interval::point(self.radius).symmetric();
        Interval::point(self.mid) + radius
    }
}
