//! `synth SPEC`: the games alone.

use serde::Serialize;

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
    /// Also count the transitions of the abstraction (slow; for comparison with tools that store them)
    #[arg(long)]
    count_transitions: bool,
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
        }
    }

    /// The report of a synthesis.
    pub(super) fn new(spec: &Spec, synthesis: &Synthesis) -> Self {
        let laws = [
            ("C1", Some(&synthesis.c1)),
            ("C2", synthesis.c2.as_ref()),
            ("Hold", synthesis.hold.as_ref()),
        ];
        Self {
            spec: spec.name.clone(),
            response: false,
            cells: synthesis.grid.cells(),
            inputs: spec.input.levels(),
            transitions: None,
            abstraction_cpu_s: synthesis.abstraction_cpu_s,
            problems: laws
                .into_iter()
                .filter_map(|(name, law)| Some(problem(name, law?)))
                .collect(),
            peak_rss_mb: usage::peak_rss_mb(),
        }
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
        if let Some(transitions) = self.transitions {
            output::line(format_args!("transitions: {transitions}"));
        }
        if let Some(mb) = self.peak_rss_mb {
            output::line(format_args!("peak memory: {mb:.1} MB"));
        }
    }
}

fn problem(name: &'static str, law: &SolvedLaw) -> ProblemReport {
    let ranks = &law.solution.ranks;
    let worst = ranks
        .iter()
        .filter(|rank| **rank != synth::game::NOT_WON)
        .max();
    ProblemReport {
        name,
        target_cells: law.target_cells,
        winning_cells: law.solution.winning,
        iterations: law.solution.sweeps,
        worst_steps: worst.copied().unwrap_or(0),
        cpu_s: law.cpu_s,
        wall_s: law.wall_s,
    }
}

/// Runs the command.
pub(super) fn run(args: &SynthArgs) -> Result<(), Failure> {
    let spec = args.spec.load()?;
    progress::catch_interrupts();
    if spec.preference.always_on {
        let report = SynthReport::of_response(&spec);
        if args.output.json {
            return output::json(&report);
        }
        report.print();
        return Ok(());
    }
    let synthesis = synthesis::synthesise(&spec, &progress::watch)?;
    let mut report = SynthReport::new(&spec, &synthesis);
    if args.count_transitions {
        let abstraction = synthesis::abstraction(&spec, &synthesis.grid).map_err(Failure::bad)?;
        report.transitions = Some(synthesis::count_transitions(&abstraction));
    }
    if args.output.json {
        output::json(&report)
    } else {
        report.print();
        Ok(())
    }
}
