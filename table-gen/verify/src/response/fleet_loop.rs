//! The closed loop of grid and fleet as numbers: what the bounds rest on.
//!
//! Frequencies are deviations in Hz, powers in GW, times in s. `f' = (p + P u - w - D f) / 2H` and
//! the governor chain are the plant's; u is the participation that the fleet delivers.

use model::flow::{self, Flow, Vector};
use model::governor::Governor;
use model::interval::Interval;
use model::plant::{Plant, STATES};

use super::time_bands::{TimeBands, UnknownTimes};

/// The always-on law in real numbers, as the device's integers give it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RealLaw {
    /// Droop gain \[1/Hz\]: participation per Hz below the set-point.
    pub droop: f64,
    /// Set-point \[Hz\].
    pub setpoint_hz: f64,
    /// Slope gain \[s/Hz\]: participation per Hz/s beyond the threshold.
    pub slope: f64,
    /// Threshold of the slope \[Hz/s\], positive: falls that are slower count nothing.
    pub slope_threshold_hz_per_s: f64,
    /// Steps over which the slope is measured \[s\].
    pub slope_window_s: f64,
    /// Largest slope response, a participation.
    pub slope_most: f64,
    /// Release of the slope response \[1/s\], at most: with ticks as the law counts them.
    pub release_per_s: f64,
    /// Release of the slope response \[1/s\], at least: with the longest ticks.
    pub release_least_per_s: f64,
    /// A command that differs from the target by less is kept.
    pub smallest_change: f64,
    /// What the device's integers may round the target by, a participation.
    pub rounding: f64,
}

/// How the loss may move inside its band.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LossProfile {
    /// One unknown value for the whole event.
    Constant,
    /// It may step or creep upwards at any time.
    NonDecreasing,
    /// It may move anywhere in its band at any time.
    Band,
}

/// The plant's parameters, each anywhere in its interval, constant and unknown to the chargers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlantBand {
    /// Parameters that are known, and the fleet's power; those below are not read from it.
    pub known: Plant,
    /// H \[GW s/Hz\].
    pub inertia: Interval,
    /// K = 1/R_eq \[GW/Hz\].
    pub governor_gain: Interval,
    /// D \[GW/Hz\].
    pub damping: Interval,
    /// T_G, T_t, T_1 and T_2.
    pub times: TimeBands,
    /// What the governors cannot do.
    pub governor: Governor,
}

/// What the proof assumes of fleet, meters and cars.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Assumed {
    /// Time \[s\] from the moment a reading speaks of until the power that it led to: least.
    pub late_least_s: f64,
    /// The same: most, the longest tick included.
    pub late_most_s: f64,
    /// Longest tick \[s\].
    pub tick_s: f64,
    /// Error of a reading \[Hz\].
    pub reading_hz: f64,
    /// By how much the age of what readings speak of may differ \[s\].
    pub age_spread_s: f64,
    /// By how much the time between the two readings of a slope may differ from the law's window
    /// \[s\].
    pub slope_jitter_s: f64,
    /// Relative error of the delivered participation.
    pub participation: f64,
    /// Absolute error of the delivered participation.
    pub participation_absolute: f64,
    /// Share of the fleet that does as it likes.
    pub hostile_share: f64,
    /// How far a command may be from its target on average over the fleet, as a share of the
    /// law's smallest change: 1 where nothing is known of the chargers' levels.
    pub mean_step_share: f64,
    /// Band of the loss \[GW\].
    pub loss: Interval,
    /// How it moves.
    pub profile: LossProfile,
    /// Half widths of the box around 0 in which the event finds f, g, l, p.
    pub initial: [f64; STATES],
}

