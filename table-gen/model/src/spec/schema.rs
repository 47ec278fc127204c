//! The whole spec as one value, and the quantities that follow from several of its sections.

use serde::{Deserialize, Serialize};

use super::{
    BaselineSpec, ChanceSpec, ChargerSpec, Direction, FleetSpec, GridSpec, InputSpec, MeterSpec,
    MethodSpec, PlantSpec, PreferenceSpec, RequirementsSpec, SamplingSpec, TableSpec,
    UncertaintySpec,
};

/// A complete specification; one field per section of the TOML document.
///
/// `Spec::default()` holds every key's documented default. A spec from [`Spec::load`] or
/// [`Spec::from_toml`] has been validated; one that was put together or changed in code should pass
/// [`Spec::validate`] before use.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Spec {
    /// Name for reports and file names.
    ///
    /// Unit: -. Allowed: 1 to 64 ASCII letters, digits, - _ or ., the first a letter or digit.
    /// Default: "unnamed".
    pub name: String,
    /// The grid's frequency dynamics without the fleet (the paper's Table I).
    pub plant: PlantSpec,
    /// The charging fleet.
    pub fleet: FleetSpec,
    /// The droop controller that the paper compares with, and that the firmware falls back to.
    pub baseline: BaselineSpec,
    /// The cells of the state space.
    pub grid: GridSpec,
    /// The inputs: participations of the fleet.
    pub input: InputSpec,
    /// When decisions are made.
    pub sampling: SamplingSpec,
    /// The law that is preferred, or always on.
    pub preference: PreferenceSpec,
    /// What measures the frequency.
    pub meter: MeterSpec,
    /// The car and the contactor of the laboratory's fleet.
    pub charger: ChargerSpec,
    /// What is not known exactly, as bounds.
    pub uncertainty: UncertaintySpec,
    /// What is drawn, for bounds on probabilities; absent: nothing.
    #[serde(skip_serializing_if = "ChanceSpec::is_absent")]
    pub chance: ChanceSpec,
    /// What is to be proved.
    pub requirements: RequirementsSpec,
    /// What the table covers.
    pub table: TableSpec,
    /// How the abstraction is computed.
    pub method: MethodSpec,
}

impl Default for Spec {
    fn default() -> Self {
        Self {
            name: "unnamed".to_owned(),
            plant: PlantSpec::default(),
            fleet: FleetSpec::default(),
            baseline: BaselineSpec::default(),
            grid: GridSpec::default(),
            input: InputSpec::default(),
            sampling: SamplingSpec::default(),
            preference: PreferenceSpec::default(),
            meter: MeterSpec::default(),
            charger: ChargerSpec::default(),
            uncertainty: UncertaintySpec::default(),
            chance: ChanceSpec::default(),
            requirements: RequirementsSpec::default(),
            table: TableSpec::default(),
            method: MethodSpec::default(),
        }
    }
}

impl Spec {
    /// P = `N_ev` `p_av`: the power in GW by which the whole fleet can move the balance at
    /// participation 1.
    ///
    /// 1.4 GW for the paper's bidirectional fleet, 0.7 GW for the unidirectional one.
    #[must_use]
    pub fn fleet_power_gw(&self) -> f64 {
        /// kW per GW.
        const KW_PER_GW: f64 = 1e6;
        f64::from(self.fleet.chargers) * self.fleet.power_per_charger_kw / KW_PER_GW
    }

    /// Least and most H \[GW s/Hz\]: the band of `[uncertainty]`, or the plant's, less what may go
    /// with the largest loss. The proof of a response is about any H inside that stays what it is
    /// from the event on; games let H move.
    #[must_use]
    pub fn inertia_band(&self) -> [f64; 2] {
        let nominal = self.plant.inertia_gw_s_per_hz;
        let uncertainty = &self.uncertainty;
        let [low, high] = uncertainty.inertia_gw_s_per_hz.unwrap_or([nominal; 2]);
        match uncertainty.inertia_lost_s_per_hz {
            None => [low, high],
            // Downwards to a whole number of the header's units.
            Some(lost) => {
                let least = low - lost * uncertainty.loss_gw[1].max(0.0);
                [(least * 1e6 - 1e-3).floor() / 1e6, high]
            }
        }
    }

