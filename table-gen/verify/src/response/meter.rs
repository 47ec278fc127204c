//! The claim `observer`: the meter of the spec errs and lags no more than the proof assumes.
//!
//! A reading counts n whole cycles between two edges, `f = n / T` with `T = n / 50 s`. It errs by
//!
//! | source | at most |
//! |---|---|
//! | jitter j of each of the two edges | `2 j f / T` |
//! | clock, temperature and ageing included | `ppm f` |
//! | resolution of the timer or the chip | itself |
//! | constant bias | itself |
//!
//! f is at most 55 Hz here. Cycles over time is the mean of f over the window, and a mean of a
//! continuous function is its value at some moment of the window: so a reading speaks exactly of a
//! moment between its age and its age plus T ago, which counts as delay. The difference of two
//! readings is, in the same way, the exact difference of f at two moments that lie a slope window
//! apart, but for their ages.

use model::spec::{MeterKind, Spec};
use model::verdict::{Claim, ClaimName};

/// Largest frequency \[Hz\] for which the errors hold.
const FREQUENCY_MOST_HZ: f64 = 55.0;
/// Cycles a second.
const CYCLES_PER_S: f64 = 50.0;

/// Largest error of a reading \[Hz\] of the spec's meter; an ideal one errs by what is assumed.
pub fn error_hz(spec: &Spec) -> f64 {
    let meter = &spec.meter;
    if meter.kind == MeterKind::Ideal {
        return spec.uncertainty.measurement[0];
    }
    let window_s = f64::from(meter.window_cycles) / CYCLES_PER_S;
    let jitter = 2.0 * meter.jitter_us * 1e-6 * FREQUENCY_MOST_HZ / window_s;
    let clock = meter.clock_ppm * 1e-6 * FREQUENCY_MOST_HZ;
    (jitter + clock + meter.resolution_hz + meter.bias_hz) * (1.0 + 1e-12)
}

/// The claim.
pub(super) fn claim(spec: &Spec) -> Claim {
    let error = error_hz(spec);
    let limit = spec.uncertainty.measurement[0];
    Claim {
        name: ClaimName::Observer,
        holds: error <= limit,
        bound: Some(error),
        limit: Some(limit),
        unit: "Hz".into(),
        statement: format!(
            "a reading of the {} meter errs by no more than is assumed; its lag counts as delay",
            spec.meter.kind.name()
        ),
        reason: (error > limit).then(|| {
            format!("it may err by {error:.5} Hz: uncertainty.measurement[0] must not be less")
        }),
    }
}
