//! What needs to see the verifier's parts: its boxes and its tube against real trajectories. Whole
//! verdicts are tested in the package `tests`.

mod delay;
mod delay_range;
mod late_fleet;
mod plant_band;
mod tube;

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Draws of a test.
struct Random(Pcg64Mcg);

impl Random {
    fn new(seed: u64) -> Self {
        Self(Pcg64Mcg::seed_from_u64(seed))
    }

    /// In \[0, 1\).
    fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// -1 or 1.
    fn sign(&mut self) -> f64 {
        if self.0.next_u64() >> 63 == 0 {
            -1.0
        } else {
            1.0
        }
    }
}
