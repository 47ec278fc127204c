//! How often the intervals of `identify` hold what made the record: a hundred draws at one sample a
//! second and a hundred at ten, whose seeds shaped nothing. Several minutes of processor time;
//! docs/identification.md has the numbers.
#![allow(
    clippy::unwrap_used,
    reason = "a draw that cannot be identified ends the measurement"
)]

#[path = "../tests/identify/draws.rs"]
mod draws;

/// Draws at each step.
const DRAWS: u64 = 100;

fn main() {
    for (step_s, seed) in [(1.0, 71_000), (0.1, 93_000)] {
        let held = draws::covered(step_s, seed, DRAWS, &draws::CHAIN);
        println!("{step_s} s, time constants told: {held} of {DRAWS} draws");
    }
}
