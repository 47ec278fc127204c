//! What `synth` answers, on one machine or on ranks.

use serde::Serialize;

use super::output;
use model::spec::Spec;
use synth::synthesis::{SolvedLaw, Synthesis};
use synth::usage;

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

/// What the ranks needed.
#[cfg(feature = "mpi")]
#[derive(Debug, Clone, Serialize)]
pub(super) struct RanksReport {
    /// Number of ranks.
    pub(super) ranks: usize,
    /// Bytes that all ranks sent after sweeps.
    pub(super) sent_bytes: u64,
    /// Of the largest rank \[MB\].
    pub(super) peak_rss_mb: f64,
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
    pub(super) transitions: Option<u64>,
    abstraction_cpu_s: f64,
    problems: Vec<ProblemReport>,
    peak_rss_mb: Option<f64>,
    #[cfg(feature = "mpi")]
    #[serde(skip_serializing_if = "Option::is_none")]
    ranks: Option<RanksReport>,
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
            cells: synthesis.problem.grid.cells(),
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
    pub(super) fn set_ranks(&mut self, ranks: RanksReport) {
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
