//! How likely a table keeps its promise: lower bounds on probabilities, every rounding downwards.
//!
//! Where a claim cannot hold with certainty, three layers say how likely it holds. Each is a bound,
//! not an estimate.
//!
//! | layer | what is drawn | module |
//! |---|---|---|
//! | 1 | the size of the loss, once an event | `loss`, `bands` |
//! | 2 | the error of the delivery, each period | `participation`, `closed_loop`, `union` |
//! | 3 | the noise of the measurement | `union` |
//!
//! The second layer rests on a finite Markov chain whose branches lead to *sets* of states: what
//! happens inside a branch is an adversary's choice. The chain knows nothing of this plant:
//!
//! | step | module |
//! |---|---|
//! | the chain | `chain` |
//! | its value over a horizon, rounded down | `value` |
//! | expected seconds below a limit, rounded up | `reward` |
//! | a chain in which a controller chooses too | `choices` |
//! | the same for processes with additive noise, on cells | `grid` |
//! | DRN and PRISM's explicit files, for an outside model checker | `export` |
//!
//! It is built for a table of laws by games in these steps:
//!
//! | step | module |
//! |---|---|
//! | coordinates in which the plant contracts | `modes` |
//! | a held input: where the state is at each tick, and f in between | `flight` |
//! | overlapping cells whose sets are closed under a step | `cover` |
//! | the firmware's decisions on a set | `decisions` |
//! | nodes and branches, from the event on; Hold, and commands that act late | `closed_loop` |
//! | other levels for a table, chosen on these sets | `maximise` |
//! | single runs of the same process, beside the bound | `sampled`, `under_way`, `kept` |
//!
//! `analysis` puts the layers together.
//!
//! The mathematics is in docs/probability.md.
#![forbid(unsafe_code)]

pub mod analysis;
pub mod bands;
pub mod chain;
pub mod choices;
pub mod closed_loop;
mod cover;
mod decisions;
pub mod export;
mod flight;
pub mod grid;
mod kept;
pub mod loss;
pub mod maximise;
mod modes;
pub mod normal;
pub mod participation;
pub mod reward;
pub mod sampled;
mod under_way;
pub mod union;
mod unit;
pub mod value;
