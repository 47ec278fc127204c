//! Every reason why a container is not taken.

use firmware::charger::Misfits;
use firmware::table::TableError;

use crate::class::DeviceClass;

/// Why a container is not taken. What is in force stays in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// Fewer bytes than a container has, or than its header states.
    Truncated {
        /// Bytes found.
        found: u32,
        /// Bytes needed.
        needed: u32,
    },
    /// More bytes than the header states.
    TooMany {
        /// Bytes found.
        found: u32,
        /// Bytes stated.
        stated: u32,
    },
    /// The first bytes are not a container's.
    NotAContainer {
        /// Bytes found.
        found: [u8; 4],
    },
    /// Another version of the container's format.
    UnsupportedFormat {
        /// Version found.
        found: u16,
        /// The version that this reader reads.
        supported: u16,
    },
    /// A field of the header is out of its range.
    BadField {
        /// Offset of the field in the container.
        offset: u8,
    },
    /// The signature is not that of the trusted key over these bytes: forged, or changed since.
    BadSignature,
    /// For chargers of another kind.
    WrongClass {
        /// Class in the container.
        found: DeviceClass,
        /// This charger's.
        own: DeviceClass,
    },
    /// Older than the table that is in force.
    Older {
        /// Version in the container.
        found: u32,
        /// Version in force, or complete and waiting for the next start.
        running: u32,
    },
    /// The version that is in force already: the same container again.
    Replayed {
        /// The version.
        version: u32,
    },
    /// The version was tried, and rolled back.
    RolledBack {
        /// The version.
        version: u32,
    },
    /// To be installed later.
    NotYetValid {
        /// First moment \[s since 1970\].
        from_s: u32,
        /// Now \[s since 1970\].
        now_s: u32,
    },
    /// To be installed before now.
    Expired {
        /// Last moment \[s since 1970\].
        until_s: u32,
        /// Now \[s since 1970\].
        now_s: u32,
    },
    /// Valid for a time only, and nobody told the charger the time.
    NoTime,
    /// The firmware's reader rejects the table.
    Table(TableError),
    /// The charger is not what the proof of the table assumed.
    Misfit(Misfits),
    /// The container does not fit into a slot.
    TooLong {
        /// Bytes of the container.
        found: u32,
        /// Bytes that a slot holds.
        room: u32,
    },
    /// The table in force is on trial, and the other slot is the way back.
    TrialRuns,
    /// A part came before a beginning, or the end before all parts.
    OutOfTurn,
    /// The flash did not take a write or an erase, or reads as something else.
    Flash,
}
