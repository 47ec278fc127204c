//! Chains with constants of their own against the bound of their distance.

use super::*;

/// What the governors are asked for \[kW\].
const ASKED: Interval = Interval {
    low: -0.8e6,
    high: 3.6e6,
};
const NONE: [Interval; STATES] = [Interval::ZERO; STATES];
const KEYS: [&str; 4] = ["governor", "turbine", "lead", "lag"];
const OWN: [f64; 4] = [2.5, 0.5, 2.0, 12.0];
/// Length of a step of the reference \[s\]; the fastest lag is longer a hundred times.
const STEP_S: f64 = 0.0025;
/// Past this the slowest lag has decayed to a millionth.
const STEPS: usize = 100_000;

/// `gb-bi-band`, each constant within these shares of its own.
fn spec(shares: [[f64; 2]; 4]) -> Spec {
    let set: Vec<String> = (0..4)
        .map(|i| {
            let [low, high] = shares[i].map(|share| share * OWN[i]);
            format!("uncertainty.{}_time_s=[{low},{high}]", KEYS[i])
        })
        .collect();
    Spec::load("gb-bi-band", &set).unwrap()
}

/// p of a chain of constants T_G, T_t, T_1, T_2 at every step, from a state on, with nothing asked.
fn free([governor, turbine, lead, lag]: [f64; 4], mut x: [f64; 3]) -> Vec<f64> {
    let rates = |[g, l, p]: [f64; 3]| {
        let dg = -g / governor;
        [dg, (g + lead * dg - l) / lag, (l - p) / turbine]
    };
    let mut out = vec![x[2]];
    for _ in 0..STEPS {
        let at = |k: &[f64; 3], share: f64| std::array::from_fn(|d| x[d] + share * STEP_S * k[d]);
        let k1 = rates(x);
        let k2 = rates(at(&k1, 0.5));
        let k3 = rates(at(&k2, 0.5));
        let k4 = rates(at(&k3, 1.0));
        let sum = |d: usize| k1[d] + 2.0 * k2[d] + 2.0 * k3[d] + k4[d];
        x = std::array::from_fn(|d| x[d] + STEP_S / 6.0 * sum(d));
        out.push(x[2]);
    }
    out
}

/// An impulse of what is asked.
fn kernel(times: [f64; 4]) -> Vec<f64> {
    let [governor, _, lead, lag] = times;
    free(times, [1.0 / governor, lead / (governor * lag), 0.0])
}

/// The most by which a chain of other constants comes off, if f is turned at the worst moments from
/// one end of its range to the other for 250 s.
fn worst(times: [f64; 4]) -> f64 {
    let differences = kernel(times).into_iter().zip(kernel(OWN));
    let sum: f64 = differences.map(|(real, own)| (real - own).abs()).sum();
    0.5 * (ASKED.high - ASKED.low) * STEP_S * sum
}

/// In \[-1, 1\], an end half of the time, by a fixed sequence.
fn draws() -> impl FnMut() -> f64 {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let unit = (state >> 11) as f64 / (1u64 << 53) as f64;
        (4.0 * unit - 2.0).clamp(-1.0, 1.0)
    }
}

fn drawn(draw: &mut impl FnMut() -> f64, shares: [[f64; 2]; 4]) -> [f64; 4] {
    std::array::from_fn(|i| {
        let [low, high] = shares[i];
        OWN[i] * (0.5 * (low + high) + 0.5 * (high - low) * draw())
    })
}

/// Two lags of T give t/T² exp(-t/T), which rises to 1/(e T) and falls; three of them rise to
/// 2/(e² T). A lead that is as long as a lag takes it away. Behind a single lag, a lead of half the
/// other lag is a jump to 1/2 at once.
#[test]
fn variations_by_hand() {
    let e = 1f64.exp();
    let point = Interval::point;
    for time in [0.5, 3.0] {
        let plain = lag(point(time));
        let cancelled = Stage {
            lead: point(time),
            lag: point(time),
        };
        for (found, known) in [
            (variation(&[plain; 2]), 2.0 / (e * time)),
            (variation(&[plain; 3]), 4.0 / (e * e * time)),
            (variation(&[plain, plain, cancelled]), 2.0 / (e * time)),
            (variation(&[plain, cancelled, plain]), 2.0 / (e * time)),
            // From 0 up to 1/T, and down.
            (variation(&[plain, cancelled]), 2.0 / time),
        ] {
            assert!(
                found >= known * (1.0 - 1e-12) && found < known * 1.001,
                "{found} {known}"
            );
        }
    }
}

