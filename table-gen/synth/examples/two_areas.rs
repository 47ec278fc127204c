//! Two areas with a tie line, five states: `cargo run --release --example two_areas -- [SCALE]`, or
//! `[F,F,TIE,P,P]`, a scale for each axis (default 2,2,2,1,1).
//! The kernel of the band and the cells from which it is reached, with time and memory; then the
//! same of the game on what an observer makes of both frequencies.

use synth::abstraction::Abstraction;
use synth::abstraction::affine::AffineAbstraction;
use synth::abstraction::guard::Unguarded;
use synth::game::bitset::BitSet;
use synth::game::{Unwatched, reach::reach, safety::safety};
use synth::usage;
use synth::yardsticks::two_areas::{self, observer};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scales = scales(std::env::args().nth(1))?;
    let shape = two_areas::shape(scales);
    println!("Five states known:");
    let (band, avoid) = (two_areas::band(&shape), two_areas::avoid(&shape));
    play(&two_areas::abstraction(&shape)?, &band, &avoid)?;

    let error = observer::error().ok_or("the observer's errors have no bound")?;
    println!(
        "Both frequencies measured within {} Hz; estimates of f1, f2 [Hz], tie, p1, p2 [GW] within {error:.4?}:",
        observer::METER_HZ
    );
    let game = observer::on_estimate(&shape, &error)?;
    play(&game.abstraction, &game.band, &game.avoid)
}

/// One scale for all axes, or one for each.
fn scales(text: Option<String>) -> Result<[u32; two_areas::STATES], Box<dyn std::error::Error>> {
    let Some(text) = text else {
        return Ok([2, 2, 2, 1, 1]);
    };
    let scales: Result<Vec<u32>, _> = text.split(',').map(str::parse).collect();
    match scales?[..] {
        [scale] if scale > 0 => Ok([scale; two_areas::STATES]),
        [a, b, c, d, e] if [a, b, c, d, e].iter().all(|scale| *scale > 0) => Ok([a, b, c, d, e]),
        _ => Err(
            format!("scales {text}: one whole number from 1, or one for each of five axes").into(),
        ),
    }
}

fn play(
    abstraction: &AffineAbstraction<{ two_areas::STATES }>,
    band: &BitSet,
    avoid: &BitSet,
) -> Result<(), Box<dyn std::error::Error>> {
    let start = usage::cpu_s();
    let cells = abstraction.shape().cells();
    let kernel = safety(abstraction, band, &Unguarded, &Unwatched)?;
    println!(
        "{cells} cells, {} inputs; {} stay in the band for ever ({} sweeps, {:.2} s)",
        abstraction.inputs(),
        kernel.winning,
        kernel.sweeps,
        usage::cpu_s() - start
    );
    let start = usage::cpu_s();
    let target = kernel.winning_set(true);
    let won = reach(abstraction, &target, avoid, &Unguarded, &Unwatched)?;
    println!(
        "{} more reach it ({} sweeps, {:.2} s); peak memory {:.0} MB",
        won.winning,
        won.sweeps,
        usage::cpu_s() - start,
        usage::peak_rss_mb().unwrap_or(0.0)
    );
    Ok(())
}
