//! What is looked for in a record: each parameter with the range in which it is looked for.
//!
//! A fit works on places in these ranges, from 0 at the low end to 1 at the high end; parameters
//! whose size is unknown by factors are spaced evenly by their logarithm.

use serde::Serialize;

use model::governor::Governor;
use model::plant::Plant;

/// Number of parameters.
pub const COUNT: usize = 13;

/// H.
pub const INERTIA: usize = 0;
/// K = 1/R_eq.
pub const GAIN: usize = 1;
/// D.
pub const DAMPING: usize = 2;
/// T_G.
pub const GOVERNOR_TIME: usize = 3;
/// T_t.
pub const TURBINE_TIME: usize = 4;
/// T_1.
pub const LEAD_TIME: usize = 5;
/// T_2.
pub const LAG_TIME: usize = 6;
/// Dead band.
pub const DEADBAND: usize = 7;
/// Limit of the governors' rate.
pub const RATE: usize = 8;
/// Limit of the governors' output.
pub const UPPER: usize = 9;
/// Lost power.
pub const LOSS: usize = 10;
/// Moment of the first loss.
pub const ONSET: usize = 11;
/// Deviation before it.
pub const REST: usize = 12;

/// How the places of a range are spaced.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spacing {
    /// Evenly.
    Even,
    /// Evenly by the logarithm of the magnitude; both ends have one sign.
    ByFactor,
}

/// A parameter: its name, and where it is looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// Key of the spec, or a name for what is no key.
    pub key: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// The end of the range at place 0.
    pub from: f64,
    /// The end at place 1.
    pub to: f64,
    /// How the places are spaced.
    pub spacing: Spacing,
}

const fn by_factor(key: &'static str, unit: &'static str, from: f64, to: f64) -> Parameter {
    Parameter {
        key,
        unit,
        from,
        to,
        spacing: Spacing::ByFactor,
    }
}

const fn even(key: &'static str, unit: &'static str, from: f64, to: f64) -> Parameter {
    Parameter {
        key,
        unit,
        from,
        to,
        spacing: Spacing::Even,
    }
}

/// All parameters, in the order of the constants of this module. The ranges hold every large
/// synchronous system from Ireland to Great Britain; onset and rest are set for each record.
pub const PARAMETERS: [Parameter; COUNT] = [
    by_factor("plant.inertia_gw_s_per_hz", "GW s/Hz", 0.5, 20.0),
    by_factor("plant.governor_gain_gw_per_hz", "GW/Hz", -0.2, -20.0),
    even("plant.damping_gw_per_hz", "GW/Hz", 0.0, 3.0),
    by_factor("plant.governor_time_s", "s", 0.3, 10.0),
    by_factor("plant.turbine_time_s", "s", 0.1, 3.0),
    even("plant.lead_time_s", "s", 0.0, 10.0),
    by_factor("plant.lag_time_s", "s", 1.0, 40.0),
    even("plant.governor.deadband_hz", "Hz", 0.0, 0.2),
    by_factor("plant.governor.rate_gw_per_s", "GW/s", 0.02, 5.0),
    by_factor("plant.governor.upper_gw", "GW", 0.05, 10.0),
    by_factor("loss_gw", "GW", 0.1, 5.0),
    even("onset_s", "s", 0.0, 1.0),
    even("rest_hz", "Hz", -0.02, 0.02),
];

impl Parameter {
    /// The value at a place; places outside [0, 1] are at the ends.
    pub fn value(&self, place: f64) -> f64 {
        let place = place.clamp(0.0, 1.0);
        match self.spacing {
            Spacing::Even => self.from + (self.to - self.from) * place,
            Spacing::ByFactor => self.from * (self.to / self.from).powf(place),
        }
    }

    /// The place of a value.
    pub fn place(&self, value: f64) -> f64 {
        let place = match self.spacing {
            Spacing::Even => (value - self.from) / (self.to - self.from),
            Spacing::ByFactor => (value / self.from).ln() / (self.to / self.from).ln(),
        };
        place.clamp(0.0, 1.0)
    }
}

/// Values of all parameters.
pub type Values = [f64; COUNT];

/// The plant of some values; the fleet is none.
pub fn plant(values: &Values) -> Plant {
    Plant {
        governor_gain: values[GAIN],
        governor_time: values[GOVERNOR_TIME],
        turbine_time: values[TURBINE_TIME],
        lead_time: values[LEAD_TIME],
        lag_time: values[LAG_TIME],
        damping: values[DAMPING],
        inertia: values[INERTIA],
        fleet: 0.0,
    }
}

/// The governors of some values. A record of a fall says nothing of the lower limit.
pub fn governor(values: &Values) -> Governor {
    Governor {
        deadband_hz: values[DEADBAND],
        rate_gw_per_s: values[RATE],
        output_gw: [f64::NEG_INFINITY, values[UPPER]],
    }
}

/// What a record says of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Told {
    /// It was given, not looked for.
    Given,
    /// Both ends of the interval.
    BothEnds,
    /// Only that it is no larger (in magnitude) than the far end.
    AtMost,
    /// Only that it is no smaller (in magnitude) than the near end.
    AtLeast,
    /// Nothing: the interval is the range in which it was looked for.
    Nothing,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_and_values_are_inverse() {
        for parameter in PARAMETERS {
            for place in [0.0, 0.2, 0.7, 1.0] {
                let back = parameter.place(parameter.value(place));
                assert!((back - place).abs() < 1e-12, "{} {back}", parameter.key);
            }
            assert_eq!(parameter.value(-1.0), parameter.from);
        }
    }
}
