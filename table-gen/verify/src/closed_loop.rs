//! The closed loop as numbers: plant, clocks and uncertainty of the spec, inputs of the table's
//! header.
//!
//! All states and powers are in the device's micro-units (µHz, kW). The plant is linear, so A and b
//! do not change with the unit. What the firmware does is taken from the header; what the grid and
//! the fleet do from the spec.

use firmware::table::TableView;

use super::changeover::Changeover;
use super::drive::Drive;
use super::estimate_error::EstimateError;
use super::held_input::HeldInput;
use super::plant_band::Premise;
use model::flow::{Matrix, Vector, absolute_integral_between};
use model::interval::Interval;
use model::plant::{Plant, STATES};
use model::spec::Spec;

/// Micro-units in a unit.
pub(super) const MICRO: f64 = firmware::units::MICRO as f64;

/// Plant, clocks, inputs and bounds of one closed loop.
#[derive(Debug, Clone)]
pub(crate) struct Model {
    /// A of `x' = A x + b v`.
    pub(crate) a: Matrix<STATES>,
    /// b of `x' = A x + b v`.
    pub(crate) b: Vector<STATES>,
    /// Net power under each level.
    pub(crate) drives: Vec<Drive>,
    /// Bound of the estimate's error \[micro-units\].
    pub(crate) error: [f64; STATES],
    /// States at the event \[micro-units\].
    pub(crate) initial: [Interval; STATES],
    /// Lowest allowed frequency \[µHz\].
    pub(crate) containment: Option<f64>,
    /// Length of a tick \[s\].
    pub(crate) tick_s: f64,
    /// One tick.
    pub(crate) tick: HeldInput,
    /// One period.
    pub(crate) period: HeldInput,
    /// Ticks of a period.
    pub(crate) period_ticks: u32,
    /// How a period begins after a change of the command, where the delay is a range.
    pub(crate) changeover: Option<Changeover>,
    /// What the drives count of a plant in bands, and for which f.
    pub(crate) plant_band: Option<Premise>,
    /// What the device knows when it decides.
    pub(crate) known: EstimateError,
}

impl Model {
    /// The closed loop of a table with a spec's plant and uncertainty, as if commands began to act
    /// at once: without the least delay.
    pub(super) fn without_delay(table: &TableView<'_>, spec: &Spec) -> Self {
        let header = table.header();
        let (a, b) = Plant::new(spec).matrices();
        let initial = &spec.uncertainty.initial;
        let initial: [Interval; STATES] = std::array::from_fn(|d| {
            let (low, high) = (micro(initial.lower[d]), micro(initial.upper[d]));
            low.join(high)
        });
        let plant_band = Premise::of(spec, &initial);
        let drives: Vec<Drive> = commands(table)
            .map(|ppm| {
                let v = net_power(spec, ppm);
                Drive::of(plant_band.as_ref().map_or(v, |band| band.widened(v)))
            })
            .collect();
        let tick_s = f64::from(header.tick_ms) / 1000.0;
        let period_ticks = u32::from(header.period_ticks);
        // Milliseconds first: the period is then one correctly rounded quotient.
        let period_s = f64::from(u32::from(header.tick_ms) * period_ticks) / 1000.0;
        let error = spec.uncertainty.measurement.map(up_micro);
        let period = HeldInput::new(&a, &b, period_s);
        let period_ms = u32::from(header.tick_ms) * period_ticks;
        let (changeover, limit) = match Changeover::new(spec, (&a, &b), period_ms, &drives) {
            Ok(changeover) => (changeover, None),
            Err(reason) => (None, Some(reason)),
        };
        let mut known = match &changeover {
            None => EstimateError::of_estimate(error, &period, &period.absolute, &drives),
            Some(changeover) => {
                let varied = absolute_integral_between(&a, &b, (0.0, changeover.rest_s()));
                let mut known = EstimateError::of_estimate(error, &period, &varied, &drives);
                for (effect, own) in known.drifts.iter_mut().zip(&drives) {
                    changeover.replace(effect, (&a, &b), (own.mid, changeover.any.range()));
                }
                known
            }
        };
        known.limit = limit;
        Self {
            a,
            b,
            changeover,
            known,
            drives,
            error,
            initial,
            plant_band,
            containment: spec.requirements.containment_hz.map(limit_micro),
            tick_s,
            tick: HeldInput::new(&a, &b, tick_s),
            period,
            period_ticks,
        }
    }

    /// Ticks from a command to its power.
    pub(crate) fn delay_ticks(&self) -> u32 {
        self.known.delay.as_ref().map_or(0, |delay| delay.ticks)
    }

