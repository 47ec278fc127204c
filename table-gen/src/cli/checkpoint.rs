//! `--checkpoint DIR`: long games that can be interrupted.

use std::path::PathBuf;
use std::time::Duration;

use super::{Failure, progress};
use model::spec::Spec;
use synth::checkpoint::Checkpoints;
use synth::game::GameError;
use synth::synthesis::{self, Synthesis, SynthesisError};

/// Where unfinished games are kept.
#[derive(Debug, clap::Args)]
pub(super) struct CheckpointArgs {
    /// Keep unfinished games in this folder, and go on from those in it; it is emptied when the
    /// games are done
    #[arg(long, value_name = "DIR")]
    checkpoint: Option<PathBuf>,
    /// Seconds between two writes of a game
    #[arg(
        long,
        value_name = "SECONDS",
        default_value_t = 60,
        requires = "checkpoint"
    )]
    checkpoint_every: u64,
}

impl CheckpointArgs {
    /// Whether a folder was given.
    #[cfg(feature = "mpi")]
    pub(super) fn is_asked(&self) -> bool {
        self.checkpoint.is_some()
    }

    /// Plays the games of a spec.
    pub(super) fn synthesise(&self, spec: &Spec) -> Result<Synthesis, Failure> {
        let Some(folder) = &self.checkpoint else {
            return Ok(synthesis::synthesise(spec, &progress::watch)?);
        };
        let every = Duration::from_secs(self.checkpoint_every);
        let checkpoints = Checkpoints::open(folder, spec, every).map_err(Failure::bad)?;
        let watch = |game| checkpoints.watch(game, progress::watch(game));
        let result = synthesis::synthesise(spec, &watch);
        if let Some(failure) = checkpoints.failure() {
            return Err(Failure::bad(failure));
        }
        if let Err(SynthesisError::Game {
            game,
            error: GameError::Interrupted,
        }) = &result
        {
            return Err(Failure::No(format!(
                "{game}: interrupted; the same command goes on from {}",
                folder.display()
            )));
        }
        checkpoints.done().map_err(Failure::bad)?;
        Ok(result?)
    }
}
