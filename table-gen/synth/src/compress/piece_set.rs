//! Which affine pieces a tree's leaves may name, and the labels that this gives a cell.

use firmware::grid::Cell;
use firmware::table::{AffineFunction, LEAF_AFFINE};
use rayon::prelude::*;

use super::cells::LabelledCell;
use super::tree::Tree;
use model::plant::STATES;

/// Most pieces in a set: what a label set has room for is 32; each costs 12 bytes.
const PIECES_MAX: usize = 8;
/// A further piece must fit at least one of this many cells that no piece before it fits.
const WORTH_ONE_IN: usize = 500;
/// Cells that a choice of pieces looks at; more are sampled.
const SAMPLE_CELLS: usize = 200_000;

/// Affine pieces and the number of input levels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PieceSet {
    /// The pieces; leaf 32 + k names the k-th.
    pub pieces: Vec<AffineFunction>,
    /// Input levels.
    pub levels: u8,
}

impl PieceSet {
    /// Leaf values that give a cell an allowed input (bit u of `allowed` for level u).
    pub fn labels(&self, cell: [u16; STATES], allowed: u32) -> u64 {
        let mut labels = u64::from(allowed);
        for (k, piece) in self.pieces.iter().enumerate() {
            let fits = u64::from(allowed >> piece.level(Cell(cell), self.levels) & 1);
            labels |= fits << (usize::from(LEAF_AFFINE) + k);
        }
        labels
    }

    /// Level that a leaf value gives a cell.
    pub fn level(&self, leaf: u8, cell: [u16; STATES]) -> u8 {
        match leaf.checked_sub(LEAF_AFFINE) {
            None => leaf,
            Some(piece) => self
                .pieces
                .get(usize::from(piece))
                .map_or(0, |piece| piece.level(Cell(cell), self.levels)),
        }
    }

    /// The leaf that a box gets of those in common: the earliest piece, else the level nearest to
    /// what the first piece says on average there, so that neighbouring boxes differ little.
    pub fn choose(&self, common: u64, cells: &[LabelledCell]) -> u8 {
        let pieces = common >> LEAF_AFFINE;
        if pieces != 0 {
            return LEAF_AFFINE + pieces.trailing_zeros() as u8;
        }
        let Some(first) = self.pieces.first() else {
            return common.trailing_zeros() as u8;
        };
        let sum: u64 = cells
            .iter()
            .map(|cell| u64::from(first.level(cell.cell(), self.levels)))
            .sum();
        let mean = (sum / cells.len().max(1) as u64) as u8;
        (0..LEAF_AFFINE)
            .filter(|level| common >> level & 1 == 1)
            .min_by_key(|level| level.abs_diff(mean))
            .unwrap_or(0)
    }

    /// The set without the pieces that a tree does not name, and the tree with its leaves
    /// renumbered.
    pub fn used(&self, tree: &Tree) -> (Self, Tree) {
        let named = tree.values();
        let mut renumbered = [0u8; 64];
        let mut pieces = Vec::new();
        for value in 0..64u8 {
            let piece = value.checked_sub(LEAF_AFFINE).map(usize::from);
            renumbered[usize::from(value)] = match piece.and_then(|k| self.pieces.get(k)) {
                Some(piece) if named >> value & 1 == 1 => {
                    pieces.push(*piece);
                    LEAF_AFFINE + pieces.len() as u8 - 1
                }
                _ => value,
            };
        }
        let levels = self.levels;
        (Self { pieces, levels }, tree.renumbered(&renumbered))
    }
}

