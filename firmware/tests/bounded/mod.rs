//! A fuzz target on a bounded corpus that is the same each time: seeds, and mutations of them.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Values at which lengths, counts and signs turn.
const EDGES: [u8; 8] = [0, 1, 2, 0x7F, 0x80, 0xFE, 0xFF, 0x40];
/// Most mutations of one input.
const MUTATIONS_MAX: u32 = 6;
/// Longest stretch that a mutation cuts out, repeats or takes from another seed.
const STRETCH_MAX: usize = 32;

/// One random change of `bytes`; `other` is a seed to take from.
fn mutate(bytes: &mut Vec<u8>, other: &[u8], random: &mut Pcg64) {
    let at = random.random_range(0..=bytes.len());
    let end = (at + random.random_range(1..=STRETCH_MAX)).min(bytes.len());
    match random.random_range(0..7) {
        0 if at < end => bytes[at] ^= 1 << random.random_range(0..8),
        1 if at < end => bytes[at] = EDGES[random.random_range(0..EDGES.len())],
        2 if at < end => bytes[at] = random.random(),
        3 => drop(bytes.drain(at..end)),
        4 => bytes.splice(at..at, bytes[at..end].to_vec()).for_each(drop),
        5 => bytes.truncate(at),
        _ => {
            let from = random.random_range(0..=other.len());
            let to = (from + STRETCH_MAX).min(other.len());
            let end = end.min(at + (to - from));
            bytes
                .splice(at..end, other[from..to].to_vec())
                .for_each(drop);
        }
    }
}

/// Runs a target on every seed and on `runs` mutations. Some inputs must get past the first decoder
/// and some must not: otherwise one side of the target is not tried.
pub(crate) fn bounded(seeds: &[Vec<u8>], runs: u32, target: fn(&[u8]) -> bool) {
    let mut random = Pcg64::seed_from_u64(1);
    let mut past = 0;
    for seed in seeds {
        target(seed);
    }
    for _ in 0..runs {
        let mut bytes = seeds[random.random_range(0..seeds.len())].clone();
        let other = &seeds[random.random_range(0..seeds.len())];
        for _ in 0..random.random_range(1..=MUTATIONS_MAX) {
            mutate(&mut bytes, other, &mut random);
        }
        past += u32::from(target(&bytes));
    }
    println!("{past} of {runs} got past the first decoder");
    assert!(
        past > runs / 100 && past < runs - runs / 100,
        "{past} of {runs}: only one side was tried"
    );
}
