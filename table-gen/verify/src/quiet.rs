//! The claim `quiet`: how often a charger's command may change by 5 % and more in any 300 s.
//!
//! # Derivation
//! A command changes where something is decided and nowhere else. A response decides once in a
//! tick. Laws by games decide once in a period: C1, C2 and Hold hold their command for a period,
//! No control commands nothing and Fixed leaves the command as it is, and what follows on Fixed
//! began at least a period after the last decision. So the changes are at least a tick, or a
//! period, apart, by the charger's own clock, and a closed stretch of T holds at most `floor(T /
//! distance) + 1` of them, of any size.
//!
//! For a response that is far above what fleets do, and no proof can give a number that is near it:
//! the proof allows the delivery to swing within its bounds at all times, and a fleet whose
//! delivery swings by 10 % every two seconds makes its chargers change hundreds of times
//! (`table-gen/lab/tests/quiet.rs`). What fleets do in runs is the monitored claim of `compare`.

use firmware::table::{Header, TableView};
use model::spec::Spec;
use model::verdict::{Claim, ClaimName};

/// The time that the claim is about \[ms\].
const SPAN_MS: u64 = 300_000;

/// The claim, where the spec makes it.
pub(super) fn claim(table: &TableView<'_>, spec: &Spec) -> Option<Claim> {
    let limit = spec.requirements.changes_per_300_s?;
    let most = changes_most(&table.header()) as f64;
    let reason = (most > limit).then(|| {
        format!("{most} is what the proof gives; `compare` counts the changes of runs, and proves nothing")
    });
    Some(Claim {
        name: ClaimName::Quiet,
        holds: reason.is_none(),
        bound: Some(most),
        limit: Some(limit),
        unit: "changes".into(),
        statement:
            "a charger's command changes at most so often by 5 % and more in any 300 s of its \
                    clock, proven from the times between decisions"
                .to_owned(),
        reason,
    })
}

/// Most changes of a command in a closed stretch of [`SPAN_MS`].
fn changes_most(header: &Header) -> u64 {
    SPAN_MS / apart_ms(header).max(1) + 1
}

/// Least time between two changes of a command \[ms\].
fn apart_ms(header: &Header) -> u64 {
    let ticks = if header.always_on {
        1
    } else {
        header.period_ticks
    };
    u64::from(header.tick_ms) * u64::from(ticks)
}
