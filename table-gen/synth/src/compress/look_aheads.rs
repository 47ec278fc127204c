//! Look-aheads for a law's domain: what the abstraction would do under the strongest input and
//! under none, in the device's integers.
//!
//! Below the target only the strongest input keeps f off its limit, and the near corner of the
//! successor box is its lower one; above the target it is no input and the upper corner. Everything
//! else about the set, that its edge is monotone and that no other corner matters, is a guess that
//! fits a stable plant with one input: the description of the domain asks every cell and uses a
//! look-ahead only where it covers no losing one.

use firmware::grid::{Cell, Grid};
use firmware::table::{LOOK_AHEAD_LEN, LOOK_AHEAD_SHIFT_MAX, LookAhead};
use firmware::units::{AXIS_F, AXIS_G, AXIS_L, AXIS_P};
use rayon::prelude::*;

use crate::abstraction::Abstraction;
use crate::abstraction::affine::AffineAbstraction;
use crate::drives::middle_power;
use crate::game::bitset::BitSet;
use model::flow::Flow;
use model::interval::Interval;
use model::plant::{Plant, STATES};
use model::spec::Spec;

/// Most steps tried: f has turned by then.
const STEPS_MAX: u8 = 6;

/// How far the bounds are moved outwards, so that a look-ahead covers fewer cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Margins {
    /// All bounds \[cells / 128\]: for the rounding of the factors.
    pub all: i32,
    /// The near bound of l on top of that \[cells / 128\]: a box's other cells have a higher f and
    /// so a lower l, and the near corner does not see them.
    pub near_l: i32,
}

/// Margins worth trying, the widest domains first.
pub const MARGINS: [Margins; 10] = {
    const fn margins(all: i32, near_l: i32) -> Margins {
        Margins { all, near_l }
    }
    [
        margins(0, 0),
        margins(1, 0),
        margins(1, 8),
        margins(1, 24),
        margins(2, 8),
        margins(2, 24),
        margins(4, 16),
        margins(6, 0),
        margins(6, 24),
        margins(9, 0),
    ]
};

/// Which way f has to go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Course {
    /// Up, under the strongest input.
    Rise,
    /// Down, under none.
    Fall,
}

/// One look-ahead for the cells below the target and one for those above it, with as few steps as
/// tell losing cells best; none where there are no such cells, or where the format cannot hold the
/// numbers.
pub fn choose(
    spec: &Spec,
    abstraction: &AffineAbstraction<STATES>,
    target: &BitSet,
    winning: &BitSet,
    margins: Margins,
) -> Vec<LookAhead> {
    let shape = abstraction.shape();
    let row = shape.count[AXIS_F] as usize;
    let on_f = |set: &BitSet| -> Vec<u16> {
        let mut found: Vec<u16> = set.iter().map(|index| (index % row) as u16).collect();
        found.sort_unstable();
        found.dedup();
        found
    };
    let (target, winning_f) = (on_f(target), on_f(winning));
    let (Some(first), Some(last)) = (target.first(), target.last()) else {
        return Vec::new();
    };
    let limit = [
        *winning_f.first().unwrap_or(first).min(first),
        *winning_f.last().unwrap_or(last).max(last),
    ];
    let best = |course| {
        let (side, done) = match course {
            Course::Rise => (limit[0]..*first, [*first, limit[1]]),
            Course::Fall => (*last + 1..limit[1] + 1, [limit[0], *last]),
        };
        let tries = (1..=STEPS_MAX).filter_map(|steps| {
            let ahead = look_ahead(spec, abstraction, course, steps, [done, limit], margins)?;
            Some((
                wrong(abstraction, winning, side.clone(), &ahead.write()),
                ahead,
            ))
        });
        // Of equals the one with the fewest steps.
        tries
            .min_by_key(|(wrong, _)| *wrong)
            .map(|(_, ahead)| ahead)
    };
    [Course::Rise, Course::Fall]
        .into_iter()
        .filter_map(best)
        .collect()
}

