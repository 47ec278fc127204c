//! What a run is judged by: one meter fed with segments of the frequency, whoever drives the plant.
//!
//! A segment is the cubic Hermite curve through frequency and slope at its two ends. Its distance from the true curve is
//! at most `h⁴ max|f''''| / 384`; with |f''''| below 1 Hz/s⁴ for this plant that is 3e-7 Hz at h = 0.1 s.

use serde::Serialize;

use super::NOMINAL_HZ;
use crate::spec::Spec;

/// Statutory lower limit \[Hz, deviation\].
const STATUTORY_LOW_HZ: f64 = -0.5;
/// Halvings when a crossing is located: h / 2^40 is far below the printed digits.
const HALVINGS: u32 = 40;

/// Frequency deviation and slope at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Knot {
    /// Time since the event \[s\].
    pub time_s: f64,
    /// Frequency deviation \[Hz\].
    pub f: f64,
    /// Its slope \[Hz/s\].
    pub df: f64,
}

/// The Hermite cubic between two knots.
#[derive(Debug, Clone, Copy)]
struct Segment {
    from: Knot,
    to: Knot,
}

impl Segment {
    fn length(&self) -> f64 {
        self.to.time_s - self.from.time_s
    }

    /// Value at a share s of the segment, 0..=1.
    fn at(&self, s: f64) -> f64 {
        let h = self.length();
        let (s2, s3) = (s * s, s * s * s);
        self.from.f * (2.0 * s3 - 3.0 * s2 + 1.0)
            + self.from.df * h * (s3 - 2.0 * s2 + s)
            + self.to.f * (3.0 * s2 - 2.0 * s3)
            + self.to.df * h * (s3 - s2)
    }

    /// Shares in (0, 1) at which the slope is zero, in order.
    fn extremes(&self) -> [Option<f64>; 2] {
        let h = self.length();
        let (d0, d1, rise) = (self.from.df * h, self.to.df * h, self.to.f - self.from.f);
        // The derivative by s is a s² + b s + c.
        let a = 3.0 * (d0 + d1) - 6.0 * rise;
        let b = 6.0 * rise - 4.0 * d0 - 2.0 * d1;
        let c = d0;
        let inside = |s: f64| (s > 0.0 && s < 1.0).then_some(s);
        if a.abs() < 1e-15 {
            return [if b == 0.0 { None } else { inside(-c / b) }, None];
        }
        let discriminant = b * b - 4.0 * a * c;
        if discriminant < 0.0 {
            return [None, None];
        }
        // The stable form: no difference of near-equal numbers.
        let q = -0.5 * (b + b.signum() * discriminant.sqrt());
        let (first, second) = (q / a, if q == 0.0 { 0.0 } else { c / q });
        [inside(first.min(second)), inside(first.max(second))]
    }

    /// Shares at which the curve crosses a level, in order, and at both ends 0 and 1: the pieces on which it does not.
    fn pieces(&self, level: f64) -> Vec<f64> {
        let mut marks = vec![0.0];
        marks.extend(self.extremes().into_iter().flatten());
        marks.push(1.0);
        let mut cuts = vec![0.0];
        for pair in marks.windows(2) {
            let (low, high) = (self.at(pair[0]) - level, self.at(pair[1]) - level);
            if (low < 0.0) != (high < 0.0) {
                cuts.push(self.crossing(pair[0], pair[1], level));
            }
        }
        cuts.push(1.0);
        cuts
    }

    /// Where the curve, monotonic between two shares, crosses a level.
    fn crossing(&self, from: f64, to: f64, level: f64) -> f64 {
        let below = self.at(from) < level;
        let (mut a, mut b) = (from, to);
        for _ in 0..HALVINGS {
            let mid = 0.5 * (a + b);
            if (self.at(mid) < level) == below {
                a = mid;
            } else {
                b = mid;
            }
        }
        0.5 * (a + b)
    }
}

