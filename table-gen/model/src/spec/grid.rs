//! The cells of the state space: the spec's section, and its exact integer form.
//!
//! # Design
//! The device computes in micro-units (1e-6 of a state's unit: µHz and kW) held in `i32`. Every
//! cell edge is a whole number of them (`geometry` refuses a grid where it is not), so host and
//! device agree on each cell to the last bit, and everything here is integer arithmetic after one
//! rounding per number.
//!
//! # Tradeoffs
//! The functions are total: on a grid that was never validated they saturate rather than panic, and
//! mean nothing.

use serde::{Deserialize, Serialize};

/// Micro-units in a unit: µHz per Hz, kW per GW.
pub(super) const MICRO_PER_UNIT: f64 = 1e6;

/// Names of the states, in the order of every array of four.
pub(super) const STATE_NAMES: [&str; 4] = ["f", "g", "l", "p"];

/// Where cells lie relative to the multiples of the width.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Alignment {
    /// Cell centres at multiples of the width, as SCOTS has it; `lower` and `upper` are the
    /// outermost centres.
    Centres,
    /// Cells side by side from `lower` to `upper`, which are the outermost edges.
    Edges,
}

impl Alignment {
    /// All values as the spec writes them.
    pub(super) const NAMES: &'static [&'static str] = &["centres", "edges"];

    /// The value as the spec writes it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Centres => "centres",
            Self::Edges => "edges",
        }
    }
}

/// The uniform grid over the states (f, g, l, p), in Hz and GW; f is the deviation from 50 Hz.
///
/// Further conditions: `lower < upper`; `upper - lower` a whole number of widths; `lower` and
/// `width` whole multiples of 1e-6; with centres, `width` an even multiple and `lower` a multiple
/// of `width`; 1 to 65535 cells along each axis; all cells together within the memory at hand.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GridSpec {
    /// Lower end of the working region. The paper's "Symbolic Control for the Grid".
    ///
    /// Unit: Hz, GW, GW, GW. Allowed: 4 numbers, each from -2000 to 2000. Default: [-1, 0, 0, 0].
    pub lower: [f64; 4],
    /// Upper end of the working region. The paper's "Symbolic Control for the Grid".
    ///
    /// Unit: Hz, GW, GW, GW. Allowed: 4 numbers, each from -2000 to 2000. Default: [0.1, 2, 2, 3].
    pub upper: [f64; 4],
    /// Width of a cell. The paper's "Symbolic Control for the Grid".
    ///
    /// Unit: Hz, GW, GW, GW. Allowed: 4 numbers, each from 0.000001 to 100. Default: [0.05, 0.05,
    /// 0.05, 0.05].
    pub width: [f64; 4],
    /// Whether `lower` and `upper` are cell centres or cell edges.
    ///
    /// Unit: -. Allowed: "centres" or "edges". Default: "centres".
    pub alignment: Alignment,
}

impl Default for GridSpec {
    fn default() -> Self {
        Self {
            lower: [-1.0, 0.0, 0.0, 0.0],
            upper: [0.1, 2.0, 2.0, 3.0],
            width: [0.05; 4],
            alignment: Alignment::Centres,
        }
    }
}

impl GridSpec {
    /// Number of cells along each axis: (upper - lower) / width, and one more with centres.
    #[must_use]
    pub fn cell_counts(&self) -> [u32; 4] {
        std::array::from_fn(|axis| {
            let span = to_micro(self.upper[axis]).saturating_sub(to_micro(self.lower[axis]));
            let widths = span / to_micro(self.width[axis]).max(1);
            let count = match self.alignment {
                Alignment::Centres => widths.saturating_add(1),
                Alignment::Edges => widths,
            };
            count.clamp(0, u32::MAX.into()) as u32
        })
    }

    /// Number of cells in the whole grid.
    #[must_use]
    pub fn cells(&self) -> u64 {
        self.cell_counts().iter().fold(1, |product: u64, &count| {
            product.saturating_mul(count.into())
        })
    }

    /// Lower edge of the first cell along each axis, in micro-units (µHz, kW, kW, kW).
    #[must_use]
    pub fn lower_edges_micro(&self) -> [i32; 4] {
        std::array::from_fn(|axis| {
            saturate(to_micro(self.lower[axis]).saturating_sub(self.overhang(axis)))
        })
    }

