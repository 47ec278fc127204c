//! Ranks as threads of one process: the way in which the slabs are tested where there is no MPI.

use std::sync::Mutex;
use std::sync::mpsc::{Receiver, Sender, channel};

use super::Transport;
use crate::game::exchange::Lost;

type Words = Vec<u64>;

/// One rank of a number of threads.
pub struct ThreadRank {
    rank: usize,
    /// To every rank, and from every rank.
    to: Vec<Sender<Words>>,
    from: Vec<Receiver<Words>>,
}

/// Ranks that can talk to one another; each belongs on a thread of its own.
pub fn ranks(count: usize) -> Vec<ThreadRank> {
    let mut all: Vec<ThreadRank> = (0..count)
        .map(|rank| ThreadRank {
            rank,
            to: Vec::new(),
            from: Vec::new(),
        })
        .collect();
    // The channel from a to b; both lists end up in the order of the other's rank.
    for a in 0..count {
        for b in 0..count {
            let (sender, receiver) = channel();
            all[a].to.push(sender);
            all[b].from.push(receiver);
        }
    }
    all
}

/// Runs a function on so many ranks at once, and returns what each returned, in their order.
pub fn run<R: Send>(count: usize, call: impl Fn(&ThreadRank) -> R + Sync) -> Vec<R> {
    let (call, results) = (&call, Mutex::new(Vec::new()));
    let found = &results;
    std::thread::scope(|scope| {
        for rank in ranks(count) {
            scope.spawn(move || {
                let result = call(&rank);
                if let Ok(mut found) = found.lock() {
                    found.push((rank.rank, result));
                }
            });
        }
    });
    let mut results = results.into_inner().unwrap_or_default();
    results.sort_by_key(|(rank, _)| *rank);
    results.into_iter().map(|(_, result)| result).collect()
}

impl Transport for ThreadRank {
    fn rank(&self) -> usize {
        self.rank
    }

    fn ranks(&self) -> usize {
        self.to.len()
    }

    fn swap(
        &self,
        outgoing: &[(usize, Words)],
        incoming: &[(usize, usize)],
    ) -> Result<Vec<Words>, Lost> {
        let gone = |rank: &usize| Lost(format!("rank {rank} has ended"));
        for (rank, words) in outgoing {
            self.to[*rank].send(words.clone()).map_err(|_| gone(rank))?;
        }
        let receive = |(rank, expected): &(usize, usize)| {
            let words = self.from[*rank].recv().map_err(|_| gone(rank))?;
            if words.len() == *expected {
                Ok(words)
            } else {
                Err(Lost(format!(
                    "rank {rank} sent {} words instead of {expected}",
                    words.len()
                )))
            }
        };
        incoming.iter().map(receive).collect()
    }

    fn sum(&self, count: u64) -> Result<u64, Lost> {
        let others: Vec<usize> = super::others(self).collect();
        let outgoing: Vec<_> = others.iter().map(|rank| (*rank, vec![count])).collect();
        let incoming: Vec<_> = others.iter().map(|rank| (*rank, 1)).collect();
        let counts = self.swap(&outgoing, &incoming)?;
        Ok(counts.iter().map(|words| words[0]).sum::<u64>() + count)
    }
}
