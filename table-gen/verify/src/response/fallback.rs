//! The claim `fallback`: the droop alone, should no charger ever use its table.
//!
//! The droop of the header is a law of the same kind: a straight line in the reading between 0 and
//! the whole fleet, without a slope response and without steps. So the same proof follows it, for
//! the same fleet of clocks, meters and delays. What is asked of it is what the operator asks for
//! an infrequent infeed loss, 1.8 GW: f stays above 49.2 Hz.

use firmware::droop::Droop;
use firmware::units::MICRO;
use model::verdict::{Claim, ClaimName};

use super::cases::{Case, Found};
use super::fleet_loop::RealLaw;
use super::plan::{Summary, examine_all};

/// Lowest deviation after an infrequent loss \[Hz\].
const LOWEST_HZ: f64 = -0.8;
/// The infrequent loss \[GW\].
const INFREQUENT_GW: f64 = 1.8;
/// Width of a band of the loss \[GW\]: wide, for there is room to spare.
const LOSS_BAND_GW: f64 = 0.1;

/// The droop as a law.
fn law(droop: Droop, of: RealLaw) -> RealLaw {
    let hz = |uhz: u32| f64::from(uhz) / f64::from(MICRO);
    RealLaw {
        droop: 1.0 / hz(droop.full_uhz),
        setpoint_hz: -hz(droop.deadband_uhz),
        slope: 0.0,
        slope_most: 0.0,
        smallest_change: 0.0,
        // A target below 1 ppm.
        rounding: 1e-6,
        ..of
    }
}

/// The claim, for losses that are constant. `go_on` is told the share that is done and may end it:
/// then nothing comes back.
pub(super) fn claim(all: &Case, droop: Droop, go_on: &dyn Fn(f64) -> bool) -> Option<Claim> {
    let all = Case {
        law: law(droop, all.law),
        ..*all
    };
    let summary = if droop.full_uhz == 0 {
        Summary { found: Vec::new() }
    } else {
        examine_all(&all, LOSS_BAND_GW, &contained, go_on)?
    };
    let up_to_gw = up_to_gw(&summary);
    let wanted_gw = all.assumed.loss.high.min(INFREQUENT_GW);
    let reason = match up_to_gw {
        Some(gw) if gw >= wanted_gw => None,
        Some(gw) => Some(format!("proven up to {gw:.3} GW")),
        None => Some("proven for no loss".to_owned()),
    };
    Some(Claim {
        name: ClaimName::Fallback,
        holds: reason.is_none(),
        bound: up_to_gw,
        limit: Some(wanted_gw),
        unit: "GW".into(),
        statement: format!(
            "with the droop alone, f >= {LOWEST_HZ} Hz for ever, for every loss up to so many GW"
        ),
        reason,
    })
}

fn contained(found: &Found) -> bool {
    found.f.low >= LOWEST_HZ && found.for_ever.is_some()
}

/// Largest loss below which every case is contained.
fn up_to_gw(summary: &Summary) -> Option<f64> {
    let good = |found: &Option<Found>| found.as_ref().is_some_and(contained);
    let lost = summary.found.iter().filter(|(_, found)| !good(found));
    let highest = summary.found.iter().map(|(case, _)| case.last.high);
    let highest = highest.reduce(f64::max)?;
    let lowest = summary.found.iter().map(|(case, _)| case.last.low);
    let lowest = lowest.reduce(f64::min)?;
    match lost.map(|(case, _)| case.last.low).reduce(f64::min) {
        None => Some(highest),
        Some(first) if first > lowest => Some(first),
        Some(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::response::testing;
    use model::interval::Interval;

    fn bands(lows: &[f64]) -> Summary {
        let case = Case {
            plant: testing::plant(),
            law: testing::law(),
            assumed: testing::assumed(),
            last: Interval::hull(0.0, 1.0),
        };
        let found = |low| {
            let f = Interval { low, high: 0.0 };
            Found {
                f,
                for_ever: Some(f),
                tube: Vec::new(),
                step_s: 0.05,
            }
        };
        let each = lows.iter().enumerate().map(|(n, low)| {
            let mut case = case;
            case.last = Interval::hull(n as f64, n as f64 + 1.0);
            (case, Some(found(*low)))
        });
        Summary {
            found: each.collect(),
        }
    }

    #[test]
    fn up_to_the_first_band_that_is_not_contained() {
        assert_eq!(up_to_gw(&bands(&[-0.1, -0.8])), Some(2.0));
        assert_eq!(up_to_gw(&bands(&[-0.1, -0.81, -0.2])), Some(1.0));
        assert_eq!(up_to_gw(&bands(&[-0.9, -0.1])), None);
        assert_eq!(up_to_gw(&bands(&[])), None);
    }
}
