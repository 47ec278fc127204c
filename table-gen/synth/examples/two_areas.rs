//! Two areas with a tie line, five states: `cargo run --release --example two_areas -- [SCALE]`.
//! The kernel of the band and the cells from which it is reached, with time and memory.

use synth::abstraction::Abstraction;
use synth::abstraction::guard::Unguarded;
use synth::game::{Unwatched, reach::reach, safety::safety};
use synth::usage;
use synth::yardsticks::two_areas;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scale = std::env::args().nth(1).map_or(Ok(1), |text| text.parse())?;
    let start = usage::cpu_s();
    let abstraction = two_areas::abstraction(scale)?;
    let cells = abstraction.shape().cells();
    let kernel = safety(
        &abstraction,
        &two_areas::band(scale),
        &Unguarded,
        &Unwatched,
    )?;
    println!(
        "{cells} cells, {} inputs; {} stay in the band for ever ({} sweeps, {:.2} s)",
        abstraction.inputs(),
        kernel.winning,
        kernel.sweeps,
        usage::cpu_s() - start
    );
    let start = usage::cpu_s();
    let won = reach(
        &abstraction,
        &kernel.winning_set(true),
        &two_areas::avoid(scale),
        &Unguarded,
        &Unwatched,
    )?;
    println!(
        "{} more reach it ({} sweeps, {:.2} s); peak memory {:.0} MB",
        won.winning,
        won.sweeps,
        usage::cpu_s() - start,
        usage::peak_rss_mb().unwrap_or(0.0)
    );
    Ok(())
}
