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
//! | [`membership`] | a set of cells as a tree with half-spaces, exact or with cells given up |
//! | [`domain`] | the domain of a law, in which its game is won again |
//! | [`encode`] | trees as bytes |
//! | [`recheck`] | the emitted bytes, played again |
//!
//! A law's table part is sound by itself: every input that it gives inside its domain is one that the game allows there.

pub mod cells;
pub mod deadbeat;
pub mod domain;
pub mod encode;
pub mod facets;
pub mod inputs;
pub mod law_set;
pub mod membership;
pub mod narrow;
pub mod reachable;
pub mod recheck;
pub mod split;
pub mod tree;

use firmware::grid::Grid;
use firmware::table::{InputsKind, LAWS, Law, LawEntry, TableView};

use crate::abstraction::Abstraction;
use crate::abstraction::affine::AffineAbstraction;
use crate::delay::DelayError;
use crate::emit::{self, EmitError, EncodedLaw};
use crate::game::bitset::BitSet;
use crate::game::inclusion::Inclusion;
use crate::game::{GameError, NOT_WON, Watch};
use crate::plant::STATES;
use crate::spec::{self, Spec};
use crate::synthesis::{self, OptionalGuard, SolvedLaw, Synthesis, SynthesisError};
use domain::Play;
use inputs::{CompressedInputs, InputsTask};
use membership::DomainPart;
use narrow::Controller;

/// Most nodes that a path of a law's inputs tree may have.
pub const INPUTS_DEPTH_MAX: u32 = 32;
/// Rounds of ranking by the tree's own choices.
pub const ROUNDS: u32 = 8;

