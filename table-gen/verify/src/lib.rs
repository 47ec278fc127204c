//! The independent verifier: bytes of a table and a spec in, a verdict out.
//!
//! The closed loop of plant, firmware and table is explored forward from every state in which the
//! event may find the grid. Quantiser, lookup and phase machine are the firmware's own; of
//! synthesis and compression nothing is reachable from this package. Every rounding goes outward,
//! so a claim that holds here holds for the real numbers.
//!
//! | step | module |
//! |---|---|
//! | plant, clocks and uncertainty of the closed loop | `closed_loop` |
//! | a stretch of time with a held input, and the frequency within it | `held_input` |
//! | what the state that is decided on says of the real one | `estimate_error` |
//! | the same where commands act late | `delayed_loop` |
//! | the same for whoever knows what was delivered | `prediction_error` |
//! | a period whose first part is under two commands | `changeover` |
//! | tight sets of states | `zonotope` |
//! | the states on which the phase machine decides alike | `regions` |
//! | the event at an unknown moment of a tick | `first_tick` |
//! | tables without Hold: tight sets in time, over the horizon | `tight_sets` |
//! | tables with Hold: No control by tight sets | `no_control` |
//! | then whole cells for ever | `closed_cells` |
//! | the worst number of periods | `longest_path` |
//! | claims | `claims` |
//! | tables that are a response: always on, no laws | `response` |
//!
//! # What is claimed
//! The event finds the grid in a state of `uncertainty.initial` and the firmware in No control, at
//! any moment between two ticks. From then on loss, delivered participation and the estimate's
//! error vary within their bounds as an adversary likes, the loss and the participation
//! continuously in time.
//!
//! Whether I1 and I2 were left or reached is what the firmware measures at its ticks. Where
//! commands act with a delay, it is what the firmware predicts there for the moment at which its
//! command begins to act, and times end at that moment; bounds of f are always those of the real f.
//!
//! # From a spec to a proof
//! ```
//! use model::spec::Spec;
//! use synth::game::unwatched;
//! use synth::pipeline::{self, Encoding};
//! use synth::synthesis;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let spec = Spec::load("paper-bi", &[])?;
//! let laws = synthesis::synthesise(&spec, &unwatched)?;
//! assert_eq!(laws.c1.solution.winning, 1_042_103);
//!
//! // What goes into flash, and what is judged: not one bit of the laws but these bytes.
//! let table = pipeline::emit(&laws, Encoding::default(), &unwatched)?;
//! let verdict = verify::verify(&table.bytes, &spec, &|_| true)?;
//! assert!(verdict.verified);
//! # Ok(())
//! # }
//! ```

mod cellset;
mod chain_times;
mod changeover;
mod claims;
mod closed_cells;
mod closed_loop;
mod delayed_loop;
mod dispatch;
mod drive;
mod error;
mod estimate_error;
mod first_tick;
mod header;
mod longest_path;

mod held_input;
mod image;
mod no_control;
mod outcome;
mod path;
mod plant_band;
mod prediction_error;
mod quiet;
mod regions;
pub mod response;
mod successor;
#[cfg(test)]
mod tests;
mod tight_sets;
mod zonotope;

pub use error::VerifyError;
pub use prediction_error::{PredictionError, prediction_error};

use model::hex::hex;
use model::plant_bands::PlantBands;
use model::verdict::{Claim, ClaimName, Counterexample, Counts, Method, Verdict};

use firmware::table::TableView;
use sha2::{Digest, Sha256};

use claims::Findings;
use model::spec::Spec;
use outcome::{Outcome, Violation};
use regions::Regions;

/// Horizon \[s\] over which a table without Hold is explored where the spec asks for ever: it
/// cannot be proven then, but a violation can be found.
const OPEN_HORIZON_S: f64 = 300.0;

/// Examines a table against a spec. `go_on` is told how much is done, in \[0, 1\] and roughly, and
/// may end it.
///
/// # Errors
/// A table that the firmware rejects, a spec that is not covered, or an end by `go_on`. A claim
/// that fails is a result.
pub fn verify(
    bytes: &[u8],
    spec: &Spec,
    go_on: &dyn Fn(f64) -> bool,
) -> Result<Verdict, VerifyError> {
    verify_assuming(bytes, spec, spec, go_on)
}

