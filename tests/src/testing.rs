//! Fixtures that several tests need: specs, their tables, and the recorded event. They are made or
//! the test fails.
#![allow(
    clippy::unwrap_used,
    reason = "a fixture that cannot be made fails its test"
)]

use lab::record::{self, ReadOptions, Record};
use model::spec::Spec;
use synth::game::unwatched;
use synth::pipeline::{self, Encoding};
use synth::synthesis::{self, Synthesis};

/// A shipped spec with overrides `key=value`.
pub fn load(name: &str, set: &[&str]) -> Spec {
    let set: Vec<String> = set.iter().map(|s| (*s).to_owned()).collect();
    Spec::load(name, &set).unwrap()
}

/// A shipped spec with overrides, and its laws.
pub fn synthesised(name: &str, set: &[&str]) -> (Spec, Synthesis) {
    let spec = load(name, set);
    let synthesis = synthesis::synthesise(&spec, &unwatched).unwrap();
    (spec, synthesis)
}

/// The dense table of a spec: the lowest allowed input of each cell, whatever the compression does.
pub fn dense_of(spec: &Spec) -> Vec<u8> {
    let synthesis = synthesis::synthesise(spec, &unwatched).unwrap();
    let emitted = pipeline::emit(&synthesis, Encoding::Dense, &unwatched).unwrap();
    emitted.bytes
}

/// A shipped spec with its dense table.
pub fn dense(name: &str) -> (Spec, Vec<u8>) {
    let spec = load(name, &[]);
    let bytes = dense_of(&spec);
    (spec, bytes)
}

/// A shipped spec with overrides, and the table that `build` makes of it.
pub fn built(name: &str, set: &[&str]) -> (Spec, Vec<u8>) {
    let spec = load(name, set);
    let bytes = pipeline::table_bytes(&spec, None, &unwatched).unwrap();
    (spec, bytes)
}

/// The bytes of a shipped table.
pub fn shipped(name: &str) -> Vec<u8> {
    let file = crate::root().join(format!("firmware/tables/{name}.bin"));
    std::fs::read(file).unwrap()
}

/// The frequency of 9 August 2019, from 92 s before to 60 s after the onset.
pub fn recorded_2019() -> Record {
    let file = crate::root().join("tests/data/gb-frequency-2019-08-09.csv");
    record::read(&file, &ReadOptions::default()).unwrap()
}

/// Does the work on so many threads.
pub fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.unwrap().install(work)
}
