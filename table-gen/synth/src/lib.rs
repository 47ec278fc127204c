//! From a specification to the bytes of a table.
//!
//! The modules in the order of the data:
//!
//! | module | turns | into |
//! |---|---|---|
//! | [`abstraction`] | plant and grid | boxes of successor cells |
//! | [`game`] | an abstraction and a target | allowed inputs and ranks |
//! | [`delay`] | a delay of the commands | what the games know then, and the device's prediction |
//! | [`synthesis`] | a spec | the laws C1, C2, Hold |
//! | [`compress`] | the laws' freedom | small trees and domains |
//! | [`emit`] | laws | the bytes of a table |
//! | [`inspect`], [`budget`] | a table | what is in it, and what it takes of a microcontroller |
//! | [`pipeline`] | a spec | a table, the whole way |
//! | [`boost_converter`] | nothing | a second plant: the engine knows none |
//! | [`usage`] | nothing | memory and processor time of this process |
#![forbid(unsafe_code)]

pub mod abstraction;
pub mod boost_converter;
pub mod budget;
pub mod compress;
pub mod delay;
pub mod emit;
pub mod game;
pub mod inspect;
pub mod pipeline;
pub mod synthesis;
pub mod usage;
