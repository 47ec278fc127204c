//! A law's inputs as a small tree: choose laws, rank the game by them, build the tree, rank again
//! by the tree's choices.
//!
//! The masks of a minimal-time game leave little freedom near the target: an input is allowed only
//! if it is as fast as the best. Ranked by a simple controller instead, the same cells are won in
//! more steps and far more inputs are allowed, among them nearly always the simple one. A tree that
//! picks any allowed input in every cell lowers the rank in every step, so it wins; ranked by its
//! own choices, the game can only gain freedom or lose useless one.
//!
//! With a preferred law quality comes before bytes. The game is ranked by that law. Where it does
//! not win by itself the cell departs from it as little as it must, and the game is ranked again by
//! what is nearest. Where the law is allowed, a leaf may give it or a level beside it, and nothing
//! else. Where it is not, any allowed input may stand, for bytes; of several the one nearest to it.

use firmware::grid::Cell;
use firmware::table::AffineFunction;

use super::CompressError;
use super::cells::{LabelledCell, labelled_cells};
use super::encode::encode_inputs;
use super::piece_set::{PieceSet, choose_pieces};
use super::preference::Preferred;
use super::tree::{Tree, build};
use crate::abstraction::Abstraction;
use crate::abstraction::affine::AffineAbstraction;
use crate::game::bitset::BitSet;
use crate::game::restricted::{Chosen, LastResort, Restricted};
use crate::game::{GameError, NOT_WON, Solution, Watch};
use crate::synthesis::OptionalGuard;
use model::plant::STATES;

/// Balances tried where the paths of the smallest tree are too long, the smallest trees first.
const BALANCES: [f64; 3] = [0.15, 0.25, 0.5];

/// A law's inputs, compressed.
#[derive(Debug, Clone, PartialEq, Eq)]
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
    /// What to do where it is allowed, and where it is not, the nearest input that is; `None`: what
    /// makes the smallest tree.
    pub preferred: Option<&'t Preferred>,
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
        match self.preferred {
            None => self.smallest(),
            Some(preferred) => self.preferring(preferred),
        }
    }

    /// The inputs that make the smallest tree: choose pieces, rank the game by the first, build the
    /// tree, rank again by the tree's choices.
    fn smallest(&self) -> Result<CompressedInputs, CompressError> {
        let levels = self.abstraction.inputs() as u8;
        let cells = self.cells(self.solution);
        let laws = choose_pieces(None, self.candidates, levels, &cells);
        drop(cells);
        let mut best = self.attempt(&laws, self.solution, self.worst_rank(self.solution))?;
        let Some(target) = self.target else {
            return Ok(best);
        };
        if self.rounds == 0 {
            return Ok(best);
        }
        let mut solution = self.ranked_by(&laws, target)?;
        let laws = choose_pieces(None, self.candidates, levels, &self.cells(&solution));
        for _ in 0..self.rounds {
            let next = self.attempt(&laws, &solution, 0)?;
            let again = self.ranked_by_tree(&next, target)?;
            // Where another law may answer instead, the ranks that the tree was made from bound
            // both.
            let steps = match self.others {
                None => self.worst_rank(&again),
                Some(_) => self.worst_rank(&solution),
            };
            if self.is_better(&next, &best) {
                best = CompressedInputs { steps, ..next };
            }
            if again.ranks == solution.ranks {
                break;
            }
            solution = again;
        }
        Ok(best)
    }

    /// The inputs nearest to a preferred law: rank the game by it, build the tree, rank again by
    /// the tree's choices.
    fn preferring(&self, preferred: &Preferred) -> Result<CompressedInputs, CompressError> {
        let mut solution = self.ranked_near(preferred)?;
        let cells: Vec<_> = self
            .cells(&solution)
            .into_iter()
            .map(|(cell, allowed)| (cell, preferred.good(cell, allowed)))
            .collect();
        let laws = choose_pieces(
            Some(preferred.law),
            self.candidates,
            preferred.levels,
            &cells,
        );
        drop(cells);
        let mut best = self.attempt(&laws, &solution, self.worst_rank(&solution))?;
        let Some(target) = self.target else {
            return Ok(best);
        };
        let mut last = best.clone();
        for _ in 0..self.rounds.max(1) {
            let again = self.ranked_by_tree(&last, target)?;
            if self.others.is_none() && best == last {
                // Where another law may answer instead, the ranks that the tree was made from
                // bound both.
                best.steps = self.worst_rank(&again);
            }
            if self.rounds == 0 || again.ranks == solution.ranks {
                break;
            }
            solution = again;
            last = self.attempt(&laws, &solution, self.worst_rank(&solution))?;
            if self.is_better(&last, &best) {
                best = last.clone();
            }
        }
        Ok(best)
    }

    /// Short paths first, then bytes.
    fn is_better(&self, a: &CompressedInputs, b: &CompressedInputs) -> bool {
        let short = |inputs: &CompressedInputs| inputs.tree.depth() <= self.depth_goal;
        (!short(a), a.bytes.len()) < (!short(b), b.bytes.len())
    }

    /// The game ranked by a tree's choices.
    fn ranked_by_tree(
        &self,
        inputs: &CompressedInputs,
        target: &BitSet,
    ) -> Result<Solution, GameError> {
        let choice = |_: usize, cell: [u32; STATES]| {
            let cell = cell.map(|i| i as u16);
            let leaf = inputs.tree.leaf(Cell(cell));
            1u32 << inputs.laws.level(leaf, cell)
        };
        self.reach(target, &choice, LastResort::None)
    }

    /// The game ranked by the preferred law, and then by what is nearest to it. A safety game and
    /// one whose ranks are to be kept are as they were.
    fn ranked_near(&self, preferred: &Preferred) -> Result<Solution, GameError> {
        let Some(target) = self.target.filter(|_| self.rounds > 0) else {
            return Ok(self.solution.clone());
        };
        let narrow = |cell: [u32; STATES]| cell.map(|i| i as u16);
        let first = |_: usize, cell: [u32; STATES]| 1u32 << preferred.level(narrow(cell));
        let solution = self.reach(target, &first, LastResort::Nearest)?;
        let near = |index: usize, cell: [u32; STATES]| {
            preferred.nearest(narrow(cell), solution.masks[index])
        };
        self.reach(target, &near, LastResort::None)
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
        self.reach(target, &first, LastResort::All)
    }

    fn reach(
        &self,
        target: &BitSet,
        chosen: &Chosen<'_, STATES>,
        last_resort: LastResort,
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
                    let allowed = solution.masks[index];
                    let good = |preferred: &Preferred| preferred.good(cell, allowed);
                    laws.labels(cell, self.preferred.map_or(allowed, good))
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
