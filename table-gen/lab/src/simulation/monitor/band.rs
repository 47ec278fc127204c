//! When a frequency band was left downwards and entered again.
//!
//! A start above the band is no departure: the event is a fall.

use super::arc::Arc;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    Below,
    Inside,
    Above,
}

/// Watches one band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BandWatch {
    low: f64,
    high: f64,
    /// When it was first left downwards \[s\].
    pub(super) left_s: Option<f64>,
    /// When it was first entered after that \[s\].
    pub(super) entered_s: Option<f64>,
    /// Whether it was left once more.
    pub(super) left_again: bool,
}

impl BandWatch {
    pub(super) fn new([low, high]: [f64; 2]) -> Self {
        Self {
            low,
            high,
            left_s: None,
            entered_s: None,
            left_again: false,
        }
    }

    /// Whether the band was left and never entered again.
    pub(super) fn is_lost(&self) -> bool {
        self.left_s.is_some() && self.entered_s.is_none()
    }

    /// Takes a segment whose curve lies within `hull`.
    #[inline]
    pub(super) fn segment(&mut self, segment: &Arc, hull: (f64, f64)) {
        let (lowest, highest) = hull;
        if self.place(lowest) == self.place(highest) {
            self.stretch(self.place(lowest), segment.from.time_s);
        } else {
            for (from, to) in segment.cuts(&[self.low, self.high]).stretches() {
                let f = segment.at(0.5 * (from + to));
                self.stretch(self.place(f), segment.time_s(from));
            }
        }
    }

    #[inline]
    fn place(&self, f: f64) -> Place {
        if f < self.low {
            Place::Below
        } else if f <= self.high {
            Place::Inside
        } else {
            Place::Above
        }
    }

    /// Takes a stretch that lies in one place as a whole.
    #[inline]
    fn stretch(&mut self, place: Place, from_s: f64) {
        match (place, self.left_s, self.entered_s) {
            (Place::Below, None, _) => self.left_s = Some(from_s),
            (Place::Inside, Some(_), None) => self.entered_s = Some(from_s),
            (Place::Below | Place::Above, Some(_), Some(_)) => self.left_again = true,
            _ => {}
        }
    }
}
