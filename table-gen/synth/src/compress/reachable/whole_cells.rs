//! An uncertain event: whole cells, from the trigger on.
//!
//! Before the trigger (No control) there is no game. The states in which f can first be seen below
//! I1 are enclosed in boxes, one for each short piece of time: the flow of the initial box under
//! the loss band, cut at the largest fall of f within a tick. From there every decision takes a
//! cell to the abstraction's box of cells. Where commands act with a delay, the boxes are carried
//! over it without a response: decisions go by the prediction.
//!
//! The boxes over a delay are to hold the verifier's sets, or its verdict meets cells that were
//! left out. Those sets follow the initial box exactly, carry what the loss varies tick by tick by
//! |exp(A tick)| at the worst, and are cut at I1; so the same is done here with pieces, for
//! |exp(A tick)| is no more than the product of its pieces' magnitudes.

use firmware::grid::Cell;
use firmware::table::{LAWS, Law, TableView};

use super::super::CompressError;
use crate::abstraction::Abstraction;
use crate::abstraction::affine::AffineAbstraction;
use crate::drives::MICRO;
use crate::game::bitset::BitSet;
use crate::problem::Problem;
use model::flow::{Flow, absolute_integral, product};
use model::interval::Interval;
use model::plant::STATES;
use model::spec::Spec;

/// Pieces into which a tick is cut.
const PIECES: u32 = 8;
/// Room around the boxes over a delay, in cells: for the bend between the ends of a piece, and for
/// roundings.
const ROOM_CELLS: f64 = 0.01;
/// Longest time to the trigger that is looked at \[s\]: past it the initial box must have left I1
/// or stays.
const TRIGGER_S_MAX: f64 = 60.0;

/// Explores; the table must hold every law with its whole domain.
///
/// # Errors
/// A loop that reaches a cell without an entry.
pub fn explore(
    problem: &Problem,
    abstraction: &AffineAbstraction<STATES>,
    table: &TableView<'_>,
) -> Result<[BitSet; LAWS], CompressError> {
    let shape = abstraction.shape();
    let header = table.header();
    let mut asked: [BitSet; LAWS] = std::array::from_fn(|_| BitSet::new(shape.cells()));
    let mut seen = BitSet::new(shape.cells());
    let mut open: Vec<usize> = Vec::new();
    for (low, high) in trigger_boxes(problem) {
        each_cell(&problem.spec, abstraction, low, high, |index| {
            if !seen.contains(index) {
                seen.insert(index);
                open.push(index);
            }
        })?;
    }
    while let Some(index) = open.pop() {
        let at = shape.cell(index);
        let cell = Cell(at.map(|i| i as u16));
        let (low, high) = shape.interval(0, at[0]);
        // The firmware's order: Hold, then C2 if the measured f is in I1, then C1.
        let mut laws = Vec::new();
        let hold = table.lookup(Law::Hold, cell);
        let c2 = table.lookup(Law::C2, cell);
        match (hold, c2) {
            (Some(_), _) => laws.push(Law::Hold),
            (None, None) => laws.push(Law::C1),
            (None, Some(_)) => {
                let (outer_low, outer_high) = (
                    f64::from(header.outer.low_uhz),
                    f64::from(header.outer.high_uhz),
                );
                if high > outer_low && low <= outer_high {
                    laws.push(Law::C2);
                }
                if low < outer_low || high > outer_high + 1.0 {
                    laws.push(Law::C1);
                }
            }
        }
        let anchor = abstraction.anchor(at);
        for law in laws {
            let outside = || CompressError::LeavesTable {
                state: [low as i32, 0, 0, 0],
            };
            let level = table.lookup(law, cell).ok_or_else(outside)?;
            asked[law as usize].insert(index);
            let next = abstraction
                .successor(&anchor, level.into())
                .ok_or_else(outside)?;
            each_in(next.low, next.high, |cell| {
                let index = shape.index(cell);
                if !seen.contains(index) {
                    seen.insert(index);
                    open.push(index);
                }
            });
        }
    }
    Ok(asked)
}

/// Lowest and highest of each state \[micro-units\].
type Box4 = ([f64; STATES], [f64; STATES]);

