//! An exactly known event: only its moment within a tick is open, so the states at a tick are a
//! curve.
//!
//! The curve is cut into short straight segments, each carried by its two ends. While both ends
//! decide alike, all of the segment does (decisions change at planes between cells and at the ends
//! of bands, and boxes are convex). Where they differ, the segment is halved, down to a length at
//! which both answers are followed for all of it.

use firmware::phase::{Decision, Phase, PhaseState};
use firmware::table::{LAWS, Law, TableView};
use firmware::units::State;

use super::super::CompressError;
use crate::drives::MICRO;
use crate::game::bitset::BitSet;
use model::plant::{Plant, STATES};
use model::propagator::Propagator;
use model::spec::Spec;

/// Segments into which the curve is cut at first.
const SEGMENTS: u32 = 64;
/// Halvings of a segment before both answers are followed.
const HALVINGS_MAX: u32 = 24;
/// Time that is explored if the spec has no horizon \[s\]: the slow pair of poles decays by e^-77
/// in 1000 s.
const HORIZON_S: f64 = 1000.0;
/// Most steps in all: a loop whose branches multiply without end is given up.
const STEPS_MAX: u64 = 200_000_000;

/// A piece of the curve of states at a tick.
#[derive(Debug, Clone, Copy)]
struct Segment {
    ends: [[f64; STATES]; 2],
    state: PhaseState,
    tick: u64,
    halvings: u32,
}

/// Explores; the table must hold every law with its whole domain.
///
/// # Errors
/// A loop that reaches a cell without an entry, or branches without end.
pub fn explore(spec: &Spec, table: &TableView<'_>) -> Result<[BitSet; LAWS], CompressError> {
    let grid = table.header().grid;
    let tick_s = f64::from(spec.sampling.watch_ms()) / 1000.0;
    let plant = Plant::new(spec);
    let step = Propagator::new(&plant, tick_s);
    let horizon_s = spec.requirements.horizon_s.unwrap_or(HORIZON_S);
    let ticks = (horizon_s / tick_s).ceil() as u64;
    let loss = spec.uncertainty.loss_gw[0];
    let mut asked = std::array::from_fn(|_| BitSet::new(grid.cells() as usize));
    let mut open = first_segments(spec, &plant, tick_s);
    let mut steps = 0u64;
    while let Some(segment) = open.pop() {
        let mut segment = segment;
        while segment.tick <= ticks {
            steps += 1;
            if steps > STEPS_MAX {
                return Err(CompressError::Unbounded);
            }
            let answers = segment
                .ends
                .map(|end| segment.state.step(table, micro(&end)));
            if answers[0] != answers[1] && segment.halvings < HALVINGS_MAX {
                let middle =
                    std::array::from_fn(|d| 0.5 * (segment.ends[0][d] + segment.ends[1][d]));
                segment.halvings += 1;
                let [first, last] = segment.ends;
                open.push(Segment {
                    ends: [middle, last],
                    ..segment
                });
                segment.ends = [first, middle];
                continue;
            }
            for end in &segment.ends {
                mark(&mut asked, table, &segment.state, micro(end))?;
            }
            if answers[0] != answers[1] {
                // Both answers, each for all of the segment.
                let (state, level) = answers[1];
                open.push(advance(&segment, state, power(spec, level), &step, loss));
            }
            let (state, level) = answers[0];
            segment = advance(&segment, state, power(spec, level), &step, loss);
        }
    }
    Ok(asked)
}

/// The states at the first tick after the event, which came up to a tick before it.
fn first_segments(spec: &Spec, plant: &Plant, tick_s: f64) -> Vec<Segment> {
    let start = spec.uncertainty.initial.lower;
    let at = |share: f64| {
        Propagator::new(plant, tick_s * share).step(&start, -spec.uncertainty.loss_gw[0])
    };
    (0..SEGMENTS)
        .map(|piece| Segment {
            ends: [piece, piece + 1].map(|end| at(f64::from(end) / f64::from(SEGMENTS))),
            state: PhaseState::INITIAL,
            tick: 0,
            halvings: 0,
        })
        .collect()
}

fn advance(
    segment: &Segment,
    state: PhaseState,
    power: f64,
    step: &Propagator,
    loss: f64,
) -> Segment {
    Segment {
        ends: segment.ends.map(|end| step.step(&end, power - loss)),
        state,
        tick: segment.tick + 1,
        ..*segment
    }
}

/// Power of an answer \[GW\]; outside the table none (the exploration ends there with an error).
fn power(spec: &Spec, step: Decision) -> f64 {
    match step {
        Decision::Level(level) => spec.fleet_power_gw() * spec.input.value(level.into()),
        Decision::Outside => 0.0,
    }
}

/// Marks the cell for which a decision at this state asks its law.
fn mark(
    asked: &mut [BitSet; LAWS],
    table: &TableView<'_>,
    before: &PhaseState,
    state: State,
) -> Result<(), CompressError> {
    let (after, _) = before.step(table, state);
    let law = match after.phase {
        Phase::NoControl | Phase::Fixed => return Ok(()),
        Phase::Fallback | Phase::Response => {
            return Err(CompressError::LeavesTable { state: state.0 });
        }
        Phase::C1 => Law::C1,
        Phase::C2 => Law::C2,
        Phase::Hold => Law::Hold,
    };
    // Between decisions the level is held and nothing is asked.
    let decided = after.ticks_left + 1 == table.header().period_ticks;
    let grid = table.header().grid;
    if decided && let Some(index) = grid.quantise(state).and_then(|cell| grid.index(cell)) {
        asked[law as usize].insert(index as usize);
    }
    Ok(())
}

/// A state as the device stores it.
fn micro(x: &[f64; STATES]) -> State {
    State(x.map(|value| (value * MICRO).floor() as i32))
}
