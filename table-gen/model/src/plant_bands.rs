//! A plant that is known in bands: what of it may be another than the spec's, and the plants at the
//! corners.
//!
//! Whoever runs plants takes them from here. A proof takes the bands themselves from the spec.

use serde::Serialize;

use crate::plant::Plant;
use crate::spec::Spec;

/// A parameter that may lie in a band.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Parameter {
    /// H \[GW s/Hz\].
    #[serde(rename = "inertia_gw_s_per_hz")]
    Inertia,
    /// 1/R_eq \[GW/Hz\].
    #[serde(rename = "governor_gain_gw_per_hz")]
    GovernorGain,
    /// D \[GW/Hz\].
    #[serde(rename = "damping_gw_per_hz")]
    Damping,
    /// T_G \[s\].
    #[serde(rename = "governor_time_s")]
    GovernorTime,
    /// T_t \[s\].
    #[serde(rename = "turbine_time_s")]
    TurbineTime,
    /// T_1 \[s\].
    #[serde(rename = "lead_time_s")]
    LeadTime,
    /// T_2 \[s\].
    #[serde(rename = "lag_time_s")]
    LagTime,
}

impl Parameter {
    /// Its symbol in the equations.
    pub const fn symbol(self) -> &'static str {
        match self {
            Self::Inertia => "H",
            Self::GovernorGain => "1/R_eq",
            Self::Damping => "D",
            Self::GovernorTime => "T_G",
            Self::TurbineTime => "T_t",
            Self::LeadTime => "T_1",
            Self::LagTime => "T_2",
        }
    }

    /// Its unit.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Inertia => "GW s/Hz",
            Self::GovernorGain | Self::Damping => "GW/Hz",
            Self::GovernorTime | Self::TurbineTime | Self::LeadTime | Self::LagTime => "s",
        }
    }

    /// Its place in a plant.
    pub const fn of(self, plant: &mut Plant) -> &mut f64 {
        match self {
            Self::Inertia => &mut plant.inertia,
            Self::GovernorGain => &mut plant.governor_gain,
            Self::Damping => &mut plant.damping,
            Self::GovernorTime => &mut plant.governor_time,
            Self::TurbineTime => &mut plant.turbine_time,
            Self::LeadTime => &mut plant.lead_time,
            Self::LagTime => &mut plant.lag_time,
        }
    }
}

/// A parameter and its least and most value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Band {
    /// Which parameter.
    pub parameter: Parameter,
    /// Least and most, in the parameter's unit.
    pub within: [f64; 2],
}

/// The plant of a spec, and the bands that hold more than its own number.
#[derive(Debug, Clone, PartialEq)]
pub struct PlantBands {
    own: Plant,
    bands: Vec<Band>,
}

impl PlantBands {
    /// Of a spec. H goes down to what the spec's largest loss may leave.
    pub fn of(spec: &Spec) -> Self {
        let own = Plant::new(spec);
        let [governor, turbine, lead, lag] = spec.time_constant_bands();
        let all = [
            (Parameter::Inertia, spec.inertia_band()),
            (Parameter::GovernorGain, spec.governor_gain_band()),
            (Parameter::Damping, spec.damping_band()),
            (Parameter::GovernorTime, governor),
            (Parameter::TurbineTime, turbine),
            (Parameter::LeadTime, lead),
            (Parameter::LagTime, lag),
        ];
        let is_wider = |&(parameter, within): &(Parameter, [f64; 2])| {
            let mut plant = own;
            within != [*parameter.of(&mut plant); 2]
        };
        let bands = all.into_iter().filter(is_wider);
        Self {
            own,
            bands: bands
                .map(|(parameter, within)| Band { parameter, within })
                .collect(),
        }
    }

    /// The bands; none where the plant is known.
    pub fn bands(&self) -> &[Band] {
        &self.bands
    }

    /// Whether a parameter lies in a band.
    pub fn holds(&self, parameter: Parameter) -> bool {
        self.bands.iter().any(|band| band.parameter == parameter)
    }

    /// The spec's own plant with each parameter in a band at the value that is said of its band.
    pub fn at(&self, mut value: impl FnMut(&Band) -> f64) -> Plant {
        let mut plant = self.own;
        for band in &self.bands {
            *band.parameter.of(&mut plant) = value(band);
        }
        plant
    }

    /// Each band in words: `H anywhere in 2.8 to 5 GW s/Hz`.
    pub fn words(&self) -> Vec<String> {
        let words = self.bands.iter().map(|band| {
            let ([low, high], parameter) = (band.within, band.parameter);
            let (symbol, unit) = (parameter.symbol(), parameter.unit());
            format!("{symbol} anywhere in {low} to {high} {unit}")
        });
        words.collect()
    }

