//! Progress of long work on stderr, and the way to interrupt it.
//!
//! On a terminal one line is drawn over and over; elsewhere (a log, a pipe) a plain line comes
//! every half a minute. Work of less than a second shows nothing.

use std::io::{IsTerminal, Write};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::output::grouped;
use super::time_left::Pace;
use synth::game::{Sweep, Watch};

/// Work shorter than this shows no progress.
const QUIET: Duration = Duration::from_secs(1);
/// Between two lines where stderr is no terminal.
const SPARSE: Duration = Duration::from_secs(30);

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// From now on Ctrl-C interrupts work at its next checkpoint instead of killing the process:
/// nothing half-written stays.
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

/// The line on stderr.
struct Line {
    bar: ProgressBar,
    terminal: bool,
    start: Instant,
    /// Of the last plain line.
    shown: Mutex<Instant>,
}

impl Line {
    fn new() -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}") {
            bar.set_style(style);
        }
        let start = Instant::now();
        Self {
            bar,
            terminal: std::io::stderr().is_terminal(),
            start,
            shown: Mutex::new(start),
        }
    }

    /// Shows a text if it is time for one.
    fn show(&self, text: impl FnOnce(Duration) -> String) {
        let elapsed = self.start.elapsed();
        if self.terminal {
            if elapsed > QUIET {
                self.bar.set_draw_target(ProgressDrawTarget::stderr());
                self.bar.set_message(text(elapsed));
                self.bar.tick();
            }
        } else if let Ok(mut shown) = self.shown.lock()
            && shown.elapsed() > SPARSE
        {
            *shown = Instant::now();
            // A closed pipe ends the output, not the program.
            let _ = writeln!(std::io::stderr(), "{}", text(elapsed));
        }
    }
}

impl Drop for Line {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// Shows the sweeps of a game.
struct GameProgress {
    name: &'static str,
    line: Line,
    pace: Mutex<Pace>,
}

impl Watch for GameProgress {
    fn sweep(&self, sweep: &Sweep) -> bool {
        let left = match self.pace.lock() {
            Ok(mut pace) => pace.after(self.line.start.elapsed().as_secs_f64(), sweep),
            Err(_) => None,
        };
        self.line.show(|elapsed| {
            let mut text = format!(
                "{} sweep {}: {} cells, {} changed, {:.0} s",
                self.name,
                sweep.sweep,
                grouped(sweep.cells),
                grouped(sweep.changed),
                elapsed.as_secs_f64(),
            );
            if let Some(left) = left {
                text.push_str(&format!(", {left}"));
            }
            text
        });
        !interrupted()
    }

    fn guarded(&self, share: f64) {
        self.line.show(|elapsed| {
            let s = elapsed.as_secs_f64();
            let left = match share {
                0.0 => String::new(),
                share => format!(", {:.0} s left", s * (1.0 - share) / share),
            };
            format!(
                "{} guard: {:.0} %, {s:.0} s{left}",
                self.name,
                100.0 * share
            )
        });
    }
}

/// An observer for a game, as synthesis asks for.
pub(super) fn watch(name: &'static str) -> Box<dyn Watch> {
    Box::new(GameProgress {
        name,
        line: Line::new(),
        pace: Mutex::new(Pace::default()),
    })
}

/// Shows the share of a piece of work that is done; the function it returns answers whether to go
/// on.
pub(super) fn share(name: &'static str) -> impl Fn(f64) -> bool {
    let line = Line::new();
    move |done| {
        line.show(|elapsed| {
            format!(
                "{name}: {:.0} %, {:.0} s",
                100.0 * done,
                elapsed.as_secs_f64()
            )
        });
        !interrupted()
    }
}
