//! Half-spaces that bound a winning set.
//!
//! A state is lost if it must leave the grid or the containment band now or k steps from now. For a
//! linear plant each of these conditions, under a saturated input, is a half-space whose normal is
//! a row of Φ(kτ); so the rows of the flow at multiples of half a period are the candidates.
//! Constants come from the cells themselves: nothing rests on the normals being right.

use firmware::table::AffineFunction;
use rayon::prelude::*;

use model::flow::Flow;
use model::grid_shape::GridShape;
use model::interval::Interval;
use model::plant::{Plant, STATES};
use model::spec::Spec;

/// Largest factor of a half-space.
const FACTOR_MAX: f64 = 512.0;
/// Times of the candidate normals: multiples of half a period, up to this many.
const HALF_PERIODS: u32 = 24;
/// A cut must shed this many losing cells for each winning cell that it sheds.
const LOSING_PER_WINNING: usize = 5;
/// Most half-spaces of the hull.
const HULL_MAX: usize = 12;
/// A cut that sheds fewer than one in this many of all losing cells is not worth its bytes.
const WORTH_ONE_IN: usize = 1000;
/// Cells of each kind that the choice looks at; more are sampled.
const SAMPLE_CELLS: usize = 30_000;

/// A cell as numbers.
pub type Point = [i32; STATES];

/// Candidate normals, both ways.
pub fn normals(spec: &Spec, shape: &GridShape<STATES>) -> Vec<[i16; STATES]> {
    let (a, b) = Plant::new(spec).matrices();
    let mut found = Vec::new();
    for half_periods in 0..=HALF_PERIODS {
        let time_s = f64::from(half_periods) * 0.5 * spec.sampling.period_s;
        let phi = match half_periods {
            0 => Flow::<STATES>::identity().phi,
            _ => Flow::over(&a, &b, time_s).phi,
        };
        for row in phi {
            let scaled: [f64; STATES] =
                std::array::from_fn(|d| Interval::mid(row[d]) * shape.width[d]);
            let largest = scaled.iter().fold(0.0f64, |max, x| max.max(x.abs()));
            let up = scaled.map(|x| (x / largest * FACTOR_MAX).round() as i16);
            found.push(up);
            found.push(up.map(|x| -x));
        }
    }
    found.sort_unstable();
    found.dedup();
    found
}

/// A convex hull: half-spaces that together hold nearly all winning cells and few losing ones, by
/// greedy cuts.
pub fn hull(normals: &[[i16; STATES]], winning: &[Point], losing: &[Point]) -> Vec<AffineFunction> {
    let mut winning = sample(winning);
    let mut losing = sample(losing);
    // Both lists stand for all; a sampled cell counts for as many as it was drawn from.
    let worth = losing.0.len() / WORTH_ONE_IN;
    let weight = (LOSING_PER_WINNING * winning.1).div_ceil(losing.1);
    let mut found = Vec::new();
    while found.len() < HULL_MAX {
        let cuts: Vec<(i64, i32)> = normals
            .par_iter()
            .map(|normal| best_cut(*normal, &winning.0, &losing.0, weight))
            .collect();
        let best = cuts.iter().enumerate().rev().max_by_key(|(_, cut)| cut.0);
        let Some((at, (score, threshold))) = best else {
            break;
        };
        if *score <= worth as i64 {
            break;
        }
        let space = AffineFunction {
            factors: normals[at],
            constant: -threshold,
        };
        winning.0.retain(|point| value(&space, *point) >= 0);
        losing.0.retain(|point| value(&space, *point) >= 0);
        found.push(space);
    }
    found
}

/// Every n-th point so that about [`SAMPLE_CELLS`] remain, and n.
fn sample(points: &[Point]) -> (Vec<Point>, usize) {
    let every = points.len().div_ceil(SAMPLE_CELLS).max(1);
    (points.iter().step_by(every).copied().collect(), every)
}

