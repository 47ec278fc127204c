//! Compression: from the games' solutions to the parts of a table.
//!
//! | file | does |
//! |---|---|
//! | [`preference`] | what a controller should do where it is free |
//! | [`candidate_pieces`] | candidate affine laws for where it is not |
//! | [`piece_set`] | chooses among them, and says which leaves are right in a cell |
//! | [`cells`] | the cells of a domain with their right leaves |
//! | [`best_plane`], [`tree`] | a small k-d tree over them |
//! | [`inputs`] | the whole of it for a law: laws, ranks, tree, ranks by the tree, … |
//! | [`half_spaces`] | half-spaces that bound a winning set |
//! | [`look_aheads`] | what a held input would do, in integers |
//! | [`membership`] | a set of cells as a tree with half-spaces, exact or with cells given up |
//! | [`domain`] | the domain of a law, in which its game is won again |
//! | [`encode`] | trees as bytes |
//! | `winning_domain` | the laws of a table for every winning cell |
//! | `reachable_domain` | the laws of a table for what the closed loop asks for |
//! | [`recheck`] | the emitted bytes, played again |
//!
//! A law's table part is sound by itself: every input that it gives inside its domain is one that
//! the game allows there.

pub mod best_plane;
pub mod candidate_pieces;
pub mod cells;
pub mod domain;
pub mod encode;
pub mod error;
pub mod half_spaces;
pub mod inputs;
pub mod look_aheads;
pub mod membership;
pub mod piece_set;
pub mod preference;
pub mod reachable;
pub mod reachable_controller;
mod reachable_domain;
pub mod recheck;
pub mod tree;
mod winning_domain;

use firmware::table::{InputsKind, LAWS, Law, LawEntry, TableView};

use crate::abstraction::Abstraction;
use crate::abstraction::affine::AffineAbstraction;
use crate::emit::{self, EmitError, EncodedLaw};
use crate::game::bitset::BitSet;
use crate::game::{NOT_WON, Watch};
use crate::problem::Problem;
use crate::synthesis::{self, OptionalGuard, SolvedLaw, Synthesis, SynthesisError};
pub use error::CompressError;
use inputs::CompressedInputs;
use membership::DomainPart;
use model::plant::STATES;
use model::spec::{self, Spec};
use preference::{Preference, Preferred};

/// Most nodes that a path of a law's inputs tree may have.
pub const INPUTS_DEPTH_MAX: u32 = 32;
/// Visits of a lookup, both parts, above which shorter paths are preferred to a smaller tree.
pub const VISITS_GOAL: u16 = 24;
/// Rounds of ranking by the tree's own choices.
pub const ROUNDS: u32 = 8;

/// How to compress.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Keep the games' minimal times: the tree chooses among the fastest inputs only.
    pub keep_minimal_time: bool,
    /// Keep every winning cell, whatever membership costs.
    pub exact_domain: bool,
}

/// A law's two parts and how they came out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CompressedLaw {
    /// Which law.
    pub law: Law,
    /// Directory entry, domain part and inputs part.
    pub encoded: EncodedLaw,
    /// Cells in which the law's game ends; none for Hold.
    pub target: Option<BitSet>,
    /// Numbers for people.
    pub report: LawReport,
}

/// What compression of a law cost and gained.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LawReport {
    /// Cells that the game won, target not counted.
    pub winning_cells: usize,
    /// Cells from which the table leads to the law's target. They are the cells of its domain; for
    /// a C2 that is asked in I1 alone, those of C1 too.
    pub domain_cells: usize,
    /// Leaves of the membership tree.
    pub domain_leaves: u32,
    /// Half-spaces of the domain.
    pub half_spaces: u32,
    /// Leaves of the inputs tree.
    pub entries: u32,
    /// Affine laws that they name.
    pub laws: u32,
    /// Worst-case steps of the fastest controller; 0 for Hold.
    pub steps_minimal: u16,
    /// Worst-case steps of the table's controller; 0 for Hold.
    pub steps: u16,
}

/// All laws of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CompressedLaws {
    /// In the order of the directory.
    pub laws: Vec<CompressedLaw>,
}

impl CompressedLaws {
    /// Bytes of all parts.
    pub fn part_bytes(&self) -> usize {
        let parts = self.laws.iter().map(|law| &law.encoded);
        parts.map(|law| law.domain.len() + law.inputs.len()).sum()
    }

    /// Cells in which a law's game ends; none for Hold and for a law that the table does not hold.
    pub fn target(&self, law: Law) -> Option<&BitSet> {
        let law = self.laws.iter().find(|found| found.law == law)?;
        law.target.as_ref()
    }

    /// The laws as `emit::assemble` takes them.
    pub fn encoded(&self) -> [Option<EncodedLaw>; LAWS] {
        let mut encoded = [None, None, None];
        for law in &self.laws {
            encoded[law.law as usize] = Some(law.encoded.clone());
        }
        encoded
    }
}

