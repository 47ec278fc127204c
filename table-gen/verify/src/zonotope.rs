//! Tight sets of states: a zonotope with a box of slack, `{ c + G α + β : |α_j| <= 1, |β_i| <=
//! slack_i }`, cut by a box.
//!
//! Linear flows map a zonotope to a zonotope exactly; what floating point loses goes into the
//! slack. Cutting by `low <= x_i <= high` shrinks the intervals of the coefficients α (a sound
//! over-approximation of the cut, exact for a single generator, which is what the unknown moment of
//! the event gives). With several generators each can make up for another and little shrinks; the
//! box remembers the cut, and one step later it still bounds what matters.

use super::drive::Drive;
use super::held_input::{HeldInput, Linear};
use model::flow::Vector;
use model::interval::Interval;
use model::plant::STATES;

/// Most generators that are kept; the smallest beyond are boxed.
const GENERATORS_MAX: usize = 32;
/// Slack \[micro-units\] from which a box of disturbance is carried as generators, so that it
/// rotates with the flow.
const SLACK_MAX: f64 = 1e-3;
/// Rounds of contraction of a cut; each costs one pass over generators and axes.
const ROUNDS_MAX: u32 = 4;

/// A zonotope with slack \[micro-units\].
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Zonotope {
    centre: [f64; STATES],
    generators: Vec<[f64; STATES]>,
    slack: [f64; STATES],
    limits: [Interval; STATES],
}

/// No limit.
const WHOLE: Interval = Interval {
    low: f64::NEG_INFINITY,
    high: f64::INFINITY,
};

impl Linear for Zonotope {
    fn range(&self, row: &Vector<STATES>) -> Interval {
        let mut sum = Interval::ZERO;
        for d in 0..STATES {
            sum = sum + row[d] * Interval::point(self.centre[d]);
        }
        let mut radius = 0.0f64;
        for generator in &self.generators {
            let mut along = Interval::ZERO;
            for d in 0..STATES {
                along = along + row[d] * Interval::point(generator[d]);
            }
            radius = (radius + along.magnitude()).next_up();
        }
        for d in 0..STATES {
            radius = (radius + (row[d].magnitude() * self.slack[d]).next_up()).next_up();
        }
        meet(sum + symmetric(radius), self.hull().range(row))
    }

    fn magnitude(&self) -> [f64; STATES] {
        std::array::from_fn(|d| self.bounds(d).magnitude())
    }
}

impl Zonotope {
    /// A box.
    pub(super) fn of_box(axes: &[Interval; STATES]) -> Self {
        let mut out = Self {
            centre: axes.map(Interval::mid),
            generators: Vec::new(),
            slack: axes.map(|axis| {
                if axis.low == axis.high {
                    0.0
                } else {
                    axis.radius()
                }
            }),
            limits: *axes,
        };
        out.tidy();
        out
    }

    /// The hull of this set under two flows and everything on the chords between their images,
    /// widened by a box: `{ (1-θ) x + θ y }` for x and y the images of one point.
    pub(super) fn chord(start: &Self, end: &Self, widen: [f64; STATES]) -> Self {
        let mut out = Self {
            centre: [0.0; STATES],
            generators: Vec::with_capacity(start.generators.len() + 1),
            slack: [0.0; STATES],
            limits: [WHOLE; STATES],
        };
        let mut chord = [0.0; STATES];
        for d in 0..STATES {
            let (a, b) = (
                Interval::point(start.centre[d]),
                Interval::point(end.centre[d]),
            );
            let half = Interval::point(0.5);
            out.centre[d] = keep((a + b) * half, &mut out.slack[d]);
            chord[d] = keep((b - a) * half, &mut out.slack[d]);
            let slack = start.slack[d].max(end.slack[d]);
            out.slack[d] = (out.slack[d] + (slack + widen[d]).next_up()).next_up();
        }
        // The generators of both are the images of the same ones; half their difference is the
        // error of their mean.
        for (a, b) in start.generators.iter().zip(&end.generators) {
            let mut mean = [0.0; STATES];
            for d in 0..STATES {
                let (x, y) = (Interval::point(a[d]), Interval::point(b[d]));
                let half = Interval::point(0.5);
                mean[d] = keep((x + y) * half, &mut out.slack[d]);
                let error = ((y - x) * half).magnitude();
                out.slack[d] = (out.slack[d] + error).next_up();
            }
            out.generators.push(mean);
        }
        out.generators.push(chord);
        out.tidy();
        out
    }

