//! `synth SPEC`: the games alone.

use super::checkpoint::CheckpointArgs;
use super::synth_report::{SynthReport, digest_of};
use super::{Failure, OutputArgs, SpecArgs, output, progress};
use synth::synthesis::{self, SolvedLaw};

/// Arguments of `synth`.
#[derive(Debug, clap::Args)]
pub(super) struct SynthArgs {
    #[command(flatten)]
    spec: SpecArgs,
    #[command(flatten)]
    output: OutputArgs,
    /// Also count the transitions of the abstraction (slow; for comparison with tools that store
    /// them)
    #[arg(long)]
    count_transitions: bool,
    /// Also print a checksum of each law's inputs and ranks, to compare runs on other numbers of
    /// threads and ranks
    #[arg(long)]
    digest: bool,
    #[command(flatten)]
    checkpoint: CheckpointArgs,
}

/// Runs the command.
pub(super) fn run(args: &SynthArgs) -> Result<(), Failure> {
    let spec = args.spec.load()?;
    progress::catch_interrupts();
    #[cfg(feature = "mpi")]
    if let Some(world) = mpi_ranks::World::join() {
        if args.count_transitions || args.checkpoint.is_asked() {
            return Err(Failure::BadInput(
                "--checkpoint and --count-transitions are for a single process".to_owned(),
            ));
        }
        return match super::ranks::run(&spec, &world, args.digest)? {
            Some(report) => show(args, &report),
            None => Ok(()),
        };
    }
    if spec.preference.always_on {
        return show(args, &SynthReport::of_response(&spec));
    }
    let synthesis = args.checkpoint.synthesise(&spec)?;
    let mut report = SynthReport::new(&spec, &synthesis);
    if args.digest {
        let counts = synthesis.problem.grid.count();
        let layer = counts[..counts.len() - 1]
            .iter()
            .map(|n| usize::from(*n))
            .product();
        let digest = |law: &SolvedLaw| {
            let own = 0..law.solution.ranks.len();
            digest_of(&synthesis::layer_sums(&law.solution, own, layer))
        };
        report.set_digest(
            synthesis
                .all()
                .into_iter()
                .map(|(_, law)| digest(law))
                .collect(),
        );
    }
    if args.count_transitions {
        let abstraction = synthesis::abstraction(&synthesis.problem).map_err(Failure::bad)?;
        report.transitions = Some(synthesis::count_transitions(&abstraction));
    }
    show(args, &report)
}

fn show(args: &SynthArgs, report: &SynthReport) -> Result<(), Failure> {
    if args.output.json {
        output::json(report)
    } else {
        report.print();
        Ok(())
    }
}
