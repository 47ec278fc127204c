//! What a table takes of a microcontroller, as data; `budget.json` is this value, both ways.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

/// The budget of a table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Budget {
    /// Bytes in all.
    pub table_bytes: usize,
    /// Header and CRC.
    pub header_bytes: usize,
    /// The laws.
    pub laws: Vec<LawBudget>,
    /// What was measured on the reference core.
    pub measured: Measured,
    /// Flash left on each microcontroller of the list, the code not counted: its size depends on
    /// the core.
    pub rooms: Vec<Room>,
}

/// Bytes and visits of a law.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LawBudget {
    /// The law.
    pub law: Cow<'static, str>,
    /// Bytes of the domain part.
    pub domain_bytes: u32,
    /// Bytes of the inputs part.
    pub inputs_bytes: u32,
    /// Most visits of a lookup, by the header.
    pub worst_visits: u16,
    /// Mean visits over the covered cells.
    pub mean_visits: f64,
}

/// Figures of the reference core, a Cortex-M4F.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Measured {
    /// Code and constants of the charger without a HAL, the reader among them \[bytes\].
    pub core_bytes: Option<u64>,
    /// Instructions of the worst lookup, quantiser included; only of the very table that was
    /// measured.
    pub lookup_instructions: Option<u64>,
}

/// What is left on a microcontroller.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Room {
    /// The microcontroller.
    #[serde(flatten)]
    pub part: Microcontroller,
    /// Flash left \[bytes\], negative if the table does not fit.
    pub left_bytes: i64,
    /// Share of the flash that the table takes.
    pub share: f64,
}

/// A microcontroller.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Microcontroller {
    /// Name, with the suffix that decides the flash.
    pub name: String,
    /// Core.
    pub core: String,
    /// Flash \[KiB\].
    pub flash_kib: u32,
    /// What should be known.
    pub note: String,
    /// Where the flash size is from.
    pub source: String,
}
