//! What the identified plants say of another event: its nadir and its steepest second, over every
//! plant that explains the record.

use serde::Serialize;

use super::Identified;
use super::course::{Stage, deviations};
use super::parameters::{INERTIA, ONSET, REST};

/// Time that is followed \[s\].
const DURATION_S: f64 = 60.0;
/// Time from one point to the next \[s\].
const POINT_S: f64 = 0.1;
/// Points in a second.
const SECOND: usize = 10;
/// Most plants that are asked.
const PLANTS: usize = 1000;

/// Another event.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Event {
    /// Lost at once \[GW\].
    pub loss_gw: f64,
    /// Inertia of that day \[GW s/Hz\].
    pub inertia_gw_s_per_hz: f64,
    /// Deviation before it \[Hz\].
    pub rest_hz: f64,
}

/// Least, best and greatest of a number.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Range {
    /// Least over all plants.
    pub low: f64,
    /// Of the best plant.
    pub best: f64,
    /// Greatest over all plants.
    pub high: f64,
}

/// What is said of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Forecast {
    /// The event.
    pub event: Event,
    /// Lowest deviation \[Hz\].
    pub nadir_hz: Range,
    /// Deviation 2 s after the loss \[Hz\].
    pub after_2_s_hz: Range,
    /// Fall of the steepest second \[Hz/s\].
    pub steepest_hz_per_s: Range,
}

/// The forecast of all identified plants.
pub fn forecast(identified: &Identified, event: Event) -> Forecast {
    let points = (DURATION_S / POINT_S) as usize;
    let times: Vec<f64> = (0..=points).map(|k| k as f64 * POINT_S).collect();
    let stages = [Stage {
        after_s: 0.0,
        power_gw: event.loss_gw,
        inertia_gw_s_per_hz: 0.0,
    }];
    let of = |values: &[f64; super::parameters::COUNT]| {
        let mut values = *values;
        values[INERTIA] = event.inertia_gw_s_per_hz;
        values[REST] = event.rest_hz;
        values[ONSET] = 0.0;
        let f = deviations(&values, &stages, &times);
        let nadir = f.iter().copied().fold(f64::INFINITY, f64::min);
        let steepest = (SECOND..f.len())
            .map(|k| f[k - SECOND] - f[k])
            .fold(0.0, f64::max);
        [nadir, f[2 * SECOND], steepest]
    };
    let best = of(&identified.best);
    let every = identified.others.len().div_ceil(PLANTS).max(1);
    let others = identified.others.iter().step_by(every).map(of);
    let ends = others.fold((best, best), |(low, high), one| {
        (
            std::array::from_fn(|k| f64::min(low[k], one[k])),
            std::array::from_fn(|k| f64::max(high[k], one[k])),
        )
    });
    let [nadir_hz, after_2_s_hz, steepest_hz_per_s] = std::array::from_fn(|k| Range {
        low: ends.0[k],
        best: best[k],
        high: ends.1[k],
    });
    Forecast {
        event,
        nadir_hz,
        after_2_s_hz,
        steepest_hz_per_s,
    }
}
