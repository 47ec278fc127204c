//! How a game shares out between ranks, without MPI and its busy waiting: ranks are threads of this
//! process, which sleep while they wait. Prints the processor time of all ranks together and the
//! bytes that they send: `cargo run --release -p synth --example scaling -- SPEC [KEY=VALUE...]`.
//!
//! Were nothing done twice, all ranks together would take what one takes. What n ranks take is
//! b + n a: a is what every rank does for itself, b what is shared out. On n machines the time of a
//! game is then a + b / n and what the network adds.

use model::spec::Spec;
use synth::game::Unwatched;
use synth::ranks::threads;
use synth::{synthesis, usage};

/// Numbers of ranks that are tried.
const RANKS: [usize; 4] = [1, 2, 4, 8];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (name, set) = arguments
        .split_first()
        .ok_or("usage: scaling SPEC [KEY=VALUE...]")?;
    let spec = Spec::load(name, set)?;
    // A rank is one thread, so that a rank's time is a core's.
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build_global()?;
    println!("ranks  cpu s  to one rank  sent MB  sweeps  winning");
    let mut alone_s = None;
    for ranks in RANKS {
        let before = usage::cpu_s();
        let found = threads::run(ranks, |rank| {
            synthesis::synthesise_shared(&spec, rank, &|_| Box::new(Unwatched))
        });
        let cpu_s = usage::cpu_s() - before;
        let found = found.into_iter().collect::<Result<Vec<_>, _>>()?;
        let sent: u64 = found.iter().map(|rank| rank.sent_bytes).sum();
        let laws = found[0].laws.all();
        let sweeps: u32 = laws
            .iter()
            .map(|(_, law)| u32::from(law.solution.sweeps))
            .sum();
        let winning: usize = laws.iter().map(|(_, law)| law.solution.winning).sum();
        let alone_s = *alone_s.get_or_insert(cpu_s);
        println!(
            "{ranks:>5}  {cpu_s:>5.2}  {:>11.2}  {:>7.2}  {sweeps:>6}  {winning}",
            cpu_s / alone_s,
            sent as f64 / 1e6,
        );
    }
    Ok(())
}
