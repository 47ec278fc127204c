//! `verify TABLE --spec SPEC`: the independent check of the bytes.

use std::path::PathBuf;

use super::{Failure, Overrides, output, progress};
use lab::falsify::witness;
use lab::simulation::beyond::Loss;
use lab::simulation::beyond::file::ScenarioFile;
use model::interval::Interval;
use model::spec::Spec;
use model::verdict::{Claim, Counterexample, Verdict};
use verify::VerifyError;
use verify::response::LossStage;

/// Arguments of `verify`.
#[derive(Debug, clap::Args)]
pub(super) struct VerifyArgs {
    /// The table to check
    #[arg(value_name = "TABLE")]
    table: PathBuf,
    /// Name of a shipped spec, or path of a TOML file
    #[arg(long, value_name = "SPEC")]
    spec: String,
    #[command(flatten)]
    overrides: Overrides,
    #[command(flatten)]
    output: super::OutputArgs,
    /// Examine the table against a fleet of which this share does as it likes, the opposite or
    /// nothing; the table stays the one of SPEC (0 to 1)
    #[arg(long, value_name = "X", allow_negative_numbers = true)]
    hostile_share: Option<f64>,
    /// Examine the table for these losses instead of the spec's: the [[loss]] of a shipped scenario
    /// such as gb-2019, or of a TOML file, each lost at any time near its moment
    #[arg(long, value_name = "FILE", conflicts_with = "hostile_share")]
    loss_steps: Option<String>,
    /// How near: so long before and after it [s]
    #[arg(long, value_name = "S", default_value_t = 0.5, requires = "loss_steps")]
    moments_s: f64,
    /// Also write the verdict to this file
    #[arg(long, value_name = "FILE")]
    verdict: Option<PathBuf>,
}

/// Runs the command.
pub(super) fn run(args: &VerifyArgs) -> Result<(), Failure> {
    let spec = args.overrides.load(&args.spec)?;
    progress::catch_interrupts();
    let fail = |path: &PathBuf, error: std::io::Error| {
        Failure::BadInput(format!("{}: {error}", path.display()))
    };
    let bytes = std::fs::read(&args.table).map_err(|error| fail(&args.table, error))?;
    let mut assumed = spec.clone();
    if args.hostile_share.is_some() {
        assumed.uncertainty.hostile_share = args.hostile_share;
        assumed.validate("--hostile-share")?;
    }
    let verdict = match &args.loss_steps {
        None => examine_assuming(&bytes, &spec, &assumed)?,
        Some(name) => examine_staged(&bytes, &spec, &stages(name, args.moments_s)?)?,
    };
    if let Some(path) = &args.verdict {
        let text = serde_json::to_string_pretty(&verdict).map_err(Failure::bad)?;
        std::fs::write(path, text).map_err(|error| fail(path, error))?;
    }
    if args.output.json {
        output::json(&verdict)?;
    } else {
        print(&verdict);
    }
    answer(&verdict)
}

/// Verifies with progress on stderr.
pub(super) fn examine(bytes: &[u8], spec: &Spec) -> Result<Verdict, Failure> {
    examine_assuming(bytes, spec, spec)
}

/// The losses of a scenario, each at any time so near to its moment \[s\].
fn stages(name: &str, moments_s: f64) -> Result<Vec<LossStage>, Failure> {
    if !(0.0..=10.0).contains(&moments_s) {
        return Err(Failure::BadInput(format!(
            "--moments-s = {moments_s} is out of range: 0 to 10"
        )));
    }
    let file = ScenarioFile::load(name).map_err(Failure::bad)?;
    let losses = file.losses();
    let refuse = |what: &str| Err(Failure::BadInput(format!("{name}: {what}")));
    if losses.is_empty() {
        return refuse("no [[loss]]; allowed: at least one");
    }
    if losses.iter().any(|loss| loss.power_gw < 0.0) {
        return refuse("a loss below 0; allowed: stages of at least 0");
    }
    if losses.iter().any(|loss| loss.inertia_gw_s_per_hz != 0.0) {
        return refuse(
            "inertia that is lost; the proof takes it as a band, uncertainty.inertia_gw_s_per_hz",
        );
    }
    let stage = |loss: &Loss| LossStage {
        earliest_s: (loss.at_s - moments_s).max(0.0),
        latest_s: loss.at_s + moments_s,
        power_gw: Interval::point(loss.power_gw),
    };
    Ok(losses.iter().map(stage).collect())
}

