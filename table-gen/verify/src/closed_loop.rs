//! The closed loop as numbers: plant, clocks and uncertainty of the spec, inputs of the table's header.
//!
//! All states and powers are in the device's micro-units (µHz, kW). The plant is linear, so A and b do not change with
//! the unit. What the firmware does is taken from the header; what the grid and the fleet do from the spec.

use firmware::table::TableView;

use super::knowledge::Knowledge;
use super::segment::Segment;
use model::flow::{Matrix, Vector};
use model::interval::Interval;
use model::plant::{GridPlant, STATES};
use model::spec::Spec;

/// Micro-units in a unit.
const MICRO: f64 = firmware::units::MICRO as f64;

/// Interval in which the net power `P u' - w` \[kW\] may vary while a level is held, as centre and radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Drive {
    /// Centre \[kW\].
    pub(crate) mid: f64,
    /// Largest distance from the centre \[kW\]; 0 if the net power is known exactly.
    pub(crate) radius: f64,
}

impl Drive {
    pub(crate) fn of(range: Interval) -> Self {
        let mid = range.mid();
        let exact = range.low == range.high;
        let radius = if exact { 0.0 } else { range.radius() };
        Self { mid, radius }
    }

    /// The interval.
    pub(crate) fn range(self) -> Interval {
        if self.radius == 0.0 {
            return Interval::point(self.mid);
        }
        let radius = Interval::point(self.radius).symmetric();
        Interval::point(self.mid) + radius
    }
}

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
    pub(crate) tick: Segment,
    /// One period.
    pub(crate) period: Segment,
    /// Ticks of a period.
    pub(crate) period_ticks: u32,
    /// What the device knows when it decides.
    pub(crate) knowledge: Knowledge,
}

impl Model {
    /// The closed loop of a table with a spec's plant and uncertainty.
    pub(crate) fn new(table: &TableView<'_>, spec: &Spec) -> Self {
        let header = table.header();
        let (a, b) = GridPlant::new(spec).matrices();
        let commands = (0..header.levels).map(|level| header.participation(level).ppm());
        let drives: Vec<Drive> = commands
            .clone()
            .map(|ppm| Drive::of(net_power(spec, ppm)))
            .collect();
        let tick_s = f64::from(header.tick_ms) / 1000.0;
        let period_ticks = u32::from(header.period_ticks);
        // Milliseconds first: the period is then one correctly rounded quotient.
        let period_s = f64::from(u32::from(header.tick_ms) * period_ticks) / 1000.0;
        let initial = &spec.uncertainty.initial;
        let error = spec.uncertainty.measurement.map(up_micro);
        let period = Segment::new(&a, &b, period_s);
        let mut model = Self {
            a,
            b,
            knowledge: Knowledge::of_estimate(error, &period, &drives),
            drives,
            error,
            initial: std::array::from_fn(|d| {
                let (low, high) = (micro(initial.lower[d]), micro(initial.upper[d]));
                low.join(high)
            }),
            containment: spec.requirements.containment_hz.map(limit_micro),
            tick_s,
            tick: Segment::new(&a, &b, tick_s),
            period,
            period_ticks,
        };
        // What the grid does is the spec's, whatever the table predicts.
        let late = spec
            .sampling
            .ticks_of(spec.uncertainty.actuation_delay_s.most_s());
        if late > 0 {
            let expected: Vec<Interval> = commands.map(|ppm| expected_power(spec, ppm)).collect();
            model.knowledge = Knowledge::of_prediction(table, &model, &expected, late);
        }
        if u32::from(header.delay_ticks) != late {
            model.knowledge.limit = Some(format!(
                "the table predicts over {} ticks, the spec's commands act {late} late",
                header.delay_ticks
            ));
        }
        model
    }

    /// Ticks from a command to its power.
    pub(crate) fn delay_ticks(&self) -> u32 {
        self.knowledge.delay.as_ref().map_or(0, |delay| delay.ticks)
    }

    /// The segment over which a decision is held.
    pub(crate) fn held(&self, ticks: u32) -> &Segment {
        if ticks == self.period_ticks {
            &self.period
        } else {
            &self.tick
        }
    }
}

/// A number of the spec in micro-units. Decimal numbers that name whole micro-units become exactly those.
pub(crate) fn micro(value: f64) -> Interval {
    let scaled = value * MICRO;
    if (scaled - scaled.round()).abs() <= 1e-9 * scaled.abs().max(1.0) {
        Interval::point(scaled.round())
    } else {
        Interval::point(value) * Interval::point(MICRO)
    }
}

fn up_micro(value: f64) -> f64 {
    micro(value).high
}

/// A lower limit of frequency \[µHz\], rounded up.
fn limit_micro(hz: f64) -> f64 {
    micro(hz).high
}

/// `P u - w` \[kW\] as a device expects it under a command \[ppm\]: all of it is delivered, the loss is in the middle of its band.
fn expected_power(spec: &Spec, ppm: u32) -> Interval {
    let [low, high] = spec.uncertainty.loss_gw;
    let fleet = micro(spec.fleet_power_gw());
    let loss = (micro(low) + micro(high)) * Interval::point(0.5);
    fleet * Interval::point(f64::from(ppm)) / Interval::point(MICRO) - loss
}

/// `P u' - w` \[kW\] for a commanded participation \[ppm\]: u' within the participation error, at most the whole fleet,
/// w within its band.
fn net_power(spec: &Spec, ppm: u32) -> Interval {
    let fleet = micro(spec.fleet_power_gw());
    let loss = micro(spec.uncertainty.loss_gw[0]).join(micro(spec.uncertainty.loss_gw[1]));
    let commanded = fleet * Interval::point(f64::from(ppm)) / Interval::point(MICRO);
    if spec.uncertainty.participation == 0.0 {
        return commanded - loss;
    }
    let error = Interval::point(spec.uncertainty.participation);
    let low = (commanded * (Interval::ONE - error)).low.max(0.0);
    let high = (commanded * (Interval::ONE + error)).high.min(fleet.high);
    Interval::hull(low, high) - loss
}
