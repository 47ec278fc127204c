//! The chain of a table of laws by games: plant, firmware and a participation error that is drawn
//! anew each period.
//!
//! # What is drawn
//! At every decision, and in Fixed after every period, the error of the delivered participation is
//! drawn anew and stays until the next draw. In No control nothing is commanded and nothing is
//! drawn. The loss moves in its band and the estimate errs in its bounds as an adversary likes.
//!
//! # Nodes
//! A node is what the firmware remembers (phase, held level), how long the excursion lasts, and a
//! point of the cover, which stands for all real states of its set. What the phase machine may
//! decide on that set are the node's *decided* states, which are the chain's states. A branch is a
//! bin of the draw; its set holds the decided states of all nodes in which the bin may end. Which
//! of them is an adversary's choice.
//!
//! # Steps
//! A step is a period, but in Fixed it ends at the tick at which f leaves I2. After such a step
//! comes a whole period of a law. So n steps last at least `floor(n/2) (period + 1)` ticks, and at
//! most `2 floor(T/(period + 1)) + 2` steps begin in T ticks.
//!
//! # Failed
//! f may fall below containment at any time, between the ticks too; no law has an entry; I2 is not
//! reached within `settle_within_s` of leaving I1 (or I2, from Fixed); the draw is outside all
//! bins.
//!
//! # Cut
//! Where there are more nodes than allowed, one state stands for all that are not followed: it
//! fails at its first step. Its value is 1 with no step to go and 0 with any, which is a lower
//! bound whatever comes after it. The chain stays a chain, and its bound a bound for every horizon.

mod event;
mod expand;
mod explore;

use firmware::phase::Phase;
use firmware::table::TableView;
use firmware::units::{MICRO, STATES};
use model::interval::Interval;
use model::plant::Plant;
use model::spec::Spec;
use serde::Serialize;

use crate::chain::Chain;
use crate::cover::Cover;
use crate::decisions::Regions;
use crate::flight::{Flights, NetPower};
use crate::modes::Modes;
pub use crate::modes::ModesError;
use crate::participation::{Bin, Drawn, Participation};

/// How finely the chain is built.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Width of a bin of the fleet's power \[GW\].
    pub bin_gw: f64,
    /// Nodes after which no more are followed; what is not followed counts as failed.
    pub nodes_max: usize,
    /// Time over which the claim is made \[s\].
    pub horizon_s: f64,
}

/// Why there is no chain.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ClosedLoopError {
    /// The plant does not contract.
    #[error(transparent)]
    Modes(#[from] ModesError),
    /// A table or spec that is not covered.
    #[error("{what}: not covered by the chain; {remedy}")]
    Unsupported {
        /// What.
        what: String,
        /// What is covered.
        remedy: &'static str,
    },
    /// A setting that makes no sense.
    #[error("{name} = {found}: allowed is {allowed}")]
    Setting {
        /// The setting.
        name: &'static str,
        /// What was found.
        found: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// It was ended from outside.
    #[error("interrupted")]
    Interrupted,
}

/// Why states failed: how many decided states fail whatever is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Failures {
    /// f may fall below containment.
    pub containment: usize,
    /// No law has an entry.
    pub uncovered: usize,
    /// I2 is not reached in time.
    pub late: usize,
    /// Branches whose image did not fit the cover.
    pub not_fitting: usize,
}

/// What was not followed any more, at [`Settings::nodes_max`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unfollowed {
    /// Steps that were followed in full: a bound over no more of them loses nothing.
    pub steps: u32,
    /// Nodes that were reached and not followed.
    pub nodes: usize,
}

/// The chain with what it was built from.
#[derive(Debug, Clone)]
pub struct ClosedLoop {
    /// The chain.
    pub chain: Chain,
    /// Steps for the horizon.
    pub steps: u32,
    /// Nodes: pairs of what the firmware remembers and a set.
    pub nodes: usize,
    /// What was not followed; nothing where every node was.
    pub cut: Option<Unfollowed>,
    /// What fails for certain.
    pub failures: Failures,
    /// How far the sets reach in f \[Hz\].
    pub reach_hz: f64,
}

/// What the firmware remembers, and a point of the cover.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Key {
    phase: Phase,
    level: u8,
    /// The band that the phase watches was left in the middle of a period.
    left: bool,
    /// Ticks since the tick before the band was left; 0 outside an excursion.
    age: u16,
    cell: [i32; STATES],
}

/// Where a branch may end.
#[derive(Debug, Clone, PartialEq)]
enum Ends {
    Failed,
    In(Vec<Key>),
}

/// A decided state: its branches.
type Decided = Vec<(f64, Ends)>;

/// An expanded node.
struct Expanded {
    decided: Vec<Decided>,
    failures: Failures,
}

/// Everything that expanding a node needs.
struct Loop<'a> {
    table: &'a TableView<'a>,
    flights: Flights,
    cover: Cover,
    regions: Regions,
    /// Bins of each level.
    bins: Vec<Vec<Bin>>,
    fleet: Interval,
    loss: Interval,
    ticks: u32,
    containment: f64,
    settle_ticks: u32,
    /// Whether an excursion can be late within the horizon.
    ages: bool,
}

/// Steps that may begin in so many ticks.
pub fn steps_in(ticks: u32, period_ticks: u32) -> u32 {
    2 * (ticks / (period_ticks + 1)) + 2
}

