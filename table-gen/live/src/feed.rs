//! The ticks of all chargers, numbered, for any number of readers.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use crate::tick::Tick;

/// Ticks that are kept for readers who come late or fall behind: ten minutes of one charger, or two
/// of five.
const KEPT: usize = 6_000;

/// A tick's number and its JSON.
pub type Numbered = (u64, Arc<str>);

#[derive(Debug, Default)]
struct Kept {
    /// Number of the oldest.
    first: u64,
    ticks: VecDeque<Arc<str>>,
}

/// The ticks. One writer for each charger, any number of readers.
#[derive(Debug, Default)]
pub struct Feed {
    kept: Mutex<Kept>,
    grown: Condvar,
}

impl Feed {
    /// A feed without ticks.
    pub fn new() -> Arc<Self> {
        Arc::default()
    }

    fn kept(&self) -> MutexGuard<'_, Kept> {
        // A writer that panicked left whole ticks behind.
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a tick.
    pub fn push(&self, tick: &Tick) {
        let Ok(text) = serde_json::to_string(tick) else {
            return;
        };
        let mut kept = self.kept();
        if kept.ticks.len() == KEPT {
            kept.ticks.pop_front();
            kept.first += 1;
        }
        kept.ticks.push_back(text.into());
        drop(kept);
        self.grown.notify_all();
    }

    /// The ticks from a number on, as soon as there is one; empty after this long without any. A
    /// reader who fell behind gets the oldest that are kept.
    pub fn wait(&self, from: u64, longest: Duration) -> Vec<Numbered> {
        let nothing_new = |kept: &mut Kept| kept.first + kept.ticks.len() as u64 <= from;
        let waited = self
            .grown
            .wait_timeout_while(self.kept(), longest, nothing_new);
        let (kept, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let skip = from.saturating_sub(kept.first) as usize;
        let numbers = kept.first + skip as u64..;
        numbers.zip(kept.ticks.iter().skip(skip).cloned()).collect()
    }
}
