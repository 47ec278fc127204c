//! Powers of the fleet: what is commanded, what is delivered beside it, and how a node keeps one.

use model::interval::Interval;

use super::Loop;
use crate::flight::NetPower;

impl Loop<'_> {
    /// Power under a level as the device expects it \[GW\].
    pub(super) fn commanded(&self, level: u8) -> Interval {
        let ppm = self.table.header().participation(level).ppm();
        self.fleet * Interval::point(f64::from(ppm)) / Interval::point(1e6)
    }

    /// What is delivered beside what is commanded, and how the loss moves.
    pub(super) fn beside(&self, level: u8, delivered: Interval) -> NetPower {
        NetPower {
            range: self.fleet * delivered - self.commanded(level),
            moving: self.net(delivered).moving,
        }
    }

    /// Whole bins that hold a power.
    pub(super) fn bins_of(&self, power: Interval) -> [i32; 2] {
        let bin = Interval::point(self.bin_gw);
        let mut first = (power.low / self.bin_gw).floor();
        let mut last = (power.high / self.bin_gw).ceil();
        // A quotient may be rounded past a whole number.
        if (Interval::point(first) * bin).low > power.low {
            first -= 1.0;
        }
        if (Interval::point(last) * bin).high < power.high {
            last += 1.0;
        }
        [first as i32, last as i32]
    }

    /// The powers of whole bins; a fleet gives no more than all and no less than nothing.
    pub(super) fn power(&self, bins: [i32; 2]) -> Interval {
        let bin = Interval::point(self.bin_gw);
        let [first, last] = bins.map(|at| Interval::point(f64::from(at)) * bin);
        Interval {
            low: first.low.max(0.0),
            high: last.high.min(self.fleet.high),
        }
    }
}
