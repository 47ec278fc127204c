//! The host side of Holdfast: from a specification to proven flash bytes, and the grid to try them on.
//!
//! The modules in the order of the data:
//!
//! | module | turns | into |
//! |---|---|---|
//! | [`spec`] | a TOML document | checked numbers |
//! | [`plant`] | parameters | the equations, once, for plain numbers and intervals |
//! | [`interval`], [`flow`] | the equations | enclosures of the flow over a time |
//! | [`grid_shape`], [`abstraction`] | plant and grid | boxes of successor cells |
//! | [`game`] | an abstraction and a target | allowed inputs and ranks |
//! | [`delay`] | a delay of the commands | what the games know then, and the device's prediction |
//! | [`synthesis`] | a spec | the laws C1, C2, Hold |
//! | [`compress`] | the laws' freedom | small trees and domains |
//! | [`emit`] | laws | the bytes of a table |
//! | [`inspect`], [`budget`] | a table | what is in it, and what it takes of a microcontroller |
//! | [`pipeline`] | a spec | a table, the whole way |
//! | [`verify`] | bytes and a spec | a verdict, independently of all before |
//! | [`falsify`] | bytes and a spec | a real trajectory that breaks a claim, if a search finds one |
//! | [`logic`] | a temporal formula | requirements, and monitors of traces |
//! | [`simulation`] | a table, or a baseline | the grid's frequency in time |
//! | [`fleet`] | a table | the same with one firmware for each charger |
//! | [`replay`] | a recorded frequency | what the firmware would have done |
//! | [`monitor`] | a charger's telemetry | lines for a person |
//! | [`boost_converter`] | nothing | a second plant: the engine knows none |
//! | [`counterfactual`] | a recorded event | what it would have been with the chargers |
//! | [`report`] | runs and findings | one HTML page and its figures |
//! | [`cli`] | arguments | all of the above |
#![forbid(unsafe_code)]

pub mod abstraction;
pub mod boost_converter;
pub mod budget;
pub mod cli;
pub mod compress;
pub mod counterfactual;
pub mod delay;
pub mod emit;
pub mod falsify;
pub mod fleet;
pub mod flow;
pub mod game;
pub mod grid_shape;
pub mod inspect;
pub mod interval;
pub mod logic;
pub mod monitor;
pub mod pipeline;
pub mod plant;
pub mod replay;
pub mod report;
pub mod simulation;
pub mod spec;
pub mod synthesis;
pub mod usage;
pub mod verify;
