//! A charger's settings: what may be set, within which range, and a place in flash for it.
//!
//! | module | holds |
//! |---|---|
//! | [`key`] | every setting: number, name, unit, range, default |
//! | [`values`] | a value for each of them, checked one by one and with each other |
//! | [`record`] | all values as bytes |
//! | [`flash`] | erasing that a power cut does not leave half done |
//! | [`store`] | what is kept in flash: the record, the device key, the challenges' numbers |
//! | [`config`] | values to what the firmware takes: charger, meter, times, limits |
//! | [`orders`] | limits and the owner's override, which last for a while and are not kept |
//! | [`testing`] | flash in memory |
//!
//! Nothing here allocates, recurses or panics; nothing is `unsafe`.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod key;

pub mod values;

pub mod record;

pub mod flash;

pub mod store;

pub mod config;

pub mod orders;

pub mod testing;