    /// The segment over which a decision is held.
    pub(crate) fn held(&self, ticks: u32) -> &HeldInput {
        if ticks == self.period_ticks {
            &self.period
        } else {
            &self.tick
        }
    }
}

/// The first key of `plant.governor` that is there.
fn governor_key(spec: &Spec) -> Option<&'static str> {
    let keys = &spec.plant.governor;
    [
        ("plant.governor.deadband_hz", keys.deadband_hz),
        ("plant.governor.rate_gw_per_s", keys.rate_gw_per_s),
        ("plant.governor.lower_gw", keys.lower_gw),
        ("plant.governor.upper_gw", keys.upper_gw),
    ]
    .into_iter()
    .find_map(|(key, value)| value.map(|_| key))
}

/// Why nothing is examined for laws by games, if the spec's governors are limited.
pub(crate) fn not_linear(spec: &Spec) -> Option<String> {
    governor_key(spec).map(|key| {
        format!(
            "not examined: {key} makes the plant non-linear, and laws by games are examined on \
             linear plants only"
        )
    })
}

/// A number of the spec in micro-units. Decimal numbers that name whole micro-units become exactly
/// those.
pub(crate) fn micro(value: f64) -> Interval {
    let scaled = value * MICRO;
    if (scaled - scaled.round()).abs() <= 1e-9 * scaled.abs().max(1.0) {
        Interval::point(scaled.round())
    } else {
        Interval::point(value) * Interval::point(MICRO)
    }
}

/// The inputs of a table \[ppm\], by level.
pub(super) fn commands(table: &TableView<'_>) -> impl Iterator<Item = u32> {
    let header = table.header();
    (0..header.levels).map(move |level| header.participation(level).ppm())
}

fn up_micro(value: f64) -> f64 {
    micro(value).high
}

/// A lower limit of frequency \[µHz\], rounded up.
fn limit_micro(hz: f64) -> f64 {
    micro(hz).high
}

/// `P u' - w` \[kW\] for a commanded participation u \[ppm\], w within its band.
///
/// Of N chargers a share σ is hostile and gives anything from 0 to 1 each; the mean of the others
/// is within a relative error δ of u. So u' lies between `(1 - σ)(1 - δ) u` and `(1 - σ)(1 + δ) u +
/// σ`, and is at most 1. With u = 0 that is anything from nothing to σ: No control too.
fn net_power(spec: &Spec, ppm: u32) -> Interval {
    let fleet = micro(spec.fleet_power_gw());
    let loss = micro(spec.uncertainty.loss_gw[0]).join(micro(spec.uncertainty.loss_gw[1]));
    let commanded = fleet * Interval::point(f64::from(ppm)) / Interval::point(MICRO);
    let hostile = spec.uncertainty.hostile();
    if spec.uncertainty.participation == 0.0 && hostile == 0.0 {
        return commanded - loss;
    }
    let error = Interval::point(spec.uncertainty.participation);
    let hostile = Interval::point(hostile);
    let honest = commanded * (Interval::ONE - hostile);
    let low = (honest * (Interval::ONE - error)).low.max(0.0);
    let high = (honest * (Interval::ONE + error) + hostile * fleet)
        .high
        .min(fleet.high);
    Interval::hull(low, high) - loss
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hostile_share_adds_and_leaves_away() {
        let set = ["uncertainty.hostile_share=0.1".to_owned()];
        let spec = Spec::load("paper-bi", &set).unwrap();
        // 1.4 GW against a loss of 2 GW: 10 % of it at rest, and all but 10 % when all are told to.
        for (ppm, low, high) in [
            (0, -2_000_000.0, -1_860_000.0),
            (500_000, -1_370_000.0, -1_230_000.0),
            (1_000_000, -740_000.0, -600_000.0),
        ] {
            let found = net_power(&spec, ppm);
            assert!(found.low <= low && found.high >= high, "{ppm} {found:?}");
            assert!(found.low > low - 1e-3 && found.high < high + 1e-3);
        }
    }

    #[test]
    fn a_limit_of_the_governors_is_named_and_a_linear_plant_is_examined() {
        let load = |set: &[String]| Spec::load("paper-bi", set).unwrap();
        assert_eq!(not_linear(&load(&[])), None);
        for key in ["deadband_hz", "rate_gw_per_s", "upper_gw"] {
            let key = format!("plant.governor.{key}");
            let reason = not_linear(&load(&[format!("{key}=0.5")])).unwrap();
            assert!(
                reason.starts_with(&format!("not examined: {key}")),
                "{reason}"
            );
        }
    }
}
