//! From the bytes of a table to the claims of its spec.
//!
//! What the fleet does is read off the table: the law's integers and the hypotheses of the header.
//! What the grid does is the spec's.

use firmware::response::ResponseLaw;
use firmware::table::{Hypotheses, LossProfile as Profile, TableView};
use firmware::units::MICRO;
use model::governor::Governor;
use model::independence::Crowd;
use model::interval::Interval;
use model::plant::Plant;
use model::spec::Spec;
use model::verdict::{Claim, ClaimName, Counts, Method};

use super::cases::{Case, Found};
use super::fallback;
use super::fleet_loop::{Assumed, LossProfile, PlantBand, RealLaw};
use super::meter;
use super::plan::{LOSS_BAND_GW, Summary, examine_all};
use super::time_bands::TimeBands;
use crate::VerifyError;

/// What was found about a response.
#[derive(Debug, Clone, PartialEq)]
pub struct Proof {
    /// The claims of the spec, each with its bound.
    pub claims: Vec<Claim>,
    /// How they were examined.
    pub method: Method,
    /// Sizes of the exploration.
    pub counts: Counts,
}

/// Examines the response of a table against a spec. `go_on` is told how much is done, in \[0, 1\],
/// and may end it.
///
/// # Errors
/// A part of the spec that is not covered, or an end by `go_on`. A claim that fails is a result.
pub fn verify(
    table: &TableView<'_>,
    spec: &Spec,
    go_on: &dyn Fn(f64) -> bool,
) -> Result<Proof, VerifyError> {
    if !go_on(0.0) {
        return Err(VerifyError::Interrupted);
    }
    let mut claims = vec![meter::claim(spec)];
    let Some(law) = table.response() else {
        let reason = "the spec asks for a response, and the table's laws come from games";
        claims.extend(not_examined(spec, reason));
        return Ok(unexamined(claims));
    };
    if !spec.preference.always_on {
        let reason = "the table is a response, and the spec asks for laws by games";
        claims.extend(not_examined(spec, reason));
        return Ok(unexamined(claims));
    }
    let all = case(&law, table, spec);
    if all.plant.known.fleet <= 0.0 || law.droop_gain_ppm_per_hz == 0 {
        claims.extend(not_examined(spec, "the law has no droop"));
        return Ok(unexamined(claims));
    }
    let requirements = &spec.requirements;
    let inner = Interval::hull(requirements.inner_hz[0], requirements.inner_hz[1]);
    let enough = |found: &Found| {
        requirements
            .containment_hz
            .is_none_or(|limit| found.f.low >= limit)
            && found.inside_from_s(inner).is_some()
    };
    // The droop takes about a third of the whole.
    let droop_too = all.assumed.profile == LossProfile::Constant;
    let share = if droop_too { 0.7 } else { 1.0 };
    let summary = examine_all(&all, LOSS_BAND_GW, &enough, &|done| go_on(share * done))
        .ok_or(VerifyError::Interrupted)?;
    let (found, counts) = judged(&summary, spec);
    claims.extend(found);
    if droop_too {
        let go_on = |done| go_on(share + (1.0 - share) * done);
        let claim = fallback::claim(&all, table.header().droop, &go_on);
        claims.push(claim.ok_or(VerifyError::Interrupted)?);
    }
    Ok(Proof {
        claims,
        method: Method::FleetBounds,
        counts,
    })
}

fn unexamined(claims: Vec<Claim>) -> Proof {
    Proof {
        claims,
        method: Method::NotExplored,
        counts: Counts::default(),
    }
}

/// Parts per million as a share.
fn share(ppm: u32) -> f64 {
    f64::from(ppm) / f64::from(MICRO)
}

fn micro(value: impl Into<f64>) -> f64 {
    value.into() / f64::from(MICRO)
}

fn band<T: Into<f64> + Copy>(ends: [T; 2]) -> Interval {
    Interval::hull(micro(ends[0]), micro(ends[1]))
}

/// The law in real numbers.
fn real_law(law: &ResponseLaw, tick_s: f64, tick_most_s: f64) -> RealLaw {
    RealLaw {
        droop: share(law.droop_gain_ppm_per_hz),
        setpoint_hz: micro(law.setpoint_uhz),
        slope: share(law.slope_gain_ppm_s_per_hz),
        slope_threshold_hz_per_s: micro(law.slope_threshold_uhz_per_s),
        slope_window_s: f64::from(law.window_ticks) * tick_s,
        slope_most: share(law.slope_most_ppm),
        release_per_s: share(law.release_ppm) / tick_s,
        release_least_per_s: share(law.release_ppm) / tick_most_s.max(tick_s),
        smallest_change: share(law.smallest_change_ppm),
        // A slope below 1 µHz/s, a slope response below 1 ppm, a target below 1 ppm.
        rounding: share(law.slope_gain_ppm_s_per_hz) * 1e-6 + 3e-6,
    }
}

