//! The functionals of the state that are bounded at every sample.

use model::interval::Interval;

use super::adjoint::{Choice, Functional, Past};
use super::fleet_loop::FleetLoop;
use super::governor;
use super::unknown;
use super::window::{Sample, Window, meet};

/// The functionals that are bounded at every sample.
#[derive(Debug, Clone)]
pub(super) struct Watched {
    functionals: Vec<Functional>,
    best: Vec<[Choice; 2]>,
}

/// Places in [`Watched`].
const F: usize = 0;
const CHANGE: usize = 1;
const CHANGE_HALF: usize = 2;
const CHANGE_WINDOW: usize = 3;
const CHANGE_SLOPE: usize = 4;
const NET: usize = 5;
const TURBINE: usize = 6;
const FIRST_STATE: usize = 7;
/// Watched only where rate or output of the governors is limited, or time constants are not known.
const GAP: usize = 10;
/// Watched only where time constants are not known.
const LAG: usize = 11;

impl Watched {
    pub(super) fn new(number: &FleetLoop, window: &Window) -> Self {
        let damping = number.damping_mid;
        let mut functionals = vec![
            Functional::state(0),
            Functional::change(1),
            Functional::change((window.length() / 2).max(1)),
            Functional::change(window.length().max(1)),
            Functional::change(window.slope),
            Functional {
                row: [-damping, 0.0, 0.0, 1.0],
                earlier: Vec::new(),
                loss: -1.0,
            },
            Functional {
                row: [0.0, 0.0, 1.0, -1.0],
                ..Functional::state(0)
            },
        ];
        functionals.extend((1..4).map(Functional::state));
        if unknown::watches_gap(number) {
            functionals.push(Functional {
                row: [number.gain_mid, -1.0, 0.0, 0.0],
                ..Functional::state(0)
            });
        }
        if number.unknown_times.is_some() {
            functionals.push(Functional {
                row: [0.0, 1.0, -1.0, 0.0],
                ..Functional::state(0)
            });
        }
        let best = vec![[(0, 2), (0, 2)]; functionals.len()];
        Self { functionals, best }
    }

    /// Bounds of the sample k, without slope response and slack, and of its state. `tried` choices
    /// are tried for each.
    pub(super) fn bounds(
        &mut self,
        past: &Past<'_>,
        k: usize,
        tried: &[Choice],
    ) -> (Sample, [Interval; 4]) {
        let ranges: Vec<Interval> = self
            .functionals
            .iter()
            .zip(&mut self.best)
            .map(|(functional, best)| past.range(k, functional, tried, best))
            .collect();
        let f = ranges[F];
        let radius = past.loop_.damping_radius * f.magnitude();
        let net = ranges[NET]
            + Interval {
                low: -radius,
                high: radius,
            };
        let [g, l, p] = [0, 1, 2].map(|axis| ranges[FIRST_STATE + axis]);
        let g = meet(g, governor::output(&past.loop_.governor));
        let governor = if governor::is_limited(&past.loop_.governor) {
            g
        } else {
            Interval::ZERO
        };
        let sample = Sample {
            f,
            change: ranges[CHANGE],
            change_half: ranges[CHANGE_HALF],
            change_window: ranges[CHANGE_WINDOW],
            change_slope: ranges[CHANGE_SLOPE],
            net,
            turbine: ranges[TURBINE],
            slope_response: Interval::ZERO,
            slack: 0.0,
            rate: 0.0,
            governor,
            gap: ranges.get(GAP).copied().unwrap_or(Interval::ZERO),
            lag: ranges.get(LAG).copied().unwrap_or(Interval::ZERO),
        };
        (sample, [f, g, l, p])
    }
}
