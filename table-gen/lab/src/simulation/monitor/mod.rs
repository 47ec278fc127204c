//! What a run is judged by: one meter fed with segments of the frequency, whoever drives the plant.
//!
//! A segment is the cubic Hermite curve through frequency and slope at its two ends. Its distance
//! from the true curve is at most `h⁴ max|f''''| / 384`; with |f''''| below 1 Hz/s⁴ for this plant
//! that is 3e-7 Hz at h = 0.1 s.

mod arc;
mod band;

use serde::Serialize;

use super::NOMINAL_HZ;
use arc::Arc;
pub use arc::Knot;
use band::BandWatch;
use model::spec::Spec;

/// Statutory lower limit \[Hz, deviation\].
pub const STATUTORY_LOW_HZ: f64 = -0.5;

/// What a run is judged by; the JSON keys of `simulate`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Lowest frequency \[Hz, absolute\].
    pub nadir_hz: f64,
    /// When \[s after the event\].
    pub nadir_time_s: f64,
    /// Frequency at the end \[Hz, absolute\].
    pub final_hz: f64,
    /// Largest participation commanded, 0..=1.
    pub max_participation: f64,
    /// Time below 49.5 Hz \[s\].
    pub seconds_below_49_5: f64,
    /// Whether f ever fell below the spec's containment; `null` if it states none.
    pub containment_breached: Option<bool>,
    /// When f first left I1 \[s\]; `null` if it never did.
    pub left_outer_s: Option<f64>,
    /// When f first came back into I1 after leaving it \[s\]; `null` if it never left or never came
    /// back.
    pub entered_outer_s: Option<f64>,
    /// When f first came back into I2 after leaving it \[s\].
    pub entered_inner_s: Option<f64>,
    /// Whether f, once back in I2, was there until the end.
    pub stayed_in_inner: bool,
    /// Whether the run satisfies ψ (see [`Monitor::satisfies_psi`]).
    pub satisfies_psi: bool,
    /// Time in which no law of the table covered the state and the firmware fell back to the droop
    /// \[s\].
    pub fallback_s: f64,
}

/// The meter.
#[derive(Debug, Clone, Copy)]
pub struct Monitor {
    last: Option<Knot>,
    nadir: (f64, f64),
    max_participation: f64,
    below_s: f64,
    fallback_s: f64,
    containment_hz: Option<f64>,
    settle_within_s: f64,
    stay: bool,
    outer: BandWatch,
    inner: BandWatch,
}

impl Monitor {
    /// A meter for a spec's requirements.
    pub fn new(spec: &Spec) -> Self {
        let requirements = &spec.requirements;
        Self {
            last: None,
            nadir: (f64::INFINITY, 0.0),
            max_participation: 0.0,
            below_s: 0.0,
            fallback_s: 0.0,
            containment_hz: requirements.containment_hz,
            settle_within_s: requirements.settle_within_s,
            stay: requirements.stay,
            outer: BandWatch::new(requirements.outer_hz),
            inner: BandWatch::new(requirements.inner_hz),
        }
    }

    /// Takes the participation commanded from now on.
    #[inline]
    pub fn participation(&mut self, u: f64) {
        self.max_participation = self.max_participation.max(u);
    }

    /// Takes a time without a law \[s\].
    #[inline]
    pub fn fallback(&mut self, time_s: f64) {
        self.fallback_s += time_s;
    }

    /// Takes the next knot of a curve without jumps in its slope; knots must come in the order of
    /// time.
    pub fn knot(&mut self, knot: Knot) {
        match self.last {
            Some(from) => self.segment(from, knot),
            None => self.start(knot),
        }
    }

    fn start(&mut self, knot: Knot) {
        self.nadir = (knot.f, knot.time_s);
        self.last = Some(knot);
    }

    /// Takes the next piece of the curve, which starts where the last one ended, perhaps with
    /// another slope.
    #[inline]
    pub fn segment(&mut self, from: Knot, to: Knot) {
        if self.last.is_none() {
            self.start(from);
        }
        self.last = Some(to);
        let segment = Arc { from, to };
        let hull = segment.hull();
        if hull.0 < self.nadir.0 {
            self.deepen(&segment);
        }
        if hull.1 < STATUTORY_LOW_HZ {
            self.below_s += segment.length();
        } else if hull.0 < STATUTORY_LOW_HZ {
            for (a, b) in segment.cuts(&[STATUTORY_LOW_HZ]).stretches() {
                if segment.at(0.5 * (a + b)) < STATUTORY_LOW_HZ {
                    self.below_s += (b - a) * segment.length();
                }
            }
        }
        self.outer.segment(&segment, hull);
        self.inner.segment(&segment, hull);
    }

    /// Looks for a new nadir on a segment.
    fn deepen(&mut self, segment: &Arc) {
        let turns = segment.extremes().into_iter().flatten();
        for share in turns {
            let f = segment.at(share);
            if f < self.nadir.0 {
                self.nadir = (f, segment.time_s(share));
            }
        }
        if segment.to.f < self.nadir.0 {
            self.nadir = (segment.to.f, segment.to.time_s);
        }
    }

    /// Whether the run so far satisfies ψ, the paper's equation 4 over the simulated time: f never
    /// below the containment; I1, once left, entered again; I2, once left, entered again, and
    /// within `settle_within_s` of leaving I1 (ψ3); with `stay`, I2 not left again.
    pub fn satisfies_psi(&self) -> bool {
        let contained = self
            .containment_hz
            .is_none_or(|limit| self.nadir.0 >= limit);
        let since_s = self.outer.left_s.unwrap_or(0.0);
        let in_time = self
            .inner
            .entered_s
            .is_none_or(|s| s - since_s <= self.settle_within_s);
        let stayed = !(self.stay && self.inner.left_again);
        contained && !self.outer.is_lost() && !self.inner.is_lost() && in_time && stayed
    }

    /// The result so far.
    pub fn summary(&self) -> Summary {
        let last = self.last.map_or(0.0, |knot| knot.f);
        Summary {
            nadir_hz: NOMINAL_HZ + self.nadir.0,
            nadir_time_s: self.nadir.1,
            final_hz: NOMINAL_HZ + last,
            max_participation: self.max_participation,
            seconds_below_49_5: self.below_s,
            containment_breached: self.containment_hz.map(|limit| self.nadir.0 < limit),
            left_outer_s: self.outer.left_s,
            entered_outer_s: self.outer.entered_s,
            entered_inner_s: self.inner.entered_s,
            stayed_in_inner: self.inner.entered_s.is_some() && !self.inner.left_again,
            satisfies_psi: self.satisfies_psi(),
            fallback_s: self.fallback_s,
        }
    }
}