/// A part of the bound for the input, which is reached with one band alone at its least constant.
#[test]
fn the_worst_input_comes_up_to_the_bound_and_not_over_it() {
    for share in [0.02, 0.1, 0.3] {
        for i in 0..4 {
            let mut shares = [[1.0; 2]; 4];
            shares[i] = [1.0 - share, 1.0 + share];
            let bound = apart(&spec(shares), ASKED, &NONE);
            assert_eq!(bound.low, -bound.high);
            let mut times = OWN;
            times[i] *= 1.0 - share;
            let reached = worst(times);
            assert!(
                reached <= bound.high && reached > 0.999 * bound.high,
                "{i} {share} {reached} {bound:?}"
            );
            times[i] = OWN[i] * (1.0 + share);
            assert!(worst(times) <= bound.high);
        }
    }
}

/// Constants drawn, and the corner that an outside program found the worst: 0.906 of the bound.
/// Bands of half the width do not hold it.
#[test]
fn constants_from_all_bands_stay_within_the_bound() {
    let mut draw = draws();
    let mut nearest = 0.0f64;
    for shares in [
        [[0.9, 1.1]; 4],
        [[0.98, 1.3], [0.5, 1.0], [0.0, 2.0], [0.9, 1.02]],
        [[0.95, 1.0], [1.0, 1.4], [1.0, 4.5], [1.0, 1.2]],
    ] {
        let bound = apart(&spec(shares), ASKED, &NONE).high;
        let mut corner = OWN;
        for (i, time) in corner.iter_mut().enumerate() {
            *time *= shares[i][usize::from(i == 2)];
        }
        let half = shares.map(|ends| ends.map(|share| 0.5 + 0.5 * share));
        assert!(worst(corner) > apart(&spec(half), ASKED, &NONE).high);
        let drawn = (0..60).map(|_| drawn(&mut draw, shares));
        for times in std::iter::once(corner).chain(drawn) {
            let reached = worst(times);
            assert!(reached <= bound, "{shares:?} {times:?} {reached} {bound}");
            nearest = nearest.max(reached / bound);
        }
    }
    assert!(nearest > 0.9, "{nearest}");
}

/// Offsets at the event, both chains alike.
#[test]
fn offsets_die_out_within_the_bound() {
    let mut draw = draws();
    let box_of = [0.0, 0.1e6, 0.06e6, 0.06e6].map(|most| Interval::hull(-most, most));
    let mut nearest = 0.0f64;
    for shares in [
        [[0.9, 1.1]; 4],
        [[0.8, 1.0], [1.0; 2], [1.0, 2.0], [1.0, 1.3]],
    ] {
        let bound = apart(&spec(shares), Interval::ZERO, &box_of).high;
        for _ in 0..100 {
            let times = drawn(&mut draw, shares);
            let x: [f64; 3] = std::array::from_fn(|d| box_of[d + 1].high * draw());
            let pairs = free(times, x).into_iter().zip(free(OWN, x));
            let reached = pairs.fold(0.0f64, |most, (real, own)| most.max((real - own).abs()));
            assert!(reached <= bound, "{shares:?} {x:?} {reached} {bound}");
            nearest = nearest.max(reached / bound);
        }
    }
    // Its three parts are largest at three times, so they are never all there at once.
    assert!(nearest > 0.3, "{nearest}");
}

/// Without a band, and with one that is the spec's own number, nothing is added.
#[test]
fn nothing_is_apart_without_a_band() {
    for shares in [None, Some([[1.0; 2]; 4])] {
        let spec = shares.map_or_else(|| Spec::load("gb-bi-band", &[]).unwrap(), spec);
        assert_eq!(apart(&spec, ASKED, &[ASKED; STATES]), Interval::ZERO);
    }
}
