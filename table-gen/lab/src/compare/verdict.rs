//! Where a table loses to the droop.
//!
//! A run of a fleet depends on the draw of its meters' errors. The mean of N errors, each uniform
//! within ±e, has the standard deviation e / √(3 N), and an error of the mean moves f by no more
//! than itself. So two numbers are called different where they are further apart than five such
//! deviations of both runs, 5 e √(2 / (3 N)), and a microhertz.

use super::chargers::ChargersConfig;
use super::{Controller, Row, Scorecard};
use serde::Serialize;

/// The unit of the device's frequency \[Hz\].
const MICROHERTZ: f64 = 1e-6;

/// What a number of the scorecard is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Measure {
    /// The lowest frequency.
    Nadir,
    /// The frequency at the end.
    Final,
}

impl Measure {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Nadir, Self::Final];

    /// The measure's name, as people and JSON read it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Nadir => "nadir",
            Self::Final => "final",
        }
    }

    /// The measure of a run \[Hz, absolute\].
    pub const fn of(self, row: &Row) -> f64 {
        match self {
            Self::Nadir => row.outcome.nadir_hz,
            Self::Final => row.outcome.final_hz,
        }
    }
}

/// A run in which the table is worse than the droop.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Defeat {
    /// Lost infeed \[GW\].
    pub loss_gw: f64,
    /// H \[GW s/Hz\].
    pub inertia_gw_s_per_hz: f64,
    /// The plant's name.
    pub plant: String,
    /// In what.
    pub measure: Measure,
    /// With the droop \[Hz, absolute\].
    pub droop_hz: f64,
    /// With the table \[Hz, absolute\].
    pub table_hz: f64,
}

impl Defeat {
    /// How far the table is below the droop \[Hz\].
    pub fn below_hz(&self) -> f64 {
        self.droop_hz - self.table_hz
    }
}

/// Runs and defeats.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// Pairs of a loss and a plant that were compared.
    pub compared: usize,
    /// Every defeat, in the order of the scorecard.
    pub defeats: Vec<Defeat>,
}

/// Difference up to which two numbers of runs of this fleet count as the same \[Hz\].
pub fn grace_hz(chargers: &ChargersConfig) -> f64 {
    let spread = chargers.meter_hz * (2.0 / (3.0 * chargers.number as f64)).sqrt();
    5.0 * spread + MICROHERTZ
}

impl Verdict {
    /// The defeats of a scorecard that was made with this fleet.
    pub fn of(scorecard: &Scorecard, chargers: &ChargersConfig) -> Self {
        let grace_hz = grace_hz(chargers);
        let mut out = Self {
            compared: 0,
            defeats: Vec::new(),
        };
        for (droop, table) in scorecard.pairs(Controller::Droop, Controller::Table) {
            out.compared += 1;
            out.defeats
                .extend(Measure::ALL.into_iter().filter_map(|measure| {
                    let (droop_hz, table_hz) = (measure.of(droop), measure.of(table));
                    (droop_hz - table_hz > grace_hz).then_some(Defeat {
                        loss_gw: table.loss_gw,
                        inertia_gw_s_per_hz: table.inertia_gw_s_per_hz,
                        plant: table.plant.clone(),
                        measure,
                        droop_hz,
                        table_hz,
                    })
                }));
        }
        out
    }

    /// The verdict in one sentence.
    pub fn sentence(&self) -> String {
        let worst = |measure| {
            let of = self.defeats.iter().filter(move |d| d.measure == measure);
            let number = of.clone().count();
            let worst = of.max_by(|a, b| a.below_hz().total_cmp(&b.below_hz()))?;
            Some(format!(
                "{} at {number} of {}, worst at {:.1} GW and {}: {:.3} against {:.3} Hz",
                measure.name(),
                self.compared,
                worst.loss_gw,
                worst.plant,
                worst.table_hz,
                worst.droop_hz
            ))
        };
        let found: Vec<String> = Measure::ALL.into_iter().filter_map(worst).collect();
        if found.is_empty() {
            return format!(
                "the table is nowhere worse than the droop ({} losses and plants)",
                self.compared
            );
        }
        format!("THE TABLE LOSES TO THE DROOP: {}", found.join("; "))
    }
}

impl Scorecard {
    /// The rows of one controller on one plant, by loss.
    pub fn of(&self, controller: Controller, plant: &str) -> impl Iterator<Item = &Row> {
        let of = move |row: &&Row| row.controller == controller && row.plant == plant;
        self.rows.iter().filter(of)
    }

    /// The rows of two controllers, side by side.
    pub fn pairs(&self, a: Controller, b: Controller) -> impl Iterator<Item = (&Row, &Row)> {
        let of = |controller| {
            self.rows
                .iter()
                .filter(move |row| row.controller == controller)
        };
        of(a).zip(of(b))
    }
}

#[cfg(test)]
mod tests {
    use super::super::Outcome;
    use super::*;

    fn row(controller: Controller, nadir_hz: f64, final_hz: f64) -> Row {
        Row {
            loss_gw: 1.0,
            inertia_gw_s_per_hz: 4.0,
            plant: "H = 4".to_owned(),
            controller,
            outcome: Outcome {
                nadir_hz,
                nadir_time_s: 5.0,
                final_hz,
                seconds_below_49_5: 0.0,
                participation_gw_s: 1.0,
                changes_per_charger: 2.0,
                changes_most: 3,
                ripple_hz: 0.0,
            },
        }
    }

    fn verdict(table: (f64, f64)) -> Verdict {
        let scorecard = Scorecard {
            rows: vec![
                row(Controller::Droop, 49.7, 49.85),
                row(Controller::Table, table.0, table.1),
            ],
        };
        let chargers = ChargersConfig {
            number: 60,
            meter_hz: 0.002,
            delay_s: [0.0, 0.0],
            lag_s: [0.0, 0.0],
            seed: 0,
        };
        Verdict::of(&scorecard, &chargers)
    }

    #[test]
    fn a_defeat_is_told_and_noise_is_none() {
        // 5 · 2 mHz · √(2/180) = 1.054 mHz.
        let even = verdict((49.699, 49.849));
        assert_eq!(even.defeats, []);
        assert!(even.sentence().contains("nowhere worse"));
        let nadir = verdict((49.6989, 49.9));
        assert_eq!(nadir.defeats.len(), 1);
        assert_eq!(nadir.defeats[0].measure, Measure::Nadir);
        assert!(nadir.sentence().starts_with("THE TABLE LOSES"));
        assert_eq!(verdict((49.6, 49.8)).defeats.len(), 2);
    }
}
