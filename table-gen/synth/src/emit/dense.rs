//! The dense encoding of a law: the smallest box of cells around its winning cells, bit-packed.

use firmware::table::{DENSE_HEADER_LEN, InputsKind, LawEntry, bits_per_entry};

use super::EncodedLaw;
use crate::game::Solution;
use model::grid_shape::GridShape;
use model::plant::STATES;

/// Which of the allowed inputs of a cell the table keeps.
pub type Choice<'c> = &'c dyn Fn(usize, u32) -> u8;

/// The lowest allowed input: no more chargers respond than must.
pub fn lowest(_cell: usize, mask: u32) -> u8 {
    mask.trailing_zeros() as u8
}

/// Encodes a law. `choose` is given a cell's position in the dense order and its allowed inputs.
pub fn encode(
    shape: &GridShape<STATES>,
    levels: u8,
    solution: &Solution,
    choose: Choice<'_>,
) -> EncodedLaw {
    let (mut low, mut high) = ([u32::MAX; STATES], [0u32; STATES]);
    for (index, mask) in solution.masks.iter().enumerate() {
        if *mask != 0 {
            let cell = shape.cell(index);
            for d in 0..STATES {
                low[d] = low[d].min(cell[d]);
                high[d] = high[d].max(cell[d]);
            }
        }
    }
    if low[0] == u32::MAX {
        // No cell has an input: one entry, "outside".
        (low, high) = ([0; STATES], [0; STATES]);
    }
    let bits = bits_per_entry(levels) as usize;
    let count: [u32; STATES] = std::array::from_fn(|d| high[d] - low[d] + 1);
    let cells: usize = count.iter().map(|n| *n as usize).product();
    let mut inputs = vec![0u8; DENSE_HEADER_LEN + (cells * bits).div_ceil(8)];
    for d in 0..STATES {
        inputs[2 * d..2 * d + 2].copy_from_slice(&(low[d] as u16).to_le_bytes());
        let at = 2 * STATES + 2 * d;
        inputs[at..at + 2].copy_from_slice(&(count[d] as u16).to_le_bytes());
    }
    let body = &mut inputs[DENSE_HEADER_LEN..];
    let window = GridShape { count, ..*shape };
    for position in 0..cells {
        let offset = window.cell(position);
        let index = shape.index(std::array::from_fn(|d| low[d] + offset[d]));
        let mask = solution.masks[index];
        if mask == 0 {
            continue;
        }
        let entry = u16::from(choose(index, mask) + 1) << (position * bits % 8);
        let at = position * bits / 8;
        body[at] |= entry as u8;
        if entry > 0xFF {
            body[at + 1] |= (entry >> 8) as u8;
        }
    }
    let entry = LawEntry {
        domain_kind: 0,
        inputs_kind: InputsKind::Dense as u8,
        worst_visits: 1,
        domain_len: 0,
        inputs_len: inputs.len() as u32,
    };
    EncodedLaw {
        entry,
        domain: Vec::new(),
        inputs,
    }
}
