//! What drives the plant, in the device's micro-units: net power by level, and the estimate's
//! error.

use model::interval::Interval;
use model::plant::STATES;
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
    fleet * Interval::hull(low, high) - loss
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