/// Boxes that hold every state on which the first decision may go: those in which a tick first
/// finds f below I1, or what is predicted from them.
fn trigger_boxes(problem: &Problem) -> Vec<Box4> {
    let (spec, delay) = (&problem.spec, &problem.delay);
    let (a, b) = (problem.a, problem.b);
    let tick_s = f64::from(spec.sampling.watch_ms()) / 1000.0;
    let piece_s = tick_s / f64::from(PIECES);
    let step = Flow::over(&a, &b, piece_s);
    let error = problem.measurement;
    let below = f64::from(spec.requirements.outer_micro()[0]) + error[0];
    let drive = problem.inputs[0].drive;
    let middle = Interval::point(drive.mid());
    let varying = absolute_integral(&a, &b, piece_s).map(|x| x * drive.radius());
    let initial = &spec.uncertainty.initial;
    let widths = spec.grid.widths_micro();
    // Without a delay the boxes are those of the estimate; else of the real state, and the
    // prediction adds the error.
    let (around, room) = match delay {
        None => (error, [0.0; STATES]),
        Some(_) => (
            [0.0; STATES],
            widths.map(|width| ROOM_CELLS * f64::from(width)),
        ),
    };
    // The flow of the box is that of its centre plus its generators; a sum of magnitudes bounds
    // them.
    let mut centre: [Interval; STATES] = std::array::from_fn(|d| {
        Interval::point(0.5 * (initial.lower[d] + initial.upper[d]) * MICRO)
    });
    let mut phi = Flow::<STATES>::identity().phi;
    let radius: [f64; STATES] =
        std::array::from_fn(|d| 0.5 * (initial.upper[d] - initial.lower[d]) * MICRO);
    let mut varied = [0.0f64; STATES];
    let mut ticks = 0.0;
    let mut previous: Option<(Box4, Box4)> = None;
    let mut boxes = Vec::new();
    while ticks * piece_s < TRIGGER_S_MAX {
        let (mut low, mut high) = ([0.0; STATES], [0.0; STATES]);
        for d in 0..STATES {
            let reach: f64 = (0..STATES).map(|j| phi[d][j].magnitude() * radius[j]).sum();
            let spread = reach + varied[d] + around[d] + room[d];
            low[d] = centre[d].low - spread;
            high[d] = centre[d].high + spread;
        }
        // The same over the delay, with what belongs together kept together.
        let ahead = match &delay {
            None => (low, high),
            Some(delay) => {
                let spread = std::array::from_fn(|d| varied[d] + error[d] + room[d]);
                delay.predicted(&centre, &product(&delay.flow.phi, &phi), &radius, &spread)
            }
        };
        // The hull of two ends of a piece holds the piece but for its bend.
        if let Some(((was_low, was_high), was_ahead)) = previous {
            let first: [f64; STATES] = std::array::from_fn(|d| low[d].min(was_low[d]));
            let last: [f64; STATES] = std::array::from_fn(|d| high[d].max(was_high[d]));
            if first[0] < below {
                // Seen at the first tick below: within a tick's fall of the limit. Over a delay the
                // box's extent would count again and again; a tick's own fall is enough.
                let extent = if delay.is_some() {
                    0.0
                } else {
                    (high[0] - low[0]).max(0.0)
                };
                let fall = extent + tick_s * steepest(spec) * MICRO;
                let mut clipped = first;
                clipped[0] = first[0].max(below - 2.0 * error[0] - fall);
                let mut end = last;
                end[0] = last[0].min(below);
                if clipped[0] <= end[0] {
                    boxes.push(match &delay {
                        None => (clipped, end),
                        Some(delay) => met(
                            joined(ahead, was_ahead),
                            delay.predicted_box(clipped, end, &error),
                        ),
                    });
                }
                if last[0] < below - 2.0 * error[0] - fall {
                    break;
                }
            }
        }
        previous = Some(((low, high), ahead));
        let flowed = model::flow::apply(&step.phi, &centre);
        centre = std::array::from_fn(|d| flowed[d] + step.gamma[d] * middle);
        phi = product(&step.phi, &phi);
        varied = match delay {
            // Every box reaches down by its own extent in f then, which is more than what is left
            // out here.
            None => std::array::from_fn(|d| varied[d] + varying[d]),
            Some(_) => carried(&step, &varied, &varying),
        };
        ticks += 1.0;
    }
    boxes
}

