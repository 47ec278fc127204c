//! The proof of a law that is always on, for a whole fleet: own clocks, own meters, own delays.
//!
//! The law answers the measured f and its slope and nothing else, so every charger's command is the
//! law's answer to some recent f. The fleet's participation then lies in the hull of those answers
//! (`lines`), which are two straight lines in a sample of f. Between such lines the grid is linear,
//! and the worst that an adversary can do to any linear functional of the trajectory is found by
//! one sweep backwards through time (`adjoint`), without sets and without splitting. The bounds of
//! the samples so far make the lines of the next step (`window`), from the event on (`event`) and,
//! where they reproduce themselves, for ever (`for_ever`).
//!
//! | step | module |
//! |---|---|
//! | numbers of the loop, parameter bands | `fleet_loop` |
//! | lines below and above the delivered participation | `lines` |
//! | a plant that is not known, as a disturbance | `unknown`, `time_bands` |
//! | governors with limits, as a disturbance | `governor` |
//! | one functional, one sweep | `adjoint` |
//! | the window of readings that act in a step | `window` |
//! | what is bounded at every sample | `watched` |
//! | from the event on | `event` |
//! | for ever | `for_ever` |
//! | what the spec's meter makes of f | `meter` |
//! | one case; all cases of a proof, in parallel | `cases`, `plan` |
//! | the same for the droop, should every charger fall back to it | `fallback` |
//! | one event's losses, in stages | `staged` |
//! | from the bytes to the claims | `proof` |

mod adjoint;
mod cases;
mod event;
mod fallback;
mod fleet_loop;
mod for_ever;
mod governor;
mod lines;
mod meter;
mod plan;
mod proof;
mod staged;
#[cfg(test)]
mod testing;
mod time_bands;
mod unknown;
mod watched;
mod window;

pub use cases::{Case, Found, Resolution, examine};
pub use fleet_loop::{Assumed, FleetLoop, LossProfile, LossStage, PlantBand, RealLaw};
pub use meter::error_hz;
pub use plan::{LOSS_BAND_GW, Summary, cases, examine_all};
pub use proof::{Proof, case_of, verify};
pub use staged::{examine_staged, verify_staged};
pub use time_bands::TimeBands;
