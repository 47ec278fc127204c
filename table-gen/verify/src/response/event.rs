//! From the event on: bounds of every sample, forward in time.

use model::interval::Interval;

use super::adjoint::{Choice, Past, Step, choices};
use super::fleet_loop::FleetLoop;
use super::for_ever::Reproduced;
use super::watched::Watched;
use super::window::{F_MOST_HZ, Sample, Samples, Window, meet};

/// Sweeps that are tried beside the one that was best at the sample before: one of all in turn, so
/// that a better one is found soon.
const TRIED: usize = 2;

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
