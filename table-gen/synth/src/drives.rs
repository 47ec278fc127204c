//! What drives the plant, in the device's micro-units: net power by level, and the estimate's
//! error.

use firmware::units::{AXIS_G, AXIS_L, AXIS_P};
use model::interval::Interval;
use model::plant::{Plant, STATES};
use model::spec::Spec;

/// Micro-units in a unit.
pub const MICRO: f64 = firmware::units::MICRO as f64;

/// Net power `P u' - w` \[µGW\] under a commanded participation: u' within the participation error
/// and what the hostile share may add or leave away, at most the whole fleet, and w within its
/// band.
pub fn net_power(spec: &Spec, level: usize) -> Interval {
    let fleet = Interval::point(spec.fleet_power_gw()) * Interval::point(MICRO);
    let u = Interval::point(spec.input.value(level));
    let error = Interval::point(spec.uncertainty.participation);
    let hostile = Interval::point(spec.uncertainty.hostile());
    let honest = u * (Interval::ONE - hostile);
    let low = (honest * (Interval::ONE - error)).low.max(0.0);
    let high = (honest * (Interval::ONE + error) + hostile).high.min(1.0);
    let [loss_low, loss_high] = spec.uncertainty.loss_gw;
    let loss = Interval::hull(loss_low, loss_high) * Interval::point(MICRO);
    let nominal = fleet * Interval::hull(low, high) - loss;
    match spec
        .counted_frequency_hz()
        .filter(|_| spec.has_plant_band())
    {
        Some(frequency_hz) => nominal + off_nominal(spec, nominal, frequency_hz),
        None => nominal,
    }
}

/// What H, 1/R_eq and D that are not the plant's add to a net power \[µGW\], for f in a range
/// \[Hz\].
///
/// Games speak of f and of the chain's states times K_0/K: those obey the equations of the plant's
/// own K_0, since the chain is linear in its gain, and they are what the device computes. What is
/// left acts on f' alone, as more or less net power does:
///
/// ```text
/// 2 H_0 f' = p + v - D_0 f + e,   e = (H_0/H) N - (p + v - D_0 f),   N = (K/K_0) p + v - D f
/// ```
///
/// where p lies between the least and the most that a chain which starts within the initial box
/// makes of such f. The verifier has its own derivation, and proves the range of f.
fn off_nominal(spec: &Spec, v: Interval, [low, high]: [f64; 2]) -> Interval {
    let plant = Plant::new(spec);
    let micro = |value: f64| Interval::point(value) * Interval::point(MICRO);
    let f = micro(low).join(micro(high));
    let initial = |axis: usize| {
        let initial = &spec.uncertainty.initial;
        micro(initial.lower[axis]).join(micro(initial.upper[axis]))
    };
    let asked = Interval::point(plant.governor_gain) * f;
    let g = asked.join(initial(AXIS_G));
    let lead = Interval::point(plant.lead_time) / Interval::point(plant.governor_time);
    let l = (lead * asked + (Interval::ONE - lead) * g).join(initial(AXIS_L));
    let p = l.join(initial(AXIS_P));
    let ends = |[low, high]: [f64; 2]| Interval::hull(low, high);
    let one = Interval::ONE;
    let gain = ends(spec.governor_gain_band()) / Interval::point(plant.governor_gain) - one;
    let lighter = Interval::point(plant.inertia) / ends(spec.inertia_band()) - one;
    let nominal_damping = Interval::point(plant.damping);
    let damping = ends(spec.damping_band()) - nominal_damping;
    let off = gain * p - damping * f;
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
