//! What a table takes of a microcontroller: bytes by part, visits of a lookup, flash left.

pub mod measured;
pub mod microcontrollers;
pub mod sweep;

use firmware::prediction::prediction_len;
use firmware::table::{CRC_LEN, HEADER_LEN, Law, TableView};
use serde::Serialize;

use crate::inspect;
use measured::{Measured, measured};
use microcontrollers::Microcontroller;

/// Bytes and visits of a law.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LawBudget {
    /// The law.
    pub law: &'static str,
    /// Bytes of the domain part.
    pub domain_bytes: u32,
    /// Bytes of the inputs part.
    pub inputs_bytes: u32,
    /// Most visits of a lookup, by the header.
    pub worst_visits: u16,
    /// Mean visits over the covered cells.
    pub mean_visits: f64,
}

/// What is left on a microcontroller.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Room {
    /// The microcontroller.
    #[serde(flatten)]
    pub part: Microcontroller,
    /// Flash left \[bytes\], negative if the table does not fit.
    pub left_bytes: i64,
    /// Share of the flash that the table takes.
    pub share: f64,
}

/// The budget of a table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Budget {
    /// Bytes in all.
    pub table_bytes: usize,
    /// Header and CRC.
    pub header_bytes: usize,
    /// The laws.
    pub laws: Vec<LawBudget>,
    /// What was measured on the reference core.
    pub measured: Measured,
    /// Flash left on each microcontroller of the list, the code not counted: its size depends on the core.
    pub rooms: Vec<Room>,
}

/// Adds a table up.
pub fn budget(table: &TableView<'_>) -> Budget {
    let bytes = table.bytes().len();
    let laws = Law::ALL
        .into_iter()
        .filter_map(|law| {
            let entry = table.header().laws[law as usize]?;
            let survey = inspect::survey(table, law)?;
            Some(LawBudget {
                law: inspect::name(law),
                domain_bytes: entry.domain_len,
                inputs_bytes: entry.inputs_len,
                worst_visits: entry.worst_visits,
                mean_visits: survey.visits_mean,
            })
        })
        .collect();
    let rooms = microcontrollers::all()
        .into_iter()
        .map(|part| {
            let flash = i64::from(part.flash_kib) * 1024;
            Room {
                left_bytes: flash - bytes as i64,
                share: bytes as f64 / flash as f64,
                part,
            }
        })
        .collect();
    Budget {
        table_bytes: bytes,
        header_bytes: HEADER_LEN + prediction_len(table.header().delay_ticks) + CRC_LEN,
        laws,
        measured: measured(table),
        rooms,
    }
}