/// The threshold of `normal·x >= threshold` with the best score: losing cells shed, less `weight`
/// times winning ones.
fn best_cut(
    normal: [i16; STATES],
    winning: &[Point],
    losing: &[Point],
    weight: usize,
) -> (i64, i32) {
    let zero = AffineFunction {
        factors: normal,
        constant: 0,
    };
    let project = |points: &[Point]| {
        let mut values: Vec<i32> = points.iter().map(|point| value(&zero, *point)).collect();
        values.sort_unstable();
        values
    };
    let (winning, losing) = (project(winning), project(losing));
    let mut best = (0i64, i32::MIN);
    let mut shed = 0;
    for (at, end) in losing.iter().enumerate() {
        if losing.get(at + 1) == Some(end) {
            continue;
        }
        while winning.get(shed).is_some_and(|v| v <= end) {
            shed += 1;
        }
        let score = (at + 1) as i64 - (weight * shed) as i64;
        if score > best.0 {
            best = (score, end + 1);
        }
    }
    best
}

/// Value of a half-space at a point.
pub fn value(space: &AffineFunction, point: Point) -> i32 {
    let mut sum = space.constant;
    for (factor, index) in space.factors.iter().zip(point) {
        sum += i32::from(*factor) * index;
    }
    sum
}

/// The same half-space, moved inwards by shares of its largest factor: in a box where losing cells
/// lie just inside, a tighter one separates.
pub fn tightened(space: &AffineFunction, shares: u32) -> impl Iterator<Item = AffineFunction> + '_ {
    let largest = space.factors.iter().map(|x| x.unsigned_abs()).max();
    let largest = i32::from(largest.unwrap_or(0));
    (0..shares).map(move |share| AffineFunction {
        factors: space.factors,
        constant: space.constant - largest * share as i32 / shares as i32,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const NORMAL: [i16; STATES] = [1, 0, 0, 0];

    fn points(f: impl IntoIterator<Item = i32>) -> Vec<Point> {
        f.into_iter().map(|f| [f, 0, 0, 0]).collect()
    }

    #[test]
    fn a_cut_sheds_losing_cells_unless_too_many_winning_ones_go_with_them() {
        let losing = points(0..5);
        assert_eq!(best_cut(NORMAL, &points(5..8), &losing, 5), (5, 5));
        // A winning cell at 2: five losing ones less its weight, or the two below it.
        let winning = points([2, 5, 6]);
        assert_eq!(best_cut(NORMAL, &winning, &losing, 2), (3, 5));
        assert_eq!(best_cut(NORMAL, &winning, &losing, 4), (2, 2));
        // The other way round nothing is shed but winning cells.
        let (score, _) = best_cut(NORMAL.map(|x| -x), &points(5..8), &losing, 5);
        assert_eq!(score, 0);
    }

    #[test]
    fn the_hull_of_a_band_is_its_two_faces() {
        let winning = points(3..=6);
        let losing = points((0..3).chain(7..12));
        let hull = hull(&[NORMAL, NORMAL.map(|x| -x)], &winning, &losing);
        // The face that sheds five first, then the one that sheds three.
        let faces = [(-1, 6), (1, -3)].map(|(factor, constant)| AffineFunction {
            factors: [factor, 0, 0, 0],
            constant,
        });
        assert_eq!(hull, faces);
        let holds = |f| hull.iter().all(|space| value(space, [f, 0, 0, 0]) >= 0);
        assert!((3..=6).all(holds) && !holds(2) && !holds(7));
    }

    #[test]
    fn tighter_ones_move_by_shares_of_the_largest_factor() {
        let space = AffineFunction {
            factors: [1, -4, 0, 2],
            constant: 10,
        };
        let constants: Vec<i32> = tightened(&space, 4).map(|s| s.constant).collect();
        assert_eq!(constants, [10, 9, 8, 7]);
        assert_eq!(value(&space, [3, 2, 5, 1]), 10 + 3 - 8 + 2);
    }
}