/// Compresses the laws of a synthesis.
///
/// # Errors
/// As [`CompressError`].
pub fn compress<'w>(
    synthesis: &Synthesis,
    options: &Options,
    watch: &dyn Fn(&'static str) -> Box<dyn Watch + 'w>,
) -> Result<CompressedLaws, CompressError> {
    let problem = &synthesis.problem;
    let abstraction = synthesis::abstraction(problem).map_err(SynthesisError::from)?;
    let context = |options| Context {
        problem,
        spec: &problem.spec,
        abstraction: &abstraction,
        options,
        watch,
    };
    if problem.spec.table.domain == spec::Domain::Reachable {
        return context(options).reachable(synthesis);
    }
    let given_up = context(options);
    let laws = given_up.winning(synthesis)?;
    if options.exact_domain || given_up.covers_the_event(&laws)? {
        return Ok(laws);
    }
    // A cell that the event itself needs was given up: then every cell is kept.
    let exact = Options {
        exact_domain: true,
        ..*options
    };
    context(&exact).winning(synthesis)
}

struct Context<'c, 'w> {
    problem: &'c Problem,
    spec: &'c Spec,
    abstraction: &'c AffineAbstraction<STATES>,
    options: &'c Options,
    watch: &'c dyn Fn(&'static str) -> Box<dyn Watch + 'w>,
}

impl<'w> Context<'_, 'w> {
    /// Whether the closed loop from the spec's initial states finds an entry wherever it comes.
    fn covers_the_event(&self, laws: &CompressedLaws) -> Result<bool, CompressError> {
        let image = emit::assemble(emit::head(self.problem)?, &laws.encoded())?;
        let table = TableView::parse(&image).map_err(EmitError::Rejected)?;
        match reachable::reachable(self.problem, self.abstraction, &table) {
            Ok(_) => Ok(true),
            // Where the closed loop cannot be explored nobody can tell: then nothing is given up
            // either.
            Err(CompressError::LeavesTable { .. } | CompressError::Unbounded) => Ok(false),
            Err(error) => Err(error),
        }
    }

    fn guard(&self, law: Law) -> OptionalGuard {
        match law {
            Law::Hold => synthesis::stay_guard(self.problem),
            Law::C1 | Law::C2 => synthesis::containment_guard(self.problem),
        }
    }

    fn watch(&self, law: Law) -> Box<dyn Watch + 'w> {
        (self.watch)(match law {
            Law::C1 => "C1, compressed",
            Law::C2 => "C2, compressed",
            Law::Hold => "Hold, compressed",
        })
    }

    /// The preferred law on the grid, if the spec has one. C1, which makes the nadir, keeps to it.
    /// C2 and Hold give it where a whole box may, and else what suits the box, for bytes: held
    /// within 4 or 2 levels they take 2.5 or 3.4 times as many and reach no more.
    fn preferred(&self, law: Law) -> Result<Option<Preferred>, CompressError> {
        let Some(preference) = Preference::of(self.spec) else {
            return Ok(None);
        };
        Ok(Some(Preferred {
            law: preference.law(self.spec, self.abstraction.shape())?,
            levels: self.abstraction.inputs() as u8,
            slack: match law {
                Law::C1 => 0,
                Law::C2 | Law::Hold => u32::BITS,
            },
        }))
    }

    /// Where a law's set-points lie.
    fn band(&self, law: Law) -> [i32; 2] {
        match law {
            Law::C1 => self.spec.requirements.outer_micro(),
            Law::C2 | Law::Hold => self.spec.requirements.inner_micro(),
        }
    }

    fn rounds(&self) -> u32 {
        if self.options.keep_minimal_time {
            0
        } else {
            ROUNDS
        }
    }
}

/// Puts a law together.
fn finish(
    law: Law,
    solved: &SolvedLaw,
    target: Option<BitSet>,
    cells: &BitSet,
    inputs: CompressedInputs,
    part: DomainPart,
) -> CompressedLaw {
    let entry = LawEntry {
        domain_kind: part.kind as u8,
        inputs_kind: InputsKind::Tree as u8,
        worst_visits: part.worst_visits + inputs.tree.depth(),
        domain_len: part.bytes.len() as u32,
        inputs_len: inputs.bytes.len() as u32,
    };
    CompressedLaw {
        law,
        target,
        report: LawReport {
            winning_cells: solved.solution.winning,
            domain_cells: cells.count(),
            domain_leaves: part.tree.leaves() as u32,
            half_spaces: part.predicates.spaces.len() as u32,
            entries: inputs.tree.leaves() as u32,
            laws: inputs.laws.pieces.len() as u32,
            steps_minimal: worst(&solved.solution.ranks),
            steps: inputs.steps,
        },
        encoded: EncodedLaw {
            entry,
            domain: part.bytes,
            inputs: inputs.bytes,
        },
    }
}

/// The cells of rank 0.
fn target(ranks: &[u16]) -> BitSet {
    let mut set = BitSet::new(ranks.len());
    for (index, rank) in ranks.iter().enumerate() {
        if *rank == 0 {
            set.insert(index);
        }
    }
    set
}

/// Largest rank of a won cell.
fn worst(ranks: &[u16]) -> u16 {
    let won = ranks.iter().filter(|rank| **rank != NOT_WON);
    won.max().copied().unwrap_or(0)
}
