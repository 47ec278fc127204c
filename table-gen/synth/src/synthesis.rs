//! From a spec to its laws: which games are played on which cells.
//!
//! | law | game | target | in the spec |
//! |---|---|---|---|
//! | C1 | reach-avoid | whole cells in I1 | always |
//! | C2 | reach-avoid | whole cells in I2 | if I2 is smaller than I1 |
//! | Hold | safety | stay in whole cells in I2 | with `stay`; the law before reaches its kernel |
//!
//! "Avoid" is every cell of which any part lies below containment. With a measurement error e, the
//! cell is that of the estimate: the real frequency may lie e outside it, so bands shrink and
//! containment rises by e. Where commands act with a delay, the cell is that of the prediction
//! ([`crate::delay`]), and e that of the prediction. Where their delay is a range, every period
//! begins with a changeover ([`crate::changeover`]).
//!
//! All numbers of the abstraction are in the device's micro-units, so that the edges of the cells
//! are exact.

use std::time::Instant;

use firmware::units::AXIS_F;

use crate::abstraction::Abstraction;
use crate::abstraction::affine::{
    AbstractionError, AffineAbstraction, AffineInput, Errors, Growth,
};
use crate::abstraction::guard::Guard;
use crate::abstraction::tube::TubeGuard;
use crate::game::bitset::BitSet;
use crate::game::exchange::{Alone, Exchange};
use crate::game::reach::{may_reach, reach_shared};
use crate::game::{GameError, LastCells, Solution, Watch, safety::safety_shared};
use crate::problem::{Problem, ProblemError};
use crate::ranks::slab::{Slab, WindowGuard};
use crate::ranks::{Slabs, Transport};
use crate::usage;
use model::grid_shape::GridShape;
use model::plant::STATES;
use model::spec::{Spec, Successor};

/// A law's game, solved.
#[derive(Debug, Clone)]
pub struct SolvedLaw {
    /// Allowed inputs and ranks.
    pub solution: Solution,
    /// Target cells (the kernel itself for Hold).
    pub target_cells: usize,
    /// Processor time of the game \[s\].
    pub cpu_s: f64,
    /// Wall time of the game \[s\].
    pub wall_s: f64,
}

/// All laws of a spec.
#[derive(Debug, Clone)]
pub struct Synthesis {
    /// What was solved.
    pub problem: Problem,
    /// Reaches I1.
    pub c1: SolvedLaw,
    /// Reaches I2; absent if I1 = I2.
    pub c2: Option<SolvedLaw>,
    /// Stays in I2; absent without `stay`.
    pub hold: Option<SolvedLaw>,
    /// Processor time of the abstraction's tables \[s\].
    pub abstraction_cpu_s: f64,
}

impl Synthesis {
    /// The laws with their names.
    pub fn all(&self) -> Vec<(&'static str, &SolvedLaw)> {
        let others = [("C2", &self.c2), ("Hold", &self.hold)];
        let mut all = vec![("C1", &self.c1)];
        all.extend(
            others
                .into_iter()
                .filter_map(|(name, law)| Some((name, law.as_ref()?))),
        );
        all
    }
}

