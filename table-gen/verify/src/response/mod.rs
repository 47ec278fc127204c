//! The proof of a law that is always on, for a whole fleet: own clocks, own meters, own delays.
//!
//! The law answers the measured f and its slope and nothing else, so every charger's command is the law's answer to some recent f. The
//! fleet's participation then lies in the hull of those answers (`lines`), which are two straight lines in a sample of f. Between such lines
//! the grid is linear, and the worst that an adversary can do to any linear functional of the trajectory is found by one sweep backwards
//! through time (`adjoint`), without sets and without splitting. The bounds of the samples so far make the lines of the next step
//! (`window`), from the event on (`event`) and, where they reproduce themselves, for ever (`for_ever`).
//!
//! | step | module |
//! |---|---|
//! | numbers of the loop, parameter bands | `fleet_loop` |
//! | lines below and above the delivered participation | `lines` |
//! | one functional, one sweep | `adjoint` |
//! | the window of readings that act in a step | `window` |
//! | from the event on | `event` |
//! | for ever | `for_ever` |
//! | bands of the loss and of the plant's parameters, in parallel | `cases` |

mod adjoint;
mod cases;
mod event;
mod fleet_loop;
mod for_ever;
mod lines;
#[cfg(test)]
mod testing;
mod window;

pub use cases::{Case, Found, Resolution, examine};
pub use fleet_loop::{Assumed, FleetLoop, Law, LossProfile, PlantBand};