    /// Least and most 1/R_eq \[GW/Hz\]: the band of `[uncertainty]`, or the plant's.
    #[must_use]
    pub fn governor_gain_band(&self) -> [f64; 2] {
        let nominal = self.plant.governor_gain_gw_per_hz;
        self.uncertainty
            .governor_gain_gw_per_hz
            .unwrap_or([nominal; 2])
    }

    /// Least and most D \[GW/Hz\]: the band of `[uncertainty]`, or the plant's.
    #[must_use]
    pub fn damping_band(&self) -> [f64; 2] {
        let nominal = self.plant.damping_gw_per_hz;
        self.uncertainty.damping_gw_per_hz.unwrap_or([nominal; 2])
    }

    /// The deviations \[Hz\] for which games count a plant that is known in bands: from a little
    /// below containment to a little above the grid of cells. The verifier proves that f stays
    /// inside. `None` without containment, which a spec with such a band has.
    #[must_use]
    pub fn counted_frequency_hz(&self) -> Option<[f64; 2]> {
        /// Below containment \[Hz\].
        const BELOW_HZ: f64 = 0.01;
        /// Above the grid of cells \[Hz\]: f may pass its edge between samples.
        const ABOVE_HZ: f64 = 0.05;
        let containment = self.requirements.containment_hz?;
        Some([containment - BELOW_HZ, self.grid.upper[0] + ABOVE_HZ])
    }

    /// Least and most T_G, T_t, T_1 and T_2 \[s\]: the bands of `[uncertainty]`, or the plant's.
    #[must_use]
    pub fn time_constant_bands(&self) -> [[f64; 2]; 4] {
        let (plant, bands) = (&self.plant, &self.uncertainty);
        [
            (plant.governor_time_s, bands.governor_time_s),
            (plant.turbine_time_s, bands.turbine_time_s),
            (plant.lead_time_s, bands.lead_time_s),
            (plant.lag_time_s, bands.lag_time_s),
        ]
        .map(|(nominal, band)| band.unwrap_or([nominal; 2]))
    }

    /// Least and most time from a command to what the grid sees of it \[s\].
    ///
    /// With W the most, a charger's power at t lies among what it was told in \[t - W, t - least\]:
    ///
    /// - A pilot that may not change yet holds what was told at its last change, which was less
    ///   than `pilot_change_s` ago if something else has been told since.
    /// - A power y that moves to what it is told at a rate of a full swing in `ramp_s` cannot lie
    ///   above all that was told in the last `ramp_s`: it would have fallen all the time, by a full
    ///   swing. Nor below.
    #[must_use]
    pub fn command_delay_s(&self) -> [f64; 2] {
        let [least, most] = *self.uncertainty.actuation_delay_s.ends_s();
        let [dead_least, dead_most] = self.charger.dead_time_s;
        let pilot = match self.fleet.direction {
            Direction::Unidirectional => self.charger.pilot_change_s,
            Direction::Bidirectional => 0.0,
        };
        [
            least + dead_least,
            most + dead_most + self.charger.ramp_s[1] + pilot,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fleet_power_is_the_papers() {
        let mut spec = Spec::default();
        // 25000 * 56 is exact in binary and one division rounds once: equality holds.
        assert_eq!(spec.fleet_power_gw(), 1.4);
        spec.fleet.power_per_charger_kw = 28.0;
        assert_eq!(spec.fleet_power_gw(), 0.7);
    }

    #[test]
    fn the_defaults_are_valid() {
        Spec::default().validate("default").unwrap();
    }

    #[test]
    fn cars_and_pilots_add_to_the_delay() {
        let load = |set: &[&str]| {
            let set: Vec<String> = set.iter().map(|s| (*s).to_owned()).collect();
            Spec::load("gb-uni", &set).map(|spec| spec.command_delay_s())
        };
        assert_eq!(load(&[]).ok(), Some([0.1, 0.5]));
        let car = [
            "uncertainty.actuation_delay_s=[0.5,0.5]",
            "charger.dead_time_s=[0.25,1]",
            "charger.ramp_s=[0,2]",
            "charger.pilot_change_s=5",
        ];
        assert_eq!(load(&car).ok(), Some([0.75, 8.5]));
        let both = [&car[..], &["fleet.direction=bidirectional"]].concat();
        assert_eq!(load(&both).ok(), Some([0.75, 3.5]));
    }
}
