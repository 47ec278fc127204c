//! A spec's fallback droop and the event's end as messages of OCPP 2.1, and back.
//!
//! | module | holds |
//! |---|---|
//! | [`curve`] | the frequency-watt curve: checked once, then interpolated |
//! | [`messages`] | the messages' fields, by the published schemas |
//! | [`fallback`] | what is said in OCPP: droop, swing, the event's end; to and from a spec |
//! | [`export`] | a fallback to messages |
//! | [`import`] | messages to a fallback |
//! | [`container`] | the table, which OCPP cannot say: a signed container in `DataTransfer` |
//!
//! ## What the curve means
//! A point says at which frequency which power is drawn from the grid; discharging is negative.
//! Between two points the power lies on the line through them, so that -7000 W at 49.5 Hz and 0 W
//! at 50 Hz are -3500 W at 49.75 Hz. Beyond the ends the power is that of the end. `v2xBaseline` is
//! added. `docs/ocpp.md` is the reader's page.
#![forbid(unsafe_code)]

pub mod container;
pub mod curve;
pub mod export;
pub mod fallback;
pub mod import;
pub mod messages;
