//! Results as texts and bytes.

use lab::simulation::trajectory::Run;
use model::spec::Spec;
use serde_json::{Value, json};
use synth::synthesis::{SolvedLaw, Synthesis};

/// The games in order: what `synth --json` says of them.
pub(crate) fn problems(synthesis: &Synthesis) -> Result<String, serde_json::Error> {
    let problem = |name: &str, law: &SolvedLaw| {
        json!({
            "name": name,
            "target_cells": law.target_cells,
            "winning_cells": law.solution.winning,
            "iterations": law.solution.sweeps,
            "cpu_s": law.cpu_s,
        })
    };
    let mut all = vec![problem("C1", &synthesis.c1)];
    all.extend(synthesis.c2.as_ref().map(|law| problem("C2", law)));
    all.extend(synthesis.hold.as_ref().map(|law| problem("Hold", law)));
    serde_json::to_string(&Value::Array(all))
}

/// The verdict on a table.
pub(crate) fn verdict(table: &[u8], spec: &Spec) -> Result<String, String> {
    let verdict = verify::verify(table, spec, &|_| true).map_err(|error| error.to_string())?;
    serde_json::to_string(&verdict).map_err(|error| error.to_string())
}

/// Summary and phases of a run, and its samples.
pub(crate) fn run(run: &Run) -> Result<(String, Vec<u8>), serde_json::Error> {
    let text = serde_json::to_string(&json!({"summary": run.summary, "phases": run.phases}))?;
    let mut rows = Vec::with_capacity(run.samples.len() * 7 * size_of::<f64>());
    for sample in &run.samples {
        let [f, g, l, p] = sample.state;
        let row = [
            sample.time_s,
            f,
            g,
            l,
            p,
            sample.participation,
            sample.delivered,
        ];
        rows.extend(row.iter().flat_map(|value| value.to_le_bytes()));
    }
    Ok((text, rows))
}