    /// The states at the end of a segment; the generators keep their order and number, the slack
    /// takes the rest.
    pub(super) fn flown(&self, segment: &HeldInput, drive: Drive) -> Self {
        let phi = &segment.flow.phi;
        let mut out = Self {
            centre: [0.0; STATES],
            generators: Vec::with_capacity(self.generators.len() + STATES),
            slack: [0.0; STATES],
            limits: [WHOLE; STATES],
        };
        let hull = self.hull();
        for d in 0..STATES {
            let varied = symmetric((segment.absolute[d] * drive.radius).next_up());
            let driven = segment.flow.gamma[d] * Interval::point(drive.mid);
            out.limits[d] = hull.range(&phi[d]) + driven + varied;
            let mut centre = segment.flow.gamma[d] * Interval::point(drive.mid);
            let mut slack = (segment.absolute[d] * drive.radius).next_up();
            for j in 0..STATES {
                centre = centre + phi[d][j] * Interval::point(self.centre[j]);
                slack = (slack + (phi[d][j].magnitude() * self.slack[j]).next_up()).next_up();
            }
            out.slack[d] = slack;
            out.centre[d] = keep(centre, &mut out.slack[d]);
        }
        for generator in &self.generators {
            let mut image = [0.0; STATES];
            for d in 0..STATES {
                let mut sum = Interval::ZERO;
                for j in 0..STATES {
                    sum = sum + phi[d][j] * Interval::point(generator[j]);
                }
                image[d] = keep(sum, &mut out.slack[d]);
            }
            out.generators.push(image);
        }
        out
    }

    /// [`Zonotope::flown`], tidied: large slack becomes generators, many generators become fewer.
    pub(super) fn after(&self, segment: &HeldInput, drive: Drive) -> Self {
        let mut out = self.flown(segment, drive);
        out.tidy();
        out
    }

    /// Interval of an axis.
    pub(super) fn bounds(&self, axis: usize) -> Interval {
        meet(
            Interval::point(self.centre[axis]) + symmetric(self.radius(axis)),
            self.limits[axis],
        )
    }

    /// The box around the set.
    pub(super) fn hull(&self) -> [Interval; STATES] {
        std::array::from_fn(|d| self.bounds(d))
    }

    /// Interval of the frequency \[µHz\].
    pub(super) fn hull_f(&self) -> Interval {
        self.bounds(firmware::units::AXIS_F)
    }

    fn radius(&self, axis: usize) -> f64 {
        let mut radius = self.slack[axis];
        for generator in &self.generators {
            radius = (radius + generator[axis].abs()).next_up();
        }
        radius
    }

    /// Cuts by `low <= x <= high` on an axis; `None` if nothing is left.
    pub(super) fn cut(&self, axis: usize, low: f64, high: f64) -> Option<Self> {
        let bounds = self.bounds(axis);
        if bounds.high < low || high < bounds.low {
            return None;
        }
        if low <= bounds.low && bounds.high <= high {
            return Some(self.clone());
        }
        let mut alpha = vec![
            Interval {
                low: -1.0,
                high: 1.0
            };
            self.generators.len()
        ];
        let fixed = Interval::point(self.centre[axis]) + symmetric(self.slack[axis]);
        let target = meet(Interval { low, high }, self.limits[axis]);
        for _ in 0..ROUNDS_MAX {
            let mut changed = false;
            for j in 0..self.generators.len() {
                let slope = self.generators[j][axis];
                if slope == 0.0 {
                    continue;
                }
                let mut rest = fixed;
                for (k, generator) in self.generators.iter().enumerate() {
                    if k != j {
                        rest = rest + Interval::point(generator[axis]) * alpha[k];
                    }
                }
                let allowed = (target - rest) / Interval::point(slope);
                let cut = Interval {
                    low: alpha[j].low.max(allowed.low),
                    high: alpha[j].high.min(allowed.high),
                };
                if cut.low > cut.high {
                    return None;
                }
                changed |= cut != alpha[j];
                alpha[j] = cut;
            }
            if !changed {
                break;
            }
        }
        let mut out = self.with_coefficients(&alpha);
        out.limits[axis] = target;
        let empty = |axis| {
            let bounds: Interval = out.bounds(axis);
            bounds.low > bounds.high
        };
        (!(0..STATES).any(empty)).then_some(out)
    }

