//! The scenario file: what happens to the grid, as TOML. Unknown keys are errors.
//!
//! ```toml
//! name = "two-losses"                  # printed in reports
//! duration_s = 120.0                   # optional, s
//! [[loss]]                             # in the order of time; optional: the spec's loss at 0
//! at_s = 0.0                           # s after the event, whole milliseconds
//! power_gw = 1.2                       # GW; negative where power comes back
//! inertia_gw_s_per_hz = 0.3            # goes with it; default 0
//! [governor]                           # each key optional; absent: the spec's
//! deadband_hz = 0.015
//! rate_gw_per_s = 0.2
//! output_gw = [0.0, 1.0]
//! [demand]                             # optional
//! noise_gw = 0.03                      # standard deviation
//! noise_time_s = 20.0                  # correlation time
//! [errors]                             # each key optional
//! participation = 0.1                  # relative, drawn each tick
//! measurement = [0.002, 0.0, 0.0, 0.0] # Hz, GW, GW, GW, drawn each tick
//! delay_s = 0.5
//! ```

use std::path::Path;

use serde::Deserialize;

use super::{DemandNoise, Disturbances, Governor, Loss};
use crate::simulation::scenario::Scenario;
use model::spec::Spec;

/// Least inertia that must remain \[GW s/Hz\].
const INERTIA_MIN: f64 = 0.1;
/// Most losses of a file.
const LOSSES_MAX: usize = 1000;
/// Names of the shipped scenarios, and their text.
const SHIPPED: &[(&str, &str)] = &[
    (
        "gb-2019",
        include_str!("../../../../scenarios/gb-2019.toml"),
    ),
    (
        "second-loss",
        include_str!("../../../../scenarios/second-loss.toml"),
    ),
    (
        "tired-governors",
        include_str!("../../../../scenarios/tired-governors.toml"),
    ),
];

