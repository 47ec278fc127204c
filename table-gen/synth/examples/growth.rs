//! Processor time of the engine per cell and sweep, on one family of games from 2 to 90 million cells:
//! `cargo run --release -p synth --example growth -- [SWEEPS [RUNS [SIZES]]]`.
//!
//! The family: the plant, fleet and inputs of `paper-bi` on f [-1, 0.1] Hz, g [0, 3.2], l and p [0, 2] GW, tau 0.5 s, 10 %
//! participation error, exact-linear successors; the four widths shrink together. Every size plays the first SWEEPS
//! sweeps of the safety game (stay in [-0.3, 0.1] Hz) and of the reach game (reach [-0.15, 0] Hz, never below -0.8 Hz). A sweep
//! is one period of the plant, so after equally many sweeps the games stand at the same moment on every grid; games
//! played to their ends differ in their numbers of sweeps. The least of RUNS runs counts: other work on the machine
//! only ever adds.

use model::spec::Spec;
use synth::abstraction::Abstraction;
use synth::abstraction::affine::AffineAbstraction;
use synth::game::bitset::BitSet;
use synth::game::guard::Unguarded;
use synth::game::{GameError, Solution, Sweep, Watch, reach::reach, safety::safety};
use synth::{synthesis, usage};

type Engine = AffineAbstraction<4>;

/// Cells on each axis: 2.25, 8.0, 32.0 and 90.1 million.
const SIZES: [[u32; 4]; 4] = [
    [88, 25, 64, 16],
    [125, 40, 80, 20],
    [160, 50, 125, 32],
    [220, 64, 160, 40],
];
const LOWER: [f64; 4] = [-1.0, 0.0, 0.0, 0.0];
const UPPER: [f64; 4] = [0.1, 3.2, 2.0, 2.0];

/// Ends a game after a number of sweeps.
struct Until(u16);

impl Watch for Until {
    fn sweep(&self, sweep: &Sweep) -> bool {
        sweep.sweep < self.0
    }
}

/// Cells whose frequencies all lie in a band \[Hz\].
fn band(abstraction: &Engine, low: f64, high: f64) -> BitSet {
    let shape = abstraction.shape();
    let mut set = BitSet::new(shape.cells());
    for index in 0..shape.cells() {
        let (from, to) = shape.interval(0, shape.cell(index)[0]);
        if from >= low * synthesis::MICRO && to <= high * synthesis::MICRO {
            set.insert(index);
        }
    }
    set
}

fn engine(counts: [u32; 4]) -> Result<Engine, Box<dyn std::error::Error>> {
    let widths: [f64; 4] =
        std::array::from_fn(|d| (UPPER[d] - LOWER[d]) / f64::from(counts[d])).map(micro);
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
    let grid = synthesis::device_grid(&spec).map_err(|error| format!("{error:?}"))?;
    Ok(synthesis::abstraction(&spec, &grid)?)
}

/// The nearest whole number of micro-units.
fn micro(width: f64) -> f64 {
    (width * synthesis::MICRO).round() / synthesis::MICRO
}

/// Least processor time of some runs of a game's first sweeps \[s\].
fn least(
    sweeps: u16,
    runs: usize,
    game: impl Fn(&dyn Watch) -> Result<Solution, GameError>,
) -> Result<f64, GameError> {
    let mut least = f64::INFINITY;
    for _ in 0..runs {
        let before = usage::cpu_s();
        match game(&Until(sweeps)) {
            Err(GameError::Interrupted) => {}
            Err(error) => return Err(error),
            Ok(solution) => eprintln!("ended after {} sweeps", solution.sweeps),
        }
        least = least.min(usage::cpu_s() - before);
    }
    Ok(least)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let sweeps: u16 = arguments.next().map_or(Ok(12), |text| text.parse())?;
    let runs: usize = arguments.next().map_or(Ok(3), |text| text.parse())?;
    let sizes: usize = arguments.next().map_or(Ok(4), |text| text.parse())?;
    println!(
        "first {sweeps} sweeps, least of {runs} runs; ns of processor time per cell and sweep"
    );
    println!("cells       safety  reach   both    ratio");
    let mut first = None;
    for counts in &SIZES[..sizes] {
        let engine = engine(*counts)?;
        let cells = engine.shape().cells();
        let unit = cells as f64 * f64::from(sweeps) * 1e-9;
        let safe = band(&engine, -0.3, 0.1);
        let safety_s = least(sweeps, runs, |watch| {
            safety(&engine, &safe, &Unguarded, watch)
        })?;
        let (target, avoid) = (band(&engine, -0.15, 0.0), band(&engine, -1.0, -0.8));
        let reach_s = least(sweeps, runs, |watch| {
            reach(&engine, &target, &avoid, &Unguarded, watch)
        })?;
        let both = (safety_s + reach_s) / unit;
        let ratio = both / *first.get_or_insert(both);
        println!(
            "{cells:<11} {:<7.2} {:<7.2} {both:<7.2} {ratio:.2}",
            safety_s / unit,
            reach_s / unit
        );
    }
    Ok(())
}
