//! `prob TABLE --spec SPEC`: a lower bound on the probability that a table keeps its promise.

use std::path::{Path, PathBuf};

use ::prob::analysis::{self, AnalysisError, Answer, Question};
use ::prob::closed_loop::ClosedLoopError;
use ::prob::export;
use ::prob::loss::Losses;
use ::prob::participation::Participation;
use ::prob::sampled::{RUNS_MAX, Runs, Sampled};
use firmware::table::TableView;
use lab::report::chart;
use lab::report::section::Section;
use serde::Serialize;
use verify::VerifyError;

use super::chain_args::{self, ChainArgs, view, within};
use super::files::write_one;
use super::shares::Job;
use super::{Failure, output, prob_figure, progress};
use model::spec::Spec;

/// Arguments of `prob`.
#[derive(Debug, clap::Args)]
pub(super) struct ProbArgs {
    #[command(flatten)]
    chain: ChainArgs,
    /// A response: time from one draw to the next [s]; default: chance.draw_interval_s, or the
    /// period
    #[arg(long, value_name = "S")]
    draw_interval_s: Option<f64>,
    /// Relative errors for which each band of losses is examined besides the spec's
    #[arg(long, value_name = "E,E,...", value_delimiter = ',')]
    errors: Vec<f64>,
    /// Sizes of the loss: a CSV of loss_gw,weight (weights in events a year), or gb-synthetic;
    /// default: chance.loss, or the spec's band
    #[arg(long, value_name = "FILE")]
    loss: Option<String>,
    /// Normal noise of each reading of f, beside the meter's own error: standard deviation [Hz];
    /// default: chance.noise_hz, or none
    #[arg(long, value_name = "HZ")]
    noise_hz: Option<f64>,
    /// Write the chain in Storm's format (laws by games, with or without Hold, delays of at most a
    /// period; with a participation, exact is one)
    #[arg(long, value_name = "FILE")]
    drn: Option<PathBuf>,
    /// Write the chain as PRISM's explicit files BASE.tra and BASE.lab
    #[arg(long, value_name = "BASE")]
    prism: Option<PathBuf>,
    /// Draw what may be lost over the horizon, for several sizes of the error, as SVG
    #[arg(long, value_name = "FILE")]
    figure: Option<PathBuf>,
    /// Runs of the same process beside the bound (laws by games)
    #[arg(long, value_name = "N")]
    runs: Option<u32>,
    /// Seed of the first run
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
}

#[derive(Debug, Serialize)]
struct ProbReport<'r> {
    spec: &'r str,
    #[serde(flatten)]
    answer: &'r Answer,
    simulated: Option<Runs>,
}

/// Runs the command.
pub(super) fn run(args: &ProbArgs) -> Result<(), Failure> {
    let spec = args.chain.spec()?;
    let question = question(args, &spec)?;
    progress::catch_interrupts();
    let bytes = args.chain.bytes()?;
    let table = view(&bytes)?;
    let bar = progress::share("prob");
    let job = Job::join();
    let go_on = |done| {
        if job.tells() {
            bar(done)
        } else {
            !progress::interrupted()
        }
    };
    let proofs = job.answers(&analysis::bands_of(&spec, &question), |own| {
        analysis::proofs(&table, &spec, &question, own, &go_on).map_err(failure)
    })?;
    let Some(proofs) = proofs else {
        return Ok(());
    };
    let answer = analysis::answer(&table, &spec, &question, proofs, &go_on);
    let answer = answer.map_err(failure)?;
    exported(args, &spec, &answer)?;
    if let Some(path) = &args.figure {
        let absolute = spec.uncertainty.participation_absolute;
        let figure = prob_figure::figure(&table.header(), absolute, &question, &answer);
        let drawn = chart::svg(&figure).map_err(Failure::bad)?;
        write_one(path, chart::with_style(&drawn).as_bytes())?;
    }
    let simulated = simulated(args, &spec, &table, &question)?;
    if args.chain.output.json {
        return output::json(&ProbReport {
            spec: &spec.name,
            answer: &answer,
            simulated,
        });
    }
    print(&spec, &answer, simulated.as_ref());
    Ok(())
}

