//! What a tick asks of a table, in instructions: the dearest lookup of each law of every shipped
//! table, and the dearest decision of a table that is a response.
//!
//! A lookup's cost hangs on the way that it takes through the two parts of a law. Every cell of the
//! grid is walked on the host; of each pair of way lengths (domain, inputs) some cells are asked on
//! the target, so that the dearest way is among them whatever a node, a half-space or a step of a
//! look-ahead costs.

use std::collections::BTreeMap;

use firmware::link::{Request, Response};
use firmware::table::{Law, LawView, TableView};
use firmware::units::STATES;

use crate::figures::{CostError, Figures, compiler};
use crate::images::{self, PIL};
use crate::pil::machine::CORTEX_M4;
use crate::pil::qemu::{Target, instructions};
use crate::root;

/// Goal for a lookup, quantiser included \[instructions\].
pub const LOOKUP_MAX: u32 = 350;
/// Cells that are asked for each pair of way lengths.
const CELLS_OF_A_WAY: usize = 24;
/// Decisions of a response that are counted.
const DECISIONS: i32 = 4_000;

/// The dearest lookups and decisions of every table in `firmware/tables`.
///
/// # Errors
/// A table is rejected, an image cannot be built, or QEMU cannot run it.
pub fn lookups() -> Result<Figures, CostError> {
    let mut figures = Figures::default();
    figures.note(&compiler());
    let pil = images::build(PIL, images::TARGET)?;
    for name in tables()? {
        let path = root().join(format!("firmware/tables/{name}.bin"));
        let bytes = std::fs::read(&path).map_err(|source| CostError::Io {
            what: path.display().to_string(),
            source,
        })?;
        let view = TableView::parse(&bytes)
            .map_err(|error| CostError::Wrong(format!("{name} is rejected: {error:?}")))?;
        let mut target = Target::start(CORTEX_M4, &pil, &bytes, true)?;
        if view.response().is_some() {
            let worst = worst_decision(&mut target)?;
            let what = format!("{name}, decision of the response");
            figures.line(&what, worst, "instructions", Some(LOOKUP_MAX));
        }
        for law in Law::ALL {
            let Some(reader) = view.law(law) else {
                continue;
            };
            let (worst, visits) = worst_lookup(&mut target, &view, law, reader)?;
            let what = format!("{name}, lookup in {law:?} with quantiser");
            figures.line(&what, worst, "instructions", Some(LOOKUP_MAX));
            let what = format!("{name}, visits of that lookup in {law:?}");
            figures.line(&what, visits.into(), "visits", None);
        }
        target.ask(&Request::Stop)?;
    }
    Ok(figures)
}

/// Instructions of the dearest lookup of all laws of one table.
///
/// # Errors
/// The table is rejected, or QEMU is gone.
pub fn dearest(target: &mut Target, table: &[u8]) -> Result<u32, CostError> {
    let view = TableView::parse(table)
        .map_err(|error| CostError::Wrong(format!("the table is rejected: {error:?}")))?;
    let mut worst = 0;
    for law in Law::ALL {
        if let Some(reader) = view.law(law) {
            worst = worst.max(worst_lookup(target, &view, law, reader)?.0);
        }
    }
    Ok(worst)
}

/// Names of the shipped tables, sorted.
fn tables() -> Result<Vec<String>, CostError> {
    let folder = root().join("firmware/tables");
    let entries = std::fs::read_dir(&folder).map_err(|source| CostError::Io {
        what: folder.display().to_string(),
        source,
    })?;
    let mut names: Vec<String> = entries
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter_map(|file| file.strip_suffix(".bin").map(str::to_owned))
        .collect();
    names.sort();
    Ok(names)
}

/// Instructions of the dearest lookup of a law, and its visits.
fn worst_lookup(
    target: &mut Target,
    view: &TableView<'_>,
    law: Law,
    reader: &LawView<'_>,
) -> Result<(u32, u16), CostError> {
    let grid = view.working().grid;
    let mut ways: BTreeMap<(u16, u16), Vec<[i32; STATES]>> = BTreeMap::new();
    for cell in (0..grid.cells()).filter_map(|index| grid.cell(index)) {
        let visits = reader.visits(cell);
        let inputs = match reader.lookup(cell) {
            Some(_) => reader.encoding().visits(cell),
            None => 0,
        };
        let cells = ways.entry((visits - inputs, inputs)).or_default();
        let full = cells.len() >= CELLS_OF_A_WAY;
        if let Some(low) = grid.bounds(cell)
            && !full
        {
            cells.push(low.map(|(low, _)| low));
        }
    }
    let mut worst = (0, 0);
    for ((domain, inputs), states) in ways {
        for state in states {
            let law = law as u8;
            let reply = target.ask(&Request::Lookup { law, state })?;
            if reply.response == Response::Refused {
                return Err(CostError::Wrong("a lookup was refused".into()));
            }
            worst = worst.max((instructions(reply.systick), domain + inputs));
        }
    }
    Ok(worst)
}

/// Instructions of the dearest decision of a response: the control step over frequencies that
/// fall, rise and swing, from zero to past the end of its droop.
fn worst_decision(target: &mut Target) -> Result<u32, CostError> {
    let mut worst = 0;
    let mut f_uhz: i32 = 0;
    for n in 0..DECISIONS {
        // A fall of 1 to 80 mHz a tick, then a rise, in blocks of 40 ticks.
        let rate = 1_000 * (1 + n * 37 % 80);
        let falls = n / 40 % 2 == 0;
        f_uhz = (f_uhz + if falls { -rate } else { rate }).clamp(-2_000_000, 200_000);
        let reply = target.ask(&Request::State([f_uhz, 0, 0, 0]))?;
        if !matches!(reply.response, Response::Action { .. }) {
            return Err(CostError::Wrong("a state was refused".into()));
        }
        worst = worst.max(instructions(reply.systick));
    }
    Ok(worst)
}