/// Everything that the bounds of one case are computed from.
#[derive(Debug, Clone)]
pub struct FleetLoop {
    /// The law.
    pub law: RealLaw,
    /// The assumptions.
    pub assumed: Assumed,
    /// P \[GW\].
    pub fleet_gw: f64,
    /// Length of a step h \[s\].
    pub step_s: f64,
    /// exp(A h) at the middle of the plant's band: middle and radius of each entry.
    pub transition: [[(f64, f64); STATES]; STATES],
    /// The integral of exp(A s) b over a step: middle and radius.
    pub drive: [(f64, f64); STATES],
    /// b, and exp(A h) b, for the sign of the integrand at both ends of a step.
    pub drive_start: [f64; STATES],
    /// See `drive_start`.
    pub drive_end: [f64; STATES],
    /// Bound of `|A² exp(A s) b|` within a step.
    pub drive_curvature: [f64; STATES],
    /// Bound of `|exp(A s) c|` within a step for the unit vector of f: what an unknown inertia or
    /// damping acts on.
    pub spread_f: [f64; STATES],
    /// The same for the direction in which an unknown governor gain acts.
    pub spread_gain: [f64; STATES],
    /// The integral over a step of the direction in which the governors' input acts: middle and
    /// radius.
    pub drive_gain: [(f64, f64); STATES],
    /// That direction, for the sign of its integrand at the start of a step.
    pub gain_start: [f64; STATES],
    /// The same at the end of a step.
    pub gain_end: [f64; STATES],
    /// Bound of its integrand's second derivative within a step.
    pub gain_curvature: [f64; STATES],
    /// What the governors cannot do.
    pub governor: Governor,
    /// K in the middle of its band \[GW/Hz\].
    pub gain_mid: f64,
    /// Half width of 1/2H, relative to nothing \[Hz/s per GW\].
    pub inverse_inertia_radius: f64,
    /// Largest 1/2H.
    pub inverse_inertia_most: f64,
    /// Half width of K \[GW/Hz\].
    pub gain_radius: f64,
    /// Half width of D \[GW/Hz\].
    pub damping_radius: f64,
    /// Largest D \[GW/Hz\].
    pub damping_most: f64,
    /// D in the middle of its band \[GW/Hz\].
    pub damping_mid: f64,
    /// Largest |K| \[GW/Hz\].
    pub gain_most: f64,
    /// T_G, T_t, T_1 and T_2, each anywhere in its band.
    pub times: TimeBands,
    /// What acts where they are not known; nothing where they are.
    pub unknown_times: Option<UnknownTimes>,
    /// Largest rate of f before the event \[Hz/s\]: what the initial box allows without loss and
    /// fleet.
    pub rate_before: f64,
    /// The loss in stages; none: it is in the band that is assumed at all times.
    pub stages: Vec<LossStage>,
}

/// A part of the loss whose moment is known within bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LossStage {
    /// Earliest moment \[s after the event\], at least 0.
    pub earliest_s: f64,
    /// Latest moment \[s after the event\].
    pub latest_s: f64,
    /// What is lost, at least 0 \[GW\].
    pub power_gw: Interval,
}

impl FleetLoop {
    /// The numbers of one case, with steps of `step_s`.
    pub fn new(plant: &PlantBand, law: RealLaw, assumed: Assumed, step_s: f64) -> Self {
        let half_inverse = |h: Interval| Interval::point(0.5) / h;
        let inverse = half_inverse(plant.inertia);
        let nominal = Plant {
            governor_gain: plant.governor_gain.mid(),
            damping: plant.damping.mid(),
            inertia: 0.5 / inverse.mid(),
            ..plant.times.middle(plant.known)
        };
        let (a, b) = nominal.matrices();
        let nominal_inverse = b[0];
        let flow = Flow::over(&a, &b, step_s);
        let split = |entry: Interval| (entry.mid(), entry.radius());
        let within = flow::tube(&a, step_s);
        let at_end = flow::apply(&flow.phi, &b);
        let curvature = flow::apply(&within, &flow::apply(&flow::product(&a, &a), &b));
        let unit: Vector<STATES> = [
            Interval::ONE,
            Interval::ZERO,
            Interval::ZERO,
            Interval::ZERO,
        ];
        let magnitude = |v: Vector<STATES>| v.map(Interval::magnitude);
        let gain = gain_direction(&nominal);
        let damping_most = plant.damping.magnitude();
        let inverse_inertia_most = inverse.magnitude();
        let [f, _, _, p] = assumed.initial;
        Self {
            law,
            assumed,
            fleet_gw: plant.known.fleet,
            step_s,
            transition: flow.phi.map(|row| row.map(split)),
            drive: flow.gamma.map(split),
            drive_start: b.map(Interval::mid),
            drive_end: at_end.map(Interval::mid),
            drive_curvature: magnitude(curvature),
            spread_f: magnitude(flow::apply(&within, &unit)),
            spread_gain: magnitude(flow::apply(&within, &gain)),
            drive_gain: Flow::over(&a, &gain, step_s).gamma.map(split),
            gain_start: gain.map(Interval::mid),
            gain_end: flow::apply(&flow.phi, &gain).map(Interval::mid),
            gain_curvature: magnitude(flow::apply(
                &within,
                &flow::apply(&flow::product(&a, &a), &gain),
            )),
            governor: plant.governor,
            gain_mid: nominal.governor_gain,
            inverse_inertia_radius: (nominal_inverse.high - inverse.low)
                .max(inverse.high - nominal_inverse.low)
                .max(0.0)
                .next_up(),
            inverse_inertia_most,
            gain_radius: plant.governor_gain.radius_or_zero(),
            damping_radius: plant.damping.radius_or_zero(),
            damping_most,
            damping_mid: nominal.damping,
            gain_most: plant.governor_gain.magnitude(),
            times: plant.times,
            unknown_times: UnknownTimes::of(&plant.times, &nominal, &within),
            rate_before: (p + damping_most * f) * inverse_inertia_most * (1.0 + 1e-12),
            stages: Vec::new(),
        }
    }

