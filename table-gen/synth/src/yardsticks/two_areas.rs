//! Load-frequency control of two areas with a tie line, five states and two inputs: what whoever
//! has more than one area asks of the engine.
//!
//! States: frequency deviations f1 and f2 \[Hz\], power on the tie line from area 1 to area 2
//! \[GW\], and the output of each area's governors and turbines \[GW\]. Area i has a fleet of
//! chargers of power P_i with participation u_i, and may lose an infeed w_i anywhere in a band:
//!
//! ```text
//! f_i' = (p_i + P_i u_i - w_i - D_i f_i ∓ p_tie) / 2H_i      p_tie' = S (f1 - f2)      p_i' = (K_i
//! f_i - p_i) / T_i
//! ```
//!
//! The game: reach and stay. Both frequencies are kept in a band for ever, and the band is reached
//! from wherever that is certain, never below containment. The widths of the grid are a parameter,
//! so that the example scales. No charger measures all five states: [`observer`] has what two
//! frequencies tell of them, and the game on that.

pub mod observer;

use crate::abstraction::affine::{
    AbstractionError, AffineAbstraction, AffineInput, Drift, Errors, Growth,
};
use crate::game::bitset::BitSet;
use model::flow::{Flow, Matrix, Vector, absolute_integral};
use model::grid_shape::GridShape;
use model::interval::Interval;

/// Number of states.
pub const STATES: usize = 5;
/// Period \[s\].
const PERIOD_S: f64 = 0.5;
/// An area.
struct Area {
    /// H \[GW s/Hz\].
    inertia: f64,
    /// D \[GW/Hz\].
    damping: f64,
    /// K \[GW/Hz\].
    governor_gain: f64,
    /// T \[s\].
    governor_time: f64,
    /// P \[GW\].
    fleet: f64,
    /// w \[GW\].
    loss: [f64; 2],
}

/// A large area that loses an infeed, and a small one beside it on a weak tie.
const AREAS: [Area; 2] = [
    Area {
        inertia: 3.0,
        damping: 0.8,
        governor_gain: -4.0,
        governor_time: 8.0,
        fleet: 1.5,
        loss: [0.95, 1.0],
    },
    Area {
        inertia: 1.5,
        damping: 0.4,
        governor_gain: -2.0,
        governor_time: 8.0,
        fleet: 0.8,
        loss: [0.0, 0.02],
    },
];
/// S \[GW/(Hz s)\].
const SYNCHRONISING: f64 = 0.4;
/// Participations of each area's fleet: 0, 1/4, ..., 1.
const LEVELS: usize = 5;

/// Range of each axis (f1, f2, tie, p1, p2), and cells on it for scale 1.
const LOWER: [f64; STATES] = [-0.5, -0.5, -0.5, -0.6, -0.35];
const UPPER: [f64; STATES] = [0.2, 0.2, 0.5, 1.5, 0.8];
const COUNT: [u32; STATES] = [28, 28, 20, 12, 8];

/// Band in which both frequencies stay \[Hz\].
pub const BAND: [f64; 2] = [-0.3, 0.1];
/// Frequencies never fall below this \[Hz\].
pub const CONTAINMENT: f64 = -0.45;

/// The grid, each axis cut into so many times as many cells.
pub fn shape(scales: [u32; STATES]) -> GridShape<STATES> {
    let count = std::array::from_fn(|d| COUNT[d] * scales[d]);
    GridShape {
        lower: LOWER,
        width: std::array::from_fn(|d| (UPPER[d] - LOWER[d]) / f64::from(count[d])),
        count,
    }
}

/// A, and the directions in which a net power acts in each area.
fn matrices() -> (Matrix<STATES>, [Vector<STATES>; 2]) {
    let p = Interval::point;
    let mut a = [[Interval::ZERO; STATES]; STATES];
    let mut b = [[Interval::ZERO; STATES]; 2];
    for (i, area) in AREAS.iter().enumerate() {
        let per_gw = Interval::ONE / (p(2.0) * p(area.inertia));
        let out_of = if i == 0 {
            -Interval::ONE
        } else {
            Interval::ONE
        };
        a[i][i] = -(p(area.damping) * per_gw);
        a[i][2] = out_of * per_gw;
        a[i][3 + i] = per_gw;
        a[2][i] = -(out_of * p(SYNCHRONISING));
        a[3 + i][i] = p(area.governor_gain) / p(area.governor_time);
        a[3 + i][3 + i] = -(Interval::ONE / p(area.governor_time));
        b[i][i] = per_gw;
    }
    (a, b)
}

