//! The service protocol: how a charger is asked and told things on its telemetry line.
//!
//! | module | holds |
//! |---|---|
//! | [`frame`] | records between zero bytes, with a checksum, beside the telemetry's |
//! | [`message`] | what can be asked, and the answers |
//! | [`seal`] | who may change what a charger does: HMAC-SHA-256 over a challenge and an order |
//! | [`facts`] | what the charger's side must be told |
//! | [`device`] | the charger's side |
//!
//! `docs/service.md` is the schema and says against whom this protects. Nothing here allocates,
//! recurses or panics; nothing is `unsafe`. Both sides use this package, so that they agree.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod frame;

pub mod message;

pub mod seal;

pub mod facts;

pub mod device;
