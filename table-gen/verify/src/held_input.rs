//! A stretch of time with a held input: where the state is at its end, and where the frequency is
//! in between.
//!
//! Write v = m + d(t) with |d| <= r. The part driven by the start and m is `y(s) = φ(s)·x + γ(s)
//! m`, where φ and γ are the frequency's row of the flow; the part driven by d is at most `r a(s)`,
//! a(s) = ∫ |e_f exp(A σ) b| dσ over [0, s]. The stretch is cut into steps of length h. Within a
//! step that starts at s_k
//!
//! - y differs from its chord by at most `h²/8 sup|y''|`, with `y'' = e_f A² Φ(s) x + e_f A Φ(s) b
//!   m`;
//! - a(s) lies below the line from a(s_k) with the slope `sup |e_f exp(A σ) b|` over the step.
//!
//! So both bounds of f are lines plus a constant, extreme at the step's ends: the excess over the
//! real range is of second order in h.

use super::drive::Drive;
use model::flow::{Flow, Matrix, Vector, absolute_integral, apply, product, tube};
use model::interval::Interval;
use model::plant::STATES;

/// Longest step \[s\]: with the paper's plant (|y''| below 1 Hz/s²) the excess is below 13 µHz.
const STEP_S_MAX: f64 = 0.01;
/// Axis of the frequency.
const F: usize = firmware::units::AXIS_F;

/// A set of states of which linear functionals can be bounded.
pub(crate) trait Linear {
    /// Range of `row · x` over the set.
    fn range(&self, row: &Vector<STATES>) -> Interval;
    /// Largest magnitude on each axis.
    fn magnitude(&self) -> [f64; STATES];
}

/// A box of states.
impl Linear for [Interval; STATES] {
    fn range(&self, row: &Vector<STATES>) -> Interval {
        let mut sum = Interval::ZERO;
        for (coefficient, axis) in row.iter().zip(self) {
            sum = sum + *coefficient * *axis;
        }
        sum
    }

    fn magnitude(&self) -> [f64; STATES] {
        self.map(Interval::magnitude)
    }
}

/// The frequency's row of the flow at the start of a step, and what bounds the step.
#[derive(Debug, Clone)]
struct Step {
    phi: Vector<STATES>,
    gamma: Interval,
    /// a(s_k), rounded up.
    absolute: f64,
    /// The line above a, at the step's end.
    absolute_end: f64,
    /// `h²/8 sup |e_f A² Φ|`, by column.
    curvature: [f64; STATES],
    /// `h²/8 sup |e_f A Φ b|`.
    curvature_drive: f64,
}

/// A stretch of time with a held input.
#[derive(Debug, Clone)]
pub(crate) struct HeldInput {
    /// Φ and Γ over the whole stretch.
    pub(crate) flow: Flow<STATES>,
    /// `∫ |exp(A s) b| ds` over the stretch, rounded up.
    pub(crate) absolute: [f64; STATES],
    steps: Vec<Step>,
    end_phi: Vector<STATES>,
    end_gamma: Interval,
}

impl HeldInput {
    /// The stretch of this length \[s\] of `x' = A x + b v`.
    pub(crate) fn new(a: &Matrix<STATES>, b: &Vector<STATES>, length_s: f64) -> Self {
        let count = (length_s / STEP_S_MAX).ceil().max(1.0) as u32;
        // A length that exceeds the exact quotient: the steps then cover the stretch.
        let h = (length_s / f64::from(count)).next_up();
        let step = Flow::over(a, b, h);
        let within = tube(a, h);
        let square = product(a, a);
        let eighth = h * h / 8.0 * (1.0 + 1e-12);
        let mut at = Flow::identity();
        let mut absolute = 0.0f64;
        let mut steps = Vec::with_capacity(count as usize);
        for _ in 0..count {
            // exp(A s) for every s of the step.
            let flows = product(&within, &at.phi);
            let bend = product(&square, &flows);
            let impulse = apply(&flows, b);
            let turn = apply(a, &impulse)[F];
            let absolute_end = (absolute + (impulse[F].magnitude() * h).next_up()).next_up();
            steps.push(Step {
                phi: at.phi[F],
                gamma: at.gamma[F],
                absolute,
                absolute_end,
                curvature: bend[F].map(|entry| (entry.magnitude() * eighth).next_up()),
                curvature_drive: (turn.magnitude() * eighth).next_up(),
            });
            absolute = absolute_end.min(next_absolute(a, b, &at, absolute, h));
            at = at.then(&step);
        }
        Self {
            flow: Flow::over(a, b, length_s),
            absolute: absolute_integral(a, b, length_s),
            end_phi: at.phi[F],
            end_gamma: at.gamma[F],
            steps,
        }
    }

