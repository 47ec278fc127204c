//! A small table made by hand: the paper's plant on a coarse grid, with plausible laws that nobody
//! proved.
//!
//! It exercises reader, phase machine and drivers where a synthesised table would only cost time.
//! Its laws have holes, so that a run also meets states outside the domain.

use firmware::droop::Droop;
use firmware::grid::{Cell, Grid, GridError};
use firmware::table::{
    CRC_LEN, HEADER_LEN, Header, Hypotheses, InputsKind, LAWS, LawEntry, PlantParameters,
    WriteError, bits_per_entry, field, seal, write_header,
};
use firmware::units::{Band, STATES};
use synth::delay::Delay;

/// Input levels: steps of 5 %.
const LEVELS: u8 = 21;
/// Cells of the grid: f in 0.05 Hz, g, l, p in 0.5 GW.
const COUNT: [u16; STATES] = [24, 8, 6, 6];

/// Why no table was made.
#[derive(Debug)]
pub enum StandInError {
    /// The grid.
    Grid(GridError),
    /// The seal.
    Write(WriteError),
}

/// The header; `stay` adds the Hold law.
fn header(stay: bool) -> Result<Header, GridError> {
    let micro = 1_000_000;
    Ok(Header {
        spec_hash: *b"a stand-in table",
        grid: Grid::new(
            [-micro, -micro / 2, -micro / 2, -micro / 2],
            [50_000, 500_000, 500_000, 500_000],
            COUNT,
        )?,
        input_step_ppm: 50_000,
        levels: LEVELS,
        stay,
        always_on: false,
        tick_ms: 100,
        period_ticks: 15,
        delay_ticks: 0,
        outer: Band {
            low_uhz: -300_000,
            high_uhz: 0,
        },
        inner: Band {
            low_uhz: -150_000,
            high_uhz: 0,
        },
        droop: Droop::PAPER,
        plant: PlantParameters::PAPER,
        hypotheses: Hypotheses::PAPER,
        laws: [None; LAWS],
    })
}

/// Level plus one of a law at a cell, 0 for none: more for a lower frequency, less for more turbine
/// power.
fn entry(law: usize, cell: [u16; STATES]) -> u8 {
    let [f, g, l, p] = cell.map(i32::from);
    let hole = (f * 7 + g * 5 + l * 3 + p + law as i32).rem_euclid(29) == 0;
    let in_band = f >= 24 - 6 - 4;
    if hole || (law == 2 && !in_band) {
        return 0;
    }
    let level = 26 - f - p + law as i32;
    level.clamp(0, i32::from(LEVELS) - 1) as u8 + 1
}

fn block(grid: &Grid, law: usize) -> Vec<u8> {
    let bits = bits_per_entry(LEVELS) as usize;
    let cells: usize = COUNT.iter().map(|count| usize::from(*count)).product();
    let mut block = vec![0; 8];
    for count in COUNT {
        block.extend(count.to_le_bytes());
    }
    let at = block.len();
    block.resize(at + (cells * bits).div_ceil(8), 0);
    for index in 0..cells {
        // Every index is one of the grid's.
        let Cell(cell) = grid.cell(index as u32).unwrap_or_default();
        let value = u16::from(entry(law, cell)) << (index * bits % 8);
        for (offset, byte) in value.to_le_bytes().into_iter().enumerate() {
            if byte != 0 {
                block[at + index * bits / 8 + offset] |= byte;
            }
        }
    }
    block
}

/// The table's bytes. With `stay` it has the Hold law instead of Fixed.
///
/// # Errors
/// None that a test should see.
pub fn table(stay: bool) -> Result<Vec<u8>, StandInError> {
    let mut header = header(stay).map_err(StandInError::Grid)?;
    let laws = if stay { LAWS } else { LAWS - 1 };
    let blocks: Vec<Vec<u8>> = (0..laws).map(|law| block(&header.grid, law)).collect();
    for (entry, block) in header.laws.iter_mut().zip(&blocks) {
        *entry = Some(LawEntry {
            domain_kind: 0,
            inputs_kind: InputsKind::Dense as u8,
            worst_visits: 1,
            domain_len: 0,
            inputs_len: block.len() as u32,
        });
    }
    let mut image = write_header(&header).to_vec();
    debug_assert_eq!(image.len(), HEADER_LEN);
    image.extend(blocks.into_iter().flatten());
    image.extend([0; CRC_LEN]);
    seal(&mut image).map_err(StandInError::Write)?;
    Ok(image)
}

/// The same laws in a table whose commands act late, with the prediction of this delay. Nobody
/// proved what it does.
///
/// # Errors
/// None for a table that the reader accepts and has no delay yet.
pub fn late(table: &[u8], delay: &Delay) -> Result<Vec<u8>, WriteError> {
    let mut image = table.to_vec();
    image[field::DELAY].copy_from_slice(&(delay.ticks as u16).to_le_bytes());
    image.splice(HEADER_LEN..HEADER_LEN, delay.coefficients.bytes());
    seal(&mut image)?;
    Ok(image)
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::table::TableView;

    #[test]
    fn the_reader_accepts_it() {
        for stay in [false, true] {
            let bytes = table(stay).unwrap();
            let view = TableView::parse(&bytes).unwrap();
            assert_eq!(view.header().stay, stay);
        }
    }
}
