//! How many chargers a fleet has, and what is wrong with them.

use model::spec::Spec;

/// Parts of a tick.
pub(super) const PARTS: usize = 10;

/// The fleet. The cars are the spec's (`[charger]`).
#[derive(Debug, Clone, PartialEq)]
pub struct FleetConfig {
    /// Instances of the firmware.
    pub instances: usize,
    /// Bound on the error of each charger's frequency meter, drawn anew each tick \[Hz\].
    pub noise_hz: f64,
    /// Least and most delay of a charger \[s\]; each has its own.
    pub delay_s: [f64; 2],
    /// Least and most lag of a meter \[s\]; each has its own.
    pub lag_s: [f64; 2],
    /// Share of chargers that never respond, 0..=1.
    pub failed_share: f64,
    /// Outages of a charger's meter in an hour.
    pub outages_per_hour: f64,
    /// Mean length of an outage \[s\].
    pub outage_s: f64,
    /// Whether the chargers' clocks are spread over the tick; otherwise all begin together.
    pub spread_clocks: bool,
    /// Seed of everything that is drawn.
    pub seed: u64,
}

impl FleetConfig {
    /// Meters and delays of a spec, nothing failed, clocks spread.
    pub fn sound(spec: &Spec, instances: usize) -> Self {
        Self {
            instances,
            noise_hz: spec.uncertainty.measurement[0],
            delay_s: *spec.uncertainty.actuation_delay_s.ends_s(),
            lag_s: spec.meter.lag_ms().map(|ms| ms / 1000.0),
            failed_share: 0.0,
            outages_per_hour: 0.0,
            outage_s: 2.0,
            spread_clocks: true,
            seed: 0,
        }
    }
}
