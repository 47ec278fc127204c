//! One segment of the frequency: the cubic Hermite curve through value and slope at its two ends.

/// Halvings when a crossing is located: h / 2^40 is far below the printed digits.
const HALVINGS: u32 = 40;
/// Most marks of a segment: both ends and three crossings of each of two levels.
const MARKS_MAX: usize = 10;

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

/// Shares of a segment, 0..=1; a list that needs no allocation.
#[derive(Debug, Clone, Copy)]
pub(super) struct Marks {
    values: [f64; MARKS_MAX],
    len: usize,
}

impl Marks {
    const EMPTY: Self = Self {
        values: [0.0; MARKS_MAX],
        len: 0,
    };

    fn push(&mut self, share: f64) {
        if let Some(slot) = self.values.get_mut(self.len) {
            *slot = share;
            self.len += 1;
        }
    }

    /// The stretches between neighbouring marks, in order.
    pub(super) fn stretches(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let pairs = self.values[..self.len].windows(2);
        pairs.map(|pair| (pair[0], pair[1])).filter(|(a, b)| a < b)
    }
}

/// The Hermite cubic between two knots.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arc {
    pub(super) from: Knot,
    pub(super) to: Knot,
}

impl Arc {
    pub(super) fn length(&self) -> f64 {
        self.to.time_s - self.from.time_s
    }

    /// Time of a share \[s\].
    pub(super) fn time_s(&self, share: f64) -> f64 {
        self.from.time_s + share * self.length()
    }

    /// Least and greatest control value of the same curve in Bernstein form; the curve lies between
    /// them.
    #[inline]
    pub(super) fn hull(&self) -> (f64, f64) {
        let third = self.length() / 3.0;
        let (a, d) = (self.from.f, self.to.f);
        let (b, c) = (a + third * self.from.df, d - third * self.to.df);
        (a.min(b).min(c).min(d), a.max(b).max(c).max(d))
    }

    /// Value at a share.
    pub(super) fn at(&self, s: f64) -> f64 {
        let h = self.length();
        let (s2, s3) = (s * s, s * s * s);
        self.from.f * (2.0 * s3 - 3.0 * s2 + 1.0)
            + self.from.df * h * (s3 - 2.0 * s2 + s)
            + self.to.f * (3.0 * s2 - 2.0 * s3)
            + self.to.df * h * (s3 - s2)
    }

    /// Shares in (0, 1) at which the slope is zero, in order.
    pub(super) fn extremes(&self) -> [Option<f64>; 2] {
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

    /// Both ends and the shares at which the curve crosses any of the levels, in order.
    pub(super) fn cuts(&self, levels: &[f64]) -> Marks {
        let mut marks = Marks::EMPTY;
        marks.push(0.0);
        for share in self.extremes().into_iter().flatten() {
            marks.push(share);
        }
        marks.push(1.0);
        let mut cuts = Marks::EMPTY;
        cuts.push(0.0);
        for level in levels {
            for (from, to) in marks.stretches() {
                let (low, high) = (self.at(from) - level, self.at(to) - level);
                if (low < 0.0) != (high < 0.0) {
                    cuts.push(self.crossing(from, to, *level));
                }
            }
        }
        cuts.push(1.0);
        cuts.values[..cuts.len].sort_by(f64::total_cmp);
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn segment(f: f64, df: f64, f1: f64, df1: f64) -> Arc {
        let knot = |time_s, f, df| Knot { time_s, f, df };
        Arc {
            from: knot(1.0, f, df),
            to: knot(3.0, f1, df1),
        }
    }

    proptest! {
        #[test]
        fn the_hull_holds_the_curve(f in -1.0..1.0, df in -1.0..1.0, f1 in -1.0..1.0, df1 in -1.0..1.0) {
            let segment = segment(f, df, f1, df1);
            let (low, high) = segment.hull();
            for i in 0..=20 {
                let value = segment.at(f64::from(i) / 20.0);
                // Rounding of sums of four terms below 2.
                prop_assert!(value >= low - 1e-14 && value <= high + 1e-14);
            }
        }
    }

    #[test]
    fn a_parabola_is_cut_where_it_crosses() {
        // f = t² - 1 on t = -1..1 moved to times 1..3: crosses -0.75 at t = ±0.5.
        let parabola = segment(0.0, -2.0, 0.0, 2.0);
        let times: Vec<f64> = parabola
            .cuts(&[-0.75])
            .stretches()
            .map(|(a, _)| parabola.time_s(a))
            .collect();
        assert_eq!(times.len(), 3);
        for (time, exact) in times.iter().zip([1.0, 1.5, 2.5]) {
            // Forty halvings of a length of 2.
            assert!((time - exact).abs() < 4.0 / 2f64.powi(40), "{time} {exact}");
        }
        assert_eq!(parabola.extremes()[0], Some(0.5));
    }
}
