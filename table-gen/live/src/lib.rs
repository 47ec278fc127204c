//! Chargers' telemetry as a page that follows them.
//!
//! | module | holds |
//! |---|---|
//! | [`tick`] | a frame as the page shows it |
//! | [`feed`] | the ticks of all chargers, for any number of readers |
//! | [`source`] | a port or a recording to ticks, at its own speed |
//! | [`server`] | the page and its events over HTTP |
//!
//! The page is three files that are compiled in; it asks nobody but this server for anything.
//! Events go one way, as server-sent events: the browser connects again by itself and goes on
//! where it was.
#![forbid(unsafe_code)]

pub mod feed;
pub mod server;
pub mod source;
pub mod tick;
