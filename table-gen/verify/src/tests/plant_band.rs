//! A plant in bands: its real trajectories, as the device's observer sees them, against the sets of
//! the nominal plant.

use firmware::units::AXIS_F;
use model::interval::Interval;
use model::plant::{Plant, STATES};
use model::spec::Spec;

use super::Random;
use super::delay::{bare, extreme, fly, load};
use crate::closed_loop::Model;
use crate::zonotope::Zonotope;
use firmware::table::TableView;

/// Trajectories of each spec.
const TRIALS: u32 = 2000;
/// Parts of a period between two looks at f.
const PARTS: u32 = 50;

const H: &str = "uncertainty.inertia_gw_s_per_hz=[3.4,4.9]";
const LOST: &str = "uncertainty.inertia_lost_s_per_hz=0.2";
const K: &str = "uncertainty.governor_gain_gw_per_hz=[-5.6,-4.5]";
const D: &str = "uncertainty.damping_gw_per_hz=[0.6,1.5]";

/// In an interval, at an end half of the time.
fn within(random: &mut Random, [low, high]: [f64; 2]) -> f64 {
    0.5 * (low + high) + 0.5 * extreme(random) * (high - low)
}

/// Of trajectories over a period on plants within a spec's bands, how many leave the sets of
/// another spec's model. Plant, state and what the adversary does are drawn.
fn leaving(real: &Spec, believed: &Spec, seed: u64) -> u32 {
    let bytes = bare(believed);
    let table = TableView::parse(&bytes).unwrap();
    let model = Model::without_delay(&table, believed);
    let mut random = Random::new(seed);
    let nominal = real.plant.governor_gain_gw_per_hz;
    let [lowest, highest] = real.counted_frequency_hz().unwrap().map(|f| f * 1e6);
    let fleet = real.fleet_power_gw() * 1e6;
    let mut left = 0;
    for _ in 0..TRIALS {
        let mut inertia = within(&mut random, real.inertia_band());
        let governor_gain = within(&mut random, real.governor_gain_band());
        let mut damping = within(&mut random, real.damping_band());
        let share = nominal / governor_gain;
        let observed = |x: &[f64; STATES]| -> [f64; STATES] {
            std::array::from_fn(|d| if d == AXIS_F { x[d] } else { x[d] * share })
        };
        // What such f can have made of the chain.
        let mut q: [f64; STATES] =
            std::array::from_fn(|_| nominal * within(&mut random, [lowest, highest]));
        q[AXIS_F] = within(&mut random, [lowest, highest]);
        let mut x: [f64; STATES] =
            std::array::from_fn(|d| if d == AXIS_F { q[d] } else { q[d] / share });
        let level = (random.unit() * model.drives.len() as f64) as usize;
        let Some(drive) = model.drives.get(level).copied() else {
            continue;
        };
        let start = q.map(Interval::point);
        let (f, after) = (
            model.period.frequency(&start, drive),
            Zonotope::of_box(&start).after(&model.period, drive),
        );
        let u = real.input.value(level);
        let (mut error, mut loss) = (extreme(&mut random), extreme(&mut random));
        let pace = 0.2 * random.unit();
        let part_s = real.sampling.period_s / f64::from(PARTS);
        // Rounding of the integration, in micro-units.
        const ROUNDING: f64 = 1e-2;
        let mut inside = true;
        let mut counted = true;
        for _ in 0..PARTS {
            if random.unit() < pace {
                (error, loss) = (extreme(&mut random), extreme(&mut random));
                // H and D may move.
                inertia = within(&mut random, real.inertia_band());
                damping = within(&mut random, real.damping_band());
            }
            let plant = Plant {
                inertia,
                governor_gain,
                damping,
                ..Plant::new(real)
            };
            let [least, most] = real.uncertainty.loss_gw.map(|gw| gw * 1e6);
            let lost = 0.5 * (least + most) + 0.5 * (most - least) * loss;
            let given = (fleet * u * (1.0 + real.uncertainty.participation * error)).min(fleet);
            x = fly(&plant, x, given - lost, part_s);
            // Past the range nothing is claimed.
            counted &= lowest <= x[AXIS_F] && x[AXIS_F] <= highest;
            if !counted {
                break;
            }
            inside &= f.low - ROUNDING <= x[AXIS_F] && x[AXIS_F] <= f.high + ROUNDING;
        }
        if counted {
            let end = observed(&x);
            inside &= (0..STATES).all(|d| {
                let bounds = after.bounds(d);
                bounds.low - ROUNDING <= end[d] && end[d] <= bounds.high + ROUNDING
            });
        }
        left += u32::from(!inside);
    }
    left
}