    /// The plants at all corners: 2ⁿ of n bands, the lowest first; none without a band.
    pub fn corners(&self) -> impl Iterator<Item = Plant> {
        let number = self.bands.len();
        let corners = if number == 0 { 0 } else { 1u32 << number };
        (0..corners).map(move |corner| {
            let mut rest = corner;
            self.at(|band| {
                let end = rest % 2;
                rest /= 2;
                band.within[end as usize]
            })
        })
    }

    /// What of a plant lies in bands, to a millionth: `H = 2.8, D = 0.5`; empty without a band.
    pub fn told(&self, mut plant: Plant) -> String {
        let told = self.bands.iter().map(|band| {
            let value = (*band.parameter.of(&mut plant) * 1e6).round() / 1e6;
            format!("{} = {value}", band.parameter.symbol())
        });
        told.collect::<Vec<_>>().join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spec(set: &[&str]) -> Spec {
        let set: Vec<String> = set.iter().map(|&pair| pair.to_owned()).collect();
        Spec::load("gb-bi", &set).unwrap()
    }

    #[test]
    fn without_bands_there_is_the_plant_alone() {
        for set in [&[][..], &["uncertainty.damping_gw_per_hz=[1,1]"]] {
            let spec = spec(set);
            let bands = PlantBands::of(&spec);
            assert_eq!((bands.bands().len(), bands.corners().count()), (0, 0));
            assert_eq!(bands.at(|_| f64::NAN), Plant::new(&spec));
            assert_eq!(bands.told(Plant::new(&spec)), "");
        }
    }

    /// What a spec says of itself, from a list of keys, agrees with this list of parameters.
    #[test]
    fn every_key_of_a_band_is_a_parameter() {
        for (key, band) in [
            ("inertia_gw_s_per_hz", "[3.9,4.1]"),
            ("governor_gain_gw_per_hz", "[-5.1,-4.9]"),
            ("damping_gw_per_hz", "[0.9,1.1]"),
            ("governor_time_s", "[2.4,2.6]"),
            ("turbine_time_s", "[0.4,0.6]"),
            ("lead_time_s", "[1.9,2.1]"),
            ("lag_time_s", "[11,13]"),
        ] {
            let spec = spec(&[&format!("uncertainty.{key}={band}")]);
            let bands = PlantBands::of(&spec);
            assert!(spec.has_plant_band() && bands.bands().len() == 1, "{key}");
            let name = serde_json::to_value(bands.bands()[0].parameter).unwrap();
            assert_eq!(name, key);
        }
        let spec = spec(&["uncertainty.inertia_lost_s_per_hz=0.1"]);
        assert!(spec.has_plant_band() && PlantBands::of(&spec).holds(Parameter::Inertia));
    }

    #[test]
    fn each_corner_comes_once_and_nothing_else_moves() {
        let spec = spec(&[
            "uncertainty.inertia_gw_s_per_hz=[2.8,5]",
            "uncertainty.governor_gain_gw_per_hz=[-6,-4]",
            "uncertainty.lag_time_s=[9.6,14.4]",
        ]);
        let bands = PlantBands::of(&spec);
        let corners: Vec<Plant> = bands.corners().collect();
        let found = corners
            .iter()
            .map(|p| (p.inertia, p.governor_gain, p.lag_time));
        assert_eq!(
            found.collect::<Vec<_>>(),
            [
                (2.8, -6.0, 9.6),
                (5.0, -6.0, 9.6),
                (2.8, -4.0, 9.6),
                (5.0, -4.0, 9.6),
                (2.8, -6.0, 14.4),
                (5.0, -6.0, 14.4),
                (2.8, -4.0, 14.4),
                (5.0, -4.0, 14.4),
            ]
        );
        for corner in &corners {
            let own = Plant::new(&spec);
            let back = Plant {
                inertia: own.inertia,
                governor_gain: own.governor_gain,
                lag_time: own.lag_time,
                ..*corner
            };
            assert_eq!(back, own);
        }
        assert_eq!(bands.told(corners[2]), "H = 2.8, 1/R_eq = -4, T_2 = 9.6");
        assert_eq!(
            bands.words(),
            [
                "H anywhere in 2.8 to 5 GW s/Hz",
                "1/R_eq anywhere in -6 to -4 GW/Hz",
                "T_2 anywhere in 9.6 to 14.4 s"
            ]
        );
    }
}
