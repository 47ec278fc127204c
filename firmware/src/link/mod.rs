//! Processor in the loop: the host plays the mains, the processor plays the charger.
//!
//! Request and response travel in lock step as frames of two bytes of length (little-endian) and a
//! postcard record. The [`session`] that answers is the same code in the Arm image and on the host,
//! so comparing the two answers compares the two processors.

pub mod session;

use serde::{Deserialize, Serialize, de::DeserializeOwned};

use crate::telemetry::{Frame, TableId};
use crate::units::STATES;

/// Version of the requests and responses.
pub const LINK_VERSION: u8 = 2;
/// Bytes of the length in front of a record.
pub const LENGTH_LEN: usize = 2;
/// Longest record.
pub const RECORD_MAX: usize = 160;
/// Longest frame.
pub const FRAME_MAX: usize = LENGTH_LEN + RECORD_MAX;

/// Where the session's charger takes its frequency from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum SourceKind {
    /// Deviations sent by the host, exact to 1 µHz.
    Deviation,
    /// The ADE7953 driver over a register bus that the host feeds.
    Ade7953,
    /// The zero-crossing window over time stamps that the host sends, on a timer of 1 MHz.
    ZeroCrossing,
}

/// A new charger.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Setup {
    /// Frequency source.
    pub source: SourceKind,
    /// Bidirectional power stage, or pilot and contactor.
    pub bidirectional: bool,
    /// Serial number: the place in the fleet.
    pub serial: u32,
    /// Limit of every source \[mA, or W when bidirectional\].
    pub limit: u32,
    /// Ticks of warm-up; `None` for the plant's own.
    pub warm_up_ticks: Option<u16>,
    /// Whether the start follows a brown-out.
    pub brown_out: bool,
}

/// What the mains does at a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mains {
    /// Nothing arrives: the bus is dead, no crossing is seen.
    Silent,
    /// A deviation \[µHz\] of this age \[ms\].
    Deviation {
        /// Deviation from nominal \[µHz\].
        uhz: i32,
        /// Age \[ms\].
        age_ms: u16,
    },
    /// The PERIOD register's value.
    Period(u16),
    /// Zero crossings since the last tick \[timer ticks\], the first `count` of them.
    Crossings {
        /// How many.
        count: u8,
        /// When.
        stamps: [u32; 8],
    },
}

/// From the host.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Request {
    /// Who are you?
    Hello,
    /// Make a new charger.
    Start(Setup),
    /// One tick of the charger.
    Tick {
        /// The charger's clock \[ms\].
        now_ms: u32,
        /// The mains.
        mains: Mains,
    },
    /// Forget the event in the bare control loop.
    Reset,
    /// One tick of the bare control loop.
    State([i32; STATES]),
    /// Quantise and look up in a law (0 C1, 1 C2, 2 Hold).
    Lookup {
        /// The law.
        law: u8,
        /// State f, g, l, p \[µHz, kW\].
        state: [i32; STATES],
    },
    /// The end.
    Stop,
}

/// What a tick put on the charger's pins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Pins {
    /// Duty of the pilot \[timer counts\].
    pub pilot_counts: u16,
    /// Contactor's coil.
    pub contactor: bool,
    /// Power stage's set-point \[W\].
    pub power_w: i32,
    /// Times the watchdog was fed.
    pub fed: u32,
}

/// From the charger.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Response {
    /// I am.
    Hello {
        /// [`LINK_VERSION`].
        version: u8,
        /// The table, if it was accepted.
        table: Option<TableId>,
    },
    /// Done.
    Done,
    /// A tick's report and pins.
    Tick {
        /// The report as telemetry carries it.
        frame: Frame,
        /// The pins.
        pins: Pins,
    },
    /// The bare control loop's action.
    Action {
        /// Participation \[ppm\].
        participation_ppm: u32,
        /// Number of the phase, as in telemetry.
        phase: u8,
        /// Whether the table decided.
        from_table: bool,
    },
    /// Level of a lookup; `None` outside the law's domain.
    Level(Option<u8>),
    /// The request was not understood, or came before `Start`.
    Refused,
}

