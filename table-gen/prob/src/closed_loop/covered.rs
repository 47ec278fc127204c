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
    // Ages of excursions are counted in 16 bits, and grow by a period past the time to settle; what
    // is found at once is only there a tick and the delay later.
    let tick_s = f64::from(header.tick_ms) / 1000.0;
    let settle_ticks = spec.requirements.settle_within_s / tick_s;
    let least = f64::from(header.delay_ticks) + 1.0;
    let most = f64::from(u16::MAX) - 2.0 * f64::from(header.period_ticks) - least;
    if !(least..=most).contains(&settle_ticks) {
        return unsupported(
            &format!("a time to settle of {settle_ticks} watch ticks"),
            "requirements.settle_within_s from the delay and a tick up to 65,535 ticks less two periods and the delay is",
        );
    }
    if spec.uncertainty.own_clocks {
        return unsupported(
            "chargers with own clocks",
            "uncertainty.own_clocks = false is",
        );
    }
    if spec.has_plant_band() {
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