/// Chooses pieces: the preferred one, then from candidates each in turn the one that fits the most
/// cells (by index and allowed inputs) that no earlier piece fits. The first is always chosen, the
/// others while they are worth their bytes.
pub fn choose_pieces(
    preferred: Option<AffineFunction>,
    candidates: &[AffineFunction],
    levels: u8,
    cells: &[([u16; STATES], u32)],
) -> PieceSet {
    let every = cells.len().div_ceil(SAMPLE_CELLS).max(1);
    let mut open: Vec<_> = cells.iter().step_by(every).copied().collect();
    let worth = open.len() / WORTH_ONE_IN;
    let fits = |piece: &AffineFunction, (cell, allowed): &([u16; STATES], u32)| {
        allowed >> piece.level(Cell(*cell), levels) & 1 == 1
    };
    let mut pieces: Vec<AffineFunction> = preferred.into_iter().collect();
    open.retain(|cell| !pieces.iter().any(|piece| fits(piece, cell)));
    while pieces.len() < PIECES_MAX {
        let counts: Vec<usize> = candidates
            .par_iter()
            .map(|piece| open.iter().filter(|cell| fits(piece, cell)).count())
            .collect();
        // Of equals the first candidate.
        let best = counts.iter().enumerate().rev().max_by_key(|(_, n)| **n);
        let Some((at, count)) = best else { break };
        if !pieces.is_empty() && *count <= worth {
            break;
        }
        pieces.push(candidates[at]);
        open.retain(|cell| !fits(&candidates[at], cell));
    }
    PieceSet { pieces, levels }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compress::best_plane::Plane;
    use firmware::table::AFFINE_FRACTION_BITS;

    const ONE: i32 = 1 << AFFINE_FRACTION_BITS;
    /// The level is f.
    const RISING: AffineFunction = AffineFunction {
        factors: [ONE as i16, 0, 0, 0],
        constant: 0,
    };
    /// The level is 3.
    const THREE: AffineFunction = AffineFunction {
        factors: [0; STATES],
        constant: 3 * ONE,
    };
    const LEVELS: u8 = 8;
    const PIECE: u64 = 1 << LEAF_AFFINE;

    fn at(f: u16) -> [u16; STATES] {
        [f, 0, 0, 0]
    }

    fn set(pieces: &[AffineFunction]) -> PieceSet {
        PieceSet {
            pieces: pieces.to_vec(),
            levels: LEVELS,
        }
    }

    #[test]
    fn a_cell_may_name_its_levels_and_the_pieces_that_give_one_of_them() {
        let set = set(&[RISING, THREE]);
        assert_eq!(set.labels(at(2), 0b0101), 0b0101 | PIECE);
        assert_eq!(set.labels(at(1), 0b1101), 0b1101 | PIECE << 1);
        assert_eq!(set.labels(at(1), 0b0101), 0b0101);
        // A leaf that names a level gives it; one that names a piece gives what the piece says.
        assert_eq!(set.level(5, at(2)), 5);
        assert_eq!(set.level(LEAF_AFFINE, at(2)), 2);
        assert_eq!(set.level(LEAF_AFFINE + 1, at(2)), 3);
    }

    #[test]
    fn a_box_gets_the_first_piece_or_the_level_nearest_to_it() {
        let set = set(&[RISING, THREE]);
        let cells = [2, 4].map(|f| LabelledCell {
            cell: at(f),
            labels: 1,
        });
        assert_eq!(set.choose(0b0100 | PIECE << 1, &cells), LEAF_AFFINE + 1);
        // The first piece says 3 on average.
        assert_eq!(set.choose(0b10_0101, &cells), 2);
        assert_eq!(set.choose(0b11_0001, &cells), 4);
    }

    #[test]
    fn pieces_that_no_leaf_names_are_dropped() {
        let tree = Tree::Split {
            plane: Plane {
                axis: 0,
                threshold: 1,
            },
            left: Box::new(Tree::Leaf(6)),
            right: Box::new(Tree::Leaf(LEAF_AFFINE + 1)),
        };
        let (kept, renumbered) = set(&[RISING, THREE]).used(&tree);
        assert_eq!(kept.pieces, [THREE]);
        assert_eq!(renumbered.leaf(Cell(at(0))), 6);
        assert_eq!(renumbered.leaf(Cell(at(1))), LEAF_AFFINE);
    }

    #[test]
    fn pieces_are_chosen_by_the_cells_that_they_add() {
        // RISING fits f = 0 to 4 and THREE fits 3, 5 and 6: after RISING it adds two.
        let mut cells: Vec<_> = (0..5).map(|f| (at(f), 1 << f)).collect();
        cells.extend([5, 6].map(|f| (at(f), 1 << 3)));
        let chosen = choose_pieces(None, &[THREE, RISING], LEVELS, &cells);
        assert_eq!(chosen.pieces, [RISING, THREE]);
        // Where the first fits all, no second is worth its bytes.
        let chosen = choose_pieces(None, &[THREE, RISING], LEVELS, &cells[..5]);
        assert_eq!(chosen.pieces, [RISING]);
    }
}