/// Verifies for losses in stages, with progress on stderr.
fn examine_staged(bytes: &[u8], spec: &Spec, stages: &[LossStage]) -> Result<Verdict, Failure> {
    let bar = progress::share("verify");
    let verdict = verify::verify_staged(bytes, spec, stages, &|done| bar(done));
    verdict.map_err(|error| match error {
        VerifyError::Interrupted => Failure::No(error.to_string()),
        _ => Failure::bad(error),
    })
}

/// The same for a fleet that is worse than the spec's.
fn examine_assuming(bytes: &[u8], spec: &Spec, assumed: &Spec) -> Result<Verdict, Failure> {
    let bar = progress::share("verify");
    let verdict = verify::verify_assuming(bytes, spec, assumed, &|done| bar(done));
    let mut verdict = verdict.map_err(|error| match error {
        VerifyError::Interrupted => Failure::No(error.to_string()),
        _ => Failure::bad(error),
    })?;
    witness::refute(&mut verdict, bytes, assumed)
        .map_err(|error| Failure::bad(VerifyError::Table(error)))?;
    Ok(verdict)
}

/// "No" unless every claim holds.
pub(super) fn answer(verdict: &Verdict) -> Result<(), Failure> {
    if verdict.verified {
        return Ok(());
    }
    let failed: Vec<String> = verdict
        .claims
        .iter()
        .filter(|claim| !claim.holds)
        .map(|claim| claim.name.to_string())
        .collect();
    Err(Failure::No(format!("not verified: {}", failed.join(", "))))
}

/// The verdict for people.
pub(super) fn print(verdict: &Verdict) {
    output::line(format_args!(
        "{}: {} ({}, {} reachable cells)",
        verdict.spec,
        if verdict.verified {
            "verified"
        } else {
            "NOT verified"
        },
        verdict.method,
        output::grouped(verdict.reachable_cells as usize),
    ));
    for band in &verdict.plant {
        output::line(format_args!("unknown: {band}"));
    }
    if let Some(share) = verdict.hostile_share {
        output::line(format_args!(
            "assumed: {} % of the chargers do as they like",
            // Without the last digits of the product.
            (1e8 * share).round() / 1e6
        ));
    }
    let mut table = output::table(&["claim", "holds", "bound", "limit", "unit"]);
    let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.4}"));
    for claim in &verdict.claims {
        table.add_row(vec![
            claim.name.to_string(),
            if claim.holds { "yes" } else { "NO" }.to_owned(),
            number(claim.bound),
            number(claim.limit),
            claim.unit.clone().into_owned(),
        ]);
    }
    output::line(table);
    for claim in &verdict.claims {
        output::line(format_args!(
            "  {}: {}{}",
            claim.name,
            claim.statement,
            because(claim)
        ));
    }
    if let Some(example) = &verdict.counterexample {
        counterexample(example);
    }
}

fn because(claim: &Claim) -> String {
    match &claim.reason {
        Some(reason) => format!(" - does NOT hold: {reason}"),
        None => String::new(),
    }
}

/// Points of a path that are printed; the JSON has all of them.
const SHOWN: usize = 12;

fn counterexample(example: &Counterexample) {
    let Some(real) = &example.real else {
        output::line(format_args!(
            "{} is not proven: {}; no real trajectory was found that breaks it. The sets that lead there:",
            example.claim, example.what
        ));
        for step in example.path.iter().rev().take(SHOWN).rev() {
            output::line(format_args!(
                "  {:7.2} s  {:10} level {:2}  f in [{:.4}, {:.4}] Hz",
                step.time_s,
                step.phase.name(),
                step.level,
                step.f_low_hz,
                step.f_high_hz
            ));
        }
        return;
    };
    output::line(format_args!(
        "{} is refuted by a real trajectory: {} at {:.3} s (event {:.4} s before the first tick; disturbances: {})",
        example.claim, real.what, real.breach_s, real.first_tick_s, real.adversary
    ));
    for point in real.points.iter().rev().take(SHOWN).rev() {
        let [f, g, l, p] = point.state;
        output::line(format_args!(
            "  {:7.2} s  {:10} level {:2}  f {f:.4} Hz  g {g:.3} l {l:.3} p {p:.3} GW",
            point.time_s,
            point.phase.name(),
            point.level
        ));
    }
}
