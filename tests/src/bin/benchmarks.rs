//! `cargo benchmarks [RUNS]`: the tables of docs/performance.md, measured on this machine.
//!
//! Every yardstick is played by the engine (the median of RUNS runs) and once by a reference that
//! stores every transition, in the same run of the same program; both must find the same number of
//! cells. Published times of other tools stand beside them: those are from other machines.

use std::error::Error;
use std::process::{Command, ExitCode};

use model::spec::Spec;
use synth::abstraction::Abstraction;
use synth::abstraction::guard::Unguarded;
use synth::game::Unwatched;
use synth::game::reach::reach;
use synth::game::safety::safety;
use synth::yardsticks::{boost_converter, two_areas, unicycle};
use synth::{synthesis, usage};
use tests::scots_examples;

/// What a run of the engine found and took.
struct Found {
    cells: usize,
    inputs: usize,
    winning: usize,
    cpu_s: f64,
}

/// One line of the table.
struct Row {
    name: &'static str,
    found: Found,
    peak_mb: f64,
    /// Cells and processor time of the reference, and its peak memory.
    reference: Option<(usize, f64, f64)>,
    /// Published seconds of SCOTS and of Dionysos.jl.
    published: [Option<f64>; 2],
}

fn main() -> ExitCode {
    let runs = match std::env::args().nth(1).map_or(Ok(5), |text| text.parse()) {
        Ok(runs) if runs > 0 => runs,
        _ => {
            eprintln!("usage: cargo benchmarks [RUNS], RUNS at least 1");
            return ExitCode::from(2);
        }
    };
    match measure(runs) {
        Ok(rows) if rows.iter().all(Row::agrees) => ExitCode::SUCCESS,
        Ok(_) => {
            eprintln!("the engine and the reference differ");
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Measures and prints line by line.
fn measure(runs: usize) -> Result<Vec<Row>, Box<dyn Error>> {
    println!("{}\n", machine());
    println!(
        "| yardstick | cells | inputs | winning | processor time | peak memory | reference, same run | ratio | \
         SCOTS | ratio | Dionysos.jl | ratio |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    let boost = || scots_examples::boost_converter().winning_safely();
    let vehicle =
        || scots_examples::unicycle(&unicycle::OBSTACLES, unicycle::TARGET).winning_by_reach();
    let rows = [
        row(
            "boost converter, safety",
            runs,
            play_boost_converter,
            Some(&boost),
            [Some(93.06), Some(4.77)],
        )?,
        row(
            "vehicle, reach around walls",
            runs,
            play_unicycle,
            Some(&vehicle),
            [Some(597.96), Some(15.03)],
        )?,
        row(
            "`paper-bi`, C1 and C2",
            runs,
            play_paper,
            None,
            [Some(90.4), None],
        )?,
        row(
            "two areas, reach and stay",
            1,
            play_two_areas,
            None,
            [None, None],
        )?,
    ];
    Ok(rows.into())
}

type Play = fn() -> Result<Found, Box<dyn Error>>;

fn row(
    name: &'static str,
    runs: usize,
    play: Play,
    reference: Option<&dyn Fn() -> usize>,
    published: [Option<f64>; 2],
) -> Result<Row, Box<dyn Error>> {
    usage::forget_peak();
    let mut all = (0..runs).map(|_| play()).collect::<Result<Vec<_>, _>>()?;
    all.sort_by(|a, b| a.cpu_s.total_cmp(&b.cpu_s));
    let found = all.swap_remove(all.len() / 2);
    let peak_mb = usage::peak_rss_mb().unwrap_or(f64::NAN);
    let reference = reference.map(|solve| {
        usage::forget_peak();
        let before = usage::cpu_s();
        let winning = solve();
        (
            winning,
            usage::cpu_s() - before,
            usage::peak_rss_mb().unwrap_or(f64::NAN),
        )
    });
    let row = Row {
        name,
        found,
        peak_mb,
        reference,
        published,
    };
    println!("{}", row.line());
    Ok(row)
}

impl Row {
    fn agrees(&self) -> bool {
        self.reference
            .is_none_or(|(winning, ..)| winning == self.found.winning)
    }

    fn line(&self) -> String {
        let ratio = |seconds: Option<f64>| match seconds {
            None => " | ".to_owned(),
            Some(s) => format!("{s:.2} s | {:.0}", s / self.found.cpu_s),
        };
        let reference = match self.reference {
            None => " | ".to_owned(),
            Some((_, s, mb)) => format!("{s:.2} s, {mb:.0} MB | {:.0}", s / self.found.cpu_s),
        };
        format!(
            "| {} | {} | {} | {} | {:.3} s | {:.0} MB | {reference} | {} | {} |",
            self.name,
            self.found.cells,
            self.found.inputs,
            self.found.winning,
            self.found.cpu_s,
            self.peak_mb,
            ratio(self.published[0]),
            ratio(self.published[1])
        )
    }
}

fn play_boost_converter() -> Result<Found, Box<dyn Error>> {
    let before = usage::cpu_s();
    let abstraction = boost_converter::scots_abstraction()?;
    let solution = safety(
        &abstraction,
        &boost_converter::scots_safe(),
        &Unguarded,
        &Unwatched,
    )?;
    Ok(found(&abstraction, solution.winning, before))
}

fn play_unicycle() -> Result<Found, Box<dyn Error>> {
    let before = usage::cpu_s();
    let abstraction = unicycle::abstraction()?;
    let (target, avoid) = (unicycle::target(), unicycle::avoid());
    let solution = reach(&abstraction, &target, &avoid, &Unguarded, &Unwatched)?;
    Ok(found(&abstraction, solution.winning, before))
}

fn play_paper() -> Result<Found, Box<dyn Error>> {
    let spec = Spec::load("paper-bi", &[])?;
    let before = usage::cpu_s();
    let synthesis = synthesis::synthesise(&spec, &|_| Box::new(Unwatched))?;
    Ok(Found {
        cells: synthesis.problem.grid.cells() as usize,
        inputs: spec.input.levels(),
        winning: synthesis
            .all()
            .iter()
            .map(|(_, law)| law.solution.winning)
            .sum(),
        cpu_s: usage::cpu_s() - before,
    })
}

fn play_two_areas() -> Result<Found, Box<dyn Error>> {
    let before = usage::cpu_s();
    let shape = two_areas::shape([1; two_areas::STATES]);
    let abstraction = two_areas::abstraction(&shape)?;
    let kernel = safety(
        &abstraction,
        &two_areas::band(&shape),
        &Unguarded,
        &Unwatched,
    )?;
    let (target, avoid) = (kernel.winning_set(true), two_areas::avoid(&shape));
    let won = reach(&abstraction, &target, &avoid, &Unguarded, &Unwatched)?;
    Ok(found(&abstraction, kernel.winning + won.winning, before))
}

fn found<const D: usize>(abstraction: &impl Abstraction<D>, winning: usize, before: f64) -> Found {
    Found {
        cells: abstraction.shape().cells(),
        inputs: abstraction.inputs(),
        winning,
        cpu_s: usage::cpu_s() - before,
    }
}

/// Processor, cores, compiler and day.
fn machine() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text
        .lines()
        .find_map(|line| line.strip_prefix("model name")?.split_once(": "))
        .map_or("unknown processor", |(_, model)| model);
    let cores = std::thread::available_parallelism().map_or(0, std::num::NonZero::get);
    let compiler = Command::new("rustc").arg("--version").output();
    let compiler = compiler.map_or_else(
        |_| "unknown compiler".to_owned(),
        |output| String::from_utf8_lossy(&output.stdout).trim().to_owned(),
    );
    let day = jiff::Timestamp::now().strftime("%Y-%m-%d");
    format!("{model}, {cores} cores, {compiler}, {day}")
}