/// The winning cells that look-aheads keep: below the target by the first, above it by the second,
/// between them all. `None` if they cover a losing cell, or if one is missing.
pub fn covered(
    abstraction: &AffineAbstraction<STATES>,
    target: &BitSet,
    winning: &BitSet,
    aheads: &[LookAhead],
) -> Option<BitSet> {
    let [rise, fall] = aheads else { return None };
    let shape = abstraction.shape();
    let count = shape.count.map(|n| n as u16);
    let (first, last) = (rise.done[0], fall.done[1]);
    let bytes = [rise.write(), fall.write()];
    let inside = |index: usize| {
        let cell = shape.cell(index).map(|i| i as u16);
        match cell[AXIS_F] {
            f if f < first => LookAhead::covers(&bytes[0], Cell(cell), count),
            f if f > last => LookAhead::covers(&bytes[1], Cell(cell), count),
            _ => winning.contains(index),
        }
    };
    let found: Vec<usize> = (0..shape.cells())
        .into_par_iter()
        .filter(|index| !target.contains(*index) && inside(*index))
        .collect();
    let mut set = BitSet::new(shape.cells());
    for index in found {
        if !winning.contains(index) {
            return None;
        }
        set.insert(index);
    }
    Some(set)
}

/// Losing cells that a look-ahead covers, on some cells of f.
fn wrong(
    abstraction: &AffineAbstraction<STATES>,
    winning: &BitSet,
    side: std::ops::Range<u16>,
    ahead: &[u8; LOOK_AHEAD_LEN],
) -> usize {
    let shape = abstraction.shape();
    let count = shape.count.map(|n| n as u16);
    (0..shape.cells())
        .into_par_iter()
        .filter(|index| !winning.contains(*index))
        .map(|index| shape.cell(index).map(|i| i as u16))
        .filter(|cell| side.contains(&cell[AXIS_F]) && LookAhead::covers(ahead, Cell(*cell), count))
        .count()
}

/// A look-ahead of some steps; `None` if the format cannot hold its numbers.
fn look_ahead(
    spec: &Spec,
    abstraction: &AffineAbstraction<STATES>,
    course: Course,
    steps: u8,
    [done, limit]: [[u16; 2]; 2],
    margins: Margins,
) -> Option<LookAhead> {
    let shape = abstraction.shape();
    let input = match course {
        Course::Rise => abstraction.inputs() - 1,
        Course::Fall => 0,
    };
    let (a, b) = Plant::new(spec).matrices();
    let flow = Flow::over(&a, &b, f64::from(spec.sampling.period_ms()) / 1000.0);
    let phi = flow.phi.map(|row| row.map(Interval::mid));
    let drive = middle_power(spec, input);
    let radius = abstraction.radius(input);
    // In cells: the index of a corner is the floor of this.
    let factor = |d: usize, j: usize| phi[d][j] * shape.width[j] / shape.width[d];
    let centre = |d: usize| {
        let first = |j: usize| shape.lower[j] + 0.5 * shape.width[j];
        let of_first: f64 = (0..STATES).map(|j| phi[d][j] * first(j)).sum();
        (of_first + flow.gamma[d].mid() * drive - shape.lower[d]) / shape.width[d]
    };
    let largest = (0..STATES * STATES)
        .map(|at| factor(at / STATES, at % STATES).abs())
        .fold(0.0, f64::max);
    let shift = (0..=LOOK_AHEAD_SHIFT_MAX)
        .rev()
        .find(|shift| largest * f64::from(1u32 << shift) < f64::from(i16::MAX))?;
    let unit = f64::from(1u32 << shift);
    // Downwards for a lower corner, upwards for an upper one: on the device's integers the box is
    // never smaller.
    let apart =
        |d: usize, more: i32| radius[d] / shape.width[d] + f64::from(margins.all + more) / 128.0;
    let lower = |d: usize, more: i32| ((centre(d) - apart(d, more)) * unit).floor() as i32;
    let upper = |d: usize, more: i32| ((centre(d) + apart(d, more)) * unit).ceil() as i32;
    let more = |d: usize| if d == AXIS_L { margins.near_l } else { 0 };
    let (near, far): ([i32; STATES], [i32; 3]) = match course {
        Course::Rise => (
            std::array::from_fn(|d| lower(d, more(d))),
            [AXIS_G, AXIS_L, AXIS_P].map(|d| upper(d, 0)),
        ),
        Course::Fall => (
            std::array::from_fn(|d| upper(d, more(d))),
            [AXIS_G, AXIS_L, AXIS_P].map(|d| lower(d, 0)),
        ),
    };
    let ahead = LookAhead {
        shift,
        steps,
        done,
        limit,
        factors: std::array::from_fn(|d| {
            std::array::from_fn(|j| (factor(d, j) * unit).round() as i16)
        }),
        near,
        far,
    };
    let grid = Grid::new([0; STATES], [1; STATES], shape.count.map(|n| n as u16)).ok()?;
    ahead.fits(&grid).then_some(ahead)
}