/// Times that a reachable table is explored again and narrowed.
const NARROWINGS: u32 = 4;

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
    /// Laws that cover the winning cells, or all but what the options allow to give up.
    fn winning(&self, synthesis: &Synthesis) -> Result<CompressedLaws, CompressError> {
        let mut done = Vec::new();
        let mut covered = Covered::none(self.abstraction.shape().cells());
        // Backwards from where the event ends: a law that gives cells up shrinks the target of the one before it.
        for (law, solved) in [
            (Law::Hold, synthesis.hold.as_ref()),
            (Law::C2, synthesis.c2.as_ref()),
            (Law::C1, Some(&synthesis.c1)),
        ] {
            if let Some(solved) = solved {
                done.push(self.law(law, solved, &mut covered)?);
            }
        }
        done.reverse();
        Ok(CompressedLaws { laws: done })
    }

    /// Whether the closed loop from the spec's initial states finds an entry wherever it comes.
    fn covers_the_event(&self, laws: &CompressedLaws) -> Result<bool, CompressError> {
        let image = emit::assemble(emit::head(self.spec, *self.grid)?, &laws.encoded())?;
        let table = TableView::parse(&image).map_err(EmitError::Rejected)?;
        match reachable::reachable(self.spec, self.abstraction, &table) {
            Ok(_) => Ok(true),
            Err(CompressError::LeavesTable { .. }) => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// Laws that cover what the closed loop asks for.
    fn reachable(&self, synthesis: &Synthesis) -> Result<CompressedLaws, CompressError> {
        let shape = self.abstraction.shape();
        let laws = [
            (Law::C1, Some(&synthesis.c1)),
            (Law::C2, synthesis.c2.as_ref()),
            (Law::Hold, synthesis.hold.as_ref()),
        ];
        let mut controllers = Vec::new();
        for (law, solved) in laws {
            let Some(solved) = solved else { continue };
            let domain = solved.solution.winning_set(law == Law::Hold);
            let target = (law != Law::Hold).then(|| target(&solved.solution.ranks));
            let guard = self.guard(law)?;
            let watch = self.watch(law);
            let candidates = deadbeat::candidates(self.spec, shape, self.band(law));
            let task = InputsTask {
                abstraction: self.abstraction,
                target: target.as_ref(),
                domain: &domain,
                guard: &guard,
                watch: watch.as_ref(),
                solution: &solved.solution,
                candidates: &candidates,
                depth_max: INPUTS_DEPTH_MAX,
                rounds: self.rounds(),
            };
            let controller = Controller::new(law, &task, &candidates)?;
            controllers.push((controller, solved, target));
        }
        let mut dense = [None, None, None];
        for (controller, ..) in &controllers {
            dense[controller.law as usize] = Some(controller.dense(self.abstraction));
        }
        let image = emit::assemble(emit::head(self.spec, *self.grid)?, &dense)?;
        drop(dense);
        let table = TableView::parse(&image).map_err(EmitError::Rejected)?;
        let mut asked = reachable::reachable(self.spec, self.abstraction, &table)?;
        let mut best = self.narrow(&controllers, &asked)?;
        // The small controller, which keeps within the explored cells, may ask for fewer of them.
        for _ in 0..NARROWINGS {
            if !asked.closed {
                break;
            }
            let image = emit::assemble(emit::head(self.spec, *self.grid)?, &best.encoded())?;
            let table = TableView::parse(&image).map_err(EmitError::Rejected)?;
            asked = reachable::reachable(self.spec, self.abstraction, &table)?;
            let next = self.narrow(&controllers, &asked)?;
            if next.part_bytes() >= best.part_bytes() {
                break;
            }
            best = next;
        }
        Ok(best)
    }

    /// The laws for what is asked for.
    fn narrow(
        &self,
        controllers: &[(Controller, &SolvedLaw, Option<BitSet>)],
        asked: &reachable::Asked,
    ) -> Result<CompressedLaws, CompressError> {
        let closed = asked.closed.then(|| {
            let mut union = asked.laws[0].clone();
            union.add(&asked.laws[1]);
            union.add(&asked.laws[2]);
            Inclusion::new(self.abstraction.shape(), &union, self.abstraction.extents())
        });
        let mut laws = Vec::new();
        for (controller, solved, target) in controllers {
            let asked = &asked.laws[controller.law as usize];
            let (inputs, part) =
                controller.narrow(self.abstraction, asked, closed.as_ref(), INPUTS_DEPTH_MAX)?;
            laws.push(finish(
                controller.law,
                solved,
                target.clone(),
                asked,
                inputs,
                part,
            ));
        }
        Ok(CompressedLaws { laws })
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

    fn law(
        &self,
        law: Law,
        solved: &SolvedLaw,
        covered: &mut Covered,
    ) -> Result<CompressedLaw, CompressError> {
        let guard = self.guard(law)?;
        let watch = self.watch(law);
        let stay = self.spec.requirements.stay;
        let target = (law != Law::Hold).then(|| {
            let mut target = target(&solved.solution.ranks);
            if stay {
                target.keep(&covered.cells);
            }
            target
        });
        // Cells that no decision brings to this law: an earlier one answers there, or f is in I2 and Fixed does.
        let mut unasked = covered.cells.clone();
        if !stay
            && let Some(target) = &target
            && law == Law::C2
        {
            unasked.add(target);
        }
        if let Some(target) = &target {
            unasked.keep(target);
        }
        let play = Play {
            spec: self.spec,
            abstraction: self.abstraction,
            guard: &guard,
            watch: watch.as_ref(),
            target: target.as_ref(),
            unasked: &unasked,
        };
        let domain = play.domain(&solved.solution, self.options.exact_domain)?;
        let candidates = deadbeat::candidates(self.spec, self.abstraction.shape(), self.band(law));
        let inputs = InputsTask {
            abstraction: self.abstraction,
            target: target.as_ref(),
            domain: &domain.cells,
            guard: &guard,
            watch: watch.as_ref(),
            solution: &domain.solution,
            candidates: &candidates,
            depth_max: INPUTS_DEPTH_MAX,
            rounds: self.rounds(),
        }
        .run()?;
        covered.cells.add(&domain.cells);
        if law == Law::C2
            && !stay
            && let Some(target) = &target
        {
            covered.cells.add(target);
        }
        Ok(finish(
            law,
            solved,
            target,
            &domain.cells,
            inputs,
            domain.part,
        ))
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
            half_spaces: part.spaces.spaces.len() as u32,
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

/// Cells at which a law later in the chain, or Fixed, answers.
struct Covered {
    cells: BitSet,
}

impl Covered {
    fn none(cells: usize) -> Self {
        Self {
            cells: BitSet::new(cells),
        }
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
