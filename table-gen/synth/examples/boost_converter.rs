//! SCOTS' boost converter: `cargo run --release --example boost_converter`.

use synth::abstraction::Abstraction;
use synth::abstraction::guard::Unguarded;
use synth::game::{Unwatched, safety::safety};
use synth::usage;
use synth::yardsticks::boost_converter;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let start = usage::cpu_s();
    let abstraction = boost_converter::scots_abstraction()?;
    let built = usage::cpu_s();
    let safe = boost_converter::scots_safe();
    let solution = safety(&abstraction, &safe, &Unguarded, &Unwatched)?;
    println!(
        "{} of {} cells stay in the box for ever ({} sweeps); abstraction {:.3} s, game {:.3} s of processor time, peak memory {:.0} \
         MB",
        solution.winning,
        abstraction.shape().cells(),
        solution.sweeps,
        built - start,
        usage::cpu_s() - built,
        usage::peak_rss_mb().unwrap_or(0.0)
    );
    Ok(())
}
