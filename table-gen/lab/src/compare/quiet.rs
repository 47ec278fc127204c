//! The claim `quiet` as a monitor sees it: how often a charger's command changed in the runs.
//!
//! A run begins with the loss. What is counted over a run of at most 300 s is counted within 300 s;
//! over a longer run it is at least what any 300 s of it hold. It says what was seen in these runs
//! and proves nothing of others.

use model::spec::Spec;
use model::verdict::{Claim, ClaimName};

use super::{CompareConfig, Controller, Scorecard};

/// The claim, for the table of a scorecard; its limit is the spec's, or none.
pub fn claim(spec: &Spec, config: &CompareConfig, scorecard: &Scorecard) -> Claim {
    let of_table = |row: &&super::Row| row.controller == Controller::Table;
    let worst = scorecard
        .rows
        .iter()
        .filter(of_table)
        .max_by_key(|row| row.outcome.changes_most);
    let runs = scorecard.rows.iter().filter(of_table).count();
    let limit = spec.requirements.changes_per_300_s;
    let most = worst.map(|row| f64::from(row.outcome.changes_most));
    let passed = most.zip(limit).is_some_and(|(most, limit)| most > limit);
    Claim {
        name: ClaimName::Quiet,
        holds: most.is_some() && !passed,
        bound: most,
        limit,
        unit: "changes".into(),
        statement: format!(
            "monitored, not proven: in {runs} runs of {} s no charger of {} changed its command \
             oftener by 5 % and more",
            config.duration_s, config.chargers.number
        ),
        reason: worst.filter(|_| passed).map(|row| {
            format!(
                "{} changes at a loss of {:.1} GW and {}",
                row.outcome.changes_most, row.loss_gw, row.plant
            )
        }),
    }
}

/// The claim in one sentence.
pub fn sentence(claim: &Claim) -> String {
    let most = claim.bound.unwrap_or(0.0);
    let verdict = match (claim.limit, claim.holds) {
        (None, _) => "quiet".to_owned(),
        (Some(limit), true) => format!("quiet (at most {limit} wanted)"),
        (Some(limit), false) => format!("NOT QUIET (at most {limit} wanted)"),
    };
    format!(
        "{verdict}: at most {most} changes of a charger; {}",
        claim.statement
    )
}