    fn with_coefficients(&self, alpha: &[Interval]) -> Self {
        let mut out = Self {
            centre: [0.0; STATES],
            generators: vec![[0.0; STATES]; self.generators.len()],
            slack: self.slack,
            limits: self.limits,
        };
        let mut centre = self.centre.map(Interval::point);
        for (j, generator) in self.generators.iter().enumerate() {
            if alpha[j].low == -1.0 && alpha[j].high == 1.0 {
                out.generators[j] = *generator;
                continue;
            }
            let (mid, radius) = (alpha[j].mid(), alpha[j].radius());
            for d in 0..STATES {
                centre[d] = centre[d] + Interval::point(generator[d]) * Interval::point(mid);
                let scaled = Interval::point(generator[d]) * Interval::point(radius);
                out.generators[j][d] = keep(scaled, &mut out.slack[d]);
            }
        }
        for d in 0..STATES {
            out.centre[d] = keep(centre[d], &mut out.slack[d]);
        }
        out
    }

    fn tidy(&mut self) {
        for d in 0..STATES {
            if self.slack[d] > SLACK_MAX {
                let mut generator = [0.0; STATES];
                generator[d] = self.slack[d];
                self.generators.push(generator);
                self.slack[d] = 0.0;
            }
        }
        if self.generators.len() <= GENERATORS_MAX {
            return;
        }
        let size = |g: &[f64; STATES]| g.iter().map(|x| x.abs()).sum::<f64>();
        self.generators.sort_by(|a, b| size(b).total_cmp(&size(a)));
        for generator in self.generators.drain(GENERATORS_MAX - STATES..) {
            for d in 0..STATES {
                self.slack[d] = (self.slack[d] + generator[d].abs()).next_up();
            }
        }
        for d in 0..STATES {
            let mut generator = [0.0; STATES];
            generator[d] = self.slack[d];
            self.generators.push(generator);
            self.slack[d] = 0.0;
        }
    }
}

/// The middle of an interval; its radius goes into the slack.
fn keep(value: Interval, slack: &mut f64) -> f64 {
    let mid = value.mid();
    if value.low != value.high {
        *slack = (*slack + value.radius()).next_up();
    }
    mid
}

/// The members of both; if there are none, the ends cross.
fn meet(a: Interval, b: Interval) -> Interval {
    Interval {
        low: a.low.max(b.low),
        high: a.high.min(b.high),
    }
}

fn symmetric(radius: f64) -> Interval {
    Interval {
        low: -radius,
        high: radius,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Zonotope {
        let unit = Interval {
            low: -1.0,
            high: 1.0,
        };
        Zonotope::of_box(&[unit, unit, Interval::ZERO, Interval::ZERO])
    }

    #[test]
    fn a_box_cut_in_half_is_a_box() {
        let half = square().cut(0, 0.0, 5.0).unwrap();
        // Exact but for a few outward roundings of numbers near 1.
        assert!(half.bounds(0).low <= 0.0 && half.bounds(0).low > -1e-14);
        assert!(half.bounds(0).high >= 1.0 && half.bounds(0).high < 1.0 + 1e-14);
        assert!(half.bounds(1).low <= -1.0);
        assert_eq!(square().cut(0, 1.5, 2.0), None);
        assert_eq!(square().cut(0, -3.0, 3.0), Some(square()));
    }

    #[test]
    fn a_cut_of_one_generator_moves_all_axes() {
        // The segment from (-1, -2) to (1, 2), cut to x >= 0.5, is the one from (0.5, 1) to (1, 2).
        let line = Zonotope {
            centre: [0.0; STATES],
            generators: vec![[1.0, 2.0, 0.0, 0.0]],
            slack: [0.0; STATES],
            limits: [WHOLE; STATES],
        };
        let cut = line.cut(0, 0.5, 9.0).unwrap();
        assert!(
            (cut.bounds(1).low - 1.0).abs() < 1e-14 && (cut.bounds(1).high - 2.0).abs() < 1e-14
        );
    }

    #[test]
    fn reduction_keeps_the_set() {
        let mut many = square();
        for i in 0..40 {
            many.generators.push([0.01, 0.02, f64::from(i), 0.0]);
        }
        let before = many.hull();
        many.tidy();
        assert_eq!(many.generators.len(), GENERATORS_MAX);
        for d in 0..STATES {
            let after = many.bounds(d);
            assert!(after.low <= before[d].low + 1e-9 && after.high >= before[d].high - 1e-9);
        }
    }
}
