//! What the bounds of past samples say of the window in which the fleet's readings lie.
//!
//! During step i, from `t` to `t + h`, the fleet acts on readings of moments between `t -
//! late_most` and `t + h - late_least`: on samples `i - newest` to `i - oldest` and what lies
//! between them. Between two samples f leaves their chord by at most `h/4` times the variation of
//! f' in the step (`slack`).

use model::interval::Interval;

use super::adjoint::Step;
use super::fleet_loop::{FleetLoop, LossProfile};
use super::governor::{self, AtSample};
use super::lines::{Delivered, Side};
use super::unknown::{self, Differences, OfStep};

/// |f| \[Hz\] up to which the bounds of the turbine's rate hold; past it nothing is claimed.
pub(super) const F_MOST_HZ: f64 = 1.0;

/// Sample offsets of the window, and of the law's slope.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Window {
    /// Steps from the step's start back to the newest sample.
    pub(super) newest: usize,
    /// Steps back to the oldest sample.
    pub(super) oldest: usize,
    /// Steps of the slope's window.
    pub(super) slope: usize,
    /// Steps of the longest tick, rounded up.
    pub(super) tick: usize,
}

impl Window {
    /// The window of a loop; nothing if readings can act within their own step, or the slope's
    /// window is not whole steps.
    pub(super) fn new(number: &FleetLoop) -> Option<Self> {
        let slope = (number.law.slope_window_s / number.step_s).round();
        let whole = (slope * number.step_s - number.law.slope_window_s).abs() < 1e-9;
        let least = number.steps_down(number.assumed.late_least_s);
        (least >= 1 && slope >= 1.0 && whole).then(|| Self {
            newest: least - 1,
            oldest: number.steps_up(number.assumed.late_most_s),
            slope: slope as usize,
            tick: number.steps_up(number.assumed.tick_s),
        })
    }

    /// Steps from the newest to the oldest sample.
    pub(super) fn length(&self) -> usize {
        self.oldest - self.newest
    }
}

/// Bounds at one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sample {
    /// f.
    pub(super) f: Interval,
    /// f less f one step before.
    pub(super) change: Interval,
    /// f less f half a window before.
    pub(super) change_half: Interval,
    /// f less f a window before.
    pub(super) change_window: Interval,
    /// f less f a slope window before.
    pub(super) change_slope: Interval,
    /// `p - w - D f`.
    pub(super) net: Interval,
    /// `l - p`, whose share 1/T_t is p'.
    pub(super) turbine: Interval,
    /// Bounds of the slope response at readings between this sample and the one before.
    pub(super) slope_response: Interval,
    /// How far f may leave the chord in the step that begins at this sample.
    pub(super) slack: f64,
    /// Bound of |f'| in that step.
    pub(super) rate: f64,
    /// g, where rate or output of the governors is limited; else 0.
    pub(super) governor: Interval,
    /// `K_mid f - g`, there and where time constants are not known; else 0.
    pub(super) gap: Interval,
    /// `g - l`, where time constants are not known; else 0.
    pub(super) lag: Interval,
}

impl Sample {
    fn differences(&self) -> Differences {
        Differences {
            f: self.f,
            gap: self.gap,
            lag: self.lag,
            turbine: self.turbine,
        }
    }

    /// What two bounds that both hold have in common.
    pub(super) fn meet(&self, other: &Self) -> Self {
        Self {
            f: meet(self.f, other.f),
            change: meet(self.change, other.change),
            change_half: meet(self.change_half, other.change_half),
            change_window: meet(self.change_window, other.change_window),
            change_slope: meet(self.change_slope, other.change_slope),
            net: meet(self.net, other.net),
            turbine: meet(self.turbine, other.turbine),
            slope_response: meet(self.slope_response, other.slope_response),
            slack: self.slack.min(other.slack),
            rate: self.rate.min(other.rate),
            governor: meet(self.governor, other.governor),
            gap: meet(self.gap, other.gap),
            lag: meet(self.lag, other.lag),
        }
    }
}

/// What two intervals that both hold have in common.
pub(super) fn meet(a: Interval, b: Interval) -> Interval {
    Interval {
        low: a.low.max(b.low),
        high: a.high.min(b.high),
    }
}

/// Samples by index from the event, or one that stands for all.
#[derive(Debug, Clone)]
pub(super) struct Samples<'a> {
    /// Numbers of the loop.
    pub(super) number: &'a FleetLoop,
    /// The window.
    pub(super) window: Window,
    /// The samples so far.
    pub(super) samples: Vec<Sample>,
    /// Whether one sample stands for all.
    pub(super) repeats: bool,
    /// Bounds of the samples before the first; nothing: the rest before an event.
    pub(super) before: Option<Sample>,
}

