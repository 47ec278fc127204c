//! A number to draw with.

use rand::Rng;
use rand_pcg::Pcg64;

/// A double in \[0, 1).
pub(crate) fn unit(random: &mut Pcg64) -> f64 {
    (random.next_u64() >> 11) as f64 * 2f64.powi(-53)
}
