//! Compression: from the games' solutions to the parts of a table.
//!
//! | file | does |
//! |---|---|
//! | [`deadbeat`] | candidate affine laws |
//! | [`law_set`] | chooses among them, and says which leaves are right in a cell |
//! | [`cells`] | the cells of a domain with their right leaves |
//! | [`split`], [`tree`] | a small k-d tree over them |
//! | [`inputs`] | the whole of it for a law: laws, ranks, tree, ranks by the tree, … |
//! | [`membership`] | the domain part |
//! | [`encode`] | trees as bytes |
//! | [`recheck`] | the emitted bytes, played again |
//!
//! A law's table part is sound by itself: every input that it gives inside its domain is one that the game allows there.

pub mod cells;
pub mod deadbeat;
pub mod encode;
pub mod inputs;
pub mod law_set;
pub mod membership;
pub mod recheck;
pub mod split;
pub mod tree;

use firmware::grid::Grid;
use firmware::table::{InputsKind, LAWS, Law, LawEntry, TREE_DEPTH_MAX};

use crate::abstraction::Abstraction;
use crate::abstraction::affine::{AbstractionError, AffineAbstraction};
use crate::emit::EncodedLaw;
use crate::game::bitset::BitSet;
use crate::game::{GameError, NOT_WON, Watch};
use crate::plant::STATES;
use crate::spec::Spec;
use crate::synthesis::{self, SolvedLaw, Synthesis};
use inputs::InputsTask;

/// Most nodes that a path of a law's inputs tree may have.
pub const INPUTS_DEPTH_MAX: u32 = 32;
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
    /// Cells of the domain.
    pub domain_cells: usize,
    /// Leaves of the inputs tree.
    pub entries: u32,
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
    Abstraction(#[from] AbstractionError),
    /// A game inside compression has no result.
    #[error("while ranking the compressed law: {0}")]
    Game(#[from] GameError),
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
    let context = Context {
        spec,
        grid: &synthesis.grid,
        abstraction: &abstraction,
        options,
        watch,
    };
    let outer = spec.requirements.outer_micro();
    let inner = spec.requirements.inner_micro();
    let mut laws = vec![context.law(Law::C1, &synthesis.c1, outer)?];
    for (law, solved) in [(Law::C2, &synthesis.c2), (Law::Hold, &synthesis.hold)] {
        if let Some(solved) = solved {
            laws.push(context.law(law, solved, inner)?);
        }
    }
    Ok(CompressedLaws { laws })
}

struct Context<'c, 'w> {
    spec: &'c Spec,
    grid: &'c Grid,
    abstraction: &'c AffineAbstraction<STATES>,
    options: &'c Options,
    watch: &'c dyn Fn(&'static str) -> Box<dyn Watch + 'w>,
}

impl Context<'_, '_> {
    fn law(
        &self,
        law: Law,
        solved: &SolvedLaw,
        band: [i32; 2],
    ) -> Result<CompressedLaw, CompressError> {
        let shape = self.abstraction.shape();
        let solution = &solved.solution;
        let safety = law == Law::Hold;
        let domain = solution.winning_set(safety);
        let target = (!safety).then(|| target(&solution.ranks));
        let candidates = deadbeat::candidates(self.spec, shape, band);
        let rounds = if self.options.keep_minimal_time {
            0
        } else {
            ROUNDS
        };
        let guard = if safety {
            synthesis::stay_guard(self.spec, self.grid)
        } else {
            synthesis::containment_guard(self.spec, self.grid)
        };
        let watch = (self.watch)(match law {
            Law::C1 => "C1, ranked by the tree",
            Law::C2 => "C2, ranked by the tree",
            Law::Hold => "Hold, ranked by the tree",
        });
        let inputs = InputsTask {
            abstraction: self.abstraction,
            target: target.as_ref(),
            domain: &domain,
            guard: &guard,
            watch: watch.as_ref(),
            solution,
            candidates: &candidates,
            depth_max: INPUTS_DEPTH_MAX,
            rounds,
        }
        .run()?;
        let part = membership::exact_tree(shape, &domain, TREE_DEPTH_MAX.into())?;
        let entry = LawEntry {
            domain_kind: part.kind as u8,
            inputs_kind: InputsKind::Tree as u8,
            worst_visits: part.worst_visits + inputs.tree.depth(),
            domain_len: part.bytes.len() as u32,
            inputs_len: inputs.bytes.len() as u32,
        };
        Ok(CompressedLaw {
            law,
            target,
            report: LawReport {
                winning_cells: solution.winning,
                domain_cells: domain.count(),
                entries: inputs.tree.leaves() as u32,
                steps_minimal: worst(&solution.ranks),
                steps: inputs.steps,
            },
            encoded: EncodedLaw {
                entry,
                domain: part.bytes,
                inputs: inputs.bytes,
            },
        })
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
