//! Progress of long work on stderr, and the way to interrupt it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::output::grouped;
use crate::game::{Sweep, Watch};

/// Work shorter than this shows no progress.
const QUIET: Duration = Duration::from_secs(1);

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// From now on Ctrl-C interrupts work at its next checkpoint instead of killing the process: nothing half-written stays.
pub(super) fn catch_interrupts() {
    // A second call, or a system without signals, leaves the default behaviour.
    let _ = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::SeqCst) {
            // Asked twice: go at once.
            std::process::exit(130);
        }
    });
}

/// Whether Ctrl-C was pressed.
pub(super) fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::SeqCst)
}

/// Shows the sweeps of a game.
pub(super) struct GameProgress {
    name: &'static str,
    bar: ProgressBar,
    start: Instant,
}

impl GameProgress {
    /// Progress of the game of a law.
    pub(super) fn new(name: &'static str) -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}") {
            bar.set_style(style);
        }
        Self {
            name,
            bar,
            start: Instant::now(),
        }
    }
}

impl Watch for GameProgress {
    fn sweep(&self, sweep: &Sweep) -> bool {
        let elapsed = self.start.elapsed();
        if elapsed > QUIET {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
            self.bar.set_message(format!(
                "{} sweep {}: {} cells, {} changed, {:.0} s",
                self.name,
                sweep.sweep,
                grouped(sweep.cells),
                grouped(sweep.changed),
                elapsed.as_secs_f64(),
            ));
            self.bar.tick();
        }
        !interrupted()
    }
}

impl Drop for GameProgress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// An observer for a game, as synthesis asks for.
pub(super) fn watch(name: &'static str) -> Box<dyn Watch> {
    Box::new(GameProgress::new(name))
}

/// Shows the share of a piece of work that is done; the function it returns answers whether to go on.
pub(super) fn share(name: &'static str) -> impl Fn(f64) -> bool {
    let progress = GameProgress::new(name);
    move |done| {
        let elapsed = progress.start.elapsed();
        if elapsed > QUIET {
            progress.bar.set_draw_target(ProgressDrawTarget::stderr());
            progress.bar.set_message(format!(
                "{name}: {:.0} %, {:.0} s",
                100.0 * done,
                elapsed.as_secs_f64()
            ));
            progress.bar.tick();
        }
        !interrupted()
    }
}
