//! From the event on: bounds of every sample, forward in time.

use model::interval::Interval;

use super::adjoint::{Choice, Functional, Past, Step, choices};
use super::fleet_loop::FleetLoop;
use super::for_ever::Reproduced;
use super::window::{F_MOST_HZ, Sample, Samples, Window, meet};

/// Sweeps that are tried beside the one that was best at the sample before: one of all in turn, so
/// that a better one is found soon.
const TRIED: usize = 2;

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
        };
        let [g, l, p] = [0, 1, 2].map(|axis| ranges[FIRST_STATE + axis]);
        (sample, [f, g, l, p])
    }
}

/// What is known from the event up to a time.
#[derive(Debug, Clone)]
pub(super) struct Event<'a> {
    /// The samples.
    pub(super) samples: Samples<'a>,
    /// The steps and states.
    pub(super) past: Past<'a>,
}

impl<'a> Event<'a> {
    /// Bounds of every sample up to a time, from rest, or from a state in which the bounds `before`
    /// hold and go on to hold. Ends early where f may leave ±[`F_MOST_HZ`].
    pub(super) fn follow(
        number: &'a FleetLoop,
        window: Window,
        before: Option<Reproduced>,
        duration_s: f64,
        memory: usize,
    ) -> Self {
        let mut watched = Watched::new(number, &window);
        let mut samples = Samples {
            number,
            window,
            samples: Vec::new(),
            repeats: false,
            before: before.map(|b| b.sample),
        };
        let mut past = Past {
            loop_: number,
            steps: Vec::new(),
            repeats: false,
            states: Vec::new(),
            memory,
            most: number.chain_most(F_MOST_HZ),
            before: before.map(|b| b.state),
        };
        let all: Vec<Choice> = choices().collect();
        let steps = number.steps_up(duration_s);
        for k in 0..=steps {
            let first = (k * TRIED) % all.len();
            let tried: Vec<Choice> = (0..TRIED).map(|n| all[(first + n) % all.len()]).collect();
            let (mut sample, mut state) = watched.bounds(&past, k, &tried);
            // Until its own step is known, that of the step before.
            let last: Option<&Step> = past.steps.last();
            sample.slack = last.map_or(0.0, |step| step.slack);
            sample.rate = last.map_or(0.0, |step| step.rate);
            samples.samples.push(sample);
            sample.slope_response = samples.slope_response(k, sample.change_slope);
            if let Some(before) = &before {
                sample = Sample {
                    slack: before.sample.slack,
                    rate: before.sample.rate,
                    ..sample.meet(&before.sample)
                };
                state = std::array::from_fn(|axis| meet(state[axis], before.state[axis]));
            }
            if let Some(last) = samples.samples.last_mut() {
                *last = sample;
            }
            let step = samples.step(k);
            if let Some(sample) = samples.samples.last_mut() {
                sample.slack = step.slack;
                sample.rate = step.rate;
            }
            past.steps.push(step);
            past.states.push(state);
            if sample.f.magnitude() >= F_MOST_HZ {
                break;
            }
        }
        Self { samples, past }
    }

    /// Bounds of f in the step that begins at sample k, between the samples too.
    pub(super) fn tube(&self, k: usize) -> Interval {
        let samples = &self.samples.samples;
        let here = samples.get(k).map_or(Interval::ZERO, |s| s.f);
        let next = samples.get(k + 1).map_or(here, |s| s.f);
        let slack = samples.get(k).map_or(0.0, |s| s.slack);
        let both = here.join(next);
        Interval {
            low: (both.low - slack).next_down(),
            high: (both.high + slack).next_up(),
        }
    }
}
