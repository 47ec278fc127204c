//! Tables by update: signed containers in two slots of flash.
//!
//! | module | holds |
//! |---|---|
//! | [`container`] | the bytes of a signed container: class, version, time, table |
//! | [`key`] | the signature, and who is believed |
//! | [`class`] | which kind of charger a container is for |
//! | [`refusal`] | every reason why a container is not taken |
//! | [`device`] | a charger's checks of a container, in order |
//! | [`marks`] | what is written beside a container: complete, tried, confirmed |
//! | [`layout`] | where the two slots lie |
//! | [`slots`] | which of two slots a charger starts with, and how the other is written |
//! | [`trial`] | when a new table has run well enough to be kept |
//! | [`wire`] | a container that comes in parts over a line, and the answers |
//! | [`mapped`] | flash that the processor sees as memory |
//!
//! # What holds when the power fails
//! A charger has two slots, and at most one of them is written. The supply may fail within every
//! write and every erase, and what was being written then may read as anything, and as something
//! else each time. At the next start one of these is in force:
//!
//! - the table that was in force before,
//! - the new table, whole and verified,
//! - if there was no table before: none, and then the built-in one or the droop.
//!
//! A table that was confirmed is never left for an older one, as long as its slot reads well. The
//! argument is in [`slots`]; `tests/power_cuts.rs` attacks it.
#![no_std]
#![forbid(unsafe_code)]

pub mod class;
pub mod container;
pub mod device;
pub mod key;
pub mod layout;
pub mod mapped;
pub mod marks;
pub mod refusal;
pub mod slots;
pub mod trial;
pub mod wire;
