//! Which tables and specs the chain covers.

use firmware::table::TableView;
use model::spec::Spec;

use super::error::ClosedLoopError;

/// What the chain covers.
pub(super) fn covered(table: &TableView<'_>, spec: &Spec) -> Result<(), ClosedLoopError> {
    let header = table.header();
    let unsupported = |what: &str, remedy| {
        Err(ClosedLoopError::Unsupported {
            what: what.to_owned(),
            remedy,
        })
    };
    if header.always_on {
        return unsupported("a response", "its errors are bounded by a union of draws");
    }
    if header.stay != spec.requirements.stay {
        return unsupported(
            "a table with Hold for a spec without, or the other way round",
            "requirements.stay as the table has it is",
        );
    }
    let most_ms = spec.uncertainty.actuation_delay_s.most_s() * 1e3 - 1e-6;
    if most_ms > f64::from(u32::from(header.tick_ms) * u32::from(header.period_ticks))
        || header.delay_ticks > header.period_ticks
    {
        return unsupported(
            "commands that act more than a period late",
            "uncertainty.actuation_delay_s of at most sampling.period_s, or a range below it, is",
        );
    }
    if spec.uncertainty.own_clocks {
        return unsupported(
            "chargers with own clocks",
            "uncertainty.own_clocks = false is",
        );
    }
    if spec.has_plant_band() || spec.has_time_constant_band() {
        return unsupported("a plant known in bands", "one plant is");
    }
    if spec.uncertainty.participation > 0.0 || spec.uncertainty.participation_absolute > 0.0 {
        return unsupported(
            "a participation error in the spec beside the one that is drawn",
            "uncertainty.participation = 0 is",
        );
    }
    if spec.uncertainty.hostile() > 0.0 {
        return unsupported(
            "a hostile share (uncertainty.hostile_share)",
            "a fleet without one is",
        );
    }
    Ok(())
}
