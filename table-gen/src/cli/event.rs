//! What is known of a recorded event besides its record: options that commands share.

use super::Failure;
use lab::identify::Known;
use lab::identify::course::Stage;
use lab::identify::parameters::{COUNT, PARAMETERS};
use lab::simulation::beyond::file::ScenarioFile;

/// What was lost, and what is known of the plant.
#[derive(Debug, clap::Args)]
pub(super) struct EventArgs {
    /// What was lost, at once [GW]
    #[arg(long, value_name = "GW", help_heading = "Recorded event")]
    loss_gw: Option<f64>,
    /// What was lost, in stages: a shipped scenario such as gb-2019, or a TOML file of [[loss]]
    #[arg(
        long,
        value_name = "FILE",
        conflicts_with = "loss_gw",
        help_heading = "Recorded event"
    )]
    loss_steps: Option<String>,
    /// A parameter that is known, e.g. plant.inertia_gw_s_per_hz=4.2; repeatable
    #[arg(long, value_name = "KEY=VALUE", help_heading = "Recorded event")]
    given: Vec<String>,
}

impl EventArgs {
    /// What they say, for the part of a record up to a time after the steepest second \[s\].
    pub(super) fn known(&self, until_s: f64) -> Result<Known, Failure> {
        within("--until-s", until_s, 2.0, 600.0)?;
        let mut stages = Vec::new();
        if let Some(power_gw) = self.loss_gw {
            within("--loss-gw", power_gw, 0.001, 100.0)?;
            stages.push(Stage {
                after_s: 0.0,
                power_gw,
                inertia_gw_s_per_hz: 0.0,
            });
        }
        if let Some(name) = &self.loss_steps {
            let file = ScenarioFile::load(name).map_err(Failure::bad)?;
            stages.extend(file.losses().iter().map(|loss| Stage {
                after_s: loss.at_s,
                power_gw: loss.power_gw,
                inertia_gw_s_per_hz: loss.inertia_gw_s_per_hz,
            }));
            if stages.is_empty() {
                return Err(Failure::BadInput(format!(
                    "{name}: no [[loss]]; allowed: at least one"
                )));
            }
        }
        let given = self
            .given
            .iter()
            .map(|text| given(text))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Known {
            stages,
            given,
            until_s,
        })
    }
}

fn within(option: &str, value: f64, low: f64, high: f64) -> Result<(), Failure> {
    if value >= low && value <= high {
        Ok(())
    } else {
        Err(Failure::BadInput(format!(
            "{option} = {value} is out of range: {low} to {high}"
        )))
    }
}

/// A parameter that is known.
fn given(text: &str) -> Result<(usize, f64), Failure> {
    let keys = || PARAMETERS.map(|parameter| parameter.key).join(", ");
    let refuse = || {
        let keys = keys();
        Failure::BadInput(format!(
            "--given {text}: allowed: KEY=NUMBER with KEY one of {keys}"
        ))
    };
    let (key, value) = text.split_once('=').ok_or_else(refuse)?;
    let index = (0..COUNT).find(|index| PARAMETERS[*index].key == key);
    let value: f64 = value.trim().parse().map_err(|_| refuse())?;
    Ok((index.ok_or_else(refuse)?, value))
}
