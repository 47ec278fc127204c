//! Coordinates in which the plant contracts.
//!
//! `x = T m`, T made of the plant's eigenvectors: one coordinate for a real eigenvalue, a pair for
//! two complex ones. In these coordinates the flow is a contraction of each block: an interval
//! shrinks, a disc turns and shrinks. Nothing rests on T being exact. Its entries are doubles; the
//! flow in m is enclosed as `T^-1 exp(A t) T` in intervals, whatever couples the blocks included.

use firmware::units::STATES;
use model::flow::{Matrix, Vector, apply, product};
use model::interval::Interval;
use nalgebra::{Complex, SMatrix};

/// A block: its first coordinate, and whether it is a pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Block {
    pub(crate) first: usize,
    pub(crate) pair: bool,
}

impl Block {
    /// Its coordinates.
    pub(crate) fn axes(self) -> std::ops::Range<usize> {
        self.first..self.first + 1 + usize::from(self.pair)
    }
}

/// The coordinates.
#[derive(Debug, Clone)]
pub(crate) struct Modes {
    pub(crate) blocks: Vec<Block>,
    /// T.
    pub(crate) out: Matrix<STATES>,
    /// An enclosure of T^-1.
    pub(crate) into: Matrix<STATES>,
}

/// The plant has no such coordinates: modes that are not separate, or one that does not die out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "the plant's modes are not separate or do not die out: the chain needs a plant that contracts"
)]
pub struct ModesError;

impl Modes {
    /// The modes of A.
    pub(crate) fn new(a: &Matrix<STATES>) -> Result<Self, ModesError> {
        let middle = SMatrix::<f64, STATES, STATES>::from_fn(|i, j| a[i][j].mid());
        let mut blocks = Vec::new();
        let mut columns: Vec<[f64; STATES]> = Vec::new();
        let eigenvalues = middle.complex_eigenvalues();
        for value in eigenvalues.iter() {
            if value.re >= 0.0 {
                return Err(ModesError);
            }
            let real = value.im.abs() < 1e-9;
            // Of a pair, the one with the positive imaginary part stands for both.
            if !real && value.im < 0.0 {
                continue;
            }
            let vector = eigenvector(&middle, *value).ok_or(ModesError)?;
            blocks.push(Block {
                first: columns.len(),
                pair: !real,
            });
            // A pair moves f by at most the radius of its disc; so does a single mode.
            let f = vector[0].norm();
            if f < 1e-9 {
                return Err(ModesError);
            }
            columns.push(vector.map(|entry| entry.re / f));
            if !real {
                columns.push(vector.map(|entry| entry.im / f));
            }
        }
        let columns: [[f64; STATES]; STATES] = columns.try_into().map_err(|_| ModesError)?;
        let plain = SMatrix::<f64, STATES, STATES>::from_fn(|i, j| columns[j][i]);
        let inverse = plain.try_inverse().ok_or(ModesError)?;
        let point = |matrix: &SMatrix<f64, STATES, STATES>| -> Matrix<STATES> {
            std::array::from_fn(|i| std::array::from_fn(|j| Interval::point(matrix[(i, j)])))
        };
        let out = point(&plain);
        let into = enclosed_inverse(&point(&inverse), &out).ok_or(ModesError)?;
        Ok(Self { blocks, out, into })
    }

    /// A map of states in these coordinates.
    pub(crate) fn map(&self, matrix: &Matrix<STATES>) -> Matrix<STATES> {
        product(&self.into, &product(matrix, &self.out))
    }

    /// A vector of states in these coordinates.
    pub(crate) fn vector(&self, vector: &Vector<STATES>) -> Vector<STATES> {
        apply(&self.into, vector)
    }

    /// Upper bound of the norm of a block of a matrix.
    pub(crate) fn norm(matrix: &Matrix<STATES>, to: Block, from: Block) -> f64 {
        // ‖B‖² is at most the largest row sum of |BᵀB|; for a rotation times a factor that is the
        // factor's square.
        let mut largest = 0.0f64;
        for j in from.axes() {
            let mut row = Interval::ZERO;
            for k in from.axes() {
                let mut entry = Interval::ZERO;
                for i in to.axes() {
                    entry = entry + matrix[i][j] * matrix[i][k];
                }
                row = row + entry.abs();
            }
            largest = largest.max(row.high);
        }
        largest.max(0.0).sqrt().next_up()
    }

