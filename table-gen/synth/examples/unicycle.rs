//! SCOTS' vehicle: `cargo run --release --example unicycle`.

use synth::abstraction::Abstraction;
use synth::abstraction::guard::Unguarded;
use synth::game::{Unwatched, reach::reach};
use synth::usage;
use synth::yardsticks::unicycle;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let start = usage::cpu_s();
    let abstraction = unicycle::abstraction()?;
    let built = usage::cpu_s();
    let (target, avoid) = (unicycle::target(), unicycle::avoid());
    let won = reach(&abstraction, &target, &avoid, &Unguarded, &Unwatched)?;
    println!(
        "{} of {} cells reach the {} of the target in at most {} steps; SCOTS' start needs {}; abstraction {:.3} s, game {:.3} s \
         of processor time, peak memory {:.0} MB",
        won.winning,
        abstraction.shape().cells(),
        target.count(),
        won.sweeps - 1,
        won.ranks[unicycle::start(&abstraction)],
        built - start,
        usage::cpu_s() - built,
        usage::peak_rss_mb().unwrap_or(0.0)
    );
    Ok(())
}