/// The case of a table and a spec, before it is cut into bands: for bounds under other assumptions
/// than the header's.
///
/// # Errors
/// A table that is no response.
pub fn case_of(table: &TableView<'_>, spec: &Spec) -> Result<Case, VerifyError> {
    let law = table.response().ok_or(VerifyError::Unsupported {
        key: "table",
        found: "laws by games".to_owned(),
        remedy: "a response is",
    })?;
    Ok(case(&law, table, spec))
}

/// What the table assumes and the spec's grid.
fn case(law: &ResponseLaw, table: &TableView<'_>, spec: &Spec) -> Case {
    let header = table.header();
    let assumed: &Hypotheses = &header.hypotheses;
    let ms = |ms: u16| f64::from(ms) / 1000.0;
    let [lag_least, lag_most] = assumed.meter_lag_ms.map(ms);
    let [delay_least, delay_most] = assumed.actuation_delay_ms.map(ms);
    let tick_s = ms(header.tick_ms);
    let tick_most_s = ms(assumed.tick_most_ms);
    let initial = &spec.uncertainty.initial;
    let longer = (tick_most_s - tick_s).max(0.0) * f64::from(law.window_ticks);
    let loss = band(assumed.loss_kw);
    let known = Plant {
        fleet: micro(header.plant.fleet_kw),
        ..Plant::new(spec)
    };
    Case {
        plant: PlantBand {
            known,
            inertia: band(assumed.inertia_kw_s_per_hz),
            governor_gain: band(assumed.governor_gain_kw_per_hz),
            damping: band(assumed.damping_kw_per_hz),
            times: TimeBands::of(spec),
            governor: Governor::of(spec),
        },
        law: real_law(law, tick_s, tick_most_s),
        assumed: Assumed {
            // The lag is half the meter's window and the age: a reading is f at some moment of its
            // window.
            late_least_s: delay_least,
            late_most_s: lag_least + lag_most + delay_most + tick_most_s,
            tick_s: tick_most_s,
            // A micro-hertz for the floor to micro-units, and what the steps' edges are rounded by.
            reading_hz: micro(assumed.estimate_error[0]) + 1.001e-6,
            age_spread_s: lag_least + lag_most,
            slope_jitter_s: lag_most - lag_least + longer,
            participation: share(assumed.participation_relative_ppm),
            participation_absolute: share(assumed.participation_absolute_ppm),
            hostile_share: spec.uncertainty.hostile(),
            mean_step_share: spec.uncertainty.mean_step_share(),
            loss,
            profile: match assumed.loss_profile {
                Profile::Constant => LossProfile::Constant,
                Profile::NonDecreasing => LossProfile::NonDecreasing,
                Profile::Band => LossProfile::Band,
            },
            initial: std::array::from_fn(|axis| {
                initial.lower[axis]
                    .abs()
                    .max(initial.upper[axis].abs())
                    .next_up()
            }),
        },
        last: loss,
    }
}

/// The claims that need no exploration of a response to be named.
fn not_examined(spec: &Spec, reason: &str) -> Vec<Claim> {
    statements(spec)
        .into_iter()
        .map(|statement| Claim {
            holds: false,
            reason: Some(format!("not examined: {reason}")),
            ..statement
        })
        .collect()
}

/// How certain the claims are: they hold always, or for as long as the mean of chargers that err
/// independently is within what is assumed.
fn certainty(spec: &Spec) -> String {
    let confidence = spec.uncertainty.participation_confidence;
    match (confidence, spec.requirements.horizon_s) {
        (Some(confidence), Some(time_s)) => format!(
            ", with a probability of {confidence} over {time_s} s for {} chargers that err \
             independently",
            Crowd::of(spec, time_s).chargers
        ),
        _ => String::new(),
    }
}