    /// The same with a loss in stages, which must stay inside the band that is assumed.
    pub fn with_stages(self, stages: &[LossStage]) -> Self {
        Self {
            stages: stages.to_vec(),
            ..self
        }
    }

    /// Where the loss lies in the step after a sample. `repeats`: in a step that stands for all
    /// after the last stage.
    ///
    /// A stage counts as lost from its latest moment on, and as possibly lost from its earliest on;
    /// between them it may be anything. So every order and every moment of the stages is inside.
    pub fn loss_in_step(&self, index: usize, repeats: bool) -> Interval {
        if self.stages.is_empty() {
            return self.assumed.loss;
        }
        let (start, end) = (
            index as f64 * self.step_s,
            (index + 1) as f64 * self.step_s * (1.0 + 1e-12),
        );
        self.stages
            .iter()
            .fold(Interval::ZERO, |sum, stage| Interval {
                low: if repeats || stage.latest_s <= start {
                    (sum.low + stage.power_gw.low).next_down()
                } else {
                    sum.low
                },
                high: if repeats || stage.earliest_s <= end {
                    (sum.high + stage.power_gw.high).next_up()
                } else {
                    sum.high
                },
            })
    }

    /// Where the loss lies at a sample, before and after it.
    pub fn loss_at(&self, index: usize, repeats: bool) -> Interval {
        self.loss_in_step(index.saturating_sub(1), repeats)
            .join(self.loss_in_step(index, repeats))
    }

    /// Steps in a time, rounded down.
    pub fn steps_down(&self, time_s: f64) -> usize {
        (time_s / self.step_s + 1e-9).floor() as usize
    }

    /// Steps in a time, rounded up.
    pub fn steps_up(&self, time_s: f64) -> usize {
        (time_s / self.step_s - 1e-9).ceil() as usize
    }

    /// Bounds of |g|, |l|, |p| while |f| stays below a bound: the chain's gains, each a filter
    /// without overshoot of what comes before it, so that no output passes the larger of its start
    /// and its gain times the largest input.
    pub fn chain_most(&self, f_most: f64) -> [f64; STATES] {
        let [_, g0, l0, p0] = self.assumed.initial;
        let g = g0.max(self.gain_most * f_most);
        // The governors' input lies between g and what is asked of them.
        let asked = g.max(self.gain_most * f_most);
        let l = l0.max(self.times.lead_most(asked, g));
        let p = p0.max(l);
        [f_most, g, l, p].map(|bound| bound * (1.0 + 1e-12))
    }
}

/// The derivative of `x'` by K f: (0, 1/T_G, T_1 / (T_2 T_G), 0).
fn gain_direction(plant: &Plant) -> Vector<STATES> {
    let point = Interval::point;
    [
        Interval::ZERO,
        Interval::ONE / point(plant.governor_time),
        point(plant.lead_time) / (point(plant.lag_time) * point(plant.governor_time)),
        Interval::ZERO,
    ]
}

/// A radius that is exactly zero where the interval is one number.
trait RadiusOrZero {
    fn radius_or_zero(self) -> f64;
}

impl RadiusOrZero for Interval {
    fn radius_or_zero(self) -> f64 {
        if self.low == self.high {
            0.0
        } else {
            self.radius()
        }
    }
}
