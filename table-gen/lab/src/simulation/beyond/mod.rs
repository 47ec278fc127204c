//! A plant that is wrong in other ways than the spec says: for testing the controller where the
//! model fails.
//!
//! Losses in stages, a second loss during recovery, inertia that is lost with the infeed, governors
//! with a dead band, a limited rate and a limited output, and noise of the demand. None of this is
//! linear; it exists in the simulation only, and [`Disturbances::outside_proof`] says which of it
//! the proof does not cover.
//!
//! | module | holds |
//! |---|---|
//! | [`mod@file`] | the scenario file |
//! | [`plant`] | the equations |
//! | [`system`] | the same in time, for the firmware's loop |

pub mod file;
pub mod noise;
pub mod plant;
pub mod system;

use model::spec::Spec;

pub use model::governor::Governor;

/// Lost infeed at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loss {
    /// When \[s after the event\].
    pub at_s: f64,
    /// Lost power \[GW\]; negative where power comes back.
    pub power_gw: f64,
    /// Inertia that goes with it \[GW s/Hz\].
    pub inertia_gw_s_per_hz: f64,
}

/// Noise of the demand: a stationary process of Ornstein and Uhlenbeck.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DemandNoise {
    /// Standard deviation \[GW\].
    pub deviation_gw: f64,
    /// Correlation time \[s\].
    pub time_s: f64,
}

impl DemandNoise {
    /// None.
    pub const NONE: Self = Self {
        deviation_gw: 0.0,
        time_s: 1.0,
    };
}

/// What happens to the grid, and how its plant differs from the spec's.
#[derive(Debug, Clone, PartialEq)]
pub struct Disturbances {
    /// Losses in the order of time.
    pub losses: Vec<Loss>,
    /// Limits of the governors.
    pub governor: Governor,
    /// Noise of the demand.
    pub demand: DemandNoise,
}

impl Disturbances {
    /// One loss at time 0 on the spec's own plant.
    pub fn of(spec: &Spec, loss_gw: f64) -> Self {
        Self {
            governor: Governor::of(spec),
            ..Self::step(loss_gw)
        }
    }

    /// The event of the paper: one loss at time 0 on a linear plant.
    pub fn step(loss_gw: f64) -> Self {
        let loss = Loss {
            at_s: 0.0,
            power_gw: loss_gw,
            inertia_gw_s_per_hz: 0.0,
        };
        Self {
            losses: vec![loss],
            governor: Governor::LINEAR,
            demand: DemandNoise::NONE,
        }
    }

    /// What of this the proof does not cover, one sentence each; empty if it covers all.
    pub fn outside_proof(&self, spec: &Spec) -> Vec<String> {
        let mut out = Vec::new();
        let [low, high] = spec.uncertainty.loss_gw;
        let mut lost = 0.0;
        for loss in &self.losses {
            lost += loss.power_gw;
            if !(low..=high).contains(&lost) {
                out.push(format!(
                    "from {} s on {lost:.3} GW are lost; the spec's band is {low} to {high} GW",
                    loss.at_s
                ));
            }
        }
        if self.losses.first().is_none_or(|loss| loss.at_s > 0.0) {
            out.push("nothing is lost at first; the proof begins with the loss".to_owned());
        }
        let inertia: f64 = self.losses.iter().map(|l| l.inertia_gw_s_per_hz).sum();
        if inertia != 0.0 {
            out.push(format!(
                "{inertia:.3} GW s/Hz of inertia are lost with the infeed"
            ));
        }
        // What the spec's own governors cannot do is a matter of `verify`.
        let (governor, own) = (&self.governor, Governor::of(spec));
        if governor.deadband_hz != own.deadband_hz {
            out.push(format!(
                "the governors have a dead band of {} Hz",
                governor.deadband_hz
            ));
        }
        if governor.rate_gw_per_s != own.rate_gw_per_s {
            out.push(format!(
                "the governors' output moves by at most {} GW/s",
                governor.rate_gw_per_s
            ));
        }
        if governor.output_gw != own.output_gw {
            let [low, high] = governor.output_gw;
            out.push(format!(
                "the governors' output stays within {low} to {high} GW"
            ));
        }
        if self.demand.deviation_gw > 0.0 {
            out.push(format!(
                "the demand varies by {} GW (standard deviation)",
                self.demand.deviation_gw
            ));
        }
        out
    }
}
