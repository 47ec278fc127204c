//! Processor time and memory of the engine per cell, on one family of games from 2 to 1,003 million
//! cells: `cargo run --release -p synth --example growth -- [SWEEPS [RUNS [FROM [TO]]]]`, sizes
//! counted from 1. SWEEPS 0 plays the games to their ends, and tells of every sweep on stderr.
//!
//! The family: the plant, fleet and inputs of `paper-bi` on f [-1, 0.1] Hz, g [0, 3.2], l and p
//! [0, 2] GW, tau 0.5 s, 10 % participation error, exact-linear successors; the four widths shrink
//! together. Every size plays the first SWEEPS sweeps of the safety game (stay in [-0.3, 0.1] Hz)
//! and of the reach game (reach [-0.15, 0] Hz, never below -0.8 Hz), both lean: what is kept of a
//! cell is a byte. A sweep is one period of the plant, so after equally many sweeps the games stand
//! at the same moment on every grid; games played to their ends differ in their numbers of sweeps.
//! The least of RUNS runs counts: other work on the machine only ever adds.

use std::time::Instant;

use firmware::grid::Grid;
use model::spec::Spec;
use synth::abstraction::Abstraction;
use synth::abstraction::affine::AffineAbstraction;
use synth::abstraction::guard::Unguarded;
use synth::game::bitset::BitSet;
use synth::game::{GameError, Sweep, Watch, reach::reach_lean, safety::safety_lean};
use synth::problem::Problem;
use synth::{synthesis, usage};

type Engine = AffineAbstraction<4>;

/// Cells on each axis: 2.25, 8.0, 32.0, 90.1, 268.8 and 1002.6 million.
const SIZES: [[u32; 4]; 6] = [
    [88, 25, 64, 16],
    [125, 40, 80, 20],
    [160, 50, 125, 32],
    [220, 64, 160, 40],
    [280, 80, 240, 50],
    [400, 116, 292, 74],
];
const LOWER: [f64; 4] = [-1.0, 0.0, 0.0, 0.0];
const UPPER: [f64; 4] = [0.1, 3.2, 2.0, 2.0];

/// Ends a game after a number of sweeps; 0 lets it go on, and tells of it.
struct Until {
    sweeps: u16,
    begun: Instant,
}

impl Watch for Until {
    fn sweep(&self, sweep: &Sweep) -> bool {
        if self.sweeps == 0 {
            eprintln!(
                "sweep {}: {} cells, {} changed; {:.0} s, {:.0} s of processor time",
                sweep.sweep,
                sweep.cells,
                sweep.changed,
                self.begun.elapsed().as_secs_f64(),
                usage::cpu_s()
            );
        }
        self.sweeps == 0 || sweep.sweep < self.sweeps
    }
}

/// Cells whose frequencies all lie in a band \[Hz\].
fn band(abstraction: &Engine, low: f64, high: f64) -> BitSet {
    let shape = abstraction.shape();
    let row: Vec<bool> = (0..shape.count[0])
        .map(|f| {
            let (from, to) = shape.interval(0, f);
            from >= low * synth::drives::MICRO && to <= high * synth::drives::MICRO
        })
        .collect();
    let mut set = BitSet::new(shape.cells());
    for at in (0..shape.cells()).step_by(row.len()) {
        let chosen = (0..row.len()).filter(|f| row[*f]);
        chosen.for_each(|f| set.insert(at + f));
    }
    set
}

/// The engine on a grid of so many cells. The spec is that of the coarsest grid: its check of
/// memory is for the games that keep everything.
fn engine(counts: [u32; 4]) -> Result<Engine, Box<dyn std::error::Error>> {
    let micro = |hz_or_gw: f64| (hz_or_gw * synth::drives::MICRO).round() as i32;
    let width = |counts: &[u32; 4], d: usize| (UPPER[d] - LOWER[d]) / f64::from(counts[d]);
    let widths: [f64; 4] =
        std::array::from_fn(|d| f64::from(micro(width(&SIZES[0], d))) / synth::drives::MICRO);
    let set = [
        format!("grid.lower={LOWER:?}"),
        format!("grid.upper={UPPER:?}"),
        format!("grid.width={widths:?}"),
        "grid.alignment=edges".to_owned(),
        "sampling.period_s=0.5".to_owned(),
        "method.successor=exact-linear".to_owned(),
        "uncertainty.participation=0.1".to_owned(),
    ];
    let spec = Spec::load("paper-bi", &set)?;
    let grid = Grid::new(
        LOWER.map(micro),
        std::array::from_fn(|d| micro(width(&counts, d)) as u32),
        counts.map(|n| n as u16),
    )
    .map_err(|error| format!("{error:?}"))?;
    Ok(synthesis::abstraction(&Problem::on_grid(&spec, grid)?)?)
}

/// Least processor time of some runs of a game's first sweeps \[s\], and how many sweeps those
/// were.
fn least<S>(
    (sweeps, runs): (u16, usize),
    game: impl Fn(&dyn Watch) -> Result<S, GameError>,
    sweeps_of: impl Fn(&S) -> u16,
) -> Result<(f64, u16), GameError> {
    let (mut least, mut played) = (f64::INFINITY, sweeps);
    for _ in 0..runs {
        let (before, begun) = (usage::cpu_s(), Instant::now());
        match game(&Until { sweeps, begun }) {
            Err(GameError::Interrupted) => {}
            Err(error) => return Err(error),
            Ok(solution) => played = sweeps_of(&solution),
        }
        least = least.min(usage::cpu_s() - before);
        if sweeps == 0 {
            eprintln!(
                "{played} sweeps, {:.0} s of wall time",
                begun.elapsed().as_secs_f64()
            );
        }
    }
    Ok((least, played))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let numbers: Vec<usize> = std::env::args()
        .skip(1)
        .map(|text| text.parse())
        .collect::<Result<_, _>>()?;
    let number = |at: usize, default| numbers.get(at).copied().unwrap_or(default);
    let how = (number(0, 12) as u16, number(1, 3));
    let sizes = number(2, 1)..=number(3, 4);
    println!("{} sweeps (0: all), least of {} runs", how.0, how.1);
    println!("ns of processor time per cell and sweep; bytes per cell are of the whole process");
    println!("cells       safety  reach   both    ratio  peak MB  bytes");
    let mut first = None;
    for size in sizes {
        let engine = engine(*SIZES.get(size - 1).ok_or("sizes are 1 to 6")?)?;
        let cells = engine.shape().cells();
        let unit = |(cpu_s, sweeps): (f64, u16)| cpu_s / (cells as f64 * f64::from(sweeps) * 1e-9);
        let safe = band(&engine, -0.3, 0.1);
        let safety = unit(least(
            how,
            |watch| safety_lean(&engine, &safe, &Unguarded, watch),
            |solution| solution.sweeps,
        )?);
        let (target, avoid) = (band(&engine, -0.15, 0.0), band(&engine, -1.0, -0.8));
        let reach = unit(least(
            how,
            |watch| reach_lean(&engine, &target, &avoid, &Unguarded, watch),
            |solution| solution.sweeps,
        )?);
        let both = safety + reach;
        let ratio = both / *first.get_or_insert(both);
        let peak_mb = usage::peak_rss_mb().unwrap_or(f64::NAN);
        println!(
            "{cells:<11} {safety:<7.2} {reach:<7.2} {both:<7.2} {ratio:<6.2} {peak_mb:<8.0} {:.1}",
            peak_mb * 1e6 / cells as f64
        );
    }
    Ok(())
}
