//! How many chargers a fleet has, and what is wrong with them.

use model::spec::Spec;

/// Parts of a tick.
pub(super) const PARTS: usize = 10;

/// What a hostile charger gives instead of what it is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Hostility {
    /// All where it is told nothing, nothing where it is told all.
    Opposite,
    /// Nothing.
    Nothing,
}

impl Hostility {
    /// Of a fleet with a hostile share, the charger with this number: as many as there are whole
    /// ones in the share, spread evenly, and each second one opposite.
    pub(super) fn of(index: usize, share: f64) -> Option<Self> {
        let until = |count: usize| (count as f64 * share).floor() as usize;
        let before = until(index);
        match until(index + 1) > before {
            true if before.is_multiple_of(2) => Some(Self::Opposite),
            true => Some(Self::Nothing),
            false => None,
        }
    }
}

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
    /// Share of chargers that from the event on do the opposite of what they are told, or nothing,
    /// in turn; 0..=1.
    pub hostile_share: f64,
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
    /// Meters, delays and hostile share of a spec, nothing failed, clocks spread.
    pub fn sound(spec: &Spec, instances: usize) -> Self {
        Self {
            instances,
            noise_hz: spec.uncertainty.measurement[0],
            delay_s: *spec.uncertainty.actuation_delay_s.ends_s(),
            lag_s: spec.meter.lag_ms().map(|ms| ms / 1000.0),
            failed_share: 0.0,
            hostile_share: spec.uncertainty.hostile(),
            outages_per_hour: 0.0,
            outage_s: 2.0,
            spread_clocks: true,
            seed: 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_of_the_chargers_is_hostile_and_half_of_it_opposite() {
        let all: Vec<_> = (0..1000).filter_map(|i| Hostility::of(i, 0.05)).collect();
        assert_eq!(all.len(), 50);
        let opposite = all.iter().filter(|kind| **kind == Hostility::Opposite);
        assert_eq!(opposite.count(), 25);
        assert!((0..1000).all(|i| Hostility::of(i, 0.0).is_none()));
        assert!((0..1000).all(|i| Hostility::of(i, 1.0).is_some()));
    }
}
