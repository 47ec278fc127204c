//! Laws by games on a plant that lies in bands: the nominal plant with something added to its net
//! power.
//!
//! Write K for 1/R_eq, K₀, H₀, D₀ for the nominal values, κ = K/K₀, and N for the power that
//! accelerates the grid. K and the time constants do not move. The governor chain is linear in its
//! gain, so that p is κ times what the real chain would give with the gain K₀. The nominal chain
//! gives q of the same f,
//!
//! ```text
//! q_g' = (K₀ f - q_g)/T_G    q_l' = (q_g + T_1 q_g' - q_l)/T_2    q_p' = (q_l - q_p)/T_t
//! 2H f' = N = κ (q_p + δ) + v - D f
//! ```
//!
//! where δ is what other time constants make of it, which [`chain_times`] bounds; without, q is
//! (g, l, p)/κ. It is q that the device's observer computes: it knows K₀ and the nominal times
//! alone. So (f, q) obeys the nominal equations with the net power v + e,
//!
//! ```text
//! e = (H₀/H) N - (q_p + v - D₀ f) = (κ - 1) q_p + κ δ - (D - D₀) f + (H₀/H - 1) N
//! ```
//!
//! and every set of this package, in which the net power moves within an interval as it likes,
//! holds it once the interval is wider by the range of e; H and D may move too. The spec's
//! `initial` and `measurement` are then about q.
//!
//! **The range of e** rests on f being in a range F since the event, and, where time constants are
//! in bands, on its having been there before. q_g stays in any interval that
//! holds K₀ F and q_g(0). q_l is drawn to `(T_1/T_G) K₀ f + (1 - T_1/T_G) q_g`, so it stays in any
//! interval that holds this and q_l(0); q_p likewise follows q_l.
//!
//! **F is proven, not assumed.** Let t be the first time at which f leaves F. Up to t the interval
//! of the net power is right, so the sets hold f, and [`Premise::reason`] has them end inside F by
//! a margin. f is continuous: there is no such t.

use firmware::units::{AXIS_F, AXIS_G, AXIS_L, AXIS_P};
use model::interval::Interval;
use model::plant::{Plant, STATES};
use model::spec::Spec;

use crate::chain_times;

/// By how much f must end inside the range \[µHz\].
const INSIDE: f64 = 1.0;

/// What a plant in bands adds to the net power, and the range of f for which it does.
#[derive(Debug, Clone)]
pub(crate) struct Premise {
    /// The range of f \[µHz\].
    f: Interval,
    /// Of q_p \[kW\], for such f.
    q: Interval,
    /// Of δ \[kW\].
    apart: Interval,
    /// κ - 1.
    gain: Interval,
    /// D - D₀ \[kW/µHz\].
    damping: Interval,
    /// D \[kW/µHz\].
    whole_damping: Interval,
    /// H₀/H - 1.
    lighter: Interval,
}

impl Premise {
    /// For a spec's bands and states at the event \[micro-units\], if it has any.
    pub(crate) fn of(spec: &Spec, initial: &[Interval; STATES]) -> Option<Self> {
        if !spec.has_plant_band() {
            return None;
        }
        let plant = Plant::new(spec);
        let hull = |[low, high]: [f64; 2]| Interval::hull(low, high);
        let inertia = hull(spec.inertia_band());
        let governor_gain = hull(spec.governor_gain_band());
        let damping = hull(spec.damping_band());
        let point = Interval::point;
        // Without containment no range can be proven; the spec is refused before.
        let f = match spec.counted_frequency_hz() {
            Some([low, high]) => {
                Interval::hull(low, high) * point(f64::from(firmware::units::MICRO))
            }
            None => initial[AXIS_F],
        };
        let asked = point(plant.governor_gain) * f;
        let g = asked.join(initial[AXIS_G]);
        let share = point(plant.lead_time) / point(plant.governor_time);
        let drawn = share * asked + (Interval::ONE - share) * g;
        let l = drawn.join(initial[AXIS_L]);
        Some(Self {
            f,
            q: l.join(initial[AXIS_P]),
            // From rest on, f was 0.
            apart: chain_times::apart(spec, asked.join(Interval::ZERO), initial),
            gain: governor_gain / point(plant.governor_gain) - Interval::ONE,
            damping: damping - point(plant.damping),
            whole_damping: damping,
            lighter: point(plant.inertia) / inertia - Interval::ONE,
        })
    }

    /// v + e for a net power v \[kW\].
    pub(crate) fn widened(&self, v: Interval) -> Interval {
        let kappa = self.gain + Interval::ONE;
        let accelerating = kappa * (self.q + self.apart) + v - self.whole_damping * self.f;
        v + self.gain * self.q + kappa * self.apart - self.damping * self.f
            + self.lighter * accelerating
    }

    /// Why an exploration in which f was between two ends \[µHz\] says nothing, if f may leave the
    /// range that it rests on.
    pub(crate) fn reason(&self, [low, high]: [f64; 2]) -> Option<String> {
        let inside = low >= self.f.low + INSIDE && high <= self.f.high - INSIDE;
        (!inside).then(|| {
            format!(
                "the plant's bands are counted for f from {:.4} to {:.4} Hz, and f may range \
                 from {:.4} to {:.4} Hz",
                self.f.low / 1e6,
                self.f.high / 1e6,
                low / 1e6,
                high / 1e6
            )
        })
    }
}
