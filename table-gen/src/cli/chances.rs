//! Options for what is uncertain in a run.

use lab::simulation::monte_carlo::draws::Draws;
use model::spec::Spec;

use super::Failure;
use super::band::{Band, PerState};

/// What is uncertain in a run.
#[derive(Debug, Clone, Copy, clap::Args)]
pub(super) struct Chances {
    /// Lost infeed [GW]; default: the middle of the spec's band. With --runs a band LOW,HIGH;
    /// default: the spec's
    #[arg(long, value_name = "GW", allow_hyphen_values = true)]
    pub(super) loss_gw: Option<Band>,
    /// Relative error of the delivered participation, drawn each tick; default 0, with --runs the
    /// spec's
    #[arg(long, value_name = "X", allow_negative_numbers = true)]
    pub(super) participation_error: Option<f64>,
    /// Error of the measured state, drawn each tick [Hz,GW,GW,GW]; default 0, with --runs the
    /// spec's
    #[arg(long, value_name = "F,G,L,P", allow_hyphen_values = true)]
    pub(super) measurement_error: Option<PerState>,
    /// Time from a command to its power [s]; default: the spec's, of a range the most. With --runs
    /// also a band LOW,HIGH; default: the spec's range
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    pub(super) delay_s: Option<Band>,
}

impl Chances {
    /// The bands of a spec, as the options change them.
    pub(super) fn draws(&self, spec: &Spec, duration_s: Option<f64>) -> Result<Draws, Failure> {
        let mut draws = Draws::of(spec);
        draws.duration_s = duration_s.unwrap_or(draws.duration_s);
        draws.participation_error = self
            .participation_error
            .unwrap_or(draws.participation_error);
        if let Some(band) = self.loss_gw {
            draws.loss_gw = band.0;
        }
        if let Some(band) = self.delay_s {
            draws.delay_s = band.0;
        }
        if let Some(bounds) = self.measurement_error {
            draws.measurement_error = bounds.0;
        }
        draws.check().map_err(Failure::bad)?;
        Ok(draws)
    }
}
