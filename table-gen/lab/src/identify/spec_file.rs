//! A spec that other commands take: another one with the identified plant in it.

use std::fmt::Write as _;

use super::parameters::{
    DAMPING, DEADBAND, GAIN, GOVERNOR_TIME, INERTIA, LAG_TIME, LEAD_TIME, RATE, TURBINE_TIME, UPPER,
};
use super::{Estimate, Identified};
use model::spec::{GovernorSpec, PlantSpec, Spec, SpecError};

/// Digits that a spec needs: far finer than any interval.
fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

/// The spec with the best plant. Limits that the fit does not need are left out. With `bands` the
/// intervals of inertia, gain and damping become what is unknown to the chargers.
///
/// # Errors
/// A plant, or bands, that do not go with the rest of the spec.
pub fn spec(base: &Spec, found: &Identified, bands: bool) -> Result<Spec, SpecError> {
    let value = |index: usize| rounded(found.best[index]);
    let limit = |needed: bool, index: usize| needed.then(|| value(index));
    let [deadband, rate, upper] = found.needed;
    let mut spec = base.clone();
    spec.name = format!("{}-identified", base.name);
    spec.name.truncate(64);
    spec.plant = PlantSpec {
        governor_gain_gw_per_hz: value(GAIN),
        governor_time_s: value(GOVERNOR_TIME),
        turbine_time_s: value(TURBINE_TIME),
        lead_time_s: value(LEAD_TIME),
        lag_time_s: value(LAG_TIME),
        damping_gw_per_hz: value(DAMPING),
        inertia_gw_s_per_hz: value(INERTIA),
        governor: GovernorSpec {
            deadband_hz: limit(deadband, DEADBAND),
            rate_gw_per_s: limit(rate, RATE),
            lower_gw: None,
            upper_gw: limit(upper, UPPER),
        },
    };
    if bands {
        let band = |index: usize| {
            let it: &Estimate = &found.parameters[index];
            Some([rounded(it.low), rounded(it.high)])
        };
        spec.uncertainty.inertia_gw_s_per_hz = band(INERTIA);
        spec.uncertainty.governor_gain_gw_per_hz = band(GAIN);
        spec.uncertainty.damping_gw_per_hz = band(DAMPING);
    }
    spec.validate("the identified spec")?;
    Ok(spec)
}

/// The intervals as comments, then the spec as TOML.
///
/// # Errors
/// A spec that cannot be written, which none is.
pub fn text(spec: &Spec, found: &Identified, record: &str) -> Result<String, toml::ser::Error> {
    let mut out = String::new();
    let percent = 100.0 * found.confidence;
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "# The plant is identified from {record}: {} samples, {:.1} mHz left.",
        found.samples,
        1e3 * found.residual_hz
    );
    let _ = writeln!(out, "# All intervals hold at once with {percent} %:");
    for it in &found.parameters {
        let _ = writeln!(
            out,
            "#   {:34} {:9.4} in [{:.4}, {:.4}] {}",
            it.key, it.value, it.low, it.high, it.unit
        );
    }
    for sentence in &found.cannot_tell {
        let _ = writeln!(out, "# Not told: {sentence}.");
    }
    out.push_str(&toml::to_string(spec)?);
    Ok(out)
}
