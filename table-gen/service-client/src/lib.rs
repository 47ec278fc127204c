//! The host's side of the service protocol.
//!
//! | module | holds |
//! |---|---|
//! | [`port`] | a serial port: raw, 115 200 baud, answers with a time limit |
//! | [`client`] | questions, and orders sealed with the charger's key |
//! | [`introductions`] | who a charger says that it is, told apart from its telemetry |
//! | [`key_file`] | a charger's key as text |
//! | [`stand_in`] | a charger on a pseudo-terminal: the device's own code, for tests and trials |

pub mod client;
pub mod introductions;
pub mod key_file;
pub mod port;
pub mod stand_in;
