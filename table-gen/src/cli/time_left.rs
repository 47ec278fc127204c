//! How long a game may still take, as far as its sweeps tell.

use std::collections::VecDeque;
use std::time::Duration;

use indicatif::HumanDuration;
use synth::game::Sweep;

/// Sweeps that the estimate looks back on.
const WINDOW: usize = 4;
/// The cells that change must shrink at least by this factor a sweep for the game to count as dying
/// out.
const DYING_OUT: f64 = 0.8;

/// What the sweeps so far say about the time left \[s\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum TimeLeft {
    /// Fewer and fewer cells change: until the last one at the present pace.
    About(f64),
    /// Until every open cell has changed, at the present cells a second. A game may end before
    /// that, and slows down only if fewer cells change a sweep.
    AtMost(f64),
}

/// The last sweeps of a game.
#[derive(Debug, Default)]
pub(super) struct Pace {
    /// Time since the game began \[s\] and cells changed, oldest first.
    sweeps: VecDeque<(f64, usize)>,
}

impl Pace {
    /// Takes note of a sweep that ended so many seconds after the game began. `None` until a few
    /// sweeps are known, and where nothing changes any more.
    pub(super) fn after(&mut self, elapsed_s: f64, sweep: &Sweep) -> Option<TimeLeft> {
        self.sweeps.push_back((elapsed_s, sweep.changed));
        if self.sweeps.len() <= WINDOW {
            return None;
        }
        let (from_s, before) = self.sweeps.pop_front()?;
        let sweep_s = (elapsed_s - from_s) / WINDOW as f64;
        if sweep.changed == 0 || before == 0 {
            return None;
        }
        let changed = sweep.changed as f64;
        let factor = (changed / before as f64).powf(1.0 / WINDOW as f64);
        let at_most_s = sweep.open as f64 / changed * sweep_s;
        if factor <= DYING_OUT {
            // changed * factor^n falls below one cell, and one more sweep finds nothing.
            let sweeps = changed.ln() / -factor.ln() + 1.0;
            let about_s = sweeps * sweep_s;
            if about_s < at_most_s {
                return Some(TimeLeft::About(about_s));
            }
        }
        Some(TimeLeft::AtMost(at_most_s))
    }
}

impl std::fmt::Display for TimeLeft {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::About(s) => write!(f, "about {} left", duration(*s)),
            Self::AtMost(s) => write!(f, "at most {} left at this pace", duration(*s)),
        }
    }
}

/// A duration \[s\], rounded up to whole seconds.
fn duration(s: f64) -> HumanDuration {
    // No game lasts longer than that.
    const MOST_S: f64 = 1e9;
    HumanDuration(Duration::from_secs(s.ceil().clamp(0.0, MOST_S) as u64))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sweep(sweep: u16, changed: usize, open: usize) -> Sweep {
        Sweep {
            sweep,
            cells: 0,
            changed,
            open,
        }
    }

    /// A sweep a second, 100 cells each, 1000 left: ten sweeps more at most.
    #[test]
    fn a_steady_game_is_bounded_by_its_open_cells() {
        let mut pace = Pace::default();
        for n in 1..=4 {
            assert_eq!(pace.after(f64::from(n), &sweep(n, 100, 2000)), None);
        }
        let left = pace.after(5.0, &sweep(5, 100, 1000));
        assert_eq!(left, Some(TimeLeft::AtMost(10.0)));
        assert_eq!(
            left.unwrap().to_string(),
            "at most 10 seconds left at this pace"
        );
    }

    /// Half as many cells each sweep: 4096, ..., 256 and then eight sweeps down to one cell, and
    /// one that finds nothing.
    #[test]
    fn a_game_that_dies_out_ends_when_less_than_a_cell_is_left() {
        let mut pace = Pace::default();
        let mut left = None;
        for n in 0..=4u16 {
            left = pace.after(2.0 * f64::from(n), &sweep(n + 1, 4096 >> n, 1_000_000));
        }
        match left {
            Some(TimeLeft::About(s)) => assert!((s - 18.0).abs() < 1e-9, "{s}"),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn nothing_is_said_when_nothing_changes() {
        let mut pace = Pace::default();
        for n in 1..=4 {
            pace.after(f64::from(n), &sweep(n, 10, 50));
        }
        assert_eq!(pace.after(5.0, &sweep(5, 0, 10)), None);
    }
}
