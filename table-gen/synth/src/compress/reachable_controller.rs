//! `table.domain = "reachable"`: only what the closed loop asks for.
//!
//! A simple controller is fixed first. It takes the level of the best affine piece where the game,
//! ranked by that piece, allows it, and the nearest allowed level elsewhere. Then its closed loop
//! is explored.
//!
//! The explored cells must be covered. They keep the controller's level; where whole cells were
//! explored, any allowed level will do whose box stays among them. So the loop stays within what
//! was explored. All other cells are free: they may be covered if the answer there is one that the
//! game allows. So both parts shrink to a few bytes.

use firmware::grid::Cell;
use firmware::table::{AffineFunction, Law};
use rayon::prelude::*;

use super::CompressError;
use super::cells::LabelledCell;
use super::encode::encode_inputs;
use super::inputs::{CompressedInputs, InputsTask};
use super::membership::{DomainPart, Predicates, describe};
use super::piece_set::{PieceSet, choose_pieces};
use super::tree::build;
use crate::abstraction::Abstraction;
use crate::emit::{EncodedLaw, dense};
use crate::game::Solution;
use crate::game::bitset::BitSet;
use crate::game::inclusion::Inclusion;
use crate::game::reach::included;
use model::plant::STATES;

/// Cells of a grid up to which membership looks at all of them; past that only at the box around
/// the reachable ones.
const CELLS_ALL_MAX: usize = 4_000_000;
/// Most nodes on a path of a membership tree, well above the bits of the four axes, below which
/// boxes are only halved.
const DEPTH_MAX: u32 = 40;

/// A law with a fixed controller.
#[derive(Debug)]
pub struct Controller {
    /// Which law.
    pub law: Law,
    /// What the game allows, ranked by the controller's first law.
    pub solution: Solution,
    /// The affine laws.
    pub laws: PieceSet,
    /// Worst-case steps.
    pub steps: u16,
}

impl Controller {
    /// Fixes the controller of a law.
    ///
    /// # Errors
    /// A game without a result.
    pub fn new(
        law: Law,
        task: &InputsTask<'_>,
        candidates: &[AffineFunction],
    ) -> Result<Self, CompressError> {
        let levels = task.abstraction.inputs() as u8;
        let laws = choose_pieces(None, candidates, levels, &task.cells(task.solution));
        let solution = match task.target {
            Some(target) if task.rounds > 0 => task.ranked_by(&laws, target)?,
            _ => task.solution.clone(),
        };
        let steps = task.worst_rank(&solution);
        Ok(Self {
            law,
            solution,
            laws,
            steps,
        })
    }

    /// The level of the controller at a cell, of those allowed.
    fn level(&self, cell: [u16; STATES], allowed: u32) -> u8 {
        let wanted = match self.laws.pieces.first() {
            Some(law) => law.level(Cell(cell), self.laws.levels),
            None => 0,
        };
        (0..self.laws.levels)
            .filter(|level| allowed >> level & 1 == 1)
            .min_by_key(|level| level.abs_diff(wanted))
            .unwrap_or(0)
    }

    /// The controller as a dense law.
    pub fn dense(&self, abstraction: &impl Abstraction<STATES>) -> EncodedLaw {
        let shape = abstraction.shape();
        dense::encode(
            shape,
            self.laws.levels,
            &self.solution,
            &|index, allowed| self.level(shape.cell(index).map(|i| i as u16), allowed),
        )
    }

    /// Inputs and domain for the cells that are asked for; `closed` answers for the set in which
    /// boxes must stay.
    ///
    /// # Errors
    /// A tree that the format cannot hold.
    pub fn narrow(
        &self,
        abstraction: &impl Abstraction<STATES, Inputs = u32>,
        asked: &BitSet,
        closed: Option<&Inclusion<STATES>>,
        depth_max: u32,
    ) -> Result<(CompressedInputs, DomainPart), CompressError> {
        let shape = abstraction.shape();
        let narrow = |index: usize| shape.cell(index).map(|i| i as u16);
        let mut cells: Vec<LabelledCell> = asked
            .iter()
            .map(|index| {
                let cell = narrow(index);
                let allowed = self.solution.masks[index];
                let kept = match closed {
                    None => 1 << self.level(cell, allowed),
                    Some(closed) => included(abstraction, closed, shape.cell(index), allowed),
                };
                LabelledCell {
                    cell,
                    labels: self.laws.labels(cell, kept),
                }
            })
            .collect();
        let (low, high) = super::cells::bounds(&cells);
        let tree = build(&mut cells, depth_max, 0.0, &|common, cells| {
            self.laws.choose(common, cells)
        });
        let (laws, tree) = self.laws.used(&tree);
        // What else must not be covered: cells at which the tree's answer is not allowed.
        let everywhere = shape.cells() <= CELLS_ALL_MAX;
        let boxed =
            |cell: &[u16; STATES]| (0..STATES).all(|d| (low[d]..=high[d]).contains(&cell[d]));
        let listed = (0..shape.cells()).into_par_iter().filter_map(|index| {
            let cell = narrow(index);
            if asked.contains(index) {
                return Some((cell, true));
            }
            if !everywhere && !boxed(&cell) {
                return None;
            }
            let level = laws.level(tree.leaf(Cell(cell)), cell);
            let free = self.solution.masks[index] >> level & 1 == 1;
            (!free).then_some((cell, false))
        });
        let mut part = describe(
            listed,
            shape.count.map(|n| n as u16),
            &Predicates::default(),
            0,
            DEPTH_MAX,
        )?;
        if !everywhere && !asked.is_empty() {
            part.confine(low, high, shape.count)?;
        }
        let bytes = encode_inputs(&tree, &laws.pieces)?;
        let inputs = CompressedInputs {
            tree,
            laws,
            bytes,
            steps: self.steps,
        };
        Ok((inputs, part))
    }
}
