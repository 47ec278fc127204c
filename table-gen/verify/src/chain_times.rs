//! Time constants in bands, for laws by games: how far what the governors give is from what the
//! device's observer computes.
//!
//! f drives two chains of the same gain: the real one with its own T_G, T_t, T_1, T_2, which stay
//! what they are, and the observer's with the spec's. Write a for K₀ f, s for differentiation, G
//! for `1/(1 + T_G s)`, E for `1/(1 + T_2 s)`, L for `(1 + T_1 s) E`, T for `1/(1 + T_t s)`, and ʳ
//! for what is real. The chains give `GʳLʳTʳ a` and `GLT a`, and their difference is, exactly,
//!
//! ```text
//! (Gʳ - G) L T a + Gʳ L (Tʳ - T) a + Gʳ Tʳ (Lʳ - L) a
//!   = - (T_Gʳ - T_G) s G Gʳ L T a  - (T_tʳ - T_t) s Gʳ L T Tʳ a
//!     + (T_1ʳ - T_1) s Gʳ Tʳ Eʳ a  - (T_2ʳ - T_2) s Gʳ Tʳ Eʳ L a
//! ```
//!
//! Each of the four is a difference of constants times a kernel k with an integral of 0 (it has a
//! factor s), folded with a. If a has always been within r of some number c, `k * a = k * (a - c)`
//! is at most r times the integral of |k|.
//!
//! **The worst real constants.** For `S >= R > 0`
//!
//! ```text
//! 1/(1 + S s) = 1/(1 + R s) · (R/S + (1 - R/S)/(1 + S s))
//! ```
//!
//! and the bracket is a delay that is drawn: nothing with a chance of R/S, else as long as an
//! exponential. It makes no integral of |k| larger. So the least constant of each band stands for
//! every real one, and with one band alone the bound is reached.
//!
//! **The integral of |k|.** k is the derivative of the impulse response h of a cascade of lags, so
//! this is the variation of h. It is summed in cells: where h' keeps its sign in a cell, the
//! difference of h, elsewhere the cell's length times the largest |h'|, which lies in `h' + [0,
//! length] h''`. What is left after the last cell is bounded stage by stage: of a stage `T x' + x =
//! y + T_1 y'` with `α = T_1/T` the part `w = x - α y` obeys `T w' + w = (1 - α) y`, so
//!
//! ```text
//! ∫|x'| <= (|α| + |1 - α|) ∫|y'| + T |w'| at the beginning
//! ```
//!
//! **Before the event.** What is asked of the states: at the event each chain is where the past of
//! f, within the same range and from rest, has brought it, and both are off by the same (g, l, p)
//! of the spec's `initial`, as gain K₀ would have it. So a past without an offset is counted, and
//! so is an observer that knows the chain's state at the event. From an offset z the chains give
//!
//! ```text
//! z_p e_t + z_l h_t * e_2 + (1 - T_1/T_G) z_g h_t * h_2 * e_G,   e = exp(-time/T), h = e/T
//! ```
//!
//! Since `T ∂e/∂T = (time/T) e <= 1/e¹`, two e differ by at most d, `d = |ln(Tʳ/T)|/e¹`, and what
//! is folded with two h and lies in 0 to 1 likewise. `h_2 * e_G` is at most `T_G/T_2`, and at most
//! 1.

use firmware::units::{AXIS_G, AXIS_L, AXIS_P};
use model::flow::{Flow, Matrix, Vector, apply, tube};
use model::interval::Interval;
use model::plant::STATES;
use model::spec::Spec;

/// Cells in the least time constant of a cascade.
const CELLS_PER_TIME: f64 = 128.0;
/// Most cells: 2,048 of the least time constant.
const CELLS_MOST: u32 = 1 << 18;
/// Share of the variation that may be left after the last cell.
const REST: f64 = 1e-6;
/// 1/e¹, rounded up.
const PEAK: f64 = 0.367_879_441_171_442_4;

/// A time constant \[s\].
#[derive(Clone, Copy)]
struct Time {
    /// The spec's own.
    own: Interval,
    /// Where the real one is.
    band: Interval,
}

impl Time {
    /// The least real one.
    fn least(self) -> Interval {
        Interval::point(self.band.low)
    }

    /// Bound of the distance of the real one from the own.
    fn off(self) -> Interval {
        let off = if self.band == self.own {
            0.0
        } else {
            (self.band - self.own).magnitude()
        };
        Interval::point(off)
    }

    /// d: bound of the distance of two exponentials.
    fn apart(self) -> Interval {
        if self.band == self.own {
            return Interval::ZERO;
        }
        // ln(1 + x) is at most x.
        let longer = self.band / self.own - Interval::ONE;
        let shorter = self.own / self.band - Interval::ONE;
        Interval::point(longer.high.max(shorter.high)) * Interval::point(PEAK)
    }
}

/// T x' + x = y + `lead` y', with T = `lag`; y is the stage before, and an impulse for the first.
#[derive(Clone, Copy)]
struct Stage {
    lead: Interval,
    lag: Interval,
}

const fn lag(time: Interval) -> Stage {
    Stage {
        lead: Interval::ZERO,
        lag: time,
    }
}