/// What has varied after one more piece. What varied one state before moves the others in it: the
/// governor answers what varied f.
fn carried(step: &Flow<STATES>, varied: &[f64; STATES], varying: &[f64; STATES]) -> [f64; STATES] {
    std::array::from_fn(|d| {
        let terms = step.phi[d].iter().zip(varied);
        varying[d]
            + terms
                .map(|(phi, varied)| phi.magnitude() * varied)
                .sum::<f64>()
    })
}

fn joined((low, high): Box4, other: Box4) -> Box4 {
    (
        std::array::from_fn(|d| low[d].min(other.0[d])),
        std::array::from_fn(|d| high[d].max(other.1[d])),
    )
}

fn met((low, high): Box4, other: Box4) -> Box4 {
    (
        std::array::from_fn(|d| low[d].max(other.0[d])),
        std::array::from_fn(|d| high[d].min(other.1[d])),
    )
}

/// Steepest fall of f from rest after the largest loss \[Hz/s\].
fn steepest(spec: &Spec) -> f64 {
    let loss = spec.uncertainty.loss_gw[1].abs();
    let initial = &spec.uncertainty.initial;
    let slack = initial.lower[3].abs() + spec.plant.damping_gw_per_hz * initial.upper[0].abs();
    (loss + slack) / (2.0 * spec.plant.inertia_gw_s_per_hz)
}

/// Calls for every cell that a box \[micro-units\] meets.
fn each_cell(
    _spec: &Spec,
    abstraction: &AffineAbstraction<STATES>,
    low: [f64; STATES],
    high: [f64; STATES],
    mut call: impl FnMut(usize),
) -> Result<(), CompressError> {
    let shape = abstraction.shape();
    let (mut first, mut last) = ([0u32; STATES], [0u32; STATES]);
    for d in 0..STATES {
        let index = |x: f64| ((x - shape.lower[d]) / shape.width[d]).floor();
        let (from, to) = (index(low[d]), index(high[d]));
        if from < 0.0 || to >= f64::from(shape.count[d]) {
            return Err(CompressError::LeavesTable {
                state: low.map(|x| x as i32),
            });
        }
        (first[d], last[d]) = (from as u32, to as u32);
    }
    each_in(first, last, |cell| call(shape.index(cell)));
    Ok(())
}

/// Calls for every cell of a box, both ends included.
fn each_in(low: [u32; STATES], high: [u32; STATES], mut call: impl FnMut([u32; STATES])) {
    for p in low[3]..=high[3] {
        for l in low[2]..=high[2] {
            for g in low[1]..=high[1] {
                for f in low[0]..=high[0] {
                    call([f, g, l, p]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::plant::Plant;

    /// Pieces together vary no less than the whole time: `∫ |exp(A s) b| ds`, which a loss that
    /// switches at the right moments attains.
    #[test]
    fn pieces_carry_what_varied_before() {
        const COUNT: u32 = 160;
        let spec = Spec::load("gb-bi-delay", &[]).unwrap();
        let (a, b) = Plant::new(&spec).matrices();
        let piece_s = 0.0125;
        let step = Flow::over(&a, &b, piece_s);
        let varying = absolute_integral(&a, &b, piece_s);
        let mut varied = [0.0; STATES];
        for _ in 0..COUNT {
            varied = carried(&step, &varied, &varying);
        }
        // Enclosures rounded upwards on one side, plain sums on the other: far below one in 1e9
        // after 160 steps.
        let whole = absolute_integral(&a, &b, piece_s * f64::from(COUNT));
        for d in 0..STATES {
            assert!(
                varied[d] >= whole[d] * (1.0 - 1e-9),
                "{d}: {varied:?} {whole:?}"
            );
            // The governor's answer is what the pieces alone leave out.
            assert!(d == 0 || varied[d] > 2.0 * varying[d] * f64::from(COUNT));
        }
    }
}
