//! What a table takes of a microcontroller: bytes by part, visits of a lookup, flash left.

pub mod measured;
pub mod microcontrollers;
pub mod sweep;

use firmware::phase::Phase;
use firmware::prediction::prediction_len;
use firmware::table::{CRC_LEN, HEADER_LEN, Law, RESPONSE_LEN, TableView};
use model::budget::{Budget, LawBudget, Room};

use crate::inspect;
use measured::measured;

/// Adds a table up.
pub fn budget(table: &TableView<'_>) -> Budget {
    let bytes = table.bytes().len();
    let response = table.response().map(|_| LawBudget {
        law: Phase::Response.name().into(),
        domain_bytes: 0,
        inputs_bytes: RESPONSE_LEN as u32,
        worst_visits: 0,
        mean_visits: 0.0,
    });
    let laws = Law::ALL
        .into_iter()
        .filter_map(|law| {
            let entry = table.header().laws[law as usize]?;
            let survey = inspect::survey(table, law)?;
            Some(LawBudget {
                law: law.name().into(),
                domain_bytes: entry.domain_len,
                inputs_bytes: entry.inputs_len,
                worst_visits: entry.worst_visits,
                mean_visits: survey.visits_mean,
            })
        })
        .chain(response)
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
