//! From a specification to the bytes of a table.
//!
//! The modules in the order of the data:
//!
//! | module | turns | into |
//! |---|---|---|
//! | [`abstraction`] | plant and grid | boxes of successor cells |
//! | [`game`] | an abstraction and a target | allowed inputs and ranks |
//! | [`drives`], [`problem`] | a spec | everything derived from it, once |
//! | `chain_times` | time constants in bands | how far the governors' output is off |
//! | [`delay`] | a delay of the commands | what the games know then, and the device's prediction |
//! | [`changeover`] | a delay that is a range | what some chargers' old command does to a period |
//! | [`checkpoint`] | a game | a file to go on from |
//! | [`ranks`] | a game | slabs of it on several machines |
//! | [`synthesis`] | a spec | the laws C1, C2, Hold |
//! | [`compress`] | the laws' freedom | small trees and domains |
//! | [`emit`] | laws | the bytes of a table |
//! | [`chosen`] | levels, cell by cell | a table's bytes, without a game |
//! | [`inspect`], [`budget`] | a table | what is in it, and what it takes of a microcontroller |
//! | [`pipeline`] | a spec | a table, the whole way |
//! | [`trigonometry`] | angles | enclosures of sine and cosine, for non-linear plants |
//! | [`yardsticks`] | nothing | other plants: the engine knows none |
//! | [`usage`] | nothing | memory and processor time of this process |
#![forbid(unsafe_code)]

pub mod abstraction;
pub mod budget;
mod chain_times;
pub mod changeover;
pub mod checkpoint;
pub mod chosen;
pub mod compress;
pub mod delay;
pub mod drives;
pub mod emit;
pub mod game;
pub mod inspect;
pub mod pipeline;
pub mod problem;
pub mod ranks;
pub mod synthesis;
pub mod trigonometry;
pub mod usage;
pub mod yardsticks;
