//! Commands whose work is a list of items: shared out between the ranks of an MPI job, or done by
//! this process alone. The first rank tells; the others are silent.

use serde::Serialize;
use serde::de::DeserializeOwned;
use synth::game::Watch;
#[cfg(feature = "mpi")]
use synth::ranks::{Transport as _, shares};

use super::{Failure, progress};

/// This process, or the job that it is a rank of.
pub(super) struct Job {
    #[cfg(feature = "mpi")]
    world: Option<mpi_ranks::World>,
}

impl Job {
    /// Joins the job that started this process, if one did. At most once in a process.
    pub(super) fn join() -> Self {
        Self {
            #[cfg(feature = "mpi")]
            world: mpi_ranks::World::join(),
        }
    }

    /// Whether this process tells what was found.
    pub(super) fn tells(&self) -> bool {
        #[cfg(feature = "mpi")]
        if let Some(world) = &self.world {
            return world.rank() == 0;
        }
        true
    }

    /// The progress of a game, shown by the process that tells.
    pub(super) fn watch(&self, name: &'static str) -> Box<dyn Watch> {
        if self.tells() {
            progress::watch(name)
        } else {
            Box::new(synth::game::Unwatched)
        }
    }

    /// Answers to all items in their order; `None` in a process that tells nothing. `work` answers
    /// those that it is given, one by one in their order; if it fails anywhere, all of it does.
    pub(super) fn answers<I: Clone, A: Serialize + DeserializeOwned>(
        &self,
        items: &[I],
        work: impl FnOnce(&[I]) -> Result<Vec<A>, Failure>,
    ) -> Result<Option<Vec<A>>, Failure> {
        #[cfg(feature = "mpi")]
        if let Some(world) = &self.world {
            let own = shares::own(world, items);
            let answers: Vec<Result<A, Failure>> = match work(&own) {
                Ok(answers) => answers.into_iter().map(Ok).collect(),
                Err(failure) => own.iter().map(|_| Err(failure.clone())).collect(),
            };
            let bytes: Result<Vec<Vec<u8>>, _> = answers.iter().map(serde_json::to_vec).collect();
            let all = shares::collect(world, &bytes.map_err(Failure::bad)?)
                .map_err(|lost| Failure::No(lost.to_string()))?;
            let Some(all) = all else { return Ok(None) };
            let read = |bytes: &Vec<u8>| -> Result<A, Failure> {
                serde_json::from_slice::<Result<A, Failure>>(bytes).map_err(Failure::bad)?
            };
            return all.iter().map(read).collect::<Result<_, _>>().map(Some);
        }
        work(items).map(Some)
    }
}