/// The question of the options.
fn question(args: &ProbArgs, spec: &Spec) -> Result<Question, Failure> {
    let chance = &spec.chance;
    let interval = args
        .draw_interval_s
        .or(chance.draw_interval_s)
        .unwrap_or(spec.sampling.period_s);
    for error in &args.errors {
        within("--errors", *error, [0.0, 1.0])?;
    }
    let noise_hz = match args.noise_hz {
        Some(sigma) => Some(within("--noise-hz", sigma, [0.0, 1.0])?),
        None => chance.noise_hz,
    };
    let losses = match (&args.loss, &chance.loss) {
        (Some(name), _) => Some(Losses::load(name).map_err(Failure::bad)?),
        (None, Some(name)) => Some(
            Losses::load(name)
                .map_err(|error| Failure::BadInput(format!("chance.loss: {error}")))?,
        ),
        (None, None) => None,
    };
    Ok(Question {
        participation: args.chain.drawn(spec),
        draw_interval_s: within("--draw-interval-s", interval, [0.0, 3600.0])?,
        losses,
        noise_hz,
        errors: args.errors.clone(),
        settings: args.chain.settings(spec)?,
    })
}

/// The section of a report about a spec that says how its participation is drawn; nothing for
/// others. The band of losses is examined for these errors beside the spec's.
pub(super) fn section(
    spec: &Spec,
    table: &TableView<'_>,
    errors: &[f64],
) -> Result<Option<Section>, Failure> {
    let chance = &spec.chance;
    let Some(participation) = chance.drawn() else {
        return Ok(None);
    };
    let losses = match &chance.loss {
        Some(name) => Some(Losses::load(name).map_err(Failure::bad)?),
        None => None,
    };
    let question = Question {
        participation: Some(participation),
        draw_interval_s: chance.draw_interval_s.unwrap_or(spec.sampling.period_s),
        losses,
        noise_hz: chance.noise_hz,
        errors: errors.to_vec(),
        settings: chain_args::plain(spec),
    };
    let bar = progress::share("prob");
    let bands = analysis::bands_of(spec, &question);
    let proofs = analysis::proofs(table, spec, &question, &bands, &bar).map_err(failure)?;
    let answer = analysis::answer(table, spec, &question, proofs, &bar).map_err(failure)?;
    let section = prob_figure::section(spec, &table.header(), &question, &answer);
    Ok(Some(section))
}

fn failure(error: AnalysisError) -> Failure {
    match &error {
        AnalysisError::Chain(ClosedLoopError::Interrupted)
        | AnalysisError::Verify(VerifyError::Interrupted)
        | AnalysisError::Table(_) => Failure::No(error.to_string()),
        _ => Failure::bad(error),
    }
}

/// Writes the chain where it is asked for.
fn exported(args: &ProbArgs, spec: &Spec, answer: &Answer) -> Result<(), Failure> {
    if args.drn.is_none() && args.prism.is_none() {
        return Ok(());
    }
    let Some(chain) = &answer.chain else {
        let why = answer
            .no_chain
            .as_deref()
            .unwrap_or("laws by games have one where --participation is given (exact is one)");
        return Err(Failure::BadInput(format!(
            "--drn, --prism: there is no chain; {why}"
        )));
    };
    let fail = |error: std::io::Error| Failure::bad(error);
    if let Some(path) = &args.drn {
        let note = format!(
            "{}: 1 - Pmax=? [F<={} \"failed\"] is the lower bound over {} s",
            spec.name,
            export::steps_there(answer.steps),
            answer.horizon_s
        );
        let mut text = Vec::new();
        export::drn(chain, answer.below.as_ref(), &note, &mut text).map_err(fail)?;
        write_one(path, &text)?;
    }
    if let Some(base) = &args.prism {
        let (mut tra, mut lab) = (Vec::new(), Vec::new());
        export::prism(chain, &mut tra, &mut lab).map_err(fail)?;
        let with = |ending: &str| -> PathBuf {
            let mut name = base.clone().into_os_string();
            name.push(ending);
            name.into()
        };
        for (path, text) in [(with(".tra"), tra), (with(".lab"), lab)] {
            write_one(Path::new(&path), &text)?;
        }
    }
    Ok(())
}

