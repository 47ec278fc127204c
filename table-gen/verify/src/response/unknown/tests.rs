//! Real plants against what unknown time constants may add.

use super::*;
use crate::response::testing::{assumed, law, plant};
use crate::response::time_bands::{TimeBands, is_point};
use model::governor::Governor;
use model::plant::Plant;
use model::stepper::Stepper;
use proptest::prelude::*;

const STEP_S: f64 = 0.05;

/// Bands from shares of the test's plant.
fn bands(shares: [[f64; 2]; 4]) -> TimeBands {
    let known = plant().known;
    let band = |time: f64, [low, high]: [f64; 2]| Interval::hull(time * low, time * high);
    TimeBands {
        governor: band(known.governor_time, shares[0]),
        turbine: band(known.turbine_time, shares[1]),
        lead: band(known.lead_time, shares[2]),
        lag: band(known.lag_time, shares[3]),
    }
}

fn number(times: TimeBands, gain_radius: f64, governor: Governor) -> FleetLoop {
    let mut band = plant();
    band.times = times;
    band.governor = governor;
    band.governor_gain = Interval::hull(-5.0 - gain_radius, -5.0 + gain_radius);
    FleetLoop::new(&band, law(), assumed(), STEP_S)
}

fn sample(number: &FleetLoop, x: &[f64; STATES]) -> Differences {
    let [f, g, l, p] = *x;
    Differences {
        f: Interval::point(f),
        gap: Interval::point(number.gain_mid * f - g),
        lag: Interval::point(g - l),
        turbine: Interval::point(l - p),
    }
}

/// What the chain of a real plant does beyond that of the middle with the same input.
fn beyond(times: TimeBands, real: &Plant, governor: &Governor, x: &[f64; STATES]) -> [f64; 3] {
    let middle = times.middle(plant().known);
    let [f, g, l, p] = *x;
    let rate = governor.rate(real, f, g);
    let gap = real.governor_time * rate;
    let of = |plant: &Plant| {
        [
            gap / plant.governor_time,
            (g + plant.lead_time / plant.governor_time * gap - l) / plant.lag_time,
            (l - p) / plant.turbine_time,
        ]
    };
    let (real, middle) = (of(real), of(&middle));
    std::array::from_fn(|axis| real[axis] - middle[axis])
}

fn share() -> impl Strategy<Value = [f64; 2]> {
    (0.7f64..1.0, 1.0f64..1.4).prop_map(|(low, high)| [low, high])
}

proptest! {
    /// A real plant from the bands, at a real state and all the way through a step, does no
    /// more beyond the middle than the bounds say.
    #[test]
    fn a_real_plant_stays_inside(
        shares in proptest::array::uniform4(share()),
        at in proptest::array::uniform4(prop_oneof![Just(0.0f64), Just(1.0), 0.0f64..1.0]),
        gain_radius in 0.0f64..1.0,
        gain_at in -1.0f64..=1.0,
        x in (-0.8f64..0.3, -1.0f64..4.0, -1.0f64..3.0, -1.0f64..3.0),
        net in -2.5f64..1.5,
        deadband_hz in prop_oneof![Just(0.0), 0.0f64..0.1],
        rate in prop_oneof![Just(f64::INFINITY), 0.01f64..0.5],
    ) {
        let governor = Governor { deadband_hz, rate_gw_per_s: rate, ..Governor::LINEAR };
        let times = bands(shares);
        let number = number(times, gain_radius, governor);
        let within = |band: Interval, at: f64| band.low + (band.high - band.low) * at;
        let real = Plant {
            governor_gain: -5.0 + gain_radius * gain_at,
            governor_time: within(times.governor, at[0]),
            turbine_time: within(times.turbine, at[1]),
            lead_time: within(times.lead, at[2]),
            lag_time: within(times.lag, at[3]),
            ..plant().known
        };
        let start = [x.0, x.1, x.2, x.3];
        let pieces = 10;
        let step = Stepper::new(&real, governor, STEP_S / f64::from(pieces));
        let mut course = vec![start];
        for _ in 0..pieces {
            let x = *course.last().unwrap_or(&start);
            course.push(step.step(&x, net));
        }
        let f_rate = course
            .iter()
            .map(|x| governor.derivative(&real, x, net)[0].abs())
            .fold(0.0, f64::max);
        // Between the pieces f' moves by far less than a tenth of itself and 1e-2.
        let f_move = STEP_S * (1.1 * f_rate + 1e-2);
        let bounds = added(&number, &sample(&number, &start), f_move).unwrap_or([f64::NAN; 3]);
        for x in &course {
            let found = beyond(times, &real, &governor, x);
            for (found, bound) in found.into_iter().zip(bounds) {
                // A few roundings of numbers below 100.
                prop_assert!(found.abs() <= bound + 1e-12, "{found} {bound} {times:?}");
            }
        }
    }
}

