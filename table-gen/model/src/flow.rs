//! Enclosures of the flow of a linear system `x' = A x + b v`.
//!
//! With `v` constant, `x(t) = Φ(t) x(0) + Γ(t) v`, where Φ(t) = exp(A t) and Γ(t) = ∫ exp(A s) b
//! ds. Both are blocks of one exponential, `exp([A b; 0 0] t) = [Φ Γ; 0 1]`. With `v` varying in
//! time within ±r, the state moves by at most `r ∫ |exp(A s) b| ds` on each axis.
//!
//! The exponential is computed in interval arithmetic by scaling, Taylor series and squaring, with
//! the series' remainder added: for ‖M‖ <= 1/2 the terms past n are below `‖M‖^(n+1)/(n+1)! · 1/(1
//! - ‖M‖/(n+2))`, which is at most twice its first factor.

use crate::interval::Interval;

/// A square matrix of intervals.
pub type Matrix<const D: usize> = [[Interval; D]; D];
/// A vector of intervals.
pub type Vector<const D: usize> = [Interval; D];

/// Taylor terms; at norm 1/2 the remainder is below 1e-23.
const TERMS: u32 = 16;
/// Norm to which the matrix is scaled before the series.
const NORM_MAX: f64 = 0.5;
/// Pieces in which the interval of integration is cut where an absolute value is integrated; a
/// power of two, so that their length is exact.
const PIECES: u32 = 256;

/// Φ and Γ at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flow<const D: usize> {
    /// Φ(t) = exp(A t).
    pub phi: Matrix<D>,
    /// Γ(t) = ∫₀ᵗ exp(A s) b ds.
    pub gamma: Vector<D>,
}

impl<const D: usize> Flow<D> {
    /// The identity: no time has passed.
    pub fn identity() -> Self {
        let mut phi = [[Interval::ZERO; D]; D];
        for (i, row) in phi.iter_mut().enumerate() {
            row[i] = Interval::ONE;
        }
        Self {
            phi,
            gamma: [Interval::ZERO; D],
        }
    }

    /// The flow of `x' = A x + b v` over a time \[s\]; what a decimal time such as 0.1 s is off by
    /// as a binary number is enclosed.
    pub fn over(a: &Matrix<D>, b: &Vector<D>, time_s: f64) -> Self {
        let norm = (norm(a, b) * time_s.next_up()).next_up();
        let halvings = if norm <= NORM_MAX {
            0
        } else {
            (norm / NORM_MAX).log2().ceil() as i32
        };
        // A power of two: the division is exact.
        let scale = 2f64.powi(-halvings);
        let step = Interval {
            low: time_s.next_down().max(0.0) * scale,
            high: time_s.next_up() * scale,
        };
        let mut flow = Self::series(a, b, step);
        for _ in 0..halvings {
            flow = flow.then(&flow);
        }
        flow
    }

    /// First this flow, then another.
    #[must_use]
    pub fn then(&self, next: &Self) -> Self {
        let gamma = apply(&next.phi, &self.gamma);
        let mut out = Self {
            phi: product(&next.phi, &self.phi),
            gamma,
        };
        for (sum, term) in out.gamma.iter_mut().zip(&next.gamma) {
            *sum = *sum + *term;
        }
        out
    }

    /// The series at a step whose scaled norm is at most [`NORM_MAX`].
    fn series(a: &Matrix<D>, b: &Vector<D>, step: Interval) -> Self {
        let mut sum = Self::identity();
        let mut term = Self::identity();
        let mut factor = 1.0f64;
        for n in 1..=TERMS {
            let scale = step / Interval::point(f64::from(n));
            // term_n = M term_{n-1} / n with M = [A b; 0 0] step. Past the first term the last row
            // of the term is zero, so b enters only once.
            let mut phi = product(a, &term.phi);
            let mut gamma = apply(a, &term.gamma);
            if n == 1 {
                gamma = *b;
            }
            for i in 0..D {
                for entry in &mut phi[i] {
                    *entry = *entry * scale;
                }
                gamma[i] = gamma[i] * scale;
            }
            term = Self { phi, gamma };
            for i in 0..D {
                for j in 0..D {
                    sum.phi[i][j] = sum.phi[i][j] + term.phi[i][j];
                }
                sum.gamma[i] = sum.gamma[i] + term.gamma[i];
            }
            factor = factor * NORM_MAX / f64::from(n);
        }
        let tail = 2.0 * factor * NORM_MAX / f64::from(TERMS + 1);
        let tail = Interval {
            low: -tail.next_up(),
            high: tail.next_up(),
        };
        for i in 0..D {
            for entry in &mut sum.phi[i] {
                *entry = *entry + tail;
            }
            sum.gamma[i] = sum.gamma[i] + tail;
        }
        sum
    }
}

