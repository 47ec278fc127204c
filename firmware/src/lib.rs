//! The device side of Holdfast, and whatever both sides must agree on.
//!
//! The modules in the order in which a measurement becomes a charging power:
//!
//! | module | turns | into |
//! |---|---|---|
//! | [`units`] | quantities of the grid model | integers in micro-units, as on the host |
//! | [`frequency`] | bytes on a bus or timer ticks | a frequency, or a reason why there is none |
//! | [`observer`] | measured frequency | the grid state (f, g, l, p) |
//! | [`grid`] | a state | a cell, by the only quantiser there is |
//! | [`table`] | a cell | an input level, or "outside" |
//! | [`prediction`] | state and commands under way | the state in which a command begins to act |
//! | [`phase`] | state and table | the law in force: No control, C1, C2, Fixed, Hold |
//! | [`response`] | a frequency and its slope | a participation, by a law that is always on |
//! | [`droop`] | a frequency | the baseline participation, used as the fallback |
//! | [`control_loop`] | one state a tick | one [`control_loop::Action`] a tick |
//! | [`event`] | f over minutes | the end of an event, and the way back to ordinary charging |
//! | [`dispatch`] | a participation | this charger's current or power |
//! | [`charger`] | one reading a tick | the above, and a [`fault`] state for what is missing |
//! | [`limit_provider`] | a reading and the other limits | what may be drawn, for other firmware |
//! | [`board`] | a board's time and lines | the loop that ticks the charger |
//! | [`telemetry`] | a tick's report | a frame on a serial line |
//! | [`flash`] | a flash region | the table's bytes |
//! | [`retained`] | how the last run ended | a word that a reset leaves alone |
//! | [`link`] | requests of a host | the answers of a charger: processor in the loop |
//!
//! Nothing here allocates, recurses or panics; nothing is `unsafe`. Everything that decides is
//! integer arithmetic, so the host's abstraction and verifier, the simulator and the charger
//! compute the same bits.
//!
//! # From the bytes of a table to a participation
//! ```
//! use firmware::control_loop::ControlLoop;
//! use firmware::units::State;
//!
//! let bytes = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/tables/gb-bi.bin"));
//! let mut control = ControlLoop::new(bytes);
//! assert_eq!(control.table_error(), None);
//!
//! // One state a tick: f in uHz from 50 Hz; g, l, p in kW, which this table does not ask for.
//! let at = |f_uhz| State([f_uhz, 0, 0, 0]);
//! assert_eq!(control.step(at(0)).participation.ppm(), 0);
//! // 5.7 GW/Hz from -0.042 Hz on are more than the fleet's 1.4 GW at -0.3 Hz: everything.
//! assert_eq!(control.step(at(-300_000)).participation.ppm(), 1_000_000);
//!
//! // A damaged table is refused as a whole, and the droop of the firmware answers.
//! let mut damaged = *bytes;
//! damaged[40] ^= 1;
//! let mut control = ControlLoop::new(&damaged);
//! assert!(control.table_error().is_some());
//! assert!(control.step(at(-300_000)).participation.ppm() > 0);
//! ```
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod units;

pub mod frequency;

pub mod observer;

pub mod grid;

pub mod table;

pub mod prediction;

pub mod phase;

pub mod response;

pub mod droop;

pub mod control_loop;

pub mod event;

pub mod dispatch;

pub mod fault;

pub mod charger;

pub mod limit_provider;

pub mod board;

pub mod telemetry;

pub mod flash;

pub mod retained;

pub mod link;

pub mod wide;
