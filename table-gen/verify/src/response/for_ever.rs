//! For ever: bounds that reproduce themselves.
//!
//! # Derivation
//! Let R be bounds of all watched functionals at one sample, and suppose that they held at every
//! sample of the last M + W steps, M the memory and W the steps that lines and slopes look back.
//! From R follow lines that bound the fleet in each of these steps, and a sweep over M steps that
//! ends in R's bounds of the state bounds each functional at the next sample. If those lie inside
//! R, then R holds at the next sample too, and by induction at all later ones. R begins as what was
//! found over the last M + W steps after the event.

use model::interval::Interval;

use super::adjoint::{Choice, Past, Step, choices};
use super::fleet_loop::FleetLoop;
use super::governor;
use super::unknown;
use super::watched::Watched;
use super::window::{F_MOST_HZ, Sample, Samples, Window, meet};

/// By how much R is widened where it did not reproduce itself, relative to its width and at least
/// \[Hz or GW\].
const WIDEN: f64 = 0.02;
const WIDEN_LEAST: f64 = 1e-5;
/// Attempts.
const ROUNDS: usize = 200;

/// Bounds of f for ever, from the end of what is known of an event; nothing if none were found.
pub(super) fn after(samples: &Samples<'_>, past: &Past<'_>, memory: usize) -> Option<Interval> {
    let first = samples
        .samples
        .len()
        .checked_sub(memory + look_back(&samples.window))?;
    let sample = samples.samples.get(first..)?.iter().copied().reduce(join)?;
    let state = past
        .states
        .get(first..)?
        .iter()
        .copied()
        .reduce(|a, b| std::array::from_fn(|axis| a[axis].join(b[axis])))?;
    reproduced(samples.number, samples.window, memory, sample, state).map(|b| b.tube())
}

/// Bounds of f for ever, from rest, whenever the loss rises: R begins as the rest before the event.
/// Nothing if none were found. The band of the loss holds 0: what was lost before the event.
pub(super) fn from_rest(number: &FleetLoop, window: Window, memory: usize) -> Option<Reproduced> {
    let state = number.assumed.initial.map(|radius| Interval {
        low: -radius,
        high: radius,
    });
    let drift = |steps: usize| {
        let most = (number.rate_before * number.step_s * steps as f64).next_up();
        Interval {
            low: -most,
            high: most,
        }
    };
    let [f, g, l, p] = number.assumed.initial;
    let watched = |is: bool, range: Interval| if is { range } else { Interval::ZERO };
    let within = |most: f64| Interval {
        low: -most.next_up(),
        high: most.next_up(),
    };
    let net = p + number.damping_most * f;
    let sample = Sample {
        f: state[0],
        change: drift(1),
        change_half: drift((window.length() / 2).max(1)),
        change_window: drift(window.length().max(1)),
        change_slope: drift(window.slope),
        net: Interval {
            low: (-net).next_down(),
            high: net.next_up(),
        },
        turbine: Interval {
            low: -(l + p).next_up(),
            high: (l + p).next_up(),
        },
        slope_response: Interval::ZERO,
        slack: 0.0,
        rate: number.rate_before,
        governor: watched(
            governor::is_limited(&number.governor),
            meet(state[1], governor::output(&number.governor)),
        ),
        gap: watched(
            unknown::watches_gap(number),
            within(number.gain_most * f + g),
        ),
        lag: watched(number.unknown_times.is_some(), within(g + l)),
    };
    let mut bounds = reproduced(number, window, memory, sample, state)?;
    for _ in 0..ROUNDS {
        let (found, found_state) = bounds.next(number, window, memory);
        let before = bounds.sample.f;
        // What held before holds still; the slope response follows from the slope, and was 0 at
        // rest.
        let sample = Sample {
            slope_response: Interval::ZERO,
            ..bounds.sample.meet(&found)
        };
        bounds = Reproduced {
            sample,
            state: std::array::from_fn(|axis| meet(bounds.state[axis], found_state[axis])),
        };
        let after = bounds.sample.f;
        if before.high - before.low - (after.high - after.low) < WIDEN_LEAST {
            break;
        }
    }
    bounds.step(number, window);
    Some(bounds)
}

/// Steps that lines and slopes look back.
pub(super) fn look_back(window: &Window) -> usize {
    window.oldest + window.slope + window.tick + 2
}

/// Bounds of one sample and state that hold at every sample.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reproduced {
    /// The sample.
    pub(super) sample: Sample,
    /// The state.
    pub(super) state: [Interval; 4],
}

impl Reproduced {
    /// The step that follows, and the bounds of the sample after it.
    fn step(&mut self, number: &FleetLoop, window: Window) -> Step {
        let mut samples = Samples {
            number,
            window,
            samples: vec![self.sample],
            repeats: true,
            before: None,
        };
        let response = samples.slope_response(0, self.sample.change_slope);
        self.sample.slope_response = self.sample.slope_response.join(response);
        samples.samples = vec![self.sample];
        samples.step(0)
    }

