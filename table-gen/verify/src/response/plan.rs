//! The cases of a proof: the bands of loss and parameters, cut so finely that each is tight.

use model::interval::Interval;
use rayon::prelude::*;

use super::cases::{Case, Found, Resolution, examine};
use super::fleet_loop::{LossProfile, PlantBand};

/// Width of a band of the loss \[GW\].
pub const LOSS_BAND_GW: f64 = 0.04;
/// Widths of the cells of unknown parameters: 1/H relative to its middle, K relative to it, D
/// \[GW/Hz\].
const INERTIA_CELL: f64 = 0.06;
const GAIN_CELL: f64 = 0.06;
const DAMPING_CELL_GW_PER_HZ: f64 = 0.2;
/// The same of the time constants, relative to their middle.
const TIME_CELL: f64 = 0.1;

/// How finely cases are followed, in turn until one is good enough. A loss that moves may jump
/// within a step, so its steps are short from the first.
const CONSTANT: [Resolution; 2] = [
    Resolution {
        step_s: 0.05,
        follow_s: 50.0,
        memory_s: 25.0,
    },
    Resolution {
        step_s: 0.025,
        follow_s: 50.0,
        memory_s: 25.0,
    },
];
const MOVING: [Resolution; 1] = [CONSTANT[1]];

/// What was found for all cases.
#[derive(Debug, Clone)]
pub struct Summary {
    /// Case for case.
    pub found: Vec<(Case, Option<Found>)>,
}

/// The cases of a band of losses, cut into bands of a width \[GW\], and a band of plants.
pub fn cases(all: &Case, loss_band_gw: f64) -> Vec<Case> {
    let inverse = |h: Interval| 1.0 / h.mid();
    let inertia = &all.plant.inertia;
    let inertia_cells = split(
        Interval::hull(1.0 / inertia.high, 1.0 / inertia.low),
        INERTIA_CELL * inverse(*inertia),
    );
    let gain = all.plant.governor_gain;
    let gains = split(gain, GAIN_CELL * gain.magnitude());
    let dampings = split(all.plant.damping, DAMPING_CELL_GW_PER_HZ);
    let losses = match all.assumed.profile {
        LossProfile::Band => vec![all.assumed.loss],
        LossProfile::Constant | LossProfile::NonDecreasing => split(all.assumed.loss, loss_band_gw),
    };
    let mut out = Vec::new();
    // T_1 may be 0.
    let times = all
        .plant
        .times
        .cut(|band| split(band, (TIME_CELL * band.mid()).max(1e-9)));
    let inertia_and_times = inertia_cells
        .iter()
        .flat_map(|inertia| times.iter().map(move |times| (inertia, times)));
    for (inverse_inertia, times) in inertia_and_times {
        for governor_gain in &gains {
            for damping in &dampings {
                for last in &losses {
                    let point = inverse_inertia.low == inverse_inertia.high;
                    let mut case = *all;
                    case.plant = PlantBand {
                        // A point stays that point; else outward, since the reciprocal is rounded
                        // twice.
                        inertia: if point {
                            *inertia
                        } else {
                            Interval {
                                low: (1.0 / inverse_inertia.high).next_down().next_down(),
                                high: (1.0 / inverse_inertia.low).next_up().next_up(),
                            }
                        },
                        governor_gain: *governor_gain,
                        damping: *damping,
                        times: *times,
                        ..all.plant
                    };
                    case.last = *last;
                    case.assumed.loss = match all.assumed.profile {
                        LossProfile::Constant => *last,
                        // Before its last rise it was anything below.
                        LossProfile::NonDecreasing => Interval {
                            low: all.assumed.loss.low,
                            high: last.high,
                        },
                        LossProfile::Band => all.assumed.loss,
                    };
                    out.push(case);
                }
            }
        }
    }
    out
}

/// Pieces of an interval, each at most so wide, whose union is the interval.
fn split(range: Interval, width: f64) -> Vec<Interval> {
    let count = ((range.high - range.low) / width - 1e-9).ceil().max(1.0) as usize;
    let edge = |index: usize| match index {
        0 => range.low,
        index if index == count => range.high,
        index => range.low + (range.high - range.low) * index as f64 / count as f64,
    };
    (0..count)
        .map(|index| Interval {
            low: edge(index),
            high: edge(index + 1),
        })
        .collect()
}

/// Cases that are examined between two reports of progress.
const TOGETHER: usize = 8;

/// Examines all cases, on all threads, more finely where what was found is not `enough`. `go_on` is
/// told the share that is done and may end it: then nothing comes back.
pub fn examine_all(
    all: &Case,
    loss_band_gw: f64,
    enough: &(dyn Fn(&Found) -> bool + Sync),
    go_on: &dyn Fn(f64) -> bool,
) -> Option<Summary> {
    let cases = cases(all, loss_band_gw);
    let resolutions: &[Resolution] = match all.assumed.profile {
        LossProfile::Constant => &CONSTANT,
        LossProfile::NonDecreasing | LossProfile::Band => &MOVING,
    };
    let best = |case: &Case| {
        let mut found = None;
        for resolution in resolutions {
            found = examine(case, *resolution).or(found);
            if found.as_ref().is_some_and(enough) {
                break;
            }
        }
        found
    };
    let mut found = Vec::with_capacity(cases.len());
    for together in cases.chunks(TOGETHER) {
        let part: Vec<(Case, Option<Found>)> = together
            .par_iter()
            .map(|case| (*case, best(case)))
            .collect();
        found.extend(part);
        if !go_on(found.len() as f64 / cases.len() as f64) {
            return None;
        }
    }
    Some(Summary { found })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::response::testing::{assumed, law, plant};

    #[test]
    fn cases_cover_every_band_and_points_stay_points() {
        let mut all = Case {
            plant: plant(),
            law: law(),
            assumed: assumed(),
            last: Interval::hull(0.0, 2.2),
        };
        all.assumed.loss = all.last;
        let found = cases(&all, LOSS_BAND_GW);
        assert_eq!(found.len(), 55);
        assert_eq!(found[0].plant, plant());
        for pair in found.windows(2) {
            assert_eq!(pair[0].last.high, pair[1].last.low);
        }
        all.plant.inertia = Interval::hull(2.0, 4.0);
        let found = cases(&all, LOSS_BAND_GW);
        let lowest = found
            .iter()
            .map(|c| c.plant.inertia.low)
            .fold(9.0, f64::min);
        let highest = found
            .iter()
            .map(|c| c.plant.inertia.high)
            .fold(0.0, f64::max);
        assert!(lowest <= 2.0 && highest >= 4.0);
    }
}
