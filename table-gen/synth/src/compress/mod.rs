//! Compression: from the games' solutions to the parts of a table.
//!
//! | file | does |
//! |---|---|
//! | [`deadbeat`] | candidate affine laws |
//! | [`law_set`] | chooses among them, and says which leaves are right in a cell |
//! | [`cells`] | the cells of a domain with their right leaves |
//! | [`split`], [`tree`] | a small k-d tree over them |
//! | [`inputs`] | the whole of it for a law: laws, ranks, tree, ranks by the tree, … |
//! | [`facets`] | half-spaces that bound a winning set |
//! | [`look_aheads`] | what a held input would do, in integers |
//! | [`membership`] | a set of cells as a tree with half-spaces, exact or with cells given up |
//! | [`domain`] | the domain of a law, in which its game is won again |
//! | [`encode`] | trees as bytes |
//! | `winning`, `asked` | the laws of a table: every winning cell, or what the closed loop asks for |
//! | [`recheck`] | the emitted bytes, played again |
//!
//! A law's table part is sound by itself: every input that it gives inside its domain is one that the game allows there.

mod asked;
pub mod cells;
pub mod deadbeat;
pub mod domain;
pub mod encode;
pub mod facets;
pub mod inputs;
pub mod law_set;
pub mod look_aheads;
pub mod membership;
pub mod narrow;
pub mod reachable;
pub mod recheck;
pub mod split;
pub mod tree;
mod winning;

use firmware::grid::Grid;
use firmware::table::{InputsKind, LAWS, Law, LawEntry, TableView};

use crate::abstraction::affine::AffineAbstraction;
use crate::delay::DelayError;
use crate::emit::{self, EmitError, EncodedLaw};
use crate::game::bitset::BitSet;
use crate::game::{GameError, NOT_WON, Watch};
use crate::synthesis::{self, OptionalGuard, SolvedLaw, Synthesis, SynthesisError};
use inputs::CompressedInputs;
use membership::DomainPart;
use model::plant::STATES;
use model::spec::{self, Spec};

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
    /// Cells from which the table leads to the law's target: those of its domain, and for a C2 that is asked in I1 alone
    /// those of C1.
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

/// Why compression has no result.
#[derive(Debug, thiserror::Error)]
pub enum CompressError {
    /// The abstraction cannot be built.
    #[error(transparent)]
    Synthesis(#[from] SynthesisError),
    /// A delay that the device cannot predict over.
    #[error(transparent)]
    Delay(#[from] DelayError),
    /// A game inside compression has no result.
    #[error("while ranking the compressed law: {0}")]
    Game(#[from] GameError),
    /// The closed loop cannot be explored.
    #[error(
        "table.domain = \"reachable\" needs an exactly known event or requirements.stay = true: in Fixed nothing bounds \
         where an uncertain state goes; use table.domain = \"winning\""
    )]
    Unbounded,
    /// The closed loop leaves the laws.
    #[error(
        "the closed loop reaches a state near f g l p = {state:?} (µHz, kW) for which no law has an entry; use \
         table.domain = \"winning\" to see which"
    )]
    LeavesTable {
        /// The state, in micro-units.
        state: [i32; STATES],
    },
    /// A table cannot be assembled.
    #[error(transparent)]
    Emit(#[from] EmitError),
    /// A part is larger than the format holds.
    #[error("a tree is larger than the format holds (16 MiB below one node)")]
    TooLarge,
}

/// Compresses the laws of a synthesis.
///
/// # Errors
/// As [`CompressError`].
pub fn compress<'w>(
    spec: &Spec,
    synthesis: &Synthesis,
    options: &Options,
    watch: &dyn Fn(&'static str) -> Box<dyn Watch + 'w>,
) -> Result<CompressedLaws, CompressError> {
    let abstraction = synthesis::abstraction(spec, &synthesis.grid)?;
    let context = |options| Context {
        spec,
        grid: &synthesis.grid,
        abstraction: &abstraction,
        options,
        watch,
    };
    if spec.table.domain == spec::Domain::Reachable {
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

/// The whole table of a synthesis, and how its laws came out.
///
/// # Errors
/// As [`compress`], and numbers of the spec that the header cannot hold.
pub fn table<'w>(
    spec: &Spec,
    synthesis: &Synthesis,
    options: &Options,
    watch: &dyn Fn(&'static str) -> Box<dyn Watch + 'w>,
) -> Result<(Vec<u8>, CompressedLaws), CompressError> {
    let laws = compress(spec, synthesis, options, watch)?;
    let head = emit::head(spec, synthesis.grid)?;
    let image = emit::assemble(head, &laws.encoded())?;
    Ok((image, laws))
}

struct Context<'c, 'w> {
    spec: &'c Spec,
    grid: &'c Grid,
    abstraction: &'c AffineAbstraction<STATES>,
    options: &'c Options,
    watch: &'c dyn Fn(&'static str) -> Box<dyn Watch + 'w>,
}

impl<'w> Context<'_, 'w> {
    /// Whether the closed loop from the spec's initial states finds an entry wherever it comes.
    fn covers_the_event(&self, laws: &CompressedLaws) -> Result<bool, CompressError> {
        let image = emit::assemble(emit::head(self.spec, *self.grid)?, &laws.encoded())?;
        let table = TableView::parse(&image).map_err(EmitError::Rejected)?;
        match reachable::reachable(self.spec, self.abstraction, &table) {
            Ok(_) => Ok(true),
            // Where the closed loop cannot be explored nobody can tell: then nothing is given up either.
            Err(CompressError::LeavesTable { .. } | CompressError::Unbounded) => Ok(false),
            Err(error) => Err(error),
        }
    }

    fn guard(&self, law: Law) -> Result<OptionalGuard, DelayError> {
        match law {
            Law::Hold => synthesis::stay_guard(self.spec, self.grid),
            Law::C1 | Law::C2 => synthesis::containment_guard(self.spec, self.grid),
        }
    }

    fn watch(&self, law: Law) -> Box<dyn Watch + 'w> {
        (self.watch)(match law {
            Law::C1 => "C1, compressed",
            Law::C2 => "C2, compressed",
            Law::Hold => "Hold, compressed",
        })
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
            laws: inputs.laws.laws.len() as u32,
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
