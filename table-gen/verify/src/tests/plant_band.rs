//! A plant in bands: its real trajectories, as the device's observer sees them, against the sets of
//! the nominal plant.

use firmware::units::{AXIS_F, AXIS_G, AXIS_L, AXIS_P};
use model::interval::Interval;
use model::plant::{Plant, STATES};
use model::spec::Spec;

use super::Random;
use super::delay::{bare, extreme, load};
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
const GOVERNOR: &str = "uncertainty.governor_time_s=[2,3]";
const TURBINE: &str = "uncertainty.turbine_time_s=[0.3,0.7]";
const LEAD: &str = "uncertainty.lead_time_s=[1.4,2.6]";
const LAG: &str = "uncertainty.lag_time_s=[9.6,14.4]";

/// In an interval, at an end half of the time.
fn within(random: &mut Random, [low, high]: [f64; 2]) -> f64 {
    0.5 * (low + high) + 0.5 * extreme(random) * (high - low)
}

/// A plant and the observer's chain, which the same f drives.
struct Watched<'a> {
    real: &'a Plant,
    nominal: &'a Plant,
    /// The real state.
    x: [f64; STATES],
    /// What the observer has; its f is not used.
    q: [f64; STATES],
}

impl Watched<'_> {
    /// Under a net power, or with f held, by steps as in [`super::delay::fly`].
    fn fly(&mut self, power: f64, time_s: f64, step_s: f64, is_held: bool) {
        let steps = (time_s / step_s).ceil();
        let h = time_s / steps;
        let rates = |x: &[f64; STATES], q: &[f64; STATES]| {
            let mut dx = self.real.derivative(*x, power);
            if is_held {
                dx[AXIS_F] = 0.0;
            }
            let [_, g, l, p] = *q;
            (dx, self.nominal.derivative([x[AXIS_F], g, l, p], power))
        };
        let (mut x, mut q) = (self.x, self.q);
        for _ in 0..steps as u32 {
            type Rates = ([f64; STATES], [f64; STATES]);
            let at = |(dx, dq): &Rates, share: f64| {
                let moved = |x: &[f64; STATES], k: &[f64; STATES]| -> [f64; STATES] {
                    std::array::from_fn(|d| x[d] + share * h * k[d])
                };
                rates(&moved(&x, dx), &moved(&q, dq))
            };
            let k1 = rates(&x, &q);
            let k2 = at(&k1, 0.5);
            let k3 = at(&k2, 0.5);
            let k4 = at(&k3, 1.0);
            let sum = |k: fn(&Rates) -> &[f64; STATES], d: usize| {
                h / 6.0 * (k(&k1)[d] + 2.0 * k(&k2)[d] + 2.0 * k(&k3)[d] + k(&k4)[d])
            };
            x = std::array::from_fn(|d| x[d] + sum(|k| &k.0, d));
            q = std::array::from_fn(|d| q[d] + sum(|k| &k.1, d));
        }
        (self.x, self.q) = (x, q);
    }
}

