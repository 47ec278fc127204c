//! One case: a band of the loss, a band of each unknown parameter, and what is found for it.

use model::interval::Interval;

use super::event::Event;
use super::fleet_loop::{Assumed, FleetLoop, LossProfile, PlantBand, RealLaw};
use super::for_ever;
use super::window::{F_MOST_HZ, Window};

/// How finely a case is examined.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Length of a step \[s\].
    pub step_s: f64,
    /// Time that is followed from the event \[s\].
    pub follow_s: f64,
    /// Time after which a sweep ends \[s\].
    pub memory_s: f64,
}

/// One case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Case {
    /// The plant.
    pub plant: PlantBand,
    /// The law.
    pub law: RealLaw,
    /// The assumptions, with the band of the loss.
    pub assumed: Assumed,
    /// Where in the band the loss is in the end; the whole band if it is constant.
    pub last: Interval,
}

/// What is found for a case.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Bounds of f at all times, for ever if `for_ever` is known, else as long as it was followed.
    pub f: Interval,
    /// Bounds of f for ever after it was followed; nothing if none were found.
    pub for_ever: Option<Interval>,
    /// Bounds of f in each step from the event on.
    pub tube: Vec<Interval>,
    /// Length of a step \[s\].
    pub step_s: f64,
}

impl Found {
    /// Time \[s\] after the event from which f is inside a band for ever; nothing if that is not
    /// known.
    pub fn inside_from_s(&self, band: Interval) -> Option<f64> {
        let within = |f: Interval| band.low <= f.low && f.high <= band.high;
        self.for_ever.filter(|f| within(*f))?;
        let after = self.tube.iter().rposition(|f| !within(*f));
        Some(after.map_or(0.0, |step| (step + 1) as f64 * self.step_s))
    }
}

/// The band of a loss that moves, with what was lost before the event: nothing. At rest the loss is
/// 0, and the event takes it into its band; bounds that hold at all times must know both. A loss
/// that does not decrease cannot come to a band below 0: then nothing.
fn since_rest_gw(assumed: &Assumed) -> Option<Interval> {
    let loss = assumed.loss;
    if assumed.profile == LossProfile::NonDecreasing && loss.low < 0.0 {
        return None;
    }
    Some(loss.join(Interval::ZERO))
}

/// Bounds for one case; nothing if the resolution does not fit the assumptions (readings that act
/// within their own step, a slope window that is not whole steps), or if f may leave ±1 Hz.
pub fn examine(case: &Case, resolution: Resolution) -> Option<Found> {
    let number = FleetLoop::new(&case.plant, case.law, case.assumed, resolution.step_s);
    let window = Window::new(&number)?;
    let memory = number.steps_up(resolution.memory_s);
    let moving = case.assumed.profile != LossProfile::Constant;
    let since_rest;
    let before = if moving {
        since_rest = FleetLoop::new(
            &case.plant,
            case.law,
            Assumed {
                loss: since_rest_gw(&case.assumed)?,
                ..case.assumed
            },
            resolution.step_s,
        );
        Some(for_ever::from_rest(&since_rest, window, memory)?)
    } else {
        None
    };
    if case.assumed.profile == LossProfile::Band {
        let f = before?.tube();
        return Some(Found {
            f,
            for_ever: Some(f),
            tube: Vec::new(),
            step_s: resolution.step_s,
        });
    }
    // After the last rise the loss is constant, in the upper part of its band that the case speaks
    // of.
    let settled = FleetLoop::new(
        &case.plant,
        case.law,
        Assumed {
            loss: case.last,
            profile: LossProfile::Constant,
            ..case.assumed
        },
        resolution.step_s,
    );
    let event = Event::follow(&settled, window, before, resolution.follow_s, memory);
    let count = event.samples.samples.len();
    let tube: Vec<Interval> = (0..count.saturating_sub(1))
        .map(|k| event.tube(k))
        .collect();
    let followed = tube.iter().copied().reduce(Interval::join)?;
    let f = before.map_or(followed, |before| before.tube());
    if f.magnitude() >= F_MOST_HZ || count <= number.steps_up(resolution.follow_s) {
        return None;
    }
    let for_ever = for_ever::after(&event.samples, &event.past, memory);
    Some(Found {
        f: match for_ever {
            Some(after) if !moving => f.join(after),
            _ => f,
        },
        for_ever,
        tube,
        step_s: resolution.step_s,
    })
}
