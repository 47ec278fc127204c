//! A law's inputs as a small tree: choose laws, rank the game by them, build the tree, rank again
//! by the tree's choices.
//!
//! The masks of a minimal-time game leave little freedom near the target: an input is allowed only
//! if it is as fast as the best. Ranked by a simple controller instead, the same cells are won in
//! more steps and far more inputs are allowed, among them nearly always the simple one. A tree that
//! picks any allowed input in every cell lowers the rank in every step, so it wins; ranked by its
//! own choices, the game can only gain freedom or lose useless one.

use firmware::grid::Cell;
use firmware::table::AffineFunction;

use super::CompressError;
use super::cells::{LabelledCell, labelled_cells};
use super::encode::encode_inputs;
use super::piece_set::{PieceSet, choose_pieces};
use super::tree::{Tree, build};
use crate::abstraction::Abstraction;
use crate::abstraction::affine::AffineAbstraction;
use crate::game::bitset::BitSet;
use crate::game::restricted::{Chosen, Restricted};
use crate::game::{GameError, NOT_WON, Solution, Watch};
use crate::synthesis::OptionalGuard;
use model::plant::STATES;

/// Balances tried where the paths of the smallest tree are too long, the smallest trees first.
const BALANCES: [f64; 3] = [0.15, 0.25, 0.5];

/// A law's inputs, compressed.
#[derive(Debug, Clone)]
pub struct CompressedInputs {
    /// The tree.
    pub tree: Tree,
    /// The affine laws that it names.
    pub laws: PieceSet,
    /// The inputs part.
    pub bytes: Vec<u8>,
    /// Worst-case steps of the tree's controller; 0 in a safety game.
    pub steps: u16,
}

/// What the inputs are compressed for.
pub struct InputsTask<'t> {
    /// The abstraction.
    pub abstraction: &'t AffineAbstraction<STATES>,
    /// Where a reach game ends; `None` in a safety game, whose masks need no ranks.
    pub target: Option<&'t BitSet>,
    /// Cells to answer for.
    pub domain: &'t BitSet,
    /// Other cells of the game, where another law decides, and what it decides there.
    pub others: Option<(&'t BitSet, &'t Chosen<'t, STATES>)>,
    /// Forbids inputs of the game.
    pub guard: &'t OptionalGuard,
    /// Told of every sweep of a game.
    pub watch: &'t dyn Watch,
    /// The game's masks on the domain.
    pub solution: &'t Solution,
    /// Affine laws to choose from.
    pub candidates: &'t [AffineFunction],
    /// Most nodes on a path.
    pub depth_max: u32,
    /// Nodes on a path above which a larger tree with shorter paths is preferred.
    pub depth_goal: u16,
    /// Rounds of ranking by the tree's own choices; 0 keeps the game's ranks.
    pub rounds: u32,
}