/// Upper bound of `∫₀ᵗ |exp(A s) b| ds` on each axis.
///
/// The interval is cut into pieces. Where the integrand keeps its sign on a piece, the piece's
/// share is the difference of Γ, exactly; elsewhere it is the piece's length times the largest
/// magnitude.
pub fn absolute_integral<const D: usize>(a: &Matrix<D>, b: &Vector<D>, time_s: f64) -> [f64; D] {
    let length = (time_s / f64::from(PIECES)).next_up();
    let step = Flow::over(a, b, length);
    let tube = tube(a, length);
    let mut y = *b;
    let mut sum = [0.0f64; D];
    for _ in 0..PIECES {
        let range = apply(&tube, &y);
        // ∫ over the piece of exp(A s) y ds, from the exponential with y in the place of b.
        let exact = Flow::over(a, &y, length).gamma;
        for d in 0..D {
            let share = if range[d].contains(0.0) {
                (range[d].magnitude() * length).next_up()
            } else {
                exact[d].magnitude()
            };
            sum[d] = (sum[d] + share).next_up();
        }
        y = apply(&step.phi, &y);
    }
    sum
}

/// Upper bound of `∫ |exp(A s) b| ds` from one time to a later one \[s\] on each axis; zero if the
/// second is not later.
pub fn absolute_integral_between<const D: usize>(
    a: &Matrix<D>,
    b: &Vector<D>,
    (from_s, to_s): (f64, f64),
) -> [f64; D] {
    if to_s <= from_s {
        return [0.0; D];
    }
    let start = Flow::over(a, b, from_s);
    // One step up, so that the rounded difference does not fall short.
    absolute_integral(a, &apply(&start.phi, b), (to_s - from_s).next_up())
}

/// Upper bound of `|exp(A s)|` for all s in `[0, time_s]`, entry by entry.
pub fn largest<const D: usize>(a: &Matrix<D>, time_s: f64) -> [[f64; D]; D] {
    let length = (time_s / f64::from(PIECES)).next_up();
    let step = Flow::over(a, &[Interval::ZERO; D], length);
    let within = tube(a, length);
    let mut at = Flow::<D>::identity().phi;
    let mut out = [[0.0f64; D]; D];
    for _ in 0..PIECES {
        let flows = product(&within, &at);
        for (out, flow) in out.iter_mut().flatten().zip(flows.iter().flatten()) {
            *out = out.max(flow.magnitude());
        }
        at = product(&step.phi, &at);
    }
    out
}

/// Enclosure of exp(A s) for all s in `[0, length_s]`: `I + A [0, h] + remainder`, with ‖A h‖ below
/// 1/2.
pub fn tube<const D: usize>(a: &Matrix<D>, length_s: f64) -> Matrix<D> {
    let zero = [Interval::ZERO; D];
    let span = (norm(a, &zero) * length_s.next_up()).next_up();
    // exp(x) - 1 - x <= x² for 0 <= x <= 1; past that the bound exp(x) is used, which is crude but
    // valid.
    let rest = if span <= 1.0 {
        (span * span).next_up()
    } else {
        span.exp() * 1.000_001
    };
    let time = Interval {
        low: 0.0,
        high: length_s.next_up(),
    };
    let mut out = Flow::<D>::identity().phi;
    for i in 0..D {
        for j in 0..D {
            let remainder = Interval {
                low: -rest,
                high: rest,
            };
            out[i][j] = out[i][j] + a[i][j] * time + remainder;
        }
    }
    out
}

/// Largest row sum of magnitudes of `[A b]`, rounded up.
fn norm<const D: usize>(a: &Matrix<D>, b: &Vector<D>) -> f64 {
    let mut largest = 0.0f64;
    for (row, drive) in a.iter().zip(b) {
        let mut sum = drive.magnitude();
        for entry in row {
            sum = (sum + entry.magnitude()).next_up();
        }
        largest = largest.max(sum);
    }
    largest
}

/// Matrix product.
pub fn product<const D: usize>(a: &Matrix<D>, b: &Matrix<D>) -> Matrix<D> {
    let mut out = [[Interval::ZERO; D]; D];
    for i in 0..D {
        for j in 0..D {
            for (k, row) in b.iter().enumerate() {
                out[i][j] = out[i][j] + a[i][k] * row[j];
            }
        }
    }
    out
}