    /// Bounds of the next sample.
    fn next(
        &mut self,
        number: &FleetLoop,
        window: Window,
        memory: usize,
    ) -> (Sample, [Interval; 4]) {
        let step = self.step(number, window);
        let (slack, rate) = (step.slack, step.rate);
        let past = Past {
            loop_: number,
            steps: vec![step],
            repeats: true,
            states: vec![self.state],
            memory,
            most: number.chain_most(F_MOST_HZ),
            before: None,
        };
        let all: Vec<Choice> = choices().collect();
        let at = memory + look_back(&window);
        let (mut sample, state) = Watched::new(number, &window).bounds(&past, at, &all);
        sample.slack = slack;
        sample.rate = rate;
        (sample, state)
    }

    /// Whether the next sample's bounds lie inside these.
    fn holds(&self, sample: &Sample, state: &[Interval; 4]) -> bool {
        // Slack and rate enter the lines by way of the readings: they must not be larger than what
        // was assumed.
        sample.slack <= self.sample.slack
            && sample.rate <= self.sample.rate
            && pairs(&self.sample, sample)
                .into_iter()
                .chain(self.state.into_iter().zip(*state))
                .all(|(outer, inner)| outer.low <= inner.low && inner.high <= outer.high)
    }

    /// f between the samples too.
    pub(super) fn tube(&self) -> Interval {
        Interval {
            low: (self.sample.f.low - self.sample.slack).next_down(),
            high: (self.sample.f.high + self.sample.slack).next_up(),
        }
    }
}

/// The smallest bounds around the first ones that reproduce themselves, as far as they are found.
fn reproduced(
    number: &FleetLoop,
    window: Window,
    memory: usize,
    sample: Sample,
    state: [Interval; 4],
) -> Option<Reproduced> {
    let mut bounds = Reproduced { sample, state };
    for _ in 0..ROUNDS {
        let (found, found_state) = bounds.next(number, window, memory);
        if bounds.holds(&found, &found_state) {
            return Some(bounds);
        }
        bounds = Reproduced {
            sample: grown(bounds.sample, found),
            state: std::array::from_fn(|axis| grow(bounds.state[axis], found_state[axis])),
        };
        if bounds.sample.f.magnitude() >= F_MOST_HZ {
            return None;
        }
    }
    None
}

/// An interval as it is where it holds what was found; else both, a little wider. What holds is not
/// widened: the others depend on it.
fn grow(outer: Interval, found: Interval) -> Interval {
    let by = (outer.high - outer.low) * WIDEN + WIDEN_LEAST;
    Interval {
        low: if found.low < outer.low {
            found.low - by
        } else {
            outer.low
        },
        high: if found.high > outer.high {
            found.high + by
        } else {
            outer.high
        },
    }
}

fn join(a: Sample, b: Sample) -> Sample {
    Sample {
        f: a.f.join(b.f),
        change: a.change.join(b.change),
        change_half: a.change_half.join(b.change_half),
        change_window: a.change_window.join(b.change_window),
        change_slope: a.change_slope.join(b.change_slope),
        net: a.net.join(b.net),
        turbine: a.turbine.join(b.turbine),
        slope_response: a.slope_response.join(b.slope_response),
        slack: a.slack.max(b.slack),
        rate: a.rate.max(b.rate),
        governor: a.governor.join(b.governor),
        gap: a.gap.join(b.gap),
        lag: a.lag.join(b.lag),
    }
}

/// The same for a bound of a magnitude.
fn grow_most(outer: f64, found: f64) -> f64 {
    if found > outer {
        found * (1.0 + WIDEN)
    } else {
        outer
    }
}

/// Every interval but the slope response, which follows from the others.
fn grown(outer: Sample, found: Sample) -> Sample {
    Sample {
        f: grow(outer.f, found.f),
        change: grow(outer.change, found.change),
        change_half: grow(outer.change_half, found.change_half),
        change_window: grow(outer.change_window, found.change_window),
        change_slope: grow(outer.change_slope, found.change_slope),
        net: grow(outer.net, found.net),
        turbine: grow(outer.turbine, found.turbine),
        slack: grow_most(outer.slack, found.slack),
        rate: grow_most(outer.rate, found.rate),
        governor: grow(outer.governor, found.governor),
        gap: grow(outer.gap, found.gap),
        lag: grow(outer.lag, found.lag),
        ..outer
    }
}

fn pairs(outer: &Sample, inner: &Sample) -> [(Interval, Interval); 10] {
    [
        (outer.f, inner.f),
        (outer.change, inner.change),
        (outer.change_half, inner.change_half),
        (outer.change_window, inner.change_window),
        (outer.change_slope, inner.change_slope),
        (outer.net, inner.net),
        (outer.turbine, inner.turbine),
        (outer.governor, inner.governor),
        (outer.gap, inner.gap),
        (outer.lag, inner.lag),
    ]
}