/// When a band was left and entered again.
#[derive(Debug, Clone, Copy, PartialEq)]
struct BandWatch {
    low: f64,
    high: f64,
    left: bool,
    entered_s: Option<f64>,
    left_again: bool,
}

impl BandWatch {
    fn new([low, high]: [f64; 2]) -> Self {
        Self {
            low,
            high,
            left: false,
            entered_s: None,
            left_again: false,
        }
    }

    fn inside(&self, f: f64) -> bool {
        self.low <= f && f <= self.high
    }

    fn segment(&mut self, segment: &Segment) {
        let clear = |f: f64| self.inside(f);
        let extremes = segment.extremes();
        let turns = extremes.into_iter().flatten().map(|s| segment.at(s));
        let all_inside = clear(segment.from.f) && clear(segment.to.f) && turns.clone().all(clear);
        if all_inside && (!self.left || self.entered_s.is_some()) {
            return;
        }
        let mut cuts = segment.pieces(self.low);
        cuts.extend(segment.pieces(self.high));
        cuts.sort_by(f64::total_cmp);
        for pair in cuts.windows(2) {
            if pair[1] <= pair[0] {
                continue;
            }
            let inside = self.inside(segment.at(0.5 * (pair[0] + pair[1])));
            match (inside, self.left, self.entered_s) {
                (false, false, _) => self.left = true,
                (true, true, None) => {
                    self.entered_s = Some(segment.from.time_s + pair[0] * segment.length());
                }
                (false, true, Some(_)) => self.left_again = true,
                _ => {}
            }
        }
    }
}

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
    /// When f first came back into I1 after leaving it \[s\]; `null` if it never left or never came back.
    pub entered_outer_s: Option<f64>,
    /// When f first came back into I2 after leaving it \[s\].
    pub entered_inner_s: Option<f64>,
    /// Whether f, once back in I2, was there until the end.
    pub stayed_in_inner: bool,
}

/// The meter.
#[derive(Debug, Clone)]
pub struct Monitor {
    last: Option<Knot>,
    nadir: (f64, f64),
    max_participation: f64,
    below_s: f64,
    containment_hz: Option<f64>,
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
            containment_hz: requirements.containment_hz,
            outer: BandWatch::new(requirements.outer_hz),
            inner: BandWatch::new(requirements.inner_hz),
        }
    }

    /// Takes the participation commanded from now on.
    pub fn participation(&mut self, u: f64) {
        self.max_participation = self.max_participation.max(u);
    }

    /// Takes the next knot; knots must come in the order of time.
    pub fn knot(&mut self, knot: Knot) {
        if knot.f < self.nadir.0 {
            self.nadir = (knot.f, knot.time_s);
        }
        if let Some(from) = self.last {
            self.segment(&Segment { from, to: knot });
        }
        self.last = Some(knot);
    }

    fn segment(&mut self, segment: &Segment) {
        // A minimum needs a falling start or a rising end.
        if segment.from.df < 0.0 && segment.to.df > 0.0 {
            for s in segment.extremes().into_iter().flatten() {
                let f = segment.at(s);
                if f < self.nadir.0 {
                    self.nadir = (f, segment.from.time_s + s * segment.length());
                }
            }
        }
        if segment.from.f.min(segment.to.f).min(self.nadir.0) < STATUTORY_LOW_HZ {
            for pair in segment.pieces(STATUTORY_LOW_HZ).windows(2) {
                if segment.at(0.5 * (pair[0] + pair[1])) < STATUTORY_LOW_HZ {
                    self.below_s += (pair[1] - pair[0]) * segment.length();
                }
            }
        }
        self.outer.segment(segment);
        self.inner.segment(segment);
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
            entered_outer_s: self.outer.entered_s,
            entered_inner_s: self.inner.entered_s,
            stayed_in_inner: self.inner.entered_s.is_some() && !self.inner.left_again,
        }
    }
}