/// The range of `p - q_p` \[kW\], for K₀ f always in a range that holds 0 and offsets of (g, l, p)
/// at the event within a box \[kW\].
pub(crate) fn apart(spec: &Spec, asked: Interval, offset: &[Interval; STATES]) -> Interval {
    let plant = &spec.plant;
    let own = [
        plant.governor_time_s,
        plant.turbine_time_s,
        plant.lead_time_s,
        plant.lag_time_s,
    ];
    let bands = spec.time_constant_bands();
    let [governor, turbine, lead, late]: [Time; 4] = std::array::from_fn(|i| Time {
        own: Interval::point(own[i]),
        band: Interval::hull(bands[i][0], bands[i][1]),
    });
    let lead_lag = Stage {
        lead: lead.own,
        lag: late.own,
    };
    let least = [governor, turbine, late].map(|time| lag(time.least()));
    let [least_governor, least_turbine, least_late] = least;
    let of = |time: Time, variation: &dyn Fn() -> f64| {
        let off = time.off();
        if off == Interval::ZERO {
            Interval::ZERO
        } else {
            off * Interval::point(variation())
        }
    };
    let share = of(governor, &|| {
        let stages = [
            lag(governor.own),
            least_governor,
            lead_lag,
            lag(turbine.own),
        ];
        variation(&stages)
    }) + of(turbine, &|| {
        let stages = [least_governor, lead_lag, lag(turbine.own), least_turbine];
        variation(&stages)
    }) + of(lead, &|| {
        variation(&[least_governor, least_turbine, least_late])
    }) + of(late, &|| {
        variation(&[least_governor, least_turbine, least_late, lead_lag])
    });
    let most = Interval::point(asked.radius()) * share;
    (most + of_offset([governor, turbine, lead, late], offset)).symmetric()
}

/// What an offset at the event makes of the difference, at most.
fn of_offset([governor, turbine, lead, late]: [Time; 4], offset: &[Interval; STATES]) -> Interval {
    let most = |axis: usize| Interval::point(offset[axis].magnitude());
    let own = lead.own / governor.own;
    let moved = if lead.off() == Interval::ZERO && governor.off() == Interval::ZERO {
        Interval::ZERO
    } else {
        Interval::point((lead.band / governor.band - own).magnitude())
    };
    let fed = Interval::point((governor.band / late.band).high.min(1.0));
    let [of_governor, of_turbine, of_late] = [governor, turbine, late].map(Time::apart);
    let of_both = of_late + of_turbine;
    most(AXIS_P) * of_turbine
        + most(AXIS_L) * of_both
        + most(AXIS_G) * (moved * fed + (Interval::ONE - own).abs() * (of_governor + of_both))
}

/// A of the cascade, and its state after the impulse.
fn cascade<const N: usize>(stages: &[Stage; N]) -> (Matrix<N>, Vector<N>) {
    let mut a = [[Interval::ZERO; N]; N];
    let mut x = [Interval::ZERO; N];
    for (i, stage) in stages.iter().enumerate() {
        let mut row = [Interval::ZERO; N];
        if i == 0 {
            x[0] = Interval::ONE / stage.lag;
        } else {
            row = a[i - 1].map(|entry| stage.lead * entry);
            row[i - 1] = row[i - 1] + Interval::ONE;
            x[i] = stage.lead / stage.lag * x[i - 1];
        }
        row[i] = row[i] - Interval::ONE;
        a[i] = row.map(|entry| entry / stage.lag);
    }
    (a, x)
}

fn dot<const N: usize>(row: &[Interval; N], x: &[Interval; N]) -> Interval {
    let terms = row.iter().zip(x).map(|(a, x)| *a * *x);
    terms.fold(Interval::ZERO, |sum, term| sum + term)
}

/// Bound of the variation of a cascade's impulse response, of which the first stage is a plain lag.
fn variation<const N: usize>(stages: &[Stage; N]) -> f64 {
    let (a, mut x) = cascade(stages);
    let fastest = stages
        .iter()
        .fold(f64::INFINITY, |least, stage| least.min(stage.lag.low));
    let length = fastest / CELLS_PER_TIME;
    let within_cell = Interval {
        low: 0.0,
        high: length.next_up(),
    };
    let step = Flow::over(&a, &[Interval::ZERO; N], length).phi;
    let flows = tube(&a, length);
    let last = N - 1;
    let slope_of = a[last];
    let bend_of: [Interval; N] = std::array::from_fn(|j| dot(&slope_of, &a.map(|row| row[j])));
    // From 0 to where it begins.
    let mut sum = x[last].magnitude();
    let mut rest = f64::INFINITY;
    for _ in 0..CELLS_MOST {
        let next = apply(&step, &x);
        let slope = dot(&slope_of, &x) + within_cell * dot(&bend_of, &apply(&flows, &x));
        let share = if slope.contains(0.0) {
            (slope.magnitude() * within_cell.high).next_up()
        } else {
            (next[last] - x[last]).magnitude()
        };
        sum = (sum + share).next_up();
        x = next;
        rest = left(stages, &a, &x);
        if rest <= REST * sum {
            break;
        }
    }
    (sum + rest).next_up()
}

/// Bound of the variation from a state on.
fn left<const N: usize>(stages: &[Stage; N], a: &Matrix<N>, x: &Vector<N>) -> f64 {
    let rates = apply(a, x);
    let mut left = Interval::point(x[0].magnitude());
    for i in 1..N {
        let Stage { lead, lag } = stages[i];
        let through = lead / lag;
        let own = lag * (rates[i] - through * rates[i - 1]).abs();
        left = (through.abs() + (Interval::ONE - through).abs()) * left + own;
    }
    left.magnitude()
}

#[cfg(test)]
mod tests;