/// The same against a fleet that is worse than the one that the table was made for: `assumed` is
/// the spec but for `uncertainty.hostile_share`, which is no number of the table. The claim
/// `header` is about the spec, all others about what is assumed.
///
/// # Errors
/// As for [`verify`], and where another key differs.
pub fn verify_assuming(
    bytes: &[u8],
    made_for: &Spec,
    assumed: &Spec,
    go_on: &dyn Fn(f64) -> bool,
) -> Result<Verdict, VerifyError> {
    let mut same = assumed.clone();
    same.uncertainty.hostile_share = made_for.uncertainty.hostile_share;
    if same != *made_for {
        return Err(VerifyError::Unsupported {
            key: "another key than uncertainty.hostile_share",
            found: "other values than the table was made for".to_owned(),
            remedy: "a table for those values is",
        });
    }
    let table = TableView::parse(bytes).map_err(VerifyError::Table)?;
    if table.header().always_on || assumed.preference.always_on {
        return of_response(&table, made_for, assumed, go_on);
    }
    let spec = assumed;
    let header = table.header();
    let model = delayed_loop::closed_loop(&table, spec);
    let regions = Regions::new(&header, model.error);
    let [first, real, from] = [model.known.first, model.known.real, model.known.before]
        .map(|error| Regions::new(&header, error));
    let settle_ticks = (spec.requirements.settle_within_s / model.tick_s).floor() as u32;
    let [low, high] = spec.requirements.inner_hz;
    let inner = closed_loop::micro(low).join(closed_loop::micro(high));
    let mut counts = Counts::default();
    let (mut tally, reachable_cells, method, scope) = if let Some(limit) = &model.known.limit {
        let tally = Outcome {
            limit: Some(limit.clone()),
            ..Outcome::default()
        };
        (tally, 0, Method::NotExplored, String::new())
    } else if header.stay {
        let job = closed_cells::ClosedCells {
            table: &table,
            model: &model,
            real: &real,
            from: &from,
            inner,
        };
        let watching = no_control::NoControl {
            table: &table,
            model: &model,
            regions: &regions,
            first: &first,
        };
        let (tally, cells) =
            for_ever(&job, &watching, &mut counts, go_on).ok_or(VerifyError::Interrupted)?;
        (tally, cells, Method::ClosedSet, String::new())
    } else {
        let horizon_s = spec.requirements.horizon_s;
        let ticks = (horizon_s.unwrap_or(OPEN_HORIZON_S) / model.tick_s).ceil() as u32;
        let explored = tight_sets::TightSets::new(&table, &model, [&regions, &real], settle_ticks)
            .run(ticks, go_on)
            .ok_or(VerifyError::Interrupted)?;
        let mut tally = explored.tally;
        let scope = match horizon_s {
            Some(s) => format!(" over {s} s from the event"),
            None => {
                tally.limit.get_or_insert_with(|| {
                    "for ever cannot be proven without Hold: set requirements.stay or requirements.horizon_s".to_owned()
                });
                String::new()
            }
        };
        tally.settle_ticks = tally.settle_ticks.max(explored.open_ticks);
        counts.sets = explored.nodes;
        let first = f64::from(tally.event_ticks) * model.tick_s;
        counts.event_to_inner_s = (tally.event_ticks > 0).then_some(first);
        (tally, explored.cells, Method::TightSets, scope)
    };
    if let Some(premise) = &model.plant_band
        && let (Some(low), Some(high)) = (tally.lowest, tally.highest)
        && let Some(reason) = premise.reason([low, high])
    {
        tally.limit.get_or_insert(reason);
        counts.event_to_inner_s = None;
    }
    counts.lookups = tally.lookups;
    counts.held_hz = tally.held.map(|range| [range.low / 1e6, range.high / 1e6]);
    counts.highest_hz = tally.highest.map(|f| f / 1e6);
    let claims = Findings {
        table: &table,
        made_for,
        spec,
        model: &model,
        tally: &tally,
        scope,
    }
    .claims();
    let failures = failures(&tally, model.tick_s);
    Ok(Verdict {
        verified: claims.iter().all(|claim| claim.holds),
        spec: spec.name.clone(),
        claims,
        reachable_cells,
        counterexample: failures.first().cloned(),
        hostile_share: spec.uncertainty.hostile_share,
        plant: PlantBands::of(spec).words(),
        spec_hash: hex(&made_for.hash()),
        table_spec_hash: hex(&header.spec_hash),
        table_sha256: hex(&Sha256::digest(bytes)),
        table_bytes: bytes.len(),
        method,
        counts,
        tool_version: env!("CARGO_PKG_VERSION").to_owned(),
        failures,
    })
}

