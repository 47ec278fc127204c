//! The specification: everything that synthesis, verification and simulation take from the user.
//!
//! A spec is a TOML document. On its way in it passes through, in this order:
//!
//! | step | file | what can be wrong |
//! |---|---|---|
//! | a shipped name or a path becomes text | `shipped`, `load` | unknown name, unreadable file |
//! | text becomes a table of keys | `load` | syntax, with line and column |
//! | names and types are checked | `keys`, `resolve` | unknown key, wrong type |
//! | `--set KEY=VALUE` replaces single keys | `overrides` | the same, named as an override |
//! | a formula becomes keys | `formula` | syntax, outside the fragment, a key that disagrees |
//! | missing keys take their defaults | `plant`, `grid`, `sampling`, `claims` | |
//! | ranges, relations of keys | `validate`, `geometry`, `memory` | values that cannot be |
//! | the plant's bands | `plant_bands` | bands that the plant is not in |
//!
//! What comes out is a [`Spec`]: plain numbers in the units that the key names carry.
//! [`Spec::hash`] names it in the table's header, so that a table can be told from one made for
//! another spec.
//!
//! # Design
//! One table of keys (`keys`) holds unit, range and description. The range check, the error texts,
//! the listing for people ([`reference()`]) and the hash all walk that table, so they cannot
//! disagree; a test compares it with the structs and with their documentation.

mod allowed;
mod chance;
mod charger;
mod claims;
mod compile;
mod delay_range;
mod error;
mod formula;
mod geometry;
mod governor;
mod grid;
mod hash;
mod key_value;
mod keys;
mod load;
mod memory;
mod meter;
mod origin;
mod overrides;
mod plant;
mod plant_bands;
mod preference;
mod resolve;
mod response;
mod sampling;
mod schema;
mod shipped;
#[cfg(test)]
mod tests;
mod validate;

pub use allowed::{Allowed, Range};
pub use chance::{ChanceSpec, LOSS_SYNTHETIC};
pub use charger::ChargerSpec;
pub use claims::{Domain, InitialBox, LossProfile, RequirementsSpec, TableSpec, UncertaintySpec};
pub use compile::{Compiled, NotSupported, compile};
pub use delay_range::DelayRange;
pub use error::SpecError;
pub use governor::GovernorSpec;
pub use grid::{Alignment, GridSpec};
pub use keys::{KeyDoc, reference};
pub use meter::{MeterKind, MeterSpec};
pub use plant::{BaselineSpec, Direction, FleetSpec, PlantSpec};
pub use preference::PreferenceSpec;
pub use sampling::{InputSpec, MethodSpec, SamplingSpec, Successor};
pub use schema::Spec;
