//! The plant's parameters that may lie in bands.

use super::origin::{Origin, inconsistent};
use super::{Spec, SpecError};

/// A parameter of the plant that may lie in a band.
struct PlantBand {
    /// Key of the band.
    key: &'static str,
    /// Key of the plant's own number.
    of: &'static str,
    unit: &'static str,
    /// The plant's own number.
    own: f64,
    /// The band, if the spec has one.
    given: Option<[f64; 2]>,
}

impl PlantBand {
    /// Whether the parameter may be another than the plant's own.
    fn is_wider(&self) -> bool {
        self.given.is_some_and(|band| band != [self.own; 2])
    }

    /// A band has its ends in order, and holds the plant's own number, which simulation, the
    /// device's observer and its droop know.
    fn check(&self, origin: &Origin) -> Result<(), SpecError> {
        let Self {
            key, of, unit, own, ..
        } = self;
        let Some([low, high]) = self.given else {
            return Ok(());
        };
        if low > high {
            return Err(SpecError::Inverted {
                origin: origin.of(key),
                key,
                found: format!("[{low}, {high}] {unit}"),
                allowed: "[low, high] with low at most high".to_owned(),
            });
        }
        if !(low..=high).contains(own) {
            let found = format!("[{low}, {high}] {unit}, beside {of} = {own}");
            return Err(inconsistent(origin, key, found, "a band that holds it"));
        }
        Ok(())
    }
}

/// H, 1/R_eq and D.
fn of_swing(spec: &Spec) -> [PlantBand; 3] {
    let (plant, bands) = (&spec.plant, &spec.uncertainty);
    [
        PlantBand {
            key: "uncertainty.inertia_gw_s_per_hz",
            of: "plant.inertia_gw_s_per_hz",
            unit: "GW s/Hz",
            own: plant.inertia_gw_s_per_hz,
            given: bands.inertia_gw_s_per_hz,
        },
        PlantBand {
            key: "uncertainty.governor_gain_gw_per_hz",
            of: "plant.governor_gain_gw_per_hz",
            unit: "GW/Hz",
            own: plant.governor_gain_gw_per_hz,
            given: bands.governor_gain_gw_per_hz,
        },
        PlantBand {
            key: "uncertainty.damping_gw_per_hz",
            of: "plant.damping_gw_per_hz",
            unit: "GW/Hz",
            own: plant.damping_gw_per_hz,
            given: bands.damping_gw_per_hz,
        },
    ]
}

/// T_G, T_t, T_1 and T_2.
fn of_times(spec: &Spec) -> [PlantBand; 4] {
    let (plant, bands) = (&spec.plant, &spec.uncertainty);
    let time = |key, of, own, given| PlantBand {
        key,
        of,
        unit: "s",
        own,
        given,
    };
    [
        time(
            "uncertainty.governor_time_s",
            "plant.governor_time_s",
            plant.governor_time_s,
            bands.governor_time_s,
        ),
        time(
            "uncertainty.turbine_time_s",
            "plant.turbine_time_s",
            plant.turbine_time_s,
            bands.turbine_time_s,
        ),
        time(
            "uncertainty.lead_time_s",
            "plant.lead_time_s",
            plant.lead_time_s,
            bands.lead_time_s,
        ),
        time(
            "uncertainty.lag_time_s",
            "plant.lag_time_s",
            plant.lag_time_s,
            bands.lag_time_s,
        ),
    ]
}

/// All of them.
fn all(spec: &Spec) -> impl Iterator<Item = PlantBand> {
    of_swing(spec).into_iter().chain(of_times(spec))
}

impl Spec {
    /// Whether a parameter of the plant may be another than the plant's own.
    #[must_use]
    pub fn has_plant_band(&self) -> bool {
        let goes = self.uncertainty.inertia_lost_s_per_hz.is_some();
        goes || all(self).any(|band| band.is_wider())
    }
}

/// Checks all of them.
pub(super) fn check(spec: &Spec, origin: &Origin) -> Result<(), SpecError> {
    all(spec).try_for_each(|band| band.check(origin))
}