#[test]
fn plants_within_the_bands_stay_in_the_sets() {
    let bands: [&[&str]; 7] = [
        &[H],
        &[LOST],
        &[K],
        &[D],
        &[H, K, D],
        &[H, LOST, K, D],
        // A lead that is longer than the governor's own time: the chain overshoots.
        &[H, K, D, "plant.lead_time_s=9"],
    ];
    for (seed, set) in bands.into_iter().enumerate() {
        let spec = load("gb-bi-band", set);
        assert_eq!(leaving(&spec, &spec, seed as u64), 0, "{set:?}");
    }
}

/// The sets of the nominal plant do not hold them, whichever band is forgotten.
#[test]
fn plants_within_a_band_that_is_forgotten_leave_the_sets() {
    let nominal = load("gb-bi-band", &[]);
    for forgotten in [&[H][..], &[LOST], &[K], &[D], &[H, K, D]] {
        let real = load("gb-bi-band", forgotten);
        assert!(leaving(&real, &nominal, 7) > 0, "{forgotten:?}");
    }
}

/// A band of one number that is not the plant's own; no spec file has one, and the sets count it
/// all the same.
#[test]
fn a_band_of_one_other_number_is_counted() {
    let nominal = load("gb-bi-band", &[]);
    let with = |change: &dyn Fn(&mut Spec)| {
        let mut spec = nominal.clone();
        change(&mut spec);
        spec
    };
    for real in [
        with(&|spec| spec.uncertainty.inertia_gw_s_per_hz = Some([3.4, 3.4])),
        with(&|spec| spec.uncertainty.governor_gain_gw_per_hz = Some([-5.6, -5.6])),
        with(&|spec| spec.uncertainty.damping_gw_per_hz = Some([0.6, 0.6])),
    ] {
        assert_eq!(leaving(&real, &real, 11), 0);
        assert!(leaving(&real, &nominal, 11) > 0);
    }
}

/// H of 4 and 2, D of 1 and 3, K of -5 and -10 by hand: containment of -0.5 Hz and a grid to 0.3 Hz
/// count f from -0.51 to 0.35 Hz, so q_p lies between -1.75 and 2.55 GW.
#[test]
fn what_is_added_by_hand() {
    let base = [
        "requirements.containment_hz=-0.5",
        "grid.upper=[0.3, 3.6, 2.2, 2.2]",
        "uncertainty.loss_gw=[2.0, 2.0]",
        "uncertainty.participation=0",
        "sampling.period_s=1",
    ];
    let drive = |key: &str| {
        let set: Vec<&str> = base.iter().copied().chain([key]).collect();
        let spec = load("paper-bi", &set);
        let bytes = bare(&spec);
        let table = TableView::parse(&bytes).unwrap();
        Model::without_delay(&table, &spec).drives[0].range()
    };
    let cases = [
        // -2 + (D - D0) (0.51 or -0.35).
        (
            "uncertainty.damping_gw_per_hz=[1,3]",
            -2.0 - 0.7,
            -2.0 + 1.02,
        ),
        // -2 + (K/K0 - 1) (-1.75 to 2.55).
        (
            "uncertainty.governor_gain_gw_per_hz=[-10,-5]",
            -2.0 - 1.75,
            -2.0 + 2.55,
        ),
        // N is from -1.75 - 2 - 0.35 to 2.55 - 2 + 0.51, and as much may come on top.
        (
            "uncertainty.inertia_gw_s_per_hz=[2,4]",
            -2.0 - 4.1,
            -2.0 + 1.06,
        ),
    ];
    for (key, low, high) in cases {
        let found = drive(key);
        assert!(
            found.low <= low * 1e6 && found.high >= high * 1e6,
            "{key} {found:?}"
        );
        assert!(
            found.low > low * 1e6 - 1.0 && found.high < high * 1e6 + 1.0,
            "{key} {found:?}"
        );
    }
}
