//! Whole games at three sizes, and the parts of a sweep alone.
//!
//! `cargo bench -p synth`. The reported times are wall times; `docs/performance.md` holds processor
//! times and ratios.

#![allow(clippy::unwrap_used, reason = "a benchmark that cannot go on fails")]

use divan::{Bencher, counter::ItemsCount};
use model::spec::Spec;
use synth::abstraction::Abstraction;
use synth::game::bitset::BitSet;
use synth::game::inclusion::Inclusion;
use synth::game::unwatched;
use synth::problem::Problem;
use synth::synthesis;

fn main() {
    divan::main();
}

fn spec(set: &[&str]) -> Spec {
    let set: Vec<String> = set.iter().map(|s| (*s).to_owned()).collect();
    Spec::load("paper-bi", &set).unwrap()
}

/// Grids of 0.3, 2.4 and 17.5 million cells, the period and the games the same.
const SIZES: [(&str, &[&str]); 3] = [
    (
        "0.3M",
        &[
            "grid.width=[0.05,0.1,0.1,0.1]",
            "method.successor=exact-linear",
        ],
    ),
    ("2.4M", &["method.successor=exact-linear"]),
    (
        "17.5M",
        &[
            "grid.width=[0.05,0.025,0.025,0.025]",
            "method.successor=exact-linear",
        ],
    ),
];

#[divan::bench(args = SIZES.map(|(name, _)| name), sample_count = 5)]
fn reach_avoid_c1_and_c2(bencher: Bencher<'_, '_>, size: &str) {
    let (_, set) = SIZES.into_iter().find(|(name, _)| *name == size).unwrap();
    let spec = spec(set);
    let cells = spec.grid.cells();
    bencher
        .counter(ItemsCount::new(cells))
        .bench(|| synthesis::synthesise(&spec, &unwatched));
}

#[divan::bench]
fn successor_boxes_of_all_inputs(bencher: Bencher<'_, '_>) {
    let spec = spec(&[]);
    let problem = Problem::new(&spec).unwrap();
    let abstraction = synthesis::abstraction(&problem).unwrap();
    let cells: Vec<[u32; 4]> = (0..4096)
        .map(|i| {
            abstraction
                .shape()
                .cell(i * 577 % abstraction.shape().cells())
        })
        .collect();
    bencher
        .counter(ItemsCount::new(cells.len() * abstraction.inputs()))
        .bench(|| {
            let mut inside = 0u32;
            for cell in &cells {
                let anchor = abstraction.anchor(divan::black_box(*cell));
                for input in 0..abstraction.inputs() {
                    inside += u32::from(abstraction.successor(&anchor, input).is_some());
                }
            }
            inside
        });
}

#[divan::bench]
fn erosion_of_one_sweep(bencher: Bencher<'_, '_>) {
    let spec = spec(&[]);
    let problem = Problem::new(&spec).unwrap();
    let abstraction = synthesis::abstraction(&problem).unwrap();
    let shape = *abstraction.shape();
    let full = BitSet::full(shape.cells());
    bencher
        .counter(ItemsCount::new(shape.cells()))
        .bench(|| Inclusion::new(&shape, divan::black_box(&full), abstraction.extents()));
}
