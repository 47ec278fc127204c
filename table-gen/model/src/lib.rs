//! What every host package of Holdfast starts from: the specification, the plant, and rigorous
//! arithmetic.
//!
//! | module | turns | into |
//! |---|---|---|
//! | [`spec`] | a TOML document | checked numbers |
//! | [`logic`] | a temporal formula | requirements |
//! | [`plant`] | parameters | the equations, once, for plain numbers and intervals |
//! | [`plant_bands`] | a spec | the plants at the corners of its bands |
//! | [`propagator`] | the equations | the exact step in plain numbers |
//! | [`governor`], [`stepper`] | governors with limits | the same, not linear |
//! | [`interval`], [`flow`] | the equations | enclosures of the flow over a time |
//! | [`exponential`] | exp and ln | enclosures |
//! | [`independence`] | independent chargers | how far their mean is off, and how likely |
//! | [`participation`] | a text | how the delivered participation is drawn |
//! | [`table_fields`] | a spec | plant, droop, hypotheses and response in a table's whole numbers |
//! | [`grid_shape`] | a grid of cells | cell numbers |
//! | [`hex`] | bytes | what people read |
//! | [`budget`] | a table | bytes, visits and flash left, as data |
//! | [`verdict`] | a proof or its failure | what commands and report show |
#![forbid(unsafe_code)]

pub mod budget;
pub mod discrepancy;
pub mod exponential;
pub mod flow;
pub mod governor;
pub mod grid_shape;
pub mod hex;
pub mod independence;
pub mod interval;
pub mod logic;
pub mod participation;
pub mod plant;
pub mod plant_bands;
pub mod propagator;
pub mod spec;
pub mod stepper;
pub mod table_fields;
pub mod verdict;