/// Matrix times vector.
pub fn apply<const D: usize>(a: &Matrix<D>, x: &Vector<D>) -> Vector<D> {
    let mut out = [Interval::ZERO; D];
    for i in 0..D {
        for j in 0..D {
            out[i] = out[i] + a[i][j] * x[j];
        }
    }
    out
}

/// The Metzler matrix of A: diagonal as it is, magnitudes elsewhere. Its exponential bounds `|exp(A
/// t)|` (SCOTS' growth bound of a linear system).
pub fn metzler<const D: usize>(a: &Matrix<D>) -> Matrix<D> {
    let mut out = *a;
    for (i, row) in out.iter_mut().enumerate() {
        for (j, entry) in row.iter_mut().enumerate() {
            if i != j {
                *entry = entry.abs();
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::SMatrix;

    /// The plant's matrix in plain numbers, from the paper's equation (5), order (f, g, l, p).
    const A: [[f64; 4]; 4] = [
        [-0.125, 0.0, 0.0, 0.125],
        [-2.0, -0.4, 0.0, 0.0],
        [-1.0 / 3.0, 1.0 / 60.0, -1.0 / 12.0, 0.0],
        [0.0, 0.0, 2.0, -2.0],
    ];

    fn interval(a: &[[f64; 4]; 4]) -> Matrix<4> {
        a.map(|row| row.map(Interval::point))
    }

    #[test]
    fn exponential_encloses_the_librarys_and_is_tight() {
        for time in [0.05, 0.5, 1.5, 2.0, 12.0] {
            let flow = Flow::over(&interval(&A), &[Interval::ZERO; 4], time);
            let library = SMatrix::<f64, 4, 4>::from_fn(|i, j| A[i][j] * time).exp();
            for i in 0..4 {
                for j in 0..4 {
                    let entry = flow.phi[i][j];
                    // The library claims about 1e-15 relative to the norm (at most 10 here); ours
                    // must be that tight.
                    assert!(entry.high - entry.low < 1e-11, "{time} {i} {j} {entry:?}");
                    assert!((library[(i, j)] - entry.mid()).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn integral_of_a_scalar_decay_is_known() {
        // x' = -x + v: Γ(t) = 1 - exp(-t), and |exp(-s)| has the same integral.
        let a = [[Interval::point(-1.0)]];
        let b = [Interval::ONE];
        let exact = 1.0 - (-1.5f64).exp();
        let flow = Flow::over(&a, &b, 1.5);
        assert!((flow.gamma[0].mid() - exact).abs() < 1e-14);
        let bound = absolute_integral(&a, &b, 1.5)[0];
        assert!(bound >= exact && bound < exact + 1e-10, "{bound} {exact}");
    }

    #[test]
    fn a_later_stretch_of_an_integral_and_the_largest_flow_are_known() {
        // ∫ exp(-s) ds from 1 to 2.5; exp(-s) is largest at 0.
        let a = [[Interval::point(-1.0)]];
        let exact = (-1f64).exp() - (-2.5f64).exp();
        let bound = absolute_integral_between(&a, &[Interval::ONE], (1.0, 2.5))[0];
        assert!(bound >= exact && bound < exact + 1e-10, "{bound} {exact}");
        assert_eq!(
            absolute_integral_between(&a, &[Interval::ONE], (1.0, 1.0)),
            [0.0]
        );
        let top = largest(&a, 2.0)[0][0];
        // The tube's remainder is the square of the piece's length.
        assert!((1.0..1.0 + 1e-4).contains(&top), "{top}");
        // x' = x grows to e²; the last piece errs by less than 3 e² (2/256)².
        let grown = largest(&[[Interval::ONE]], 2.0)[0][0];
        let exact = 2f64.exp();
        assert!(grown >= exact && grown < exact * 1.001, "{grown}");
    }

    #[test]
    fn absolute_integral_of_an_oscillator_counts_both_signs() {
        // x' = y, y' = -x, b = (0, 1): x(s) = sin s; over 2π the integral of |sin| is 4 and Γ is 0.
        let a = [
            [Interval::ZERO, Interval::ONE],
            [Interval::point(-1.0), Interval::ZERO],
        ];
        let b = [Interval::ZERO, Interval::ONE];
        let time = std::f64::consts::TAU;
        let bound = absolute_integral(&a, &b, time);
        // A piece that holds a sign change is overestimated by at most its length times its largest
        // value, 2 (2π/256)².
        assert!(bound[0] >= 4.0 - 1e-12 && bound[0] < 4.0 + 3.0 * (time / 256.0).powi(2) * 2.0);
        assert!(Flow::over(&a, &b, time).gamma[0].magnitude() < 1e-10);
    }
}
