//! What each fuzz target does with bytes from outside: one function a target, which panics if a
//! promise of the firmware does not hold, and says whether the bytes got past the first decoder.
//!
//! libFuzzer calls them through `fuzz_targets/`, on nightly and for as long as one likes: `cargo
//! +nightly fuzz run table`. `firmware/tests/fuzz_targets.rs` calls the same functions with a
//! bounded corpus that is the same each time, on any toolchain.

pub mod link;
pub mod readings;
pub mod table;
pub mod telemetry;
