//! The falsifier against every shipped spec's table: at least 10^7 control steps each, and no
//! violation.
//!
//! `cargo bench -p lab --bench falsify`. The tables are made here as `build` makes them.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a benchmark that cannot go on fails"
)]

use std::time::Instant;

use lab::falsify::falsify;
use model::spec::Spec;
use synth::game::unwatched;
use synth::{pipeline, synthesis};

const STEPS: u64 = 10_000_000;

fn main() {
    println!("spec steps trajectories seconds smallest_margin_hz");
    for name in Spec::shipped_names() {
        let spec = Spec::load(name, &[]).unwrap();
        let laws = synthesis::synthesise(&spec, &unwatched).unwrap();
        let encoding = pipeline::Encoding::default();
        let bytes = pipeline::emit(&laws, encoding, &unwatched).unwrap().bytes;
        let start = Instant::now();
        let found = falsify(&bytes, &spec, STEPS, 2024).unwrap();
        if let Some(violation) = found.violation {
            panic!("{name}: {violation:#?}");
        }
        println!(
            "{name} {} {} {:.1} {:.4}",
            found.steps,
            found.trajectories,
            start.elapsed().as_secs_f64(),
            found.smallest_margin_hz
        );
    }
}