/// Net power of an area \[GW\] at a level of participation.
fn net_power(area: &Area, level: usize) -> Interval {
    let u = Interval::point(level as f64) / Interval::point((LEVELS - 1) as f64);
    Interval::point(area.fleet) * u - Interval::hull(area.loss[0], area.loss[1])
}

/// Net powers of both areas \[GW\] under an input: `v + LEVELS u` is level v in area 1, u in 2.
fn net_powers(input: usize) -> [Interval; 2] {
    [
        net_power(&AREAS[0], input % LEVELS),
        net_power(&AREAS[1], input / LEVELS),
    ]
}

/// What each input adds to the state over a period, for the net powers that it may give, and so
/// much more on each axis.
fn drifts(powers: impl Fn(usize) -> [Interval; 2], more: [f64; STATES]) -> Vec<Drift<STATES>> {
    let (a, b) = matrices();
    // The engine's own drives have one direction; here each input adds the response to two.
    let gammas = b.map(|b| Flow::over(&a, &b, PERIOD_S).gamma);
    let absolute = b.map(|b| absolute_integral(&a, &b, PERIOD_S));
    let drift = |input| {
        let mut drift = Drift {
            centre: [Interval::ZERO; STATES],
            radius: more,
        };
        for d in 0..STATES {
            for (i, power) in powers(input).iter().enumerate() {
                drift.centre[d] = drift.centre[d] + gammas[i][d] * Interval::point(power.mid());
                let spread = (absolute[i][d] * power.radius()).next_up();
                drift.radius[d] = (drift.radius[d] + spread).next_up();
            }
        }
        drift
    };
    (0..LEVELS * LEVELS).map(drift).collect()
}

/// The abstraction on a grid for what each input adds.
fn abstraction_of(
    shape: &GridShape<STATES>,
    drifts: &[Drift<STATES>],
) -> Result<AffineAbstraction<STATES>, AbstractionError> {
    let (a, b) = matrices();
    let input = AffineInput {
        a,
        b: b[0],
        drive: Interval::ZERO,
    };
    let errors = Errors {
        before: [0.0; STATES],
        after: [0.0; STATES],
    };
    AffineAbstraction::with_drifts(
        *shape,
        &vec![input; drifts.len()],
        PERIOD_S,
        Growth::ExactLinear,
        errors,
        Some(drifts),
    )
}

/// The abstraction on a grid, with an input for each pair of levels.
///
/// # Errors
/// As [`AffineAbstraction::new`].
pub fn abstraction(
    shape: &GridShape<STATES>,
) -> Result<AffineAbstraction<STATES>, AbstractionError> {
    abstraction_of(shape, &drifts(net_powers, [0.0; STATES]))
}

/// Cells chosen by the intervals of both frequencies.
fn by_frequencies(shape: &GridShape<STATES>, choose: impl Fn((f64, f64)) -> bool) -> BitSet {
    let chosen: [Vec<bool>; 2] = std::array::from_fn(|d| {
        (0..shape.count[d])
            .map(|i| choose(shape.interval(d, i)))
            .collect()
    });
    let mut set = BitSet::new(shape.cells());
    for index in 0..shape.cells() {
        let cell = shape.cell(index);
        if chosen[0][cell[0] as usize] && chosen[1][cell[1] as usize] {
            set.insert(index);
        }
    }
    set
}

/// Covers the rounding of a cell's ends \[Hz\].
const ROUNDING_HZ: f64 = 1e-9;

/// Cells with both frequencies in the band. An end within a nanohertz of the band's counts as on
/// it: the claim is for a band wider by so much.
pub fn band(shape: &GridShape<STATES>) -> BitSet {
    band_within(shape, 0.0)
}

/// Cells with both frequencies in the band and not nearer to its ends than this \[Hz\].
fn band_within(shape: &GridShape<STATES>, margin_hz: f64) -> BitSet {
    let margin_hz = margin_hz - ROUNDING_HZ;
    by_frequencies(shape, |(low, high)| {
        low >= BAND[0] + margin_hz && high <= BAND[1] - margin_hz
    })
}

/// Cells of which any part lies below containment, less a nanohertz.
pub fn avoid(shape: &GridShape<STATES>) -> BitSet {
    avoid_below(shape, 0.0)
}

/// Cells of which any part is not so far above containment \[Hz\].
fn avoid_below(shape: &GridShape<STATES>, margin_hz: f64) -> BitSet {
    by_frequencies(shape, |(low, _)| {
        low >= CONTAINMENT + margin_hz - ROUNDING_HZ
    })
    .complement()
}