    /// Upper bound of the length of a block of a vector.
    pub(crate) fn length(vector: &Vector<STATES>, block: Block) -> f64 {
        let mut sum = Interval::ZERO;
        for i in block.axes() {
            let size = Interval::point(vector[i].magnitude());
            sum = sum + size * size;
        }
        sum.high.max(0.0).sqrt().next_up()
    }
}

/// An eigenvector: the direction that `A - λ` shrinks most.
fn eigenvector(
    a: &SMatrix<f64, STATES, STATES>,
    value: Complex<f64>,
) -> Option<[Complex<f64>; STATES]> {
    let shifted = SMatrix::<Complex<f64>, STATES, STATES>::from_fn(|i, j| {
        let diagonal = if i == j {
            value
        } else {
            Complex::new(0.0, 0.0)
        };
        Complex::new(a[(i, j)], 0.0) - diagonal
    });
    let svd = shifted.svd(false, true);
    let v = svd.v_t?;
    let least = svd.singular_values.imin();
    // Rows of the result are conjugates.
    Some(std::array::from_fn(|j| v[(least, j)].conj()))
}

/// An enclosure of T^-1 from S near it: with E = I - S T, `T^-1 = S + E (I - E)^-1 S`, and the
/// entries of the second part are at most `‖E‖/(1 - ‖E‖)` times the largest of S in their column.
fn enclosed_inverse(s: &Matrix<STATES>, t: &Matrix<STATES>) -> Option<Matrix<STATES>> {
    let st = product(s, t);
    let mut norm = 0.0f64;
    for (i, row) in st.iter().enumerate() {
        let mut sum = 0.0f64;
        for (j, entry) in row.iter().enumerate() {
            let unit = if i == j {
                Interval::ONE
            } else {
                Interval::ZERO
            };
            sum = (sum + (unit - *entry).magnitude()).next_up();
        }
        norm = norm.max(sum);
    }
    if norm.is_nan() || norm > 1e-6 {
        return None;
    }
    // With ‖E‖ <= 1e-6, ‖E‖/(1 - ‖E‖) is below 1.00001 ‖E‖.
    let relative = norm * 1.000_01;
    let mut out = *s;
    for j in 0..STATES {
        let largest = (0..STATES).map(|i| s[i][j].magnitude()).fold(0.0, f64::max);
        let radius = (relative * largest).next_up();
        for row in &mut out {
            row[j] = row[j] + Interval::hull(-radius, radius);
        }
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::flow::Flow;
    use model::plant::Plant;
    use model::spec::Spec;

    #[test]
    fn the_papers_plant_contracts_in_its_modes() {
        let spec = Spec::load("paper-bi", &[]).unwrap();
        let (a, b) = Plant::new(&spec).matrices();
        let modes = Modes::new(&a).unwrap();
        let identity = product(&modes.into, &modes.out);
        for (i, row) in identity.iter().enumerate() {
            for (j, entry) in row.iter().enumerate() {
                assert!(entry.contains(if i == j { 1.0 } else { 0.0 }));
                assert!(entry.high - entry.low < 1e-11);
            }
        }
        let flow = Flow::over(&a, &b, 1.5);
        let map = modes.map(&flow.phi);
        // The poles are -2.021, -0.433 and -0.077 ± 0.226i to three digits: 1.5 s of them to 1e-3.
        let mut norms: Vec<f64> = modes
            .blocks
            .iter()
            .map(|b| Modes::norm(&map, *b, *b))
            .collect();
        norms.sort_by(f64::total_cmp);
        let known = [
            (-2.021f64 * 1.5).exp(),
            (-0.433f64 * 1.5).exp(),
            (-0.077f64 * 1.5).exp(),
        ];
        for (found, known) in norms.iter().zip(known) {
            assert!((found - known).abs() < 1e-3, "{norms:?}");
        }
        for to in &modes.blocks {
            for from in &modes.blocks {
                assert!(to == from || Modes::norm(&map, *to, *from) < 1e-6);
            }
        }
    }
}
