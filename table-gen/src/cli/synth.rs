//! `synth SPEC`: the games alone.

use serde::Serialize;

use super::checkpoint::CheckpointArgs;
use super::{Failure, OutputArgs, SpecArgs, output, progress};
use model::spec::Spec;
use synth::synthesis::{self, SolvedLaw, Synthesis};
use synth::usage;

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

/// One game, as JSON and the table show it.
#[derive(Debug, Clone, Serialize)]
pub(super) struct ProblemReport {
    name: &'static str,
    target_cells: usize,
    winning_cells: usize,
    iterations: u16,
    worst_steps: u16,
    cpu_s: f64,
    wall_s: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    digest: Option<String>,
}

/// The answer of `synth`; `build` repeats it.
#[derive(Debug, Clone, Serialize)]
pub(super) struct SynthReport {
    spec: String,
    /// Whether the law is always on, so that no game is played.
    response: bool,
    cells: u32,
    inputs: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    transitions: Option<u64>,
    abstraction_cpu_s: f64,
    problems: Vec<ProblemReport>,
    peak_rss_mb: Option<f64>,
    #[cfg(feature = "mpi")]
    #[serde(skip_serializing_if = "Option::is_none")]
    ranks: Option<super::ranks::RanksReport>,
}

impl SynthReport {
    /// The report of a spec whose preferred law is always on: no game is played.
    pub(super) fn of_response(spec: &Spec) -> Self {
        Self {
            spec: spec.name.clone(),
            response: true,
            cells: 0,
            inputs: 0,
            transitions: None,
            abstraction_cpu_s: 0.0,
            problems: Vec::new(),
            peak_rss_mb: usage::peak_rss_mb(),
            #[cfg(feature = "mpi")]
            ranks: None,
        }
    }

    /// The report of a synthesis.
    pub(super) fn new(spec: &Spec, synthesis: &Synthesis) -> Self {
        Self {
            spec: spec.name.clone(),
            response: false,
            cells: synthesis.grid.cells(),
            inputs: spec.input.levels(),
            transitions: None,
            abstraction_cpu_s: synthesis.abstraction_cpu_s,
            problems: synthesis
                .all()
                .into_iter()
                .map(|(name, law)| problem(name, law))
                .collect(),
            peak_rss_mb: usage::peak_rss_mb(),
            #[cfg(feature = "mpi")]
            ranks: None,
        }
    }

    /// Adds a checksum to each game, in their order.
    pub(super) fn set_digest(&mut self, digests: Vec<String>) {
        for (problem, digest) in self.problems.iter_mut().zip(digests) {
            problem.digest = Some(digest);
        }
    }

    /// Adds what the ranks needed.
    #[cfg(feature = "mpi")]
    pub(super) fn set_ranks(&mut self, ranks: super::ranks::RanksReport) {
        self.ranks = Some(ranks);
    }

    /// The same as a table on stdout.
    pub(super) fn print(&self) {
        if self.response {
            output::line(format_args!(
                "{}: a response, always on: no game is played",
                self.spec
            ));
            return;
        }
        output::line(format_args!(
            "{}: {} cells, {} inputs",
            self.spec,
            output::grouped(self.cells as usize),
            self.inputs
        ));
        let mut table = output::table(&[
            "game",
            "target cells",
            "winning cells",
            "sweeps",
            "worst steps",
            "CPU s",
            "wall s",
        ]);
        for problem in &self.problems {
            table.add_row(vec![
                problem.name.to_owned(),
                output::grouped(problem.target_cells),
                output::grouped(problem.winning_cells),
                problem.iterations.to_string(),
                problem.worst_steps.to_string(),
                format!("{:.3}", problem.cpu_s),
                format!("{:.3}", problem.wall_s),
            ]);
        }
        output::line(table);
        for problem in &self.problems {
            if let Some(digest) = &problem.digest {
                output::line(format_args!("{}: {digest}", problem.name));
            }
        }
        if let Some(transitions) = self.transitions {
            output::line(format_args!("transitions: {transitions}"));
        }
        if let Some(mb) = self.peak_rss_mb {
            output::line(format_args!("peak memory: {mb:.1} MB"));
        }
    }
}

fn problem(name: &'static str, law: &SolvedLaw) -> ProblemReport {
    // The last sweep of a reach game wins nothing; safety has no steps.
    let worst_steps = match name {
        "Hold" => 0,
        _ => law.solution.sweeps.saturating_sub(1),
    };
    ProblemReport {
        name,
        target_cells: law.target_cells,
        winning_cells: law.solution.winning,
        iterations: law.solution.sweeps,
        worst_steps,
        cpu_s: law.cpu_s,
        wall_s: law.wall_s,
        digest: None,
    }
}

/// One checksum of those of all layers.
pub(super) fn digest_of(layers: &[u64]) -> String {
    let sum = layers.iter().fold(0u64, |sum, layer| {
        (sum.rotate_left(5) ^ layer).wrapping_mul(0x9E37_79B9_7F4A_7C15)
    });
    format!("{sum:016x}")
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
        let counts = synthesis.grid.count();
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
        let abstraction = synthesis::abstraction(&spec, &synthesis.grid).map_err(Failure::bad)?;
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