    /// Bounds of the frequency at all times of the stretch \[µHz\], from every state of a set.
    pub(crate) fn frequency(&self, set: &impl Linear, drive: Drive) -> Interval {
        let magnitude = set.magnitude();
        let mid = Interval::point(drive.mid);
        let at = |phi: &Vector<STATES>, gamma: Interval| set.range(phi) + gamma * mid;
        let Some(first) = self.steps.first() else {
            return at(&self.end_phi, self.end_gamma);
        };
        let mut start = at(&first.phi, first.gamma);
        let mut range = start;
        for (index, step) in self.steps.iter().enumerate() {
            let end = match self.steps.get(index + 1) {
                Some(next) => at(&next.phi, next.gamma),
                None => at(&self.end_phi, self.end_gamma),
            };
            let mut bend = step.curvature_drive * drive.mid.abs();
            for (curvature, magnitude) in step.curvature.iter().zip(&magnitude) {
                bend += curvature * magnitude;
            }
            // Five products and five sums of non-negative numbers: relative error below 12
            // roundings.
            let bend = bend * (1.0 + 12.0 * f64::EPSILON);
            let wide = |at: Interval, absolute: f64| {
                let radius = (bend + (drive.radius * absolute).next_up()).next_up();
                at + Interval {
                    low: -radius,
                    high: radius,
                }
            };
            let both = wide(start, step.absolute).join(wide(end, step.absolute_end));
            range = range.join(both);
            start = end;
        }
        range
    }
}

/// a at the end of a step: exact where the integrand keeps its sign, else the largest magnitude
/// times the length.
fn next_absolute(
    a: &Matrix<STATES>,
    b: &Vector<STATES>,
    at: &Flow<STATES>,
    absolute: f64,
    h: f64,
) -> f64 {
    let impulse = apply(&at.phi, b);
    let within = apply(&tube(a, h), &impulse)[F];
    if within.contains(0.0) {
        return f64::INFINITY;
    }
    let share = Flow::over(a, &impulse, h).gamma[F].magnitude();
    (absolute + share).next_up()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decay() -> (Matrix<STATES>, Vector<STATES>) {
        // Four uncoupled states, f' = -f + v.
        let mut a = [[Interval::ZERO; STATES]; STATES];
        a[0][0] = Interval::point(-1.0);
        let mut b = [Interval::ZERO; STATES];
        b[0] = Interval::ONE;
        (a, b)
    }

    #[test]
    fn the_range_of_a_decay_is_known() {
        let (a, b) = decay();
        let segment = HeldInput::new(&a, &b, 1.0);
        let mut set = [Interval::ZERO; STATES];
        set[0] = Interval::point(2.0);
        let still = Drive {
            mid: 0.0,
            radius: 0.0,
        };
        let range = segment.frequency(&set, still);
        // From 2 down to 2/e; the excess of a chord is at most h²/8 · 2 = 2.5e-5.
        assert!(range.high >= 2.0 && range.high < 2.0 + 3e-5);
        let low = 2.0 * (-1.0f64).exp();
        assert!(range.low <= low && range.low > low - 3e-5, "{range:?}");
    }

    #[test]
    fn a_varying_drive_widens_the_range_by_its_integral() {
        let (a, b) = decay();
        let segment = HeldInput::new(&a, &b, 1.0);
        let set = [Interval::ZERO; STATES];
        let range = segment.frequency(
            &set,
            Drive {
                mid: 0.0,
                radius: 3.0,
            },
        );
        // 3 (1 - 1/e); the last step's line exceeds a by at most h²/2.
        let reach = 3.0 * (1.0 - (-1.0f64).exp());
        assert!(
            range.high >= reach && range.high < reach + 3.0 * 1e-4,
            "{range:?}"
        );
        assert!(range.low <= -reach && range.low > -reach - 3.0 * 1e-4);
    }
}
