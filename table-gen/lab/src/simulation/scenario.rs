//! What happens to the grid in a run.

use model::spec::Spec;

/// A scenario: the event and the errors of this run.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// Lost infeed, a step at time 0 \[GW\].
    pub loss_gw: f64,
    /// Length of the run \[s\].
    pub duration_s: f64,
    /// Relative error of the delivered participation; each tick draws uniformly from ± this.
    pub participation_error: f64,
    /// Error of the measured state (f, g, l, p); each tick draws uniformly from ± this \[Hz, GW\].
    pub measurement: [f64; 4],
    /// Time from a command to its power \[s\].
    pub delay_s: f64,
    /// Time from the event to the firmware's first tick \[s\].
    pub event_offset_s: f64,
    /// Seed of everything that is drawn.
    pub seed: u64,
    /// Grid state when the event comes (f, g, l, p) \[Hz, GW\].
    pub initial: [f64; 4],
}

/// Length of a run if none is asked for \[s\]: the slow mode (-0.077 1/s) has decayed by e^-23.
pub const DURATION_S: f64 = 300.0;
/// Longest run that is simulated \[s\].
pub const DURATION_S_MAX: f64 = 86_400.0;

/// Why a scenario is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{option} = {value} is out of range: {allowed}")]
pub struct ScenarioError {
    /// The option of the command line.
    pub option: &'static str,
    /// Its value.
    pub value: f64,
    /// What is allowed.
    pub allowed: &'static str,
}

impl Scenario {
    /// The event of a spec: the middle of its loss band, from the middle of its initial box, no
    /// error.
    pub fn of(spec: &Spec) -> Self {
        let [low, high] = spec.uncertainty.loss_gw;
        let initial = &spec.uncertainty.initial;
        Self {
            loss_gw: 0.5 * (low + high),
            duration_s: DURATION_S,
            participation_error: 0.0,
            measurement: [0.0; 4],
            event_offset_s: 0.0,
            delay_s: spec.uncertainty.actuation_delay_s.most_s(),
            seed: 0,
            initial: std::array::from_fn(|d| 0.5 * (initial.lower[d] + initial.upper[d])),
        }
    }

    /// Checks every number.
    ///
    /// # Errors
    /// The first number that is not finite or out of range.
    pub fn check(&self) -> Result<(), ScenarioError> {
        let within = |option, value: f64, low: f64, high: f64, allowed| {
            if value >= low && value <= high {
                Ok(())
            } else {
                Err(ScenarioError {
                    option,
                    value,
                    allowed,
                })
            }
        };
        within("--loss-gw", self.loss_gw, -100.0, 100.0, "-100 to 100 GW")?;
        if self.duration_s <= 0.0 {
            within(
                "--duration-s",
                self.duration_s,
                f64::MIN_POSITIVE,
                1.0,
                "above 0 to 86400 s",
            )?;
        }
        within(
            "--duration-s",
            self.duration_s,
            0.0,
            DURATION_S_MAX,
            "above 0 to 86400 s",
        )?;
        let share = self.participation_error;
        within("--participation-error", share, 0.0, 1.0, "0 to 1")?;
        within("--delay-s", self.delay_s, 0.0, 60.0, "0 to 60 s")?;
        for value in self.measurement {
            within("--measurement-error", value, 0.0, 10.0, "0 to 10 each")?;
        }
        for value in self.initial {
            within(
                "uncertainty.initial",
                value,
                -2000.0,
                2000.0,
                "finite, within 2000",
            )?;
        }
        Ok(())
    }
}
