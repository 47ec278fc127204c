//! The chain's value beside Storm's, and its time and memory at the size that a chain of a table
//! has.
//!
//! `stormpy` comes from PyPI. The comparison is ignored unless it is asked for, and then fails
//! without it:
//!
//! ```text
//! python3 -m venv ENV && ENV/bin/pip install stormpy
//! HOLDFAST_PYTHON=ENV/bin/python cargo test --release -p prob --test storm -- --ignored
//! ```
//!
//! | instance | what |
//! |---|---|
//! | coin | one state that fails with probability 1/4 a step, 10 steps |
//! | choices | 2,000 states at random, 4 branches of up to 5 members, 40 steps |
//! | large | 100,000 states at random, 8 branches of up to 3 members, 120 steps |
//! | paper-bi | the first two seconds of a flashed table, the participation normal with 0.2 % |
//! | paper-bi-cut | two minutes of it, cut at 20,000 nodes, over the steps that were followed |
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use firmware::table::TableView;
use model::spec::Spec;
use prob::chain::{Chain, ChainBuilder, ChainError, FAILED, SAFE};
use prob::closed_loop::{self, Settings};
use prob::participation::Participation;
use prob::{export, value};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;

#[test]
fn a_hundred_thousand_states_have_a_value() {
    let chain = random(100_000, [8, 3], 2).unwrap();
    assert_eq!(chain.states(), 100_002);
    let start = Instant::now();
    let bounds = value::bounds(&chain, 120);
    let seconds = start.elapsed().as_secs_f64();
    println!(
        "{} states, {} transitions, 120 steps: {:?} in {seconds:.2} s",
        chain.states(),
        chain.transitions(),
        bounds[120]
    );
    assert!(bounds[120] < 1.0 && bounds[120] > 0.5);
}

#[test]
#[ignore = "needs stormpy: set HOLDFAST_PYTHON to a Python that has it"]
fn agrees_with_storm() {
    let python =
        std::env::var_os("HOLDFAST_PYTHON").expect("HOLDFAST_PYTHON names a Python with stormpy");
    let mut coin = ChainBuilder::new();
    coin.state(&[(0.75, vec![2])]).unwrap();
    let (paper, steps) = paper_bi(2.0, 200_000);
    let (cut, followed) = paper_bi(120.0, 20_000);
    let instances = [
        ("coin", coin.finish(&[2]).unwrap(), 10),
        ("choices", random(2_000, [4, 5], 1).unwrap(), 40),
        ("large", random(100_000, [8, 3], 2).unwrap(), 120),
        ("paper-bi", paper, steps),
        ("paper-bi-cut", cut, followed),
    ];
    let dir = std::env::temp_dir().join(format!("holdfast-storm-{}", std::process::id()));
    std::fs::create_dir_all(&dir).unwrap();
    let mut arguments = Vec::new();
    for (name, chain, steps) in &instances {
        let path = dir.join(format!("{name}.drn"));
        export::drn(
            chain,
            None,
            name,
            &mut BufWriter::new(File::create(&path).unwrap()),
        )
        .unwrap();
        let bound = value::bounds(chain, *steps)[*steps as usize];
        arguments.extend([
            path.display().to_string(),
            steps.to_string(),
            format!("{bound:?}"),
        ]);
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/compare_with_storm.py");
    let status = Command::new(python)
        .arg(script)
        .args(arguments)
        .status()
        .unwrap();
    std::fs::remove_dir_all(&dir).unwrap();
    assert!(status.success());
}

/// So many seconds of paper-bi, and the steps for which nothing is lost by a cut.
fn paper_bi(horizon_s: f64, nodes_max: usize) -> (Chain, u32) {
    let bytes = include_bytes!("../../../firmware/tables/paper-bi.bin");
    let table = TableView::parse(bytes).unwrap();
    let spec = Spec::load("paper-bi", &[]).unwrap();
    let kind = Participation::Gaussian {
        sigma: 0.002,
        tail: 5.0,
    };
    let settings = Settings {
        bin_gw: 0.005,
        nodes_max,
        horizon_s,
    };
    let built = closed_loop::build(&table, &spec, &kind, &settings, &|_, _| true).unwrap();
    let steps = built.cut.map_or(built.steps, |cut| cut.steps);
    (built.chain, steps)
}

/// States with so many branches of at most so many members; a ten-thousandth of each state's weight
/// fails.
fn random(states: u32, [branches, members]: [u64; 2], seed: u64) -> Result<Chain, ChainError> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut below = |n: u64| random.next_u64() % n;
    let mut chain = ChainBuilder::new();
    // The first two states are failed and safe.
    for _ in 0..states {
        let weights: Vec<u64> = (0..branches).map(|_| 1 + below(1000)).collect();
        let total: u64 = weights.iter().sum::<u64>() + 1;
        let mut row = vec![(1.0 / (total as f64) * 0.5, vec![FAILED])];
        for weight in weights {
            let count = 1 + below(members);
            let to = (0..count).map(|_| match below(500) {
                0 => SAFE,
                _ => 2 + below(u64::from(states)) as u32,
            });
            row.push((weight as f64 / total as f64, to.collect()));
        }
        chain.state(&row)?;
    }
    chain.finish(&[2, 3])
}