/// The same for a response and a loss in stages, which takes the place of the spec's loss.
///
/// # Errors
/// As for [`verify`], and where table or spec is no response.
pub fn verify_staged(
    bytes: &[u8],
    spec: &Spec,
    stages: &[response::LossStage],
    go_on: &dyn Fn(f64) -> bool,
) -> Result<Verdict, VerifyError> {
    let table = TableView::parse(bytes).map_err(VerifyError::Table)?;
    if !spec.preference.always_on {
        return Err(VerifyError::Unsupported {
            key: "preference.always_on",
            found: "laws by games".to_owned(),
            remedy: "a response is",
        });
    }
    if let Some(lost) = spec.uncertainty.inertia_lost_s_per_hz {
        return Err(VerifyError::Unsupported {
            key: "uncertainty.inertia_lost_s_per_hz",
            found: format!("{lost}, beside a loss in stages"),
            remedy: "one H during the event is",
        });
    }
    let proof = response::verify_staged(&table, spec, stages, go_on)?;
    Ok(verdict_of_response(&table, spec, spec, proof))
}

/// The claim that a table is the one that the spec asks for and that the device can use it, alone:
/// nothing is explored. A verdict is not "verified" where it fails.
///
/// # Errors
/// A table that the firmware rejects.
pub fn header_claim(bytes: &[u8], spec: &Spec) -> Result<Claim, VerifyError> {
    let table = TableView::parse(bytes).map_err(VerifyError::Table)?;
    Ok(claims::header(&table, spec))
}

/// The verdict on a response, or on a table for a spec that asks for one.
fn of_response(
    table: &TableView<'_>,
    made_for: &Spec,
    spec: &Spec,
    go_on: &dyn Fn(f64) -> bool,
) -> Result<Verdict, VerifyError> {
    let proof = response::verify(table, spec, go_on)?;
    Ok(verdict_of_response(table, made_for, spec, proof))
}

/// The verdict with what was found of f.
fn verdict_of_response(
    table: &TableView<'_>,
    made_for: &Spec,
    spec: &Spec,
    proof: response::Proof,
) -> Verdict {
    let header = table.header();
    let mut claims = vec![claims::header(table, made_for)];
    claims.push(dispatch::claim(spec));
    claims.extend(image::claim(table, spec));
    claims.extend(proof.claims);
    claims.extend(quiet::claim(table, spec));
    Verdict {
        verified: claims.iter().all(|claim| claim.holds),
        spec: spec.name.clone(),
        claims,
        reachable_cells: 0,
        counterexample: None,
        hostile_share: spec.uncertainty.hostile_share,
        plant: PlantBands::of(spec).words(),
        spec_hash: hex(&made_for.hash()),
        table_spec_hash: hex(&header.spec_hash),
        table_sha256: hex(&Sha256::digest(table.bytes())),
        table_bytes: table.bytes().len(),
        method: proof.method,
        counts: proof.counts,
        tool_version: env!("CARGO_PKG_VERSION").to_owned(),
        failures: Vec::new(),
    }
}

/// No control by tight sets, then the closed set of cells.
fn for_ever(
    job: &closed_cells::ClosedCells<'_>,
    watching: &no_control::NoControl<'_>,
    counts: &mut Counts,
    go_on: &dyn Fn(f64) -> bool,
) -> Option<(Outcome, u64)> {
    let mut tally = Outcome::default();
    let watched = watching.watch(&mut tally);
    counts.sets = watched.traces.len() as u64;
    counts.first_cells = watched.seeds.len() as u64;
    let seeds: Vec<u32> = watched.seeds.keys().copied().collect();
    let seed_path = |cell: u32| match watched.seeds.get(&cell) {
        Some(trace) => watched.traces.path(*trace),
        None => Vec::new(),
    };
    let cells = job.run(seeds, &seed_path, &mut tally, go_on)?;
    // From the last tick inside I1 to the first decision, then the periods, then until Hold's first
    // command acts.
    let settle = 1 + tally.periods * job.model.period_ticks + job.model.delay_ticks();
    tally.settle_ticks = settle;
    if let Some(last) = watched.last_tick
        && tally.limit.is_none()
        && !tally.violations.contains_key(&Violation::Late)
    {
        // The first tick comes up to a tick after the event.
        let ticks = last + tally.settle_ticks;
        counts.event_to_inner_s = Some(f64::from(ticks) * job.model.tick_s);
    }
    Some((tally, cells))
}

/// The first failure of each kind, as sets.
fn failures(tally: &Outcome, tick_s: f64) -> Vec<Counterexample> {
    let violations = tally.violations.iter();
    violations
        .map(|(kind, found)| Counterexample {
            claim: match kind {
                Violation::Containment => ClaimName::Containment,
                Violation::Late => ClaimName::Settle,
                Violation::Left => ClaimName::Stay,
                Violation::Handover => ClaimName::HandOver,
                Violation::Uncovered | Violation::Visits => ClaimName::Table,
            },
            what: found.what.clone(),
            path: found.path.iter().map(|step| step.shown(tick_s)).collect(),
            real: None,
        })
        .collect()
}