/// The claims, without an answer.
fn statements(spec: &Spec) -> Vec<Claim> {
    let requirements = &spec.requirements;
    let certainty = certainty(spec);
    let [low, high] = requirements.inner_hz;
    let within_s = requirements.settle_within_s;
    let claim = |name, limit, unit: &'static str, statement| Claim {
        name,
        holds: false,
        bound: None,
        limit,
        unit: unit.into(),
        statement: format!("{statement}{certainty}"),
        reason: None,
    };
    let mut claims = vec![
        claim(
            ClaimName::Containment,
            requirements.containment_hz,
            "Hz",
            match requirements.containment_hz {
                Some(limit) => {
                    format!("f >= {limit} Hz for ever, between samples too, whole fleet")
                }
                None => "f has a lower bound for ever, between samples too".to_owned(),
            },
        ),
        claim(
            ClaimName::Settle,
            Some(within_s),
            "s",
            format!("{low} <= f <= {high} Hz for good within {within_s} s of the last loss"),
        ),
    ];
    if requirements.stay {
        claims.push(claim(
            ClaimName::Stay,
            Some(low),
            "Hz",
            format!("from then on {low} <= f <= {high} Hz for ever, between samples too"),
        ));
    }
    claims
}

/// How a case is named in a reason.
fn named(case: &Case) -> String {
    let mut name = format!("loss {:.3} to {:.3} GW", case.last.low, case.last.high);
    let plant = &case.plant;
    for (what, range) in [
        ("H", plant.inertia),
        ("K", plant.governor_gain),
        ("D", plant.damping),
        ("T_G", plant.times.governor),
        ("T_t", plant.times.turbine),
        ("T_1", plant.times.lead),
        ("T_2", plant.times.lag),
    ] {
        if range.low < range.high {
            name.push_str(&format!(", {what} {:.3} to {:.3}", range.low, range.high));
        }
    }
    name
}

/// The claims with their answers.
pub(super) fn judged(summary: &Summary, spec: &Spec) -> (Vec<Claim>, Counts) {
    let requirements = &spec.requirements;
    let inner = Interval::hull(requirements.inner_hz[0], requirements.inner_hz[1]);
    let open = summary
        .found
        .iter()
        .find(|(_, found)| found.as_ref().is_none_or(|found| found.for_ever.is_none()));
    let known: Vec<(&Case, &Found)> = summary
        .found
        .iter()
        .filter_map(|(case, found)| found.as_ref().map(|found| (case, found)))
        .collect();
    let lowest = known
        .iter()
        .min_by(|a, b| a.1.f.low.total_cmp(&b.1.f.low))
        .copied();
    let highest = known.iter().map(|(_, found)| found.f.high).reduce(f64::max);
    let for_ever = known
        .iter()
        .filter_map(|(_, found)| found.for_ever)
        .reduce(Interval::join);
    let latest = known
        .iter()
        .map(|(case, found)| (*case, found.inside_from_s(inner)))
        .max_by(|a, b| {
            let time = |t: Option<f64>| t.unwrap_or(f64::INFINITY);
            time(a.1).total_cmp(&time(b.1))
        });
    let no_bounds =
        open.map(|(case, _)| format!("no bounds that hold for ever were found: {}", named(case)));
    let claims = statements(spec)
        .into_iter()
        .map(|claim| {
            let (bound, reason) = match claim.name {
                ClaimName::Containment => {
                    let low = lowest.map(|(_, found)| found.f.low);
                    let broken = lowest
                        .filter(|(_, found)| claim.limit.is_some_and(|limit| found.f.low < limit));
                    let reason = broken.map(|(case, found)| {
                        format!("f >= {:.4} Hz is proven: {}", found.f.low, named(case))
                    });
                    (low, reason)
                }
                ClaimName::Settle => {
                    let time = latest.and_then(|(_, time)| time);
                    let reason = latest.and_then(|(case, time)| match (time, claim.limit) {
                        (None, _) => Some(format!("not for good in I2: {}", named(case))),
                        (Some(s), Some(limit)) if s > limit => {
                            Some(format!("it may take {s:.1} s: {}", named(case)))
                        }
                        _ => None,
                    });
                    (time, reason)
                }
                _ => {
                    let outside = known.iter().find(|(_, found)| {
                        found
                            .for_ever
                            .is_some_and(|f| f.low < inner.low || f.high > inner.high)
                    });
                    let reason = outside.map(|(case, found)| {
                        let f = found.for_ever.unwrap_or(found.f);
                        format!(
                            "f in [{:.4}, {:.4}] Hz for ever: {}",
                            f.low,
                            f.high,
                            named(case)
                        )
                    });
                    (for_ever.map(|f| f.low), reason)
                }
            };
            let reason = no_bounds.clone().or(reason);
            Claim {
                holds: reason.is_none() && bound.is_some(),
                bound,
                reason,
                ..claim
            }
        })
        .collect();
    let counts = Counts {
        sets: summary.found.len() as u64,
        event_to_inner_s: latest.and_then(|(_, time)| time),
        held_hz: for_ever.map(|f| [f.low, f.high]),
        highest_hz: highest,
        ..Counts::default()
    };
    (claims, counts)
}