/// A response with what it cost on the processor; zeros on the host.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reply {
    /// The response.
    pub response: Response,
    /// Ticks of the system timer for it.
    pub systick: u32,
    /// Stack used for it \[bytes\], where it was painted.
    pub stack: u32,
}

/// Why bytes are not a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinkError {
    /// The length is zero or more than [`RECORD_MAX`].
    BadLength {
        /// Length found.
        found: u16,
    },
    /// Fewer bytes than the length says.
    Truncated,
    /// Not a record of the type expected.
    Malformed,
}

/// The record's length that a frame starts with.
///
/// # Errors
/// A length that no record has.
pub const fn record_length(prefix: [u8; LENGTH_LEN]) -> Result<usize, LinkError> {
    let found = u16::from_le_bytes(prefix);
    if found == 0 || found as usize > RECORD_MAX {
        return Err(LinkError::BadLength { found });
    }
    Ok(found as usize)
}

/// A record from its bytes, without the length.
///
/// # Errors
/// Bytes of another type, or more of them than the record has.
pub fn decode<T: DeserializeOwned>(record: &[u8]) -> Result<T, LinkError> {
    match postcard::take_from_bytes(record) {
        Ok((value, [])) => Ok(value),
        _ => Err(LinkError::Malformed),
    }
}

/// A record from a whole frame.
///
/// # Errors
/// As [`record_length`] and [`decode`], and a frame that is cut short.
pub fn decode_frame<T: DeserializeOwned>(frame: &[u8]) -> Result<T, LinkError> {
    let prefix = frame.first_chunk().ok_or(LinkError::Truncated)?;
    let length = record_length(*prefix)?;
    let record = frame.get(LENGTH_LEN..).unwrap_or_default();
    decode(record.get(..length).ok_or(LinkError::Truncated)?)
}

/// The bytes of a frame; empty if the record were longer than [`RECORD_MAX`], which none of this
/// module is.
pub fn encode<'b, T: Serialize>(value: &T, buffer: &'b mut [u8; FRAME_MAX]) -> &'b [u8] {
    let Some((prefix, room)) = buffer.split_first_chunk_mut::<LENGTH_LEN>() else {
        return &[];
    };
    let Ok(record) = postcard::to_slice(value, room) else {
        return &[];
    };
    let length = record.len();
    *prefix = (length as u16).to_le_bytes();
    buffer.get(..LENGTH_LEN + length).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn golden_bytes() {
        let mut buffer = [0; FRAME_MAX];
        assert_eq!(encode(&Request::Hello, &mut buffer), [1, 0, 0]);
        let tick = Request::Tick {
            now_ms: 300,
            mains: Mains::Deviation { uhz: -1, age_ms: 2 },
        };
        assert_eq!(encode(&tick, &mut buffer), [6, 0, 2, 0xAC, 0x02, 1, 1, 2]);
        let stamps = [u32::MAX; 8];
        let longest = Request::Tick {
            now_ms: u32::MAX,
            mains: Mains::Crossings { count: 8, stamps },
        };
        let frame = encode(&longest, &mut buffer);
        assert_eq!(frame.len(), LENGTH_LEN + 1 + 5 + 1 + 1 + 40);
        assert_eq!(decode_frame(frame), Ok(longest));
    }

    #[test]
    fn bad_frames_are_named() {
        let read = decode_frame::<Request>;
        assert_eq!(read(&[]), Err(LinkError::Truncated));
        assert_eq!(read(&[0, 0]), Err(LinkError::BadLength { found: 0 }));
        assert_eq!(read(&[255, 0, 0]), Err(LinkError::BadLength { found: 255 }));
        assert_eq!(read(&[2, 0, 0]), Err(LinkError::Truncated));
        assert_eq!(read(&[1, 0, 99]), Err(LinkError::Malformed));
        assert_eq!(read(&[2, 0, 0, 0]), Err(LinkError::Malformed));
    }

    proptest! {
        #[test]
        fn any_bytes_decode_or_are_rejected(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            let _ = decode_frame::<Request>(&bytes);
            let _ = decode_frame::<Reply>(&bytes);
        }
    }
}
