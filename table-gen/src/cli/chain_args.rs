//! Options that `prob` and `maximise` share: a table, its spec, and how its chain is built.

use std::path::PathBuf;

use ::prob::closed_loop::Settings;
use ::prob::participation::Participation;
use firmware::table::TableView;
use model::spec::Spec;

use super::{Failure, OutputArgs, Overrides};

/// Time over which the promise is bounded where the spec has no horizon \[s\].
const HORIZON_S: f64 = 120.0;
/// Width of a bin of the fleet's power \[GW\].
const BIN_GW: f64 = 0.0025;
/// Nodes after which a chain is followed no more.
const NODES_MAX: usize = 500_000;

/// A table, its spec and its chain.
#[derive(Debug, clap::Args)]
pub(super) struct ChainArgs {
    /// The table
    #[arg(value_name = "TABLE")]
    table: PathBuf,
    /// Name of a shipped spec, or path of a TOML file
    #[arg(long, value_name = "SPEC")]
    spec: String,
    #[command(flatten)]
    overrides: Overrides,
    #[command(flatten)]
    pub(super) output: OutputArgs,
    /// Error of the delivered participation, drawn anew each period: exact, uniform:BOUND,
    /// gaussian:SIGMA[,DEVIATIONS], truncated:SIGMA,BOUND or bernoulli:CHARGERS; default:
    /// chance.participation
    #[arg(long, value_name = "KIND")]
    participation: Option<Participation>,
    /// Time over which the promise is bounded; default: the spec's horizon, or 120 [s]
    #[arg(long, value_name = "S")]
    horizon_s: Option<f64>,
    /// Width of a bin of the fleet's power [GW]
    #[arg(long, value_name = "GW", default_value_t = BIN_GW)]
    bin_gw: f64,
    /// Nodes after which a chain is followed no more; what is not followed counts as failed
    #[arg(long, value_name = "N", default_value_t = NODES_MAX)]
    nodes_max: usize,
}

impl ChainArgs {
    /// Loads the spec.
    pub(super) fn spec(&self) -> Result<Spec, Failure> {
        self.overrides.load(&self.spec)
    }

    /// The table's bytes.
    pub(super) fn bytes(&self) -> Result<Vec<u8>, Failure> {
        std::fs::read(&self.table)
            .map_err(|error| Failure::BadInput(format!("{}: {error}", self.table.display())))
    }

    /// How the participation is drawn, if the options or the spec say so.
    pub(super) fn drawn(&self, spec: &Spec) -> Option<Participation> {
        self.participation.or(spec.chance.drawn())
    }

    /// How the chain is built.
    pub(super) fn settings(&self, spec: &Spec) -> Result<Settings, Failure> {
        let plain = plain(spec);
        let horizon_s = self.horizon_s.unwrap_or(plain.horizon_s);
        Ok(Settings {
            bin_gw: within("--bin-gw", self.bin_gw, [0.0, 1.0])?,
            nodes_max: self.nodes_max,
            horizon_s: within("--horizon-s", horizon_s, [0.0, 3600.0])?,
        })
    }
}

/// How a chain is built where no option says otherwise.
pub(super) fn plain(spec: &Spec) -> Settings {
    Settings {
        bin_gw: BIN_GW,
        nodes_max: NODES_MAX,
        horizon_s: spec.requirements.horizon_s.unwrap_or(HORIZON_S),
    }
}

/// The bytes as the firmware reads them.
pub(super) fn view(bytes: &[u8]) -> Result<TableView<'_>, Failure> {
    TableView::parse(bytes)
        .map_err(|error| Failure::BadInput(format!("the firmware rejects the table: {error:?}")))
}

/// An option's value, if it is above the low end and at most the high one.
pub(super) fn within(name: &str, value: f64, [low, high]: [f64; 2]) -> Result<f64, Failure> {
    if value > low && value <= high {
        return Ok(value);
    }
    Err(Failure::BadInput(format!(
        "{name} = {value}: above {low} and at most {high} is allowed"
    )))
}
