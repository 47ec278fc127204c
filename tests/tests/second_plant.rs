//! The boost converter: the engine on a switched plant, against the slow solver and against the
//! growth-bound interface.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use nalgebra::{DMatrix, DVector};
use synth::abstraction::Abstraction;
use synth::abstraction::growth::{GrowthAbstraction, GrowthBound};
use synth::abstraction::guard::Unguarded;
use synth::game::bitset::BitSet;
use synth::game::{Unwatched, safety::safety};
use synth::yardsticks::boost_converter::{self, PERIOD_S};
use tests::reference::SlowGame;

const CELLS: u32 = 60;

/// The slow solver's view of one mode.
fn slow(mode: usize) -> SlowGame {
    let input = boost_converter::inputs()[mode];
    let shape = boost_converter::shape(CELLS);
    SlowGame {
        a: DMatrix::from_fn(2, 2, |i, j| input.a[i][j].mid()),
        b: DVector::from_fn(2, |i, _| input.b[i].mid()),
        drives: vec![(1.0, 0.0)],
        axes: (0..2)
            .map(|d| (shape.lower[d], shape.width[d], CELLS as usize))
            .collect(),
        period: PERIOD_S,
        measurement: vec![0.0; 2],
    }
}

/// The same plant through the interface for non-linear ones.
struct Sampled {
    modes: Vec<(DMatrix<f64>, DVector<f64>)>,
}

impl GrowthBound<2> for Sampled {
    fn inputs(&self) -> usize {
        self.modes.len()
    }
    fn centre(&self, x: [f64; 2], input: usize) -> [f64; 2] {
        let (phi, gamma) = &self.modes[input];
        let next = phi * DVector::from_row_slice(&x) + gamma;
        [next[0], next[1]]
    }
    fn radius(&self, _x: [f64; 2], r: [f64; 2], input: usize) -> [f64; 2] {
        let next = self.modes[input].0.abs() * DVector::from_row_slice(&r);
        // The plain product rounds; a relative 1e-12 covers it.
        [next[0] * (1.0 + 1e-12), next[1] * (1.0 + 1e-12)]
    }
}

#[test]
fn the_converter_can_be_kept_in_its_box() {
    let abstraction = boost_converter::abstraction(CELLS).unwrap();
    let cells = abstraction.shape().cells();
    let all = BitSet::full(cells);
    let fast = safety(&abstraction, &all, &Unguarded, &Unwatched).unwrap();
    assert!(fast.winning > 0 && fast.winning < cells);
    // One slow game with the boxes of both modes.
    let game = slow(0);
    let boxes: Vec<Vec<_>> = slow(0)
        .boxes()
        .into_iter()
        .zip(slow(1).boxes())
        .map(|(mut off, mut on)| vec![off.remove(0), on.remove(0)])
        .collect();
    assert_eq!(fast.masks, game.safety(&boxes, &vec![true; cells]));
    // The interface for non-linear plants finds the same kernel.
    let modes = (0..2)
        .map(|mode| {
            let game = slow(mode);
            let mut augmented = DMatrix::zeros(3, 3);
            augmented
                .view_mut((0, 0), (2, 2))
                .copy_from(&(&game.a * PERIOD_S));
            augmented
                .view_mut((0, 2), (2, 1))
                .copy_from(&(&game.b * PERIOD_S));
            let exponential = augmented.exp();
            let phi = exponential.view((0, 0), (2, 2)).into_owned();
            (phi, exponential.view((0, 2), (2, 1)).column(0).into_owned())
        })
        .collect();
    let sampled = GrowthAbstraction::new(boost_converter::shape(CELLS), Sampled { modes });
    let generic = safety(&sampled, &all, &Unguarded, &Unwatched).unwrap();
    assert_eq!(fast.masks, generic.masks);
}
