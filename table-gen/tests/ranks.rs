//! `mpirun -n N table-gen synth SPEC`: the same solution on any number of ranks, and a clear end
//! when a rank dies. More ranks than cores are asked for, so that one machine will do.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

const PROGRAM: &str = env!("CARGO_BIN_EXE_table-gen");

fn mpirun(ranks: usize) -> Command {
    let mut command = Command::new("mpirun");
    command
        .args(["--oversubscribe", "--allow-run-as-root", "-n"])
        .arg(ranks.to_string())
        .arg(PROGRAM)
        // Waiting ranks must not take the cores from those that work.
        .env("OMPI_MCA_mpi_yield_when_idle", "1")
        .env("RAYON_NUM_THREADS", "1");
    command
}

fn json(output: &Output) -> serde_json::Value {
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Counts, sweeps and checksum of each game.
fn answers(report: &serde_json::Value) -> Vec<[serde_json::Value; 5]> {
    let keys = [
        "name",
        "target_cells",
        "winning_cells",
        "iterations",
        "digest",
    ];
    let problems = report["problems"].as_array().unwrap();
    problems
        .iter()
        .map(|problem| keys.map(|key| problem[key].clone()))
        .collect()
}

#[test]
fn two_and_three_ranks_find_what_one_finds() {
    let small = ["--set", "grid.width=[0.05,0.1,0.1,0.1]"];
    let stay = [
        "--set",
        "requirements.stay=true",
        "--set",
        "requirements.inner_hz=[-0.3,0.1]",
        "--set",
        "requirements.outer_hz=[-0.3,0.1]",
        "--set",
        "method.between_samples=true",
        "--set",
        "method.successor=exact-linear",
        "--set",
        "sampling.period_s=1.0",
        "--set",
        "grid.width=[0.025,0.1,0.1,0.1]",
    ];
    for set in [&small[..], &stay[..]] {
        let arguments = [&["synth", "paper-bi", "--json", "--digest"], set].concat();
        let alone = json(&Command::new(PROGRAM).args(&arguments).output().unwrap());
        for ranks in 1..=3 {
            let together = json(&mpirun(ranks).args(&arguments).output().unwrap());
            assert_eq!(answers(&together), answers(&alone), "{ranks} ranks");
            assert_eq!(together["ranks"]["ranks"], ranks);
            assert_eq!(together["ranks"]["sent_bytes"] == 0, ranks == 1);
        }
    }
}

#[test]
fn ranks_share_out_a_scorecard_a_sweep_and_proofs() {
    let table = concat!(env!("CARGO_MANIFEST_DIR"), "/../firmware/tables/gb-bi.bin");
    let scorecard = ["compare", "gb-bi", "--table", table, "--json"];
    let short = ["--loss-gw", "1.0,1.3", "--inertia", "2.8,4"];
    let few = ["--duration-s", "70", "--chargers", "6"];
    let scorecard = [&scorecard[..], &short, &few].concat();
    let sweep = ["budget", "paper-bi", "--sweep", "--json"];
    let three = ["--widths", "3", "--periods", "1.5,2,3", "--errors", "0"];
    let sweep = [&sweep[..], &three].concat();
    let folder = tempfile::tempdir().unwrap();
    let losses = folder.path().join("losses.csv");
    // One that is proven and two that are not: the table is for 2 GW.
    std::fs::write(&losses, "loss_gw,weight\n1.7,2\n2.0,1\n2.6,1\n").unwrap();
    let table = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../firmware/tables/paper-bi.bin"
    );
    let losses = losses.to_str().unwrap();
    let proofs = ["prob", table, "--spec", "paper-bi", "--json"];
    let proofs = [&proofs[..], &["--loss", losses]].concat();
    for arguments in [scorecard, sweep, proofs] {
        let alone = Command::new(PROGRAM).args(&arguments).output().unwrap();
        assert!(alone.status.success() && alone.stdout.len() > 100);
        for ranks in 2..=3 {
            let together = mpirun(ranks).args(&arguments).output().unwrap();
            assert!(together.status.success(), "{ranks} ranks");
            assert_eq!(
                String::from_utf8_lossy(&together.stdout),
                String::from_utf8_lossy(&alone.stdout),
                "{ranks} ranks"
            );
        }
    }
}

/// Processes that a process has started and their own, as the system lists them.
fn ranks_of(mpirun: &Child) -> Vec<u32> {
    let path = format!("/proc/{0}/task/{0}/children", mpirun.id());
    let children = std::fs::read_to_string(path).unwrap_or_default();
    children
        .split_whitespace()
        .filter_map(|id| id.parse().ok())
        .collect()
}

#[test]
fn a_rank_that_dies_ends_the_job_and_nothing_is_told() {
    let mut job = mpirun(3)
        // 47 million cells.
        .args(["synth", "paper-bi", "--json"])
        .args(["--set", "grid.width=[0.005,0.025,0.05,0.05]"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while ranks_of(&job).len() < 3 {
        assert!(begun.elapsed() < Duration::from_secs(60), "no ranks");
        std::thread::sleep(Duration::from_millis(50));
    }
    // Long enough for the games to have begun, short of their end.
    std::thread::sleep(Duration::from_secs(1));
    assert!(job.try_wait().unwrap().is_none(), "the job ended too soon");
    let victim = ranks_of(&job)[1];
    let killed = Command::new("kill")
        .args(["-9", &victim.to_string()])
        .status()
        .unwrap();
    assert!(killed.success());
    let output = job.wait_with_output().unwrap();
    assert!(!output.status.success());
    assert!(
        output.stdout.is_empty(),
        "{}",
        String::from_utf8_lossy(&output.stdout)
    );
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(told.contains("signal 9"), "{told}");
}
