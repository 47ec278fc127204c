//! The yardsticks of the field: the engine's answers against a reference that stores every
//! transition, cell by cell.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use model::interval::Interval;
use synth::abstraction::Abstraction;
use synth::abstraction::growth::{GrowthAbstraction, GrowthBound};
use synth::abstraction::guard::Unguarded;
use synth::abstraction::invariant::InvariantPlant;
use synth::game::inputs::InputSet;
use synth::game::{NOT_WON, Unwatched, reach::reach, safety::safety};
use synth::yardsticks::{boost_converter, two_areas, unicycle};
use tests::scots_examples;

#[test]
fn the_boost_converter_has_the_references_kernel() {
    let abstraction = boost_converter::scots_abstraction().unwrap();
    let solution = safety(
        &abstraction,
        &boost_converter::scots_safe(),
        &Unguarded,
        &Unwatched,
    )
    .unwrap();
    let reference = scots_examples::boost_converter();
    let kernel = reference.transitions.safety(&reference.set);
    let differ = (0..kernel.len()).filter(|cell| kernel[*cell] != (solution.masks[*cell] != 0));
    assert_eq!(differ.count(), 0);
    assert!(solution.winning > 0 && solution.winning < kernel.len());
}

#[test]
fn the_vehicle_reaches_from_the_references_cells() {
    let abstraction = unicycle::abstraction().unwrap();
    let solution = reach(
        &abstraction,
        &unicycle::target(),
        &unicycle::avoid(),
        &Unguarded,
        &Unwatched,
    )
    .unwrap();
    let reference = scots_examples::unicycle(&unicycle::OBSTACLES, unicycle::TARGET);
    let won = reference.transitions.reach(&reference.set);
    let differ = (0..won.len()).filter(|cell| won[*cell] == solution.masks[*cell].is_empty());
    assert_eq!(differ.count(), 0);
    assert_eq!(reference.set.iter().filter(|cell| **cell).count(), 140);
    assert_ne!(solution.ranks[unicycle::start(&abstraction)], NOT_WON);
}

/// The vehicle through the interface for any plant with a growth bound, in plain floating point and
/// with few inputs.
struct Vehicle {
    inputs: Vec<(f64, f64)>,
}

impl GrowthBound<3> for Vehicle {
    fn inputs(&self) -> usize {
        self.inputs.len()
    }
    fn centre(&self, x: [f64; 3], input: usize) -> [f64; 3] {
        let (speed, t) = self.inputs[input];
        let (way, phi) = (0.3 * speed, 0.3 * speed * t);
        let mean = if phi == 0.0 {
            way
        } else {
            way * phi.sin() / phi
        };
        let (sine, cosine) = (x[2] + phi).sin_cos();
        [
            x[0] + mean * (cosine - t * sine),
            x[1] + mean * (sine + t * cosine),
            x[2] + 2.0 * phi,
        ]
    }
    fn radius(&self, _x: [f64; 3], r: [f64; 3], input: usize) -> [f64; 3] {
        let (speed, t) = self.inputs[input];
        let c = speed.abs() * (1.0 + t * t).sqrt();
        // Covers the rounding of the plain numbers, at most 10 in magnitude.
        let slack = 1e-13;
        [
            r[0] + c * 0.3 * r[2] + slack,
            r[1] + c * 0.3 * r[2] + slack,
            r[2] + slack,
        ]
    }
}

#[test]
fn tables_of_an_invariant_plant_are_the_boxes_of_the_general_one() {
    let plant = unicycle::Unicycle::new();
    let tables = unicycle::abstraction().unwrap();
    let inputs: Vec<_> = (0..49)
        .map(|input| {
            let value = |k: usize| 0.3 * (k as f64 - 3.0);
            (value(input % 7), value(input / 7).tan() / 2.0)
        })
        .collect();
    // The general one holds 32 inputs at a time.
    for part in 0..2 {
        let chosen: Vec<_> = inputs.iter().copied().skip(25 * part).take(25).collect();
        let count = chosen.len();
        let general = GrowthAbstraction::new(unicycle::shape(), Vehicle { inputs: chosen });
        let mut compared = 0;
        for index in (0..tables.shape().cells()).step_by(7) {
            let cell = tables.shape().cell(index);
            let (a, b) = (tables.anchor(cell), general.anchor(cell));
            for input in 0..count {
                let (fast, slow) = (
                    tables.successor(&a, 25 * part + input),
                    general.successor(&b, input),
                );
                assert_eq!(fast, slow, "{cell:?} input {}", 25 * part + input);
                compared += usize::from(fast.is_some());
            }
        }
        assert!(compared > 100_000, "{compared}");
    }
    let radius = plant.radius([Interval::ZERO; 3], [Interval::point(0.1); 3], 24);
    assert_eq!(radius.map(Interval::mid), [0.1; 3], "input 24 stands still");
}

/// Five states on a small grid: the solution does not depend on the number of threads, and the game
/// is worth playing.
#[test]
fn two_areas_are_kept_in_the_band() {
    let shape = two_areas::shape([1; two_areas::STATES]);
    let abstraction = two_areas::abstraction(&shape).unwrap();
    let kernel = safety(
        &abstraction,
        &two_areas::band(&shape),
        &Unguarded,
        &Unwatched,
    )
    .unwrap();
    assert!(kernel.winning > 0, "nothing stays");
    let won = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let (target, avoid) = (kernel.winning_set(true), two_areas::avoid(&shape));
            reach(&abstraction, &target, &avoid, &Unguarded, &Unwatched).unwrap()
        })
    };
    let one = won(1);
    assert!(one.winning > 0, "nothing reaches");
    assert!(one == won(2) && one == won(8));
}