    /// Upper edge of the last cell along each axis, in micro-units (µHz, kW, kW, kW).
    #[must_use]
    pub fn upper_edges_micro(&self) -> [i32; 4] {
        std::array::from_fn(|axis| {
            saturate(to_micro(self.upper[axis]).saturating_add(self.overhang(axis)))
        })
    }

    /// Cell width along each axis, in micro-units (µHz, kW, kW, kW).
    #[must_use]
    pub fn widths_micro(&self) -> [u32; 4] {
        self.width
            .map(|width| to_micro(width).clamp(0, u32::MAX.into()) as u32)
    }

    /// How far the outermost cells reach past `lower` and `upper`, in micro-units.
    fn overhang(&self, axis: usize) -> i64 {
        match self.alignment {
            Alignment::Centres => to_micro(self.width[axis]) / 2,
            Alignment::Edges => 0,
        }
    }
}

/// `value` in micro-units, to the nearest; saturating.
pub(super) fn to_micro(value: f64) -> i64 {
    (value * MICRO_PER_UNIT).round() as i64
}

/// A whole number of micro-units in the state's unit, for messages.
pub(super) fn from_micro(micro: i64) -> f64 {
    micro as f64 / MICRO_PER_UNIT
}

/// `value` in micro-units where it is a whole number of them.
///
/// The tolerance covers the noise of one decimal conversion, one sum and one product at the ends of
/// the allowed range: 2000 units are 2e9 micro-units, where each rounding errs by at most 2.4e-7.
pub(super) fn to_whole_micro(value: f64) -> Option<i64> {
    const TOLERANCE_MICRO: f64 = 1e-6;
    let scaled = value * MICRO_PER_UNIT;
    ((scaled - scaled.round()).abs() <= TOLERANCE_MICRO).then(|| to_micro(value))
}

fn saturate(micro: i64) -> i32 {
    micro.clamp(i32::MIN.into(), i32::MAX.into()) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn centres_reach_half_a_cell_past_the_ends() {
        let grid = GridSpec::default();
        assert_eq!(grid.cell_counts(), [23, 41, 41, 61]);
        assert_eq!(grid.cells(), 2_358_443);
        assert_eq!(
            grid.lower_edges_micro(),
            [-1_025_000, -25_000, -25_000, -25_000]
        );
        assert_eq!(
            grid.upper_edges_micro(),
            [125_000, 2_025_000, 2_025_000, 3_025_000]
        );
        assert_eq!(grid.widths_micro(), [50_000; 4]);
    }

    #[test]
    fn edges_end_at_the_ends() {
        let grid = GridSpec {
            lower: [-1.0, -0.6, -0.3, -0.3],
            upper: [0.1, 3.6, 2.2, 2.2],
            width: [0.01, 0.1, 0.05, 0.05],
            alignment: Alignment::Edges,
        };
        assert_eq!(grid.cell_counts(), [110, 42, 50, 50]);
        assert_eq!(grid.cells(), 11_550_000);
        assert_eq!(
            grid.lower_edges_micro(),
            [-1_000_000, -600_000, -300_000, -300_000]
        );
        assert_eq!(
            grid.upper_edges_micro(),
            [100_000, 3_600_000, 2_200_000, 2_200_000]
        );
    }

    #[test]
    fn decimal_noise_is_not_a_fraction_of_a_micro_unit() {
        assert_eq!(to_whole_micro(0.1 + 0.2), Some(300_000));
        assert_eq!(to_whole_micro(-0.000_001), Some(-1));
        assert_eq!(to_whole_micro(0.000_000_5), None);
        assert_eq!(to_whole_micro(1_999.999_999), Some(1_999_999_999));
    }

    #[test]
    fn nonsense_saturates() {
        let grid = GridSpec {
            width: [0.0; 4],
            upper: [f64::INFINITY; 4],
            ..GridSpec::default()
        };
        assert_eq!(grid.cell_counts(), [u32::MAX; 4]);
        assert_eq!(grid.cells(), u64::MAX);
        assert_eq!(grid.upper_edges_micro(), [i32::MAX; 4]);
    }
}