/// Builds the chain. `go_on` is told the nodes expanded and known, and may end it.
///
/// # Errors
/// See [`ClosedLoopError`].
pub fn build(
    table: &TableView<'_>,
    spec: &Spec,
    participation: &Participation,
    settings: &Settings,
    go_on: &dyn Fn(usize, usize) -> bool,
) -> Result<ClosedLoop, ClosedLoopError> {
    let (whole, start, steps) = prepared(table, spec, participation, settings)?;
    whole.explore(start, steps, settings, go_on)
}

/// What the chain is made from: the loop, where it begins, and the steps of the horizon.
fn prepared<'a>(
    table: &'a TableView<'a>,
    spec: &Spec,
    participation: &Participation,
    settings: &Settings,
) -> Result<(Loop<'a>, Vec<Ends>, u32), ClosedLoopError> {
    covered(table, spec)?;
    let positive = |name, found: f64| {
        if found > 0.0 && found <= 1e4 {
            return Ok(());
        }
        let allowed = "above 0, at most 10000";
        Err(ClosedLoopError::Setting {
            name,
            found,
            allowed,
        })
    };
    positive("bin_gw", settings.bin_gw)?;
    positive("horizon_s", settings.horizon_s)?;
    let header = table.header();
    let plant = Plant::new(spec);
    let (a, b) = plant.matrices();
    let modes = Modes::new(&a)?;
    let tick_s = f64::from(header.tick_ms) / 1000.0;
    let ticks = u32::from(header.period_ticks);
    let flights = Flights::new(&modes, &a, &b, tick_s, ticks);
    let loss = Interval::hull(spec.uncertainty.loss_gw[0], spec.uncertainty.loss_gw[1]);
    let moving = if loss.low == loss.high {
        0.0
    } else {
        loss.radius()
    };
    let width = header
        .grid
        .width()
        .map(|width| f64::from(width) / f64::from(MICRO));
    let cover = Cover::new(
        &modes,
        &flights,
        ticks,
        [0.5 * settings.bin_gw, moving],
        width,
    )
    .ok_or(ClosedLoopError::Unsupported {
        what: "a plant that hardly contracts".to_owned(),
        remedy: "a plant whose modes die out within minutes is",
    })?;
    let error = spec
        .uncertainty
        .measurement
        .map(|e| (e * f64::from(MICRO)).next_up());
    let levels = 0..header.levels;
    let bins = levels.map(|level| {
        let command = f64::from(header.participation(level).ppm()) / f64::from(MICRO);
        participation.bins(command, settings.bin_gw / plant.fleet.max(1e-9))
    });
    let horizon_ticks = (settings.horizon_s / tick_s).ceil() as u32;
    let settle_ticks = (spec.requirements.settle_within_s / tick_s).floor() as u32;
    let whole = Loop {
        table,
        regions: Regions::new(table, &modes, error),
        bins: bins.collect(),
        fleet: Interval::point(plant.fleet),
        loss,
        ticks,
        containment: spec
            .requirements
            .containment_hz
            .unwrap_or(f64::NEG_INFINITY),
        settle_ticks,
        ages: horizon_ticks > settle_ticks,
        flights,
        cover,
    };
    let start = whole.start(&modes, (&a, &b), spec, tick_s, horizon_ticks)?;
    Ok((whole, start, steps_in(horizon_ticks, ticks)))
}

/// What the chain covers.
fn covered(table: &TableView<'_>, spec: &Spec) -> Result<(), ClosedLoopError> {
    let header = table.header();
    let unsupported = |what: &str, remedy| {
        Err(ClosedLoopError::Unsupported {
            what: what.to_owned(),
            remedy,
        })
    };
    if header.always_on {
        return unsupported("a response", "its errors are bounded by a union of draws");
    }
    if header.stay || spec.requirements.stay {
        return unsupported("a table with Hold", "tables without (stay = false) are");
    }
    if header.delay_ticks > 0 || spec.uncertainty.actuation_delay_s.most_s() > 0.0 {
        return unsupported(
            "commands that act late",
            "uncertainty.actuation_delay_s = 0 is",
        );
    }
    if spec.uncertainty.own_clocks {
        return unsupported(
            "chargers with own clocks",
            "uncertainty.own_clocks = false is",
        );
    }
    for [low, high] in [
        spec.inertia_band(),
        spec.governor_gain_band(),
        spec.damping_band(),
    ] {
        if low < high {
            return unsupported("a plant known in bands", "one plant is");
        }
    }
    if spec.uncertainty.participation > 0.0 || spec.uncertainty.participation_absolute > 0.0 {
        return unsupported(
            "a participation error in the spec beside the one that is drawn",
            "uncertainty.participation = 0 is",
        );
    }
    if spec.uncertainty.hostile() > 0.0 {
        return unsupported(
            "a hostile share (uncertainty.hostile_share)",
            "a fleet without one is",
        );
    }
    Ok(())
}

impl Loop<'_> {
    /// Net power under a delivered participation.
    fn net(&self, delivered: Interval) -> NetPower {
        let exact = self.loss.low == self.loss.high;
        let moving = if exact { 0.0 } else { self.loss.radius() };
        NetPower {
            range: self.fleet * delivered - Interval::point(self.loss.mid()),
            moving,
        }
    }
}

#[cfg(test)]
mod tests;
