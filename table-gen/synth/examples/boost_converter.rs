//! The safety game of the boost converter on 800 x 800 cells: `cargo run --release --example boost_converter`.

use synth::abstraction::Abstraction;
use synth::boost_converter;
use synth::game::bitset::BitSet;
use synth::game::guard::Unguarded;
use synth::game::{Unwatched, safety::safety};
use synth::usage;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let abstraction = boost_converter::abstraction(800)?;
    let cells = abstraction.shape().cells();
    let start = usage::cpu_s();
    let solution = safety(&abstraction, &BitSet::full(cells), &Unguarded, &Unwatched)?;
    println!(
        "{} of {cells} cells stay in the box for ever; {} sweeps, {:.3} s of processor time",
        solution.winning,
        solution.sweeps,
        usage::cpu_s() - start
    );
    Ok(())
}
