//! Options that several commands share.

use clap::Args;
use model::spec::Spec;

use super::failure::Failure;

/// The spec and what overrides it.
#[derive(Debug, Clone, Args)]
pub(crate) struct SpecArgs {
    /// Name of a shipped spec, or path of a TOML file
    #[arg(value_name = "SPEC")]
    pub(super) spec: String,
    #[command(flatten)]
    pub(super) overrides: Overrides,
}

/// Options of every command that reads a spec.
#[derive(Debug, Clone, Args)]
pub(crate) struct Overrides {
    /// Override a key of the spec, e.g. plant.inertia_gw_s_per_hz=3; KEY=none removes an optional
    /// one
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(super) set: Vec<String>,
}

/// Options of every command.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct OutputArgs {
    /// Print one JSON object on stdout and nothing else there
    #[arg(long)]
    pub(super) json: bool,
}

impl SpecArgs {
    /// Loads the spec.
    pub(super) fn load(&self) -> Result<Spec, Failure> {
        self.overrides.load(&self.spec)
    }
}

impl Overrides {
    /// Loads a spec by name or path.
    pub(super) fn load(&self, spec: &str) -> Result<Spec, Failure> {
        Ok(Spec::load(spec, &self.set)?)
    }
}