impl InputsTask<'_> {
    /// Compresses.
    ///
    /// # Errors
    /// A tree that the format cannot hold, or a game with too many steps.
    pub fn run(&self) -> Result<CompressedInputs, CompressError> {
        let levels = self.abstraction.inputs() as u8;
        let cells = self.cells(self.solution);
        let laws = choose_pieces(self.candidates, levels, &cells);
        drop(cells);
        let mut best = self.attempt(&laws, self.solution, self.worst_rank(self.solution))?;
        let Some(target) = self.target else {
            return Ok(best);
        };
        if self.rounds == 0 {
            return Ok(best);
        }
        let mut solution = self.ranked_by(&laws, target)?;
        let laws = choose_pieces(self.candidates, levels, &self.cells(&solution));
        for _ in 0..self.rounds {
            let next = self.attempt(&laws, &solution, 0)?;
            let choice = |_: usize, cell: [u32; STATES]| {
                let cell = cell.map(|i| i as u16);
                let leaf = next.tree.leaf(Cell(cell));
                1u32 << next.laws.level(leaf, cell)
            };
            let again = self.reach(target, &choice, false)?;
            // Where another law may answer instead, the ranks that the tree was made from bound
            // both.
            let steps = match self.others {
                None => self.worst_rank(&again),
                Some(_) => self.worst_rank(&solution),
            };
            let short = |inputs: &CompressedInputs| inputs.tree.depth() <= self.depth_goal;
            // Short paths first, then bytes.
            let better = (!short(&next), next.bytes.len()) < (!short(&best), best.bytes.len());
            if better {
                best = CompressedInputs { steps, ..next };
            }
            if again.ranks == solution.ranks {
                break;
            }
            solution = again;
        }
        Ok(best)
    }

    /// The game ranked by the first of some laws: it wins what it can alone, all inputs help where
    /// it cannot go on.
    pub(super) fn ranked_by(
        &self,
        laws: &PieceSet,
        target: &BitSet,
    ) -> Result<Solution, GameError> {
        let first = |_: usize, cell: [u32; STATES]| match laws.pieces.first() {
            Some(law) => 1u32 << law.level(Cell(cell.map(|i| i as u16)), laws.levels),
            None => 0,
        };
        self.reach(target, &first, true)
    }

    fn reach(
        &self,
        target: &BitSet,
        chosen: &Chosen<'_, STATES>,
        last_resort: bool,
    ) -> Result<Solution, GameError> {
        let mut everywhere = self.domain.clone();
        if let Some((others, _)) = self.others {
            everywhere.add(others);
        }
        let game = Restricted {
            abstraction: self.abstraction,
            target,
            domain: &everywhere,
            settled: self.others.map(|(cells, _)| cells),
            guard: self.guard,
            watch: self.watch,
        };
        let decided = |index: usize, cell: [u32; STATES]| match self.others {
            Some((cells, choice)) if cells.contains(index) => choice(index, cell),
            _ => chosen(index, cell),
        };
        game.reach(&decided, last_resort)
    }

    /// Cells of the domain with their allowed inputs.
    pub(super) fn cells(&self, solution: &Solution) -> Vec<([u16; STATES], u32)> {
        let shape = self.abstraction.shape();
        self.domain
            .iter()
            .filter(|index| solution.masks[*index] != 0)
            .map(|index| (shape.cell(index).map(|i| i as u16), solution.masks[index]))
            .collect()
    }

    pub(super) fn worst_rank(&self, solution: &Solution) -> u16 {
        let others = self.others.iter().flat_map(|(cells, _)| cells.iter());
        let ranks = self
            .domain
            .iter()
            .chain(others)
            .map(|index| solution.ranks[index]);
        ranks.filter(|rank| *rank != NOT_WON).max().unwrap_or(0)
    }

    fn attempt(
        &self,
        laws: &PieceSet,
        solution: &Solution,
        steps: u16,
    ) -> Result<CompressedInputs, CompressError> {
        let mut cells: Vec<LabelledCell> =
            labelled_cells(self.abstraction.shape(), |index, cell| {
                if self.domain.contains(index) {
                    laws.labels(cell, solution.masks[index])
                } else {
                    0
                }
            });
        let mut grown = |balance| {
            build(&mut cells, self.depth_max, balance, &|common, cells| {
                laws.choose(common, cells)
            })
        };
        // Where no balance makes the paths short enough, the smallest tree it is.
        let mut tree = grown(0.0);
        if tree.depth() > self.depth_goal {
            let mut balanced = BALANCES.into_iter().map(grown);
            tree = balanced
                .find(|tree| tree.depth() <= self.depth_goal)
                .unwrap_or(tree);
        }
        drop(cells);
        let (laws, tree) = laws.used(&tree);
        let bytes = encode_inputs(&tree, &laws.pieces)?;
        Ok(CompressedInputs {
            tree,
            laws,
            bytes,
            steps,
        })
    }
}
