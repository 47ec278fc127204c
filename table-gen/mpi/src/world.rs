//! The job that this process belongs to.
//!
//! A rank that dies ends the job. MPI's own errors are fatal by default, a killed process is seen
//! by `mpirun`, and a panic becomes an abort here: were the rank unwound, it would wait for the
//! others for ever.

use mpi::collective::SystemOperation;
use mpi::environment::Universe;
use mpi::request::WaitGuard;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives, Destination, Source};
use synth::game::exchange::Lost;
use synth::ranks::Transport;

/// Set by the launchers of Open MPI and of MPICH.
const LAUNCHED: [&str; 2] = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE"];

/// All ranks of the job. MPI is finished when it is dropped.
pub struct World {
    world: SimpleCommunicator,
    _universe: Universe,
}

impl World {
    /// Joins the job, if a launcher started this process as a rank of one and MPI allows threads
    /// beside the one that calls it.
    pub fn join() -> Option<Self> {
        if LAUNCHED.iter().all(|name| std::env::var_os(name).is_none()) {
            return None;
        }
        let (universe, threading) = mpi::initialize_with_threading(mpi::Threading::Funneled)?;
        if threading < mpi::Threading::Funneled {
            return None;
        }
        let shown = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            shown(info);
            std::process::abort();
        }));
        Some(Self {
            world: universe.world(),
            _universe: universe,
        })
    }
}

impl Transport for World {
    fn rank(&self) -> usize {
        self.world.rank() as usize
    }

    fn ranks(&self) -> usize {
        self.world.size() as usize
    }

    fn swap(
        &self,
        outgoing: &[(usize, Vec<u64>)],
        incoming: &[(usize, usize)],
    ) -> Result<Vec<Vec<u64>>, Lost> {
        let mut received: Vec<Vec<u64>> = incoming.iter().map(|(_, len)| vec![0; *len]).collect();
        mpi::request::scope(|scope| {
            let sends: Vec<_> = outgoing
                .iter()
                .map(|(rank, words)| {
                    let to = self.world.process_at_rank(*rank as i32);
                    WaitGuard::from(to.immediate_send(scope, &words[..]))
                })
                .collect();
            for ((rank, _), words) in incoming.iter().zip(&mut received) {
                let from = self.world.process_at_rank(*rank as i32);
                from.receive_into(&mut words[..]);
            }
            drop(sends);
        });
        Ok(received)
    }

    fn sum(&self, count: u64) -> Result<u64, Lost> {
        let mut sum = 0;
        self.world
            .all_reduce_into(&count, &mut sum, SystemOperation::sum());
        Ok(sum)
    }
}