/// Of trajectories over a period on plants within a spec's bands, how many leave the sets of
/// another spec's model. Plant, state and what the adversary does are drawn.
fn leaving(real: &Spec, believed: &Spec, seed: u64) -> u32 {
    let bytes = bare(believed);
    let table = TableView::parse(&bytes).unwrap();
    let model = Model::without_delay(&table, believed);
    let mut random = Random::new(seed);
    let known = Plant::new(real);
    let nominal = known.governor_gain;
    let own = [
        known.governor_time,
        known.turbine_time,
        known.lead_time,
        known.lag_time,
    ];
    let differs = real.time_constant_bands() != own.map(|time| [time; 2]);
    let [lowest, highest] = real.counted_frequency_hz().unwrap().map(|f| f * 1e6);
    let fleet = real.fleet_power_gw() * 1e6;
    let mut left = 0;
    for _ in 0..TRIALS {
        let mut inertia = within(&mut random, real.inertia_band());
        let governor_gain = within(&mut random, real.governor_gain_band());
        let mut damping = within(&mut random, real.damping_band());
        let share = nominal / governor_gain;
        let [governor_time, turbine_time, lead_time, lag_time] = real
            .time_constant_bands()
            .map(|band| within(&mut random, band));
        let plant = Plant {
            inertia,
            governor_gain,
            governor_time,
            turbine_time,
            lead_time,
            lag_time,
            damping,
            ..known
        };
        // What such f can have made of the chain.
        let mut q: [f64; STATES] =
            std::array::from_fn(|_| nominal * within(&mut random, [lowest, highest]));
        q[AXIS_F] = within(&mut random, [lowest, highest]);
        let real_of = |q: &[f64; STATES]| -> [f64; STATES] {
            std::array::from_fn(|d| if d == AXIS_F { q[d] } else { q[d] / share })
        };
        let mut x = real_of(&q);
        if differs {
            // An offset and a past, in which f goes where it likes.
            let initial = &real.uncertainty.initial;
            for d in [AXIS_G, AXIS_L, AXIS_P] {
                q[d] = 1e6 * within(&mut random, [initial.lower[d], initial.upper[d]]);
            }
            let mut past = Watched {
                real: &plant,
                nominal: &known,
                x: real_of(&q),
                q,
            };
            for _ in 0..(random.unit() * 8.0) as u32 {
                past.x[AXIS_F] = within(&mut random, [lowest, highest]);
                past.fly(0.0, 0.5 * 32f64.powf(random.unit()), 0.01, true);
            }
            (x, q) = (past.x, past.q);
            q[AXIS_F] = x[AXIS_F];
        }
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
                damping,
                ..plant
            };
            let [least, most] = real.uncertainty.loss_gw.map(|gw| gw * 1e6);
            let lost = 0.5 * (least + most) + 0.5 * (most - least) * loss;
            let given = (fleet * u * (1.0 + real.uncertainty.participation * error)).min(fleet);
            let mut flight = Watched {
                real: &plant,
                nominal: &known,
                x,
                q,
            };
            flight.fly(given - lost, part_s, 0.002, false);
            (x, q) = (flight.x, flight.q);
            // Past the range nothing is claimed.
            counted &= lowest <= x[AXIS_F] && x[AXIS_F] <= highest;
            if !counted {
                break;
            }
            inside &= f.low - ROUNDING <= x[AXIS_F] && x[AXIS_F] <= f.high + ROUNDING;
        }
        if counted {
            q[AXIS_F] = x[AXIS_F];
            let end = q;
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
    let bands: [&[&str]; 11] = [
        &[H],
        &[LOST],
        &[K],
        &[D],
        &[H, K, D],
        &[H, LOST, K, D],
        // A lead that is longer than the governor's own time: the chain overshoots.
        &[H, K, D, "plant.lead_time_s=9"],
        &[GOVERNOR],
        &[TURBINE, LEAD],
        &[LAG],
        &[H, K, D, GOVERNOR, TURBINE, LEAD, LAG],
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
    for forgotten in [
        &[H][..],
        &[LOST],
        &[K],
        &[D],
        &[H, K, D],
        &[GOVERNOR],
        &[TURBINE],
        &[LEAD],
        &[LAG],
    ] {
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
        with(&|spec| spec.uncertainty.governor_time_s = Some([3.0, 3.0])),
        with(&|spec| spec.uncertainty.turbine_time_s = Some([0.3, 0.3])),
        with(&|spec| spec.uncertainty.lead_time_s = Some([1.4, 1.4])),
        with(&|spec| spec.uncertainty.lag_time_s = Some([9.6, 9.6])),
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

/// The same range of f, K_0 f within 2.15 GW of its middle; integrals of |k| of an outside program
/// for 5 % less, which is the worst of the band.
#[test]
fn what_time_constants_add_by_an_outside_program() {
    for (key, integral) in [
        ("uncertainty.governor_time_s=[2.375,2.625]", 0.013_259_26),
        ("uncertainty.turbine_time_s=[0.475,0.525]", 0.003_174_126),
        ("uncertainty.lead_time_s=[1.9,2.1]", 0.010_975_45),
        ("uncertainty.lag_time_s=[11.4,12.6]", 0.037_275_14),
    ] {
        let spec = load(
            "paper-bi",
            &[
                "requirements.containment_hz=-0.5",
                "grid.upper=[0.3, 3.6, 2.2, 2.2]",
                "uncertainty.loss_gw=[2.0, 2.0]",
                "uncertainty.participation=0",
                key,
            ],
        );
        let bytes = bare(&spec);
        let table = TableView::parse(&bytes).unwrap();
        let found = Model::without_delay(&table, &spec).drives[0].range();
        let more = 2.15e6 * integral;
        for added in [-2e6 - found.low, found.high + 2e6] {
            assert!(
                added > 0.9999 * more && added < 1.001 * more,
                "{key} {added} {more}"
            );
        }
    }
}