impl Samples<'_> {
    /// The sample `back` steps before sample k; nothing before an event from rest.
    fn get(&self, k: usize, back: usize) -> Option<&Sample> {
        if self.repeats {
            return self.samples.first();
        }
        match k.checked_sub(back) {
            Some(index) => self.samples.get(index),
            None => self.before.as_ref(),
        }
    }

    /// f of a sample, before the event too.
    fn f(&self, k: usize, back: usize) -> Interval {
        match self.get(k, back) {
            Some(sample) => sample.f,
            None => {
                let drift = self.number.rate_before * self.number.step_s * (back - k) as f64;
                let reach = (self.number.assumed.initial[0] + drift).next_up();
                Interval {
                    low: -reach,
                    high: reach,
                }
            }
        }
    }

    fn change(&self, k: usize, back: usize) -> Interval {
        // The first sample's change is that before the event.
        match self.get(k, back) {
            Some(sample) if self.repeats || self.before.is_some() || k > back => sample.change,
            _ => {
                let drift = (self.number.rate_before * self.number.step_s).next_up();
                Interval {
                    low: -drift,
                    high: drift,
                }
            }
        }
    }

    /// Bounds of f(k - newer) - f(k - older).
    fn difference(&self, k: usize, newer: usize, older: usize) -> Interval {
        let half = self.window.length() / 2;
        let sum = |from: usize, to: usize| {
            (from..to).fold(Interval::ZERO, |sum, back| sum + self.change(k, back))
        };
        let mut best = sum(newer, older);
        let steps = older - newer;
        let mut meet = |other: Interval| {
            best.low = best.low.max(other.low);
            best.high = best.high.min(other.high);
        };
        if let Some(sample) = self.get(k, newer) {
            if half > 0 && steps >= half {
                meet(sample.change_half + sum(newer + half, older));
            }
            if steps == self.window.length() {
                meet(sample.change_window);
            }
        }
        best
    }

    /// The largest of something over the steps that readings before sample k may lie in.
    fn largest(&self, k: usize, of: impl Fn(&Sample) -> f64) -> f64 {
        if self.repeats {
            return self.samples.first().map_or(0.0, of);
        }
        let oldest = k.saturating_sub(self.window.oldest + self.window.slope + 1);
        let within = self.samples.get(oldest..=k).unwrap_or_default();
        let before = self.before.as_ref().map_or(0.0, &of);
        within.iter().map(of).fold(before, f64::max)
    }

    /// Largest slack of the steps whose samples readings of step k may lie between.
    pub(super) fn slack(&self, k: usize) -> f64 {
        self.largest(k, |sample| sample.slack)
    }

    /// Error of a measured slope \[Hz/s\]: of its two readings, and of the time between them.
    fn slope_error(&self, k: usize) -> f64 {
        let assumed = &self.number.assumed;
        let both = 2.0 * (assumed.reading_hz + self.slack(k));
        let rate = self
            .largest(k, |sample| sample.rate)
            .max(self.number.rate_before);
        (both + assumed.slope_jitter_s * rate) / self.number.law.slope_window_s * (1.0 + 1e-12)
    }

    /// Slope response, before the release, of a slope: a participation.
    fn answer(&self, slope_hz_per_s: f64) -> f64 {
        let law = &self.number.law;
        (law.slope * (-slope_hz_per_s - law.slope_threshold_hz_per_s)).clamp(0.0, law.slope_most)
    }

    /// Bounds of the slope response at readings up to sample k, from the slopes and the bounds at
    /// the sample before.
    pub(super) fn slope_response(&self, k: usize, change_slope: Interval) -> Interval {
        let law = &self.number.law;
        let pad = law.rounding + 1e-12;
        let error = self.slope_error(k);
        let of = |change: f64| change / law.slope_window_s;
        let before = self.get(k, 1).map(|s| (s.change_slope, s.slope_response));
        let (slope_before, held) = before.unwrap_or((change_slope, Interval::ZERO));
        // A reading between the two samples: the slope lies between theirs.
        let steepest = change_slope.low.min(slope_before.low);
        let release = law.release_per_s * self.number.step_s;
        let release_least = law.release_least_per_s * self.number.step_s;
        let high = self.answer(of(steepest) - error) + pad;
        // Every charger takes a reading within a tick of any moment, and remembers it.
        let mut flattest = change_slope.high;
        let mut known = true;
        for back in 1..=self.window.tick + 1 {
            match self.get(k, back) {
                Some(sample) => flattest = flattest.max(sample.change_slope.high),
                None => known = false,
            }
        }
        let since = law.release_per_s * (self.window.tick as f64 + 1.0) * self.number.step_s;
        let low = if known {
            self.answer(of(flattest) + error) - since - pad
        } else {
            0.0
        };
        if self.repeats {
            // For ever: what was held before may have been anything that the bounds allow.
            return Interval {
                low: 0.0,
                high: high.max(held.high),
            };
        }
        Interval {
            low: low.max(held.low - release - pad).max(0.0),
            high: high.max(held.high - release_least + pad).max(0.0),
        }
    }

    /// What is known of step k, from its samples.
    pub(super) fn step(&self, k: usize) -> Step {
        let window = self.window;
        let assumed = &self.number.assumed;
        let reading = assumed.reading_hz + self.slack(k);
        let held = (window.newest..=window.oldest)
            .map(|back| {
                self.get(k, back)
                    .map_or(Interval::ZERO, |s| s.slope_response)
            })
            .reduce(Interval::join)
            .unwrap_or(Interval::ZERO);
        // The release counts from reading to reading, the bounds from what they speak of to what
        // they speak of.
        let aged = self.number.law.release_per_s * assumed.age_spread_s;
        let middle = window.newest.midpoint(window.oldest);
        // How far the highest (lowest) f of the window may lie above (below) a sample of it.
        let reach = |at: usize, side: Side| {
            (window.newest..=window.oldest).fold(0.0f64, |most, back| {
                let change = match back.cmp(&at) {
                    std::cmp::Ordering::Less => self.difference(k, back, at),
                    std::cmp::Ordering::Equal => Interval::ZERO,
                    std::cmp::Ordering::Greater => -self.difference(k, at, back),
                };
                most.max(match side {
                    Side::Below => change.high,
                    Side::Above => -change.low,
                })
            })
        };
        let lines = |side: Side| {
            let (at, reach_hz) = [window.newest, middle, window.oldest]
                .map(|at| (at, reach(at, side)))
                .into_iter()
                .reduce(|a, b| if b.1 < a.1 - 1e-9 { b } else { a })
                .unwrap_or((window.newest, f64::INFINITY));
            let delivered = Delivered {
                law: &self.number.law,
                assumed,
                side,
                reach_hz: reach_hz + reading,
                slope_response: match side {
                    Side::Below => (held.low - aged).max(0.0),
                    Side::Above if held.high > 0.0 => held.high + aged,
                    Side::Above => 0.0,
                },
            };
            let range = self.f(k, at);
            let outermost = match side {
                Side::Below => delivered.at(range.high),
                Side::Above => delivered.at(range.low),
            };
            (delivered.lines(range, at), outermost)
        };
        let (below, least) = lines(Side::Below);
        let (above, most) = lines(Side::Above);
        let f = self.f(k, 0);
        let sample = self.get(k, 0);
        let net = sample.map_or(Interval::ZERO, |s| s.net);
        let fleet = self.number.fleet_gw;
        // The largest net power at the step's start, and how far it and f move within the step.
        let start = (net.high + fleet * most)
            .abs()
            .max((net.low + fleet * least).abs());
        let drift = self.number.step_s * self.turbine_rate(sample) + self.rise(k);
        let share = self.number.step_s * self.number.inverse_inertia_most;
        let f_move = share * (start + drift) / (1.0 - share * self.number.damping_most);
        let net_most = start + drift + self.number.damping_most * f_move;
        let spread = most - least;
        let at = sample.map(|sample| AtSample {
            f,
            g: sample.governor,
            gap: sample.gap,
            f_move: f_move * (1.0 + 1e-9),
        });
        Step {
            governor: at.and_then(|at| governor::disturbance(self.number, &at)),
            below,
            above,
            unknown: OfStep {
                f_most: (f.magnitude() + f_move) * (1.0 + 1e-9),
                net_most: net_most * (1.0 + 1e-9),
                times: sample.and_then(|sample| {
                    unknown::added(self.number, &sample.differences(), f_move * (1.0 + 1e-9))
                }),
            },
            slack: self.slack_of(sample, spread, net_most, self.rise(k)),
            rate: self.number.inverse_inertia_most * net_most * (1.0 + 1e-9),
        }
    }

    /// How much the loss may rise within the step after a sample.
    fn rise(&self, k: usize) -> f64 {
        let loss = self.number.loss_in_step(k, self.repeats);
        match self.number.assumed.profile {
            LossProfile::Constant => 0.0,
            LossProfile::NonDecreasing | LossProfile::Band => (loss.high - loss.low).next_up(),
        }
    }

    /// Bound of |p'| in the step after a sample: p' is filtered l', so it passes neither its start
    /// nor the largest |l'|.
    fn turbine_rate(&self, sample: Option<&Sample>) -> f64 {
        let number = self.number;
        let [f, g, l, _] = number.chain_most(F_MOST_HZ);
        let asked = g.max(number.gain_most * f);
        let l_rate = (number.times.lead_most(asked, g) + l) / number.times.lag.low;
        let start = sample.map_or(f64::INFINITY, |s| s.turbine.magnitude());
        (start / number.times.turbine.low).max(l_rate) * (1.0 + 1e-9)
    }

    /// How far f may leave the chord in a step: a quarter of the step times the variation of f' in
    /// it, which the participation's spread, a rise of the loss, the turbine and the damping make.
    fn slack_of(&self, sample: Option<&Sample>, spread: f64, net_most: f64, rise: f64) -> f64 {
        let number = self.number;
        let smooth = number.step_s
            * (self.turbine_rate(sample)
                + number.damping_most * number.inverse_inertia_most * net_most);
        0.25 * number.step_s
            * number.inverse_inertia_most
            * (number.fleet_gw * spread + rise + smooth)
            * (1.0 + 1e-9)
    }
}