/// Why there are no laws.
#[derive(Debug, thiserror::Error)]
pub enum SynthesisError {
    /// The spec does not fit the device.
    #[error(transparent)]
    Problem(#[from] ProblemError),
    /// The preferred law is always on: no game is played.
    #[error("preference.always_on is true: the law itself is the table, and no game is played")]
    Response,
    /// The abstraction cannot be built.
    #[error(transparent)]
    Abstraction(#[from] AbstractionError),
    /// A game has no result.
    #[error("{game}: {error}")]
    Game {
        /// The law whose game it is.
        game: &'static str,
        /// Why.
        error: GameError,
    },
    /// A game has an empty answer: no controller exists on this grid.
    #[error("{game}: no controller exists on this grid: {reason}")]
    NoController {
        /// The law whose game it is.
        game: &'static str,
        /// Which requirement fails, and how close it came.
        reason: String,
    },
}

/// The abstraction of a problem's plant on its grid.
///
/// # Errors
/// As [`AffineAbstraction::new`].
pub fn abstraction(problem: &Problem) -> Result<AffineAbstraction<STATES>, AbstractionError> {
    let growth = match problem.spec.method.successor {
        Successor::GrowthBound => Growth::GrowthBound,
        Successor::ExactLinear => Growth::ExactLinear,
    };
    let (shape, inputs, period_s) = (problem.shape, &problem.inputs, problem.period_s);
    let plain = Errors {
        before: problem.measurement,
        after: problem.measurement,
    };
    let at_once: Option<Vec<_>> = problem.changeover.as_ref().map(|changeover| {
        let plant = (&problem.a, &problem.b);
        let drift = |input: &AffineInput<STATES>| changeover.drift(plant, period_s, input.drive);
        inputs.iter().map(drift).collect()
    });
    let (errors, drifts) = match &problem.delay {
        Some(delay) => (delay.errors, Some(&delay.drifts[..])),
        None => (plain, at_once.as_deref()),
    };
    AffineAbstraction::with_drifts(shape, inputs, period_s, growth, errors, drifts)
}

/// The guard of a band \[µHz\], if the spec asks for the time between the samples and the band has
/// an end.
fn between_samples(problem: &Problem, [low, high]: [f64; 2]) -> OptionalGuard {
    let bounded = low.is_finite() || high.is_finite();
    let guarded = problem.spec.method.between_samples && bounded;
    OptionalGuard(guarded.then(|| {
        TubeGuard::with_changeover(
            &problem.shape,
            &problem.inputs,
            (problem.period_s, problem.changeover.as_ref()),
            problem.known_within,
            AXIS_F,
            (low, high),
        )
    }))
}

/// The guard of C1 and C2: f stays above containment between the samples too, if the spec asks for
/// it.
pub fn containment_guard(problem: &Problem) -> OptionalGuard {
    let low = problem.containment.unwrap_or(f64::NEG_INFINITY);
    between_samples(problem, [low, f64::INFINITY])
}

/// The guard of Hold: f stays in I2 between the samples too, if the spec asks for it.
pub fn stay_guard(problem: &Problem) -> OptionalGuard {
    between_samples(problem, problem.inner)
}

/// A guard, or none.
#[derive(Debug, Clone)]
pub struct OptionalGuard(Option<TubeGuard<STATES>>);

impl Guard<STATES> for OptionalGuard {
    fn permitted(&self, cell: [u32; STATES], inputs: u32) -> u32 {
        match &self.0 {
            None => inputs,
            Some(guard) => guard.permitted(cell, inputs),
        }
    }
}

/// Cells whose whole frequency interval, widened by the measurement error, lies in a band \[µHz\].
fn cells_within(shape: &GridShape<STATES>, [low, high]: [f64; 2], error: f64) -> BitSet {
    by_frequency(shape, |cell_low, cell_high| {
        cell_low - error >= low && cell_high + error <= high
    })
}

/// Cells chosen by their frequency interval \[µHz\].
fn by_frequency(shape: &GridShape<STATES>, choose: impl Fn(f64, f64) -> bool) -> BitSet {
    let row: Vec<bool> = (0..shape.count[0])
        .map(|f| {
            let (low, high) = shape.interval(0, f);
            choose(low, high)
        })
        .collect();
    let mut set = BitSet::new(shape.cells());
    for index in 0..shape.cells() {
        if row[index % row.len()] {
            set.insert(index);
        }
    }
    set
}

/// Plays the games of a spec. `watch` is asked for an observer of each game by its name.
///
/// # Errors
/// A grid or abstraction that cannot be, an empty target, an empty kernel or winning set, or an
/// interruption.
pub fn synthesise<'w>(
    spec: &Spec,
    watch: &dyn Fn(&'static str) -> Box<dyn Watch + 'w>,
) -> Result<Synthesis, SynthesisError> {
    if spec.preference.always_on {
        return Err(SynthesisError::Response);
    }
    let before = usage::cpu_s();
    let problem = Problem::new(spec)?;
    let abstraction = abstraction(&problem)?;
    let guards = [containment_guard(&problem), stay_guard(&problem)];
    let abstraction_cpu_s = usage::cpu_s() - before;
    let laws = play_laws(&problem, &abstraction, &guards, &Alone, watch)?;
    Ok(laws.of(problem, abstraction_cpu_s))
}

/// What a rank has of a synthesis that several play.
#[derive(Debug, Clone)]
pub struct SharedSynthesis {
    /// The laws in this rank's window; counts are those of the whole grid.
    pub laws: Synthesis,
    /// Own cells within the window.
    pub own: std::ops::Range<usize>,
    /// Cells of a layer of the grid, of which the window and the own cells are made.
    pub layer: usize,
    /// Bytes that this rank sent to others after sweeps.
    pub sent_bytes: u64,
}

/// Plays the games of a spec together with other ranks, each in a slab of the grid. Every rank
/// calls it with the same spec.
///
/// # Errors
/// As [`synthesise`], or a rank that is gone.
pub fn synthesise_shared<'w>(
    spec: &Spec,
    transport: &impl Transport,
    watch: &dyn Fn(&'static str) -> Box<dyn Watch + 'w>,
) -> Result<SharedSynthesis, SynthesisError> {
    let before = usage::cpu_s();
    let problem = Problem::new(spec)?;
    let whole = abstraction(&problem)?;
    let guards = [containment_guard(&problem), stay_guard(&problem)];
    let slab = Slab::new(&whole, transport.rank(), transport.ranks());
    let part = slab.part();
    let slabs = Slabs::new(transport, &part).map_err(|lost| SynthesisError::Game {
        game: "the slabs",
        error: lost.into(),
    })?;
    let guards = guards
        .each_ref()
        .map(|guard| WindowGuard::new(guard, &slab));
    let abstraction_cpu_s = usage::cpu_s() - before;
    let laws = play_laws(&problem, &slab, &guards, &slabs, watch)?;
    Ok(SharedSynthesis {
        laws: laws.of(problem, abstraction_cpu_s),
        own: slabs.owned(part.window.len()),
        layer: slab.shape().strides()[STATES - 1],
        sent_bytes: slabs.sent_bytes(),
    })
}

/// The laws of a problem, before they are put beside it.
struct Laws {
    c1: SolvedLaw,
    c2: Option<SolvedLaw>,
    hold: Option<SolvedLaw>,
}

impl Laws {
    fn of(self, problem: Problem, abstraction_cpu_s: f64) -> Synthesis {
        Synthesis {
            problem,
            c1: self.c1,
            c2: self.c2,
            hold: self.hold,
            abstraction_cpu_s,
        }
    }
}

/// Plays the games in a window of the grid: the whole, or a rank's. The guards are those of
/// containment and of Hold.
fn play_laws<'w, A: Abstraction<STATES, Inputs = u32>, G: Guard<STATES>>(
    problem: &Problem,
    abstraction: &A,
    [contained, stay]: &[G; 2],
    exchange: &dyn Exchange,
    watch: &dyn Fn(&'static str) -> Box<dyn Watch + 'w>,
) -> Result<Laws, SynthesisError> {
    // The window's shape, which is not the problem's on a rank.
    let shape = abstraction.shape();
    let requirements = &problem.spec.requirements;
    let error = problem.known_within[AXIS_F];
    let outer = cells_within(shape, problem.outer, error);
    let inner = cells_within(shape, problem.inner, error);
    let avoid = match problem.containment {
        None => BitSet::new(outer.len()),
        // A cell counts as contained only if its lower end, less the error, is at or above the
        // limit.
        Some(limit) => by_frequency(shape, |low, _| low - error < limit),
    };
    let hold = if requirements.stay {
        let mut last = 0;
        let law = solve("Hold", exchange, watch, |watch| {
            let watch = LastCells::new(watch);
            let solution = safety_shared(abstraction, &inner, stay, exchange, &watch);
            last = watch.last();
            solution
        })?;
        if law.solution.winning == 0 {
            // The last sweep only finds that nothing is left.
            let periods = law.solution.sweeps.saturating_sub(2);
            let closest = match last {
                0 => "none has an input that keeps f there between the samples".to_owned(),
                _ => format!("{last} came closest, with {periods} periods"),
            };
            return Err(SynthesisError::NoController {
                game: "Hold",
                reason: format!(
                    "requirements.stay fails: of the {} cells in I2 none can stay there for ever; {closest}",
                    inner.count(),
                ),
            });
        }
        Some(law)
    } else {
        None
    };
    let kernel = hold.as_ref().map(|law| law.solution.winning_set(true));
    let same = requirements.outer_micro() == requirements.inner_micro();
    let play = |name, target: &BitSet| {
        let law = solve(name, exchange, watch, |watch| {
            reach_shared(abstraction, (target, &avoid), contained, exchange, watch)
        })?;
        if law.solution.winning == 0 {
            return Err(SynthesisError::NoController {
                game: name,
                reason: format!(
                    "{} fails: no cell outside the target's {} can be driven into it for certain; {} cells came closest, \
                     with an input that may do so",
                    goal(name, &kernel),
                    law.target_cells,
                    may_reach(abstraction, target, &avoid),
                ),
            });
        }
        Ok(law)
    };
    let c2 = match (same, &kernel) {
        (true, _) => None,
        (false, Some(kernel)) => Some(play("C2", kernel)?),
        (false, None) => Some(play("C2", &inner)?),
    };
    let c1_target = match (&kernel, &c2) {
        (None, _) => outer,
        (Some(kernel), None) => kernel.clone(),
        (Some(_), Some(c2)) => {
            // C1 hands over where C2 (or Hold) has an entry and f is in I1.
            let mut target = c2.solution.winning_set(true);
            for index in 0..target.len() {
                if !outer.contains(index) {
                    target.remove(index);
                }
            }
            target
        }
    };
    let c1 = play("C1", &c1_target)?;
    Ok(Laws { c1, c2, hold })
}

/// The requirement that a reach game is for, by its key.
fn goal(game: &str, kernel: &Option<BitSet>) -> &'static str {
    match (game, kernel) {
        ("C2", None) => "requirements.inner_hz",
        ("C2", Some(_)) => "requirements.inner_hz with stay",
        (_, None) => "requirements.outer_hz",
        (_, Some(_)) => "requirements.outer_hz with stay",
    }
}

fn solve<'w>(
    game: &'static str,
    exchange: &dyn Exchange,
    watch: &dyn Fn(&'static str) -> Box<dyn Watch + 'w>,
    play: impl FnOnce(&dyn Watch) -> Result<Solution, GameError>,
) -> Result<SolvedLaw, SynthesisError> {
    let (cpu, wall) = (usage::cpu_s(), Instant::now());
    let failed = |error| SynthesisError::Game { game, error };
    let watch = watch(game);
    let solution = play(watch.as_ref()).map_err(failed)?;
    let own = exchange.owned(solution.ranks.len());
    let targets = solution.ranks[own].iter().filter(|rank| **rank == 0);
    let target_cells = exchange
        .sum(targets.count())
        .map_err(|lost| failed(lost.into()))?;
    Ok(SolvedLaw {
        solution,
        target_cells,
        cpu_s: usage::cpu_s() - cpu,
        wall_s: wall.elapsed().as_secs_f64(),
    })
}

/// A checksum of each layer of a solution's own cells, masks and ranks: the same on any number of
/// ranks and threads.
pub fn layer_sums(solution: &Solution, own: std::ops::Range<usize>, layer: usize) -> Vec<u64> {
    let crc = crc::Crc::<u64>::new(&crc::CRC_64_ECMA_182);
    let masks = solution.masks[own.clone()].chunks(layer);
    masks
        .zip(solution.ranks[own].chunks(layer))
        .map(|(masks, ranks)| {
            let mut digest = crc.digest();
            for (mask, rank) in masks.iter().zip(ranks) {
                digest.update(&mask.to_le_bytes());
                digest.update(&rank.to_le_bytes());
            }
            digest.finalize()
        })
        .collect()
}

/// Transitions of the abstraction: cells in the boxes of all allowed pairs. A count for comparison
/// with tools that store them; nothing else needs it.
pub fn count_transitions<const D: usize, A: Abstraction<D>>(abstraction: &A) -> u64 {
    use rayon::prelude::*;
    let shape = abstraction.shape();
    (0..shape.cells())
        .into_par_iter()
        .map(|index| {
            let anchor = abstraction.anchor(shape.cell(index));
            (0..abstraction.inputs())
                .filter_map(|input| abstraction.successor(&anchor, input))
                .map(|cells| {
                    (0..D)
                        .map(|d| u64::from(cells.high[d] - cells.low[d] + 1))
                        .product::<u64>()
                })
                .sum::<u64>()
        })
        .sum()
}