/// Runs of the same process.
fn simulated(
    args: &ProbArgs,
    spec: &Spec,
    table: &TableView<'_>,
    question: &Question,
) -> Result<Option<Runs>, Failure> {
    let Some(runs) = args.runs else {
        return Ok(None);
    };
    if !(1..=RUNS_MAX).contains(&runs) {
        return Err(Failure::BadInput(format!(
            "--runs = {runs}: 1 to {RUNS_MAX} is allowed"
        )));
    }
    if table.header().always_on {
        return Err(Failure::BadInput(
            "--runs: for a response use `simulate SPEC --runs N` or `fleet`".to_owned(),
        ));
    }
    let kind = question.participation.unwrap_or(Participation::Exact);
    let sampled = Sampled::new(table, spec, kind, question.settings.horizon_s);
    let found = sampled.many(runs, args.seed, &|| !progress::interrupted());
    found
        .map(Some)
        .ok_or_else(|| Failure::No("interrupted".to_owned()))
}

/// The answer for people.
fn print(spec: &Spec, answer: &Answer, simulated: Option<&Runs>) {
    output::line(format_args!(
        "{}: P(psi over {} s) >= {:.9}   ({:.2e} may be lost)",
        spec.name,
        answer.horizon_s,
        answer.lower_bound,
        1.0 - answer.lower_bound
    ));
    let mut table = output::table(&["layer", "at least", "how"]);
    let layers = &answer.layers;
    let rows = [
        ("size of the loss", Some(&layers.loss)),
        ("participation", layers.participation.as_ref()),
        ("noise", layers.noise.as_ref()),
    ];
    for (name, layer) in rows {
        if let Some(layer) = layer {
            table.add_row(vec![
                name.to_owned(),
                format!("{:.9}", layer.lower_bound),
                layer.how.replace("; ", ";\n").replace(": a ", ":\na "),
            ]);
        }
    }
    output::line(table);
    if answer.states > 0 {
        output::line(format_args!(
            "chain: {} states, {} transitions, {} steps; sets reach {:.1} mHz in f",
            output::grouped(answer.states),
            output::grouped(answer.transitions),
            answer.steps,
            1e3 * answer.reach_hz.unwrap_or(0.0)
        ));
    }
    if let Some(seconds) = answer.seconds_below_49_5 {
        output::line(format_args!(
            "below 49.5 Hz: at most {seconds:.3} s are expected, a run that may fail counted as all of it"
        ));
    }
    if let Some(cut) = &answer.cut {
        let until = cut.lower_bound.map_or("no time".to_owned(), |bound| {
            format!("{:.1} s: P >= {bound:.9}", cut.until_s)
        });
        output::line(format_args!(
            "cut: {} nodes after {} steps are more than --nodes-max and count as failed; nothing is lost by that over {until}",
            output::grouped(cut.nodes),
            cut.steps
        ));
    }
    output::line(format_args!("most is lost by: {}", answer.dominates));
    if !answer.rates.is_empty() {
        let mut table = output::table(&[
            "leaves, a year",
            "no fleet, at least",
            "at most",
            "fleet, at most",
        ]);
        for rate in &answer.rates {
            table.add_row(vec![
                format!("{:.1} Hz", 50.0 + rate.limit_hz),
                format!("{:.3}", rate.alone_at_least),
                format!("{:.3}", rate.alone_at_most),
                format!("{:.3}", rate.fleet_at_most),
            ]);
        }
        output::line(table);
    }
    if let Some(runs) = simulated {
        output::line(format_args!(
            "simulated: {} of {} runs keep it; at 95 % between {:.6} and {:.6}, at 1 - 1e-6 between {:.6} and {:.6}; lowest f {:.4} Hz, seed {}",
            runs.kept,
            runs.runs,
            runs.interval_95[0],
            runs.interval_95[1],
            runs.interval_1e6[0],
            runs.interval_1e6[1],
            runs.lowest_hz,
            runs.worst_seed
        ));
    }
    for assumption in &answer.assumptions {
        output::line(format_args!("assumed: {assumption}"));
    }
}
