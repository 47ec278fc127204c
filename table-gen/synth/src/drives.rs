//! What drives the plant, in the device's micro-units: net power by level, and the estimate's
//! error.

use firmware::units::{AXIS_G, AXIS_L, AXIS_P};
use model::interval::Interval;
use model::plant::{Plant, STATES};
use model::spec::Spec;

use crate::chain_times;

/// Micro-units in a unit.
pub const MICRO: f64 = firmware::units::MICRO as f64;

/// Net power `P u' - w` \[µGW\] under a commanded participation: u' within the participation error
/// and what the hostile share may add or leave away, at most the whole fleet, and w within its
/// band; with what a plant in bands adds.
pub fn net_power(spec: &Spec, level: usize) -> Interval {
    let nominal = of_fleet_and_loss(spec, level);
    counted(spec).map_or(nominal, |f| {
        let chain = Chain::of(spec, f);
        nominal + off_nominal(spec, nominal, &chain, chain.off(spec))
    })
}

/// The middle of the net power, for laws that are tried. Time constants in bands are left out: they
/// add as much as they take.
pub fn middle_power(spec: &Spec, level: usize) -> f64 {
    let nominal = of_fleet_and_loss(spec, level);
    let power = counted(spec).map_or(nominal, |f| {
        nominal + off_nominal(spec, nominal, &Chain::of(spec, f), Interval::ZERO)
    });
    power.mid()
}

/// Net power without what a plant in bands adds.
fn of_fleet_and_loss(spec: &Spec, level: usize) -> Interval {
    let fleet = Interval::point(spec.fleet_power_gw()) * Interval::point(MICRO);
    let u = Interval::point(spec.input.value(level));
    let error = Interval::point(spec.uncertainty.participation);
    let hostile = Interval::point(spec.uncertainty.hostile());
    let honest = u * (Interval::ONE - hostile);
    let low = (honest * (Interval::ONE - error)).low.max(0.0);
    let high = (honest * (Interval::ONE + error) + hostile).high.min(1.0);
    let [loss_low, loss_high] = spec.uncertainty.loss_gw;
    let loss = Interval::hull(loss_low, loss_high) * Interval::point(MICRO);
    fleet * Interval::hull(low, high) - loss
}

/// The range of f \[µHz\] for which a plant in bands is counted, if there is one.
fn counted(spec: &Spec) -> Option<Interval> {
    let [low, high] = spec
        .counted_frequency_hz()
        .filter(|_| spec.has_plant_band())?;
    Some(micro(low).join(micro(high)))
}

fn micro(value: f64) -> Interval {
    Interval::point(value) * Interval::point(MICRO)
}

/// The governors' chain with the plant's own numbers, for f in a range.
struct Chain {
    /// f \[µHz\].
    f: Interval,
    /// K_0 f \[µGW\].
    asked: Interval,
    /// States at the event \[micro-units\].
    initial: [Interval; STATES],
    /// p \[µGW\], between the least and the most that a chain which starts within the initial box
    /// makes of such f.
    p: Interval,
}

impl Chain {
    fn of(spec: &Spec, f: Interval) -> Self {
        let plant = Plant::new(spec);
        let bounds = &spec.uncertainty.initial;
        let initial: [Interval; STATES] =
            std::array::from_fn(|axis| micro(bounds.lower[axis]).join(micro(bounds.upper[axis])));
        let asked = Interval::point(plant.governor_gain) * f;
        let g = asked.join(initial[AXIS_G]);
        let lead = Interval::point(plant.lead_time) / Interval::point(plant.governor_time);
        let l = (lead * asked + (Interval::ONE - lead) * g).join(initial[AXIS_L]);
        Self {
            f,
            asked,
            p: l.join(initial[AXIS_P]),
            initial,
        }
    }

    /// How far a chain with time constants in the spec's bands is from it \[µGW\].
    fn off(&self, spec: &Spec) -> Interval {
        chain_times::off(spec, self.asked.join(Interval::ZERO), &self.initial)
    }
}

/// What a plant in bands adds to a net power v \[µGW\].
///
/// Games speak of f and of the states of the chain that the device computes, with the plant's own
/// K_0 and time constants. The chain is linear in its gain, so the real one gives K/K_0 times what
/// it would with K_0, which is p and what other time constants put it off by. This acts on f'
/// alone, as more or less net power does:
///
/// ```text
/// 2 H_0 f' = p + v - D_0 f + e
/// e = (H_0/H) N - (p + v - D_0 f)      N = (K/K_0) (p + off) + v - D f
/// ```
///
/// The verifier has its own derivation, and proves the range of f.
fn off_nominal(spec: &Spec, v: Interval, chain: &Chain, times: Interval) -> Interval {
    let plant = Plant::new(spec);
    let ends = |[low, high]: [f64; 2]| Interval::hull(low, high);
    let one = Interval::ONE;
    let gain = ends(spec.governor_gain_band()) / Interval::point(plant.governor_gain) - one;
    let lighter = Interval::point(plant.inertia) / ends(spec.inertia_band()) - one;
    let nominal_damping = Interval::point(plant.damping);
    let damping = ends(spec.damping_band()) - nominal_damping;
    let Chain { f, p, .. } = *chain;
    let off = gain * p - damping * f + (one + gain) * times;
    off + lighter * (p + v - nominal_damping * f + off)
}

/// Bound of the estimate's error \[micro-units\], rounded up.
pub fn measurement_micro(spec: &Spec) -> [f64; STATES] {
    spec.uncertainty
        .measurement
        .map(|e| if e == 0.0 { 0.0 } else { (e * MICRO).next_up() })
}

/// Net power under a level as the device expects it \[µGW\]: delivered as commanded, the loss in
/// the middle of its band.
pub fn expected_power(spec: &Spec, level: usize) -> Interval {
    let fleet = Interval::point(spec.fleet_power_gw()) * Interval::point(MICRO);
    let [low, high] = spec.uncertainty.loss_gw;
    let loss = Interval::point(0.5 * low + 0.5 * high) * Interval::point(MICRO);
    fleet * Interval::point(spec.input.value(level)) - loss
}