/// A scenario as its file gives it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScenarioFile {
    /// Name for reports.
    pub name: String,
    /// Length of the run \[s\].
    pub duration_s: Option<f64>,
    #[serde(default)]
    loss: Vec<LossEntry>,
    #[serde(default)]
    governor: GovernorEntry,
    #[serde(default)]
    demand: DemandEntry,
    #[serde(default)]
    errors: ErrorsEntry,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct LossEntry {
    at_s: f64,
    power_gw: f64,
    #[serde(default)]
    inertia_gw_s_per_hz: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct GovernorEntry {
    deadband_hz: Option<f64>,
    rate_gw_per_s: Option<f64>,
    output_gw: Option<[f64; 2]>,
}

#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct DemandEntry {
    noise_gw: Option<f64>,
    noise_time_s: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct ErrorsEntry {
    participation: Option<f64>,
    measurement: Option<[f64; 4]>,
    delay_s: Option<f64>,
}

/// Why a scenario file is refused: where, which key, what was found, what is allowed.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct ScenarioFileError(String);

impl ScenarioFile {
    /// Loads the shipped scenario of this name, or the file at this path.
    ///
    /// # Errors
    /// A file that cannot be read, is no TOML, or holds an unknown key or a value out of its range.
    pub fn load(name: &str) -> Result<Self, ScenarioFileError> {
        if let Some((_, text)) = SHIPPED.iter().find(|(shipped, _)| *shipped == name) {
            return Self::parse(text, name);
        }
        let text = std::fs::read_to_string(Path::new(name)).map_err(|error| {
            let shipped: Vec<&str> = SHIPPED.iter().map(|(name, _)| *name).collect();
            ScenarioFileError(format!(
                "{name}: cannot be read: {error}; allowed: a shipped scenario ({}) or the path of a TOML file",
                shipped.join(", ")
            ))
        })?;
        Self::parse(&text, name)
    }

    /// The shipped scenarios, in order.
    pub fn shipped() -> impl Iterator<Item = Result<Self, ScenarioFileError>> {
        SHIPPED.iter().map(|(name, text)| Self::parse(text, name))
    }

    /// Reads a scenario from text that `origin` names in messages.
    ///
    /// # Errors
    /// As [`ScenarioFile::load`].
    pub fn parse(text: &str, origin: &str) -> Result<Self, ScenarioFileError> {
        let file: Self = toml::from_str(text).map_err(|error| {
            let offset = error.span().map_or(0, |span| span.start);
            let before = text.get(..offset).unwrap_or(text);
            let line = before.matches('\n').count() + 1;
            let message = error.message().replace('\n', "; ");
            ScenarioFileError(format!("{origin}: line {line}: {message}"))
        })?;
        file.check()
            .map_err(|reason| ScenarioFileError(format!("{origin}: {reason}")))?;
        Ok(file)
    }

    /// Every number in its range.
    fn check(&self) -> Result<(), String> {
        let within = |key: &str, value: Option<f64>, low: f64, high: f64, unit: &str| match value {
            Some(x) if !(x >= low && x <= high) => Err(format!(
                "{key}: found {x}; allowed: a number from {low} to {high} {unit}"
            )),
            _ => Ok(()),
        };
        within("duration_s", self.duration_s, 0.1, 86_400.0, "s")?;
        if self.loss.len() > LOSSES_MAX {
            let found = self.loss.len();
            return Err(format!(
                "loss: found {found}; allowed: at most {LOSSES_MAX}"
            ));
        }
        let mut last_s = 0.0;
        for (index, loss) in self.loss.iter().enumerate() {
            let key = |name: &str| format!("loss[{index}].{name}");
            within(
                &key("at_s"),
                Some(loss.at_s),
                last_s,
                86_400.0,
                "s, in order",
            )?;
            let ms = loss.at_s * 1000.0;
            if (ms - ms.round()).abs() > 1e-6 {
                let found = loss.at_s;
                return Err(format!(
                    "{}: found {found} s; allowed: whole milliseconds",
                    key("at_s")
                ));
            }
            within(&key("power_gw"), Some(loss.power_gw), -100.0, 100.0, "GW")?;
            let inertia = Some(loss.inertia_gw_s_per_hz);
            within(
                &key("inertia_gw_s_per_hz"),
                inertia,
                -100.0,
                100.0,
                "GW s/Hz",
            )?;
            last_s = loss.at_s;
        }
        let (governor, demand, errors) = (&self.governor, &self.demand, &self.errors);
        within("governor.deadband_hz", governor.deadband_hz, 0.0, 5.0, "Hz")?;
        within(
            "governor.rate_gw_per_s",
            governor.rate_gw_per_s,
            1e-6,
            1000.0,
            "GW/s",
        )?;
        if let Some([low, high]) = governor.output_gw
            && !(low.is_finite() && high.is_finite() && low <= 0.0 && high >= 0.0)
        {
            return Err(format!(
                "governor.output_gw: found [{low}, {high}]; allowed: [low, high] with low <= 0 <= high GW"
            ));
        }
        within("demand.noise_gw", demand.noise_gw, 0.0, 10.0, "GW")?;
        within("demand.noise_time_s", demand.noise_time_s, 0.1, 3600.0, "s")?;
        within("errors.participation", errors.participation, 0.0, 1.0, "")?;
        for value in errors.measurement.iter().flatten() {
            within(
                "errors.measurement",
                Some(*value),
                0.0,
                10.0,
                "Hz, GW, GW, GW",
            )?;
        }
        within("errors.delay_s", errors.delay_s, 0.0, 60.0, "s")
    }

    /// The losses, in the order of time.
    pub fn losses(&self) -> Vec<Loss> {
        let loss = |entry: &LossEntry| Loss {
            at_s: entry.at_s,
            power_gw: entry.power_gw,
            inertia_gw_s_per_hz: entry.inertia_gw_s_per_hz,
        };
        self.loss.iter().map(loss).collect()
    }

    /// The disturbances on a spec's plant.
    ///
    /// # Errors
    /// Losses that leave too little inertia.
    pub fn disturbances(&self, spec: &Spec) -> Result<Disturbances, ScenarioFileError> {
        let losses = self.losses();
        let mut inertia = spec.plant.inertia_gw_s_per_hz;
        for loss in &losses {
            inertia -= loss.inertia_gw_s_per_hz;
            if inertia < INERTIA_MIN {
                return Err(ScenarioFileError(format!(
                    "{}: the losses up to {} s leave {inertia} GW s/Hz of inertia; allowed: at least {INERTIA_MIN}",
                    self.name, loss.at_s
                )));
            }
        }
        let own = Governor::of(spec);
        let governor = Governor {
            rate_gw_per_s: self.governor.rate_gw_per_s.unwrap_or(own.rate_gw_per_s),
            output_gw: self.governor.output_gw.unwrap_or(own.output_gw),
            deadband_hz: self.governor.deadband_hz.unwrap_or(own.deadband_hz),
        };
        let demand = DemandNoise {
            deviation_gw: self.demand.noise_gw.unwrap_or(0.0),
            time_s: self.demand.noise_time_s.unwrap_or(20.0),
        };
        let step = Disturbances::step(Scenario::of(spec).loss_gw);
        Ok(Disturbances {
            losses: if losses.is_empty() {
                step.losses
            } else {
                losses
            },
            governor,
            demand,
        })
    }

    /// Puts the file's errors and length into a scenario.
    pub fn apply(&self, scenario: &mut Scenario) {
        let errors = &self.errors;
        scenario.duration_s = self.duration_s.unwrap_or(scenario.duration_s);
        scenario.participation_error = errors.participation.unwrap_or(scenario.participation_error);
        scenario.measurement = errors.measurement.unwrap_or(scenario.measurement);
        scenario.delay_s = errors.delay_s.unwrap_or(scenario.delay_s);
    }
}
