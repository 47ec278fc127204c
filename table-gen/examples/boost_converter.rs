//! The safety game of the boost converter on 800 x 800 cells: `cargo run --release --example boost_converter`.

use table_gen::abstraction::Abstraction;
use table_gen::boost_converter;
use table_gen::game::bitset::BitSet;
use table_gen::game::guard::Unguarded;
use table_gen::game::{Unwatched, safety::safety};
use table_gen::usage;

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
