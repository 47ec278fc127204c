//! Whole verdicts, on tables made for the purpose.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on fails"
)]

mod delay;
mod falsify;
mod mutants;
mod paper;
mod second_checker;

use std::sync::LazyLock;

use firmware::table::{Law, TableView};
use lab::falsify::witness;
use model::spec::Spec;
use model::verdict::Verdict;
use tests::testing::{dense, dense_of, load};

/// A spec with Hold and a little of every uncertainty, on a grid of 435,600 cells.
const SMALL: [&str; 6] = [
    "name=small",
    "grid={lower=[-0.9,-0.4,-0.2,-0.2],upper=[0.1,3.2,2.0,2.0],width=[0.02,0.2,0.1,0.1],alignment=\"edges\"}",
    "sampling.period_s=2.0",
    "uncertainty.measurement=[0,0,0,0]",
    "uncertainty.participation=0.01",
    "uncertainty.loss_gw=[1.995,2.005]",
];

/// The small spec, with further overrides.
fn small(more: &[&str]) -> Spec {
    load("gb-bi-band", &[&SMALL, more].concat())
}

static SMALL_TABLE: LazyLock<Vec<u8>> = LazyLock::new(|| dense_of(&small(&[])));
static PAPER_BI: LazyLock<Vec<u8>> = LazyLock::new(|| dense("paper-bi").1);

/// The verdict on a table, with a real trajectory for what fails if one is found.
fn judge(bytes: &[u8], spec: &Spec) -> Verdict {
    let mut verdict = verify::verify(bytes, spec, &|_| true).unwrap();
    witness::refute(&mut verdict, bytes, spec).unwrap();
    verdict
}

/// Byte and bit at which a dense law stores a cell's entry, and the bits of an entry.
fn dense_entry(view: &TableView<'_>, law: Law, cell: [u16; 4]) -> Option<(usize, usize)> {
    let mut at = firmware::table::HEADER_LEN;
    for other in Law::ALL {
        let Some(entry) = view.header().laws[other as usize] else {
            continue;
        };
        if other == law {
            break;
        }
        at += (entry.domain_len + entry.inputs_len) as usize;
    }
    let bytes = view.bytes();
    let word = |i: usize| u16::from_le_bytes([bytes[at + 2 * i], bytes[at + 2 * i + 1]]);
    let mut position = 0usize;
    for axis in (0..4).rev() {
        let (first, count) = (word(axis), word(4 + axis));
        if cell[axis] < first || cell[axis] >= first + count {
            return None;
        }
        position = position * usize::from(count) + usize::from(cell[axis] - first);
    }
    let bit = position * firmware::table::bits_per_entry(view.header().levels) as usize;
    Some((at + firmware::table::DENSE_HEADER_LEN + bit / 8, bit % 8))
}

/// The table with a cell's entry replaced (0: outside, else level + 1) and sealed again.
fn with_entry(bytes: &[u8], law: Law, cell: [u16; 4], entry: u8) -> Vec<u8> {
    let mut image = bytes.to_vec();
    let view = TableView::parse(bytes).unwrap();
    let bits = firmware::table::bits_per_entry(view.header().levels);
    let (at, shift) = dense_entry(&view, law, cell).unwrap();
    let mut pair = u16::from_le_bytes([image[at], image[at + 1]]);
    let mask = ((1u16 << bits) - 1) << shift;
    pair = (pair & !mask) | (u16::from(entry) << shift);
    image[at..at + 2].copy_from_slice(&pair.to_le_bytes());
    firmware::table::seal(&mut image).unwrap();
    image
}
