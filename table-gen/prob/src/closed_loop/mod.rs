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
//! Where there is Hold, or commands act late, a node is what was decided, and the set in which it
//! begins to act (`ahead`): it has one decided state.
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

mod ahead;
mod changeover;
mod commanded;
mod covered;
mod error;
mod event;
mod expand;
mod explore;
mod known;
mod offers;
mod pace;
mod powers;

use std::collections::HashSet;

use firmware::phase::{Phase, PhaseState};
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
use crate::reward::Reward;
use ahead::Ahead;
pub use error::ClosedLoopError;
pub(crate) use offers::Offered;
pub use offers::Place;
pub use pace::Pace;

/// Below this frequency seconds are counted \[Hz\]: 49.5 Hz, as a deviation.
pub const BELOW_HZ: f64 = -0.5;

/// Most cells into which the states at the first decision are cut.
const FIRST_CELLS_MAX: usize = 20_000;

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

/// Why states failed: how many decided states fail whatever is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Failures {
    /// f may fall below containment.
    pub containment: usize,
    /// No law has an entry.
    pub uncovered: usize,
    /// I2 is not reached in time.
    pub late: usize,
    /// f may leave I2, or the states that Hold covers, while Hold is in force.
    pub left: usize,
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
    /// How long they last.
    pub pace: Pace,
    /// Nodes: pairs of what the firmware remembers and a set.
    pub nodes: usize,
    /// What was not followed; nothing where every node was.
    pub cut: Option<Unfollowed>,
    /// What fails for certain.
    pub failures: Failures,
    /// How far the sets reach in f \[Hz\].
    pub reach_hz: f64,
    /// Seconds below [`BELOW_HZ`] that each state may bring.
    pub below: Reward,
    /// Seconds below [`BELOW_HZ`] before the first decision, at most.
    pub below_before_s: f64,
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
    /// Where a decision is kept: what was delivered under the command before \[bins\], if it still
    /// counts.
    before: Option<[i32; 2]>,
}

impl Key {
    /// What the firmware remembers, at a tick at which it decides.
    fn state(&self) -> PhaseState {
        PhaseState {
            phase: self.phase,
            level: self.level,
            ticks_left: 0,
        }
    }
}

/// Why a decided state fails whatever is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Failure {
    Containment,
    Uncovered,
    Late,
    Left,
}

/// Where a branch may end.
#[derive(Debug, Clone, PartialEq)]
enum Ends {
    Failed,
    In(Vec<Key>),
}

/// Branches of a decided state.
type Branches = Vec<(f64, Ends)>;

/// What comes before the first decision.
struct Start {
    /// Where the first decision may be.
    ends: Vec<Ends>,
    /// Ticks before it in which f may be below [`BELOW_HZ`].
    ticks_below: u32,
}

/// A decided state.
struct Decided {
    branches: Branches,
    /// Ticks of its step in which f may be below [`BELOW_HZ`].
    ticks_below: u32,
    /// Why it fails whatever is drawn, if it does.
    failure: Option<Failure>,
}

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
    /// With Hold, or where commands act late.
    ahead: Option<Ahead>,
    /// Bins of each level.
    bins: Vec<Vec<Bin>>,
    bin_gw: f64,
    fleet: Interval,
    loss: Interval,
    ticks: u32,
    tick_s: f64,
    containment: f64,
    settle_ticks: u32,
    /// Whether an excursion can be late within the horizon.
    ages: bool,
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
    let (whole, start, horizon_ticks) = prepared(table, spec, participation, settings)?;
    whole.explore(&start, horizon_ticks, settings, go_on)
}

/// The chain in which the places of `open` offer every level.
pub(crate) fn offered(
    table: &TableView<'_>,
    spec: &Spec,
    participation: &Participation,
    settings: &Settings,
    open: &HashSet<Place>,
    go_on: &dyn Fn(usize, usize) -> bool,
) -> Result<Offered, ClosedLoopError> {
    let (whole, start, horizon_ticks) = prepared(table, spec, participation, settings)?;
    if whole.ahead.is_some() {
        return Err(ClosedLoopError::Unsupported {
            what: "other levels for a table with Hold, or whose commands act late".to_owned(),
            remedy: "tables without are (stay = false, uncertainty.actuation_delay_s = 0)",
        });
    }
    let steps = whole.pace().steps_in(horizon_ticks);
    whole.offer(&start.ends, steps, settings, open, go_on)
}

/// What the chain is made from: the loop, where it begins, and the ticks of the horizon.
fn prepared<'a>(
    table: &'a TableView<'a>,
    spec: &Spec,
    participation: &Participation,
    settings: &Settings,
) -> Result<(Loop<'a>, Start, u32), ClosedLoopError> {
    covered::covered(table, spec)?;
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
    let ahead = Ahead::new(table, spec, &modes, (&a, &b), settings.bin_gw)?;
    let changeover = ahead.as_ref().and_then(|ahead| ahead.changeover.as_ref());
    let beside = changeover.map(|changeover| changeover.reach(&modes, plant.fleet));
    let cover = Cover::new(
        &modes,
        &flights,
        ticks,
        ([0.5 * settings.bin_gw, moving], &beside.unwrap_or_default()),
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
        ahead,
        bins: bins.collect(),
        bin_gw: settings.bin_gw,
        fleet: Interval::point(plant.fleet),
        loss,
        ticks,
        tick_s,
        containment: spec
            .requirements
            .containment_hz
            .unwrap_or(f64::NEG_INFINITY),
        settle_ticks,
        ages: horizon_ticks > settle_ticks,
        flights,
        cover,
    };
    let start = whole.start(&modes, (&a, &b), spec, horizon_ticks)?;
    Ok((whole, start, horizon_ticks))
}

impl Loop<'_> {
    /// How long steps last.
    fn pace(&self) -> Pace {
        Pace::of(&self.table.header())
    }

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