/// Each bound is reached: with a thousandth less than any of the four radii a plant at an end
/// of its band would be outside.
#[test]
fn no_radius_is_wider_than_a_plant_at_an_end_needs() {
    let x = [-0.4, 0.3, 1.1, 0.2];
    let wide = [0.8, 1.3];
    let same = [1.0, 1.0];
    for axis in 0..4 {
        let mut shares = [same; 4];
        shares[axis] = wide;
        let times = bands(shares);
        let number = number(times, 0.0, Governor::LINEAR);
        let bounds = added(&number, &sample(&number, &x), 0.0).unwrap_or([f64::NAN; 3]);
        let reached = wide.map(|share| {
            let mut real = plant().known;
            let time = [
                &mut real.governor_time,
                &mut real.turbine_time,
                &mut real.lead_time,
                &mut real.lag_time,
            ];
            *time.into_iter().nth(axis).map_or(&mut 0.0, |time| time) *= share;
            beyond(times, &real, &Governor::LINEAR, &x)
        });
        // What each time constant acts on: g' and l', p', l', l'.
        let acts_on = [0, 2, 1, 1][axis];
        let most = reached.map(|of| of[acts_on].abs());
        let most = most[0].max(most[1]);
        // The step's own movement is in the bound of l' and p'; without it the radius is met.
        let still = match axis {
            0 => bounds[0],
            1 => number.unknown_times.map_or(0.0, |u| u.turbine) * (x[2] - x[3]).abs(),
            2 => number.unknown_times.map_or(0.0, |u| u.lead) * (-5.0 * x[0] - x[1]).abs(),
            _ => {
                let (lag, lead) = number.unknown_times.map_or((0.0, 0.0), |u| (u.lag, u.lead));
                lag * (x[1] - x[2]).abs() + lead * (-5.0 * x[0] - x[1]).abs()
            }
        };
        assert!(bounds[acts_on] >= most, "{axis}");
        // T_2 stands in both terms of l', which its bound takes apart.
        let tight = if axis == 3 { 0.2 } else { 0.999 };
        assert!(most >= tight * still, "{axis}: {most} {still}");
    }
}

#[test]
fn known_times_add_nothing_and_cuts_cover_the_bands() {
    let known = TimeBands::known(&plant().known);
    assert_eq!(number(known, 0.0, Governor::LINEAR).unknown_times, None);
    assert_eq!(known.middle(plant().known), plant().known);
    let times = bands([[0.9, 1.1], [1.0, 1.0], [1.0, 1.0], [0.8, 1.2]]);
    let halves = |band: Interval| {
        let mid = band.mid();
        if is_point(band) {
            vec![band]
        } else {
            vec![
                Interval::hull(band.low, mid),
                Interval::hull(mid, band.high),
            ]
        }
    };
    let cut = times.cut(halves);
    assert_eq!(cut.len(), 4);
    let joined = cut.iter().map(|t| t.governor).reduce(Interval::join);
    assert_eq!(joined, Some(times.governor));
    let joined = cut.iter().map(|t| t.lag).reduce(Interval::join);
    assert_eq!(joined, Some(times.lag));
}
