//! The states on which the phase machine decides alike.
//!
//! A decision depends on the cell of the measured state and on whether its frequency lies in I1 and
//! I2. So the cell edges of every axis, and on the frequency axis the edges of the bands as well,
//! cut the states into regions on each of which one representative state stands for all: the
//! firmware's own phase machine is asked for that one.

use firmware::phase::Phase;
use firmware::table::Header;
use firmware::units::{AXIS_F, Band, State};

use super::zonotope::Zonotope;
use model::interval::Interval;
use model::plant::STATES;

/// A region and the part of a set whose measurement may fall into it.
#[derive(Debug, Clone)]
pub(super) struct Part {
    /// A measured state of the region.
    pub(super) representative: State,
    /// The real states.
    pub(super) set: Zonotope,
}

/// The edges that cut the measured states, ascending on each axis \[micro-units\].
#[derive(Debug, Clone)]
pub(super) struct Regions {
    edges: [Vec<i32>; STATES],
    bands: Vec<i32>,
    outer: [i32; 2],
    inner: [i32; 2],
    error: [f64; STATES],
}

impl Regions {
    /// The regions of a table, for an estimate within an error of the real state.
    pub(super) fn new(header: &Header, error: [f64; STATES]) -> Self {
        let grid = &header.grid;
        let mut edges: [Vec<i32>; STATES] = std::array::from_fn(|d| {
            let (lower, width) = (i64::from(grid.lower_edge()[d]), i64::from(grid.width()[d]));
            // The grid's constructor has checked that every edge fits i32.
            (0..=i64::from(grid.count()[d]))
                .map(|i| (lower + width * i) as i32)
                .collect()
        });
        // A stored frequency is in the band up to and including `high`: the next integer is the
        // first outside.
        let ends = |band: &Band| [band.low_uhz, band.high_uhz.saturating_add(1)];
        let (outer, inner) = (ends(&header.outer), ends(&header.inner));
        let mut bands = [outer, inner].concat();
        bands.sort_unstable();
        bands.dedup();
        edges[AXIS_F].extend(&bands);
        edges[AXIS_F].sort_unstable();
        edges[AXIS_F].dedup();
        Self {
            edges,
            bands,
            outer,
            inner,
            error,
        }
    }

    /// The parts of a set by the band that a watching phase examines. On the other axes the
    /// representatives lie within the set's bounds.
    pub(super) fn by_band(&self, set: &Zonotope, phase: Phase) -> Vec<Part> {
        // Bounds that cross: generators and limits have no state in common.
        let empty = |axis| set.bounds(axis).low > set.bounds(axis).high;
        if (0..STATES).any(empty) {
            return Vec::new();
        }
        let band = match phase {
            // No control ends below I1 alone: one edge, so that the sets that stay are not cut in
            // two.
            Phase::NoControl => &self.outer[..1],
            _ => &self.inner[..],
        };
        let mut representative = [0i32; STATES];
        for (axis, value) in representative.iter_mut().enumerate() {
            *value = set.bounds(axis).mid().floor() as i32;
        }
        let part = Part {
            representative: State(representative),
            set: set.clone(),
        };
        cut(band, AXIS_F, self.error[AXIS_F], vec![part])
    }

    /// The parts of a set by cell and band.
    pub(super) fn by_cell(&self, set: &Zonotope) -> Vec<Part> {
        let mut parts = vec![Part {
            representative: State([0; STATES]),
            set: set.clone(),
        }];
        for axis in 0..STATES {
            parts = cut(&self.edges[axis], axis, self.error[axis], parts);
        }
        parts
    }

    /// Representatives of a cell, one for each band region that it meets, and the real frequencies
    /// \[µHz\] of each.
    pub(super) fn within(&self, bounds: &[(i32, i32); STATES]) -> Vec<(State, Interval)> {
        let (low, high) = bounds[AXIS_F];
        let mut starts = vec![low];
        starts.extend(
            self.bands
                .iter()
                .filter(|edge| low < **edge && **edge < high),
        );
        let error = self.error[AXIS_F];
        let mut out = Vec::with_capacity(starts.len());
        for (i, start) in starts.iter().enumerate() {
            let end = starts.get(i + 1).copied().unwrap_or(high);
            let mut state = bounds.map(|(low, _)| low);
            state[AXIS_F] = *start;
            let range = Interval {
                low: (f64::from(*start) - error).next_down(),
                high: (f64::from(end) + error).next_up(),
            };
            out.push((State(state), range));
        }
        out
    }
}

fn cut(edges: &[i32], axis: usize, error: f64, parts: Vec<Part>) -> Vec<Part> {
    let mut out = Vec::with_capacity(parts.len());
    for part in parts {
        let bounds = part.set.bounds(axis);
        let first =
            edges.partition_point(|edge| f64::from(*edge) <= (bounds.low - error).next_down());
        let last =
            edges.partition_point(|edge| f64::from(*edge) <= (bounds.high + error).next_up());
        // Region i lies between the edges i-1 and i.
        for region in first..=last {
            let low = match region.checked_sub(1) {
                Some(below) => f64::from(edges[below]) - error,
                None => f64::NEG_INFINITY,
            };
            let high = match edges.get(region) {
                Some(above) => f64::from(*above) + error,
                None => f64::INFINITY,
            };
            if let Some(set) = part.set.cut(axis, low.next_down(), high.next_up()) {
                let mut representative = part.representative;
                representative.0[axis] = match region.checked_sub(1) {
                    Some(below) => edges[below],
                    None => edges.first().copied().unwrap_or(0).saturating_sub(1),
                };
                out.push(Part {
                    representative,
                    set,
                });
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_astride_an_edge_has_two_parts() {
        let axis = Interval {
            low: -2.0,
            high: 3.0,
        };
        let set = Zonotope::of_box(&[axis, axis, axis, axis]);
        let parts = cut(
            &[-10, 0, 10],
            0,
            0.0,
            vec![Part {
                representative: State::default(),
                set,
            }],
        );
        assert_eq!(parts.len(), 2);
        assert_eq!(parts[0].representative.0[0], -10);
        assert_eq!(parts[1].representative.0[0], 0);
        assert!(parts[0].set.bounds(0).high >= 0.0 && parts[0].set.bounds(0).high < 1e-6);
    }

    #[test]
    fn an_error_makes_the_parts_overlap() {
        let axis = Interval {
            low: -2.0,
            high: 3.0,
        };
        let set = Zonotope::of_box(&[axis, axis, axis, axis]);
        let parts = cut(
            &[0],
            0,
            1.0,
            vec![Part {
                representative: State::default(),
                set,
            }],
        );
        assert!((parts[0].set.bounds(0).high - 1.0).abs() < 1e-6);
        assert!((parts[1].set.bounds(0).low + 1.0).abs() < 1e-6);
        assert_eq!(parts[0].representative.0[0], -1);
    }
}
