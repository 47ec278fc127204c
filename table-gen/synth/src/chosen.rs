//! A table of given levels, cell by cell: for whoever chooses levels by other means than a game.
//!
//! What a game would have allowed plays no part here, so nothing is promised of such a table. It is
//! examined as any other: by the verifier, or by a bound on its probability.

use firmware::table::{InputsKind, LAWS, Law, LawEntry, TableView};

use crate::abstraction::affine::AffineAbstraction;
use crate::compress::piece_set::choose_pieces;
use crate::compress::reachable_controller::Controller;
use crate::compress::{CompressError, INPUTS_DEPTH_MAX, candidate_pieces, recheck};
use crate::emit::{self, EmitError, EncodedLaw, dense};
use crate::game::Solution;
use crate::game::bitset::BitSet;
use crate::problem::Problem;
use crate::synthesis::{self, SynthesisError};
use model::plant::STATES;

/// Levels of all laws.
#[derive(Debug, Clone)]
pub struct Chosen {
    /// Masks of one level each, or none; by law.
    masks: [Option<Vec<u32>>; LAWS],
    abstraction: AffineAbstraction<STATES>,
}

/// A table of another shape than the spec's.
#[derive(Debug, thiserror::Error)]
pub enum ChosenError {
    /// The table's grid, levels or laws are not those of the spec.
    #[error("the table's {0} is not the spec's: levels can be changed on the same cells alone")]
    Shape(&'static str),
    /// No abstraction, or numbers that do not fit.
    #[error(transparent)]
    Compress(#[from] CompressError),
    /// No bytes.
    #[error(transparent)]
    Emit(#[from] EmitError),
}

impl From<SynthesisError> for ChosenError {
    fn from(error: SynthesisError) -> Self {
        Self::Compress(error.into())
    }
}

impl Chosen {
    /// The levels of a table, which may have been made for another spec on the same cells.
    ///
    /// # Errors
    /// A table of another shape, or a spec that makes no problem.
    pub fn of(problem: &Problem, table: &TableView<'_>) -> Result<Self, ChosenError> {
        let header = table.header();
        if header.grid != problem.grid {
            return Err(ChosenError::Shape("grid"));
        }
        if usize::from(header.levels) != problem.inputs.len() {
            return Err(ChosenError::Shape("number of levels"));
        }
        if header.always_on || header.stay != problem.spec.requirements.stay {
            return Err(ChosenError::Shape("set of laws"));
        }
        let abstraction = synthesis::abstraction(problem).map_err(SynthesisError::from)?;
        let masks = Law::ALL.map(|law| {
            let levels = recheck::levels(&problem.shape, table.law(law)?);
            let mask = |level: Option<u8>| level.map_or(0, |level| 1u32 << level);
            Some(levels.into_iter().map(mask).collect())
        });
        Ok(Self { masks, abstraction })
    }

    /// Gives a cell of a law this level. A law that the table does not hold is left away.
    pub fn set(&mut self, problem: &Problem, law: Law, cell: [u16; STATES], level: u8) {
        if let Some(masks) = &mut self.masks[law as usize] {
            masks[problem.shape.index(cell.map(u32::from))] = 1 << level;
        }
    }

    /// Gives every cell of every law this level.
    pub fn fill(&mut self, level: u8) {
        for masks in self.masks.iter_mut().flatten() {
            masks.fill(1 << level);
        }
    }

    /// Cells at which two of the same shape differ, over all laws.
    pub fn differences(&self, other: &Self) -> usize {
        let laws = self.masks.iter().zip(&other.masks);
        let of_law = |(a, b): (&Option<Vec<u32>>, &Option<Vec<u32>>)| match (a, b) {
            (Some(a), Some(b)) => a.iter().zip(b).filter(|(a, b)| a != b).count(),
            _ => 0,
        };
        laws.map(of_law).sum()
    }

    fn solution(masks: &[u32]) -> Solution {
        Solution {
            masks: masks.to_vec(),
            ranks: Vec::new(),
            winning: 0,
            sweeps: 0,
        }
    }

    /// The table with every cell as it is, dense: large, and for the generator's own use.
    ///
    /// # Errors
    /// Numbers that do not fit the format.
    pub fn dense(&self, problem: &Problem) -> Result<Vec<u8>, ChosenError> {
        let levels = problem.inputs.len() as u8;
        let laws = self.masks.each_ref().map(|masks| {
            let masks = masks.as_ref()?;
            let solution = Self::solution(masks);
            Some(dense::encode(
                &problem.shape,
                levels,
                &solution,
                &dense::lowest,
            ))
        });
        Ok(emit::assemble(emit::head(problem)?, &laws)?)
    }

    /// The table for the cells that are asked for, as small trees. Of the other cells it answers
    /// for those at which its answer is the chosen one.
    ///
    /// # Errors
    /// A tree that the format cannot hold.
    pub fn small(
        &self,
        problem: &Problem,
        asked: &[(Law, [u16; STATES])],
    ) -> Result<Vec<u8>, ChosenError> {
        let mut laws: [Option<EncodedLaw>; LAWS] = [None, None, None];
        for law in Law::ALL {
            let Some(masks) = &self.masks[law as usize] else {
                continue;
            };
            let of_law = asked.iter().filter(|(asked, _)| *asked == law);
            let indices = of_law.map(|(_, cell)| problem.shape.index(cell.map(u32::from)));
            let mut set = BitSet::new(masks.len());
            for index in indices.filter(|index| masks[*index] != 0) {
                set.insert(index);
            }
            laws[law as usize] = Some(self.law(problem, law, masks, &set)?);
        }
        Ok(emit::assemble(emit::head(problem)?, &laws)?)
    }

    fn law(
        &self,
        problem: &Problem,
        law: Law,
        masks: &[u32],
        asked: &BitSet,
    ) -> Result<EncodedLaw, ChosenError> {
        let levels = problem.inputs.len() as u8;
        let shape = &problem.shape;
        if asked.is_empty() {
            let nothing = Self::solution(&vec![0; masks.len()]);
            return Ok(dense::encode(shape, levels, &nothing, &dense::lowest));
        }
        let requirements = &problem.spec.requirements;
        let band = match law {
            Law::C1 => requirements.outer_micro(),
            Law::C2 | Law::Hold => requirements.inner_micro(),
        };
        let candidates = candidate_pieces::candidates(&problem.spec, shape, band);
        let cells: Vec<_> = asked
            .iter()
            .map(|index| (shape.cell(index).map(|i| i as u16), masks[index]))
            .collect();
        let controller = Controller {
            law,
            solution: Self::solution(masks),
            laws: choose_pieces(None, &candidates, levels, &cells),
            steps: 0,
        };
        let (inputs, part) = controller.narrow(&self.abstraction, asked, None, INPUTS_DEPTH_MAX)?;
        let entry = LawEntry {
            domain_kind: part.kind as u8,
            inputs_kind: InputsKind::Tree as u8,
            worst_visits: part.worst_visits + inputs.tree.depth(),
            domain_len: part.bytes.len() as u32,
            inputs_len: inputs.bytes.len() as u32,
        };
        Ok(EncodedLaw {
            entry,
            domain: part.bytes,
            inputs: inputs.bytes,
        })
    }
}
