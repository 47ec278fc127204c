//! The loop of the product's bidirectional spec, for tests.

use super::fleet_loop::{Assumed, LossProfile, PlantBand, RealLaw};
use super::time_bands::TimeBands;
use model::governor::Governor;
use model::interval::Interval;
use model::plant::Plant;

/// P \[GW\].
const FLEET_GW: f64 = 1.4;

pub(super) fn law() -> RealLaw {
    RealLaw {
        droop: 6.0 / FLEET_GW,
        setpoint_hz: -0.05,
        slope: 2.0 / FLEET_GW,
        slope_threshold_hz_per_s: 0.03,
        slope_window_s: 0.5,
        slope_most: 0.9 / FLEET_GW,
        release_per_s: 0.05 / FLEET_GW,
        release_least_per_s: 0.05 / FLEET_GW,
        smallest_change: 0.05,
        rounding: 4e-6,
    }
}

pub(super) fn assumed() -> Assumed {
    Assumed {
        late_least_s: 0.15,
        late_most_s: 0.7,
        tick_s: 0.1,
        reading_hz: 0.002,
        age_spread_s: 0.12,
        slope_jitter_s: 0.02,
        participation: 0.1,
        participation_absolute: 0.0,
        hostile_share: 0.0,
        mean_step_share: 1.0,
        loss: Interval::hull(2.0, 2.02),
        profile: LossProfile::Constant,
        initial: [0.02, 0.1, 0.06, 0.06],
    }
}

pub(super) fn plant() -> PlantBand {
    let known = Plant {
        governor_gain: -5.0,
        governor_time: 2.5,
        turbine_time: 0.5,
        lead_time: 2.0,
        lag_time: 12.0,
        damping: 1.0,
        inertia: 4.0,
        fleet: FLEET_GW,
    };
    PlantBand {
        known,
        inertia: Interval::point(known.inertia),
        governor_gain: Interval::point(known.governor_gain),
        damping: Interval::point(known.damping),
        times: TimeBands::known(&known),
        governor: Governor::LINEAR,
    }
}
