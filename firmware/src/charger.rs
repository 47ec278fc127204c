//! The supervisor: one tick from a frequency reading to the charger's set-point.
//!
//! `source -> gate -> filter -> observer -> control loop -> dispatch`, and a defined [`Mode`] for
//! every way in which a part of it can be missing. Nothing here fails: what is wrong at a tick is
//! in the [`Report`].
//!
//! ## Time
//! The caller ticks every `tick_ms` by a millisecond clock that may wrap. A late tick advances the
//! observer by the ticks that were missed, up to [`CATCH_UP_TICKS_MAX`], with the frequency
//! interpolated. The period's clock advances with it, and the tick decides once. A larger step of
//! the clock, or one backwards, makes the observer start again. A tick that comes too early
//! advances nothing.
//!
//! ## Fit
//! When it starts, a charger compares itself with what the proof of its table assumed
//! ([`misfits`]). Where it is something else it runs the droop and says so at every tick.
//!
//! ## Energy
//! Nothing is energised before a frequency has been believed and the delay of [`StartDelay`] has
//! passed, nor after the mains has gone, until the same has happened again. Without its crystal a
//! charger believes no frequency ([`ChargerConfig::standing_faults`]): it energises nothing.
//!
//! ## Trust
//! After a start nobody knows the governor chain: the grid may be in the middle of an event. The
//! observer's initial error dies out with its slowest time constant. So the droop, which needs f
//! alone, is in force for [`trust_ticks`], and at least for the table's delay: after that every
//! command under way is one that was noted since.

mod clock;
mod config;
mod fit;
pub mod reference;
mod report;
mod start;

pub use clock::CATCH_UP_TICKS_MAX;
pub use config::{ChargerConfig, trust_ticks};
pub use fit::{Installation, MeterFacts, Misfits, misfits};
pub use report::Report;
pub use start::StartDelay;

use crate::control_loop::{ControlLoop, Source};
use crate::dispatch::Dispatch;
use crate::droop::Droop;
use crate::event::{Course, EventWatch};
use crate::fault::{Faults, Mode, ResetCause};
use crate::frequency::filter::Filter;
use crate::frequency::gate::Gate;
use crate::frequency::{FrequencyError, FrequencySource};
use crate::observer::{Observer, ObserverConfig};
use crate::phase::Phase;
use crate::table::{TableError, TableView, field};
use crate::units::{Participation, State};
use crate::wide::divide;
use clock::{Due, TickClock};
use report::{ChangeLog, Standing};
use start::Start;

/// Tick without a table \[ms\].
pub const TICK_MS_DEFAULT: u16 = 100;

/// Feeds the watchdog. Only a completed tick calls it: every step done, and the set-point accepted
/// by the hardware.
pub trait Watchdog {
    /// Restarts the watchdog's time.
    fn feed(&mut self);
}

/// A charger: everything between the mains and the car but the hardware.
#[derive(Debug)]
pub struct Charger<'t, S, D, W> {
    source: S,
    dispatch: D,
    watchdog: W,
    standing_faults: Faults,
    hold_ticks: u16,
    release_ppm: u32,
    tick_ms: u16,
    gate: Gate,
    filter: Filter,
    /// `None` without a table, and for a response whose plant has a chain that is too fast for the
    /// tick.
    observer: Option<Observer>,
    control: ControlLoop<'t>,
    droop: Droop,
    /// `None` without a table and for a response.
    event: Option<EventWatch>,
    /// Restarted by a fault, and the warm-up that follows is not over.
    restarted: bool,
    /// What the proof of the table assumed otherwise.
    misfits: Misfits,
    warm_up_ticks: u16,
    warm_up_left: u16,
    lost_ticks: u16,
    clock: TickClock,
    start: Start,
    /// Ticks since the start; saturates.
    sequence: u32,
    f_uhz: i32,
    standing: Standing,
    changes: ChangeLog,
}

impl<'t, S: FrequencySource, D: Dispatch, W: Watchdog> Charger<'t, S, D, W> {
    /// A charger before its first tick. `table` is the flash image, checked here.
    pub fn new(
        source: S,
        dispatch: D,
        watchdog: W,
        table: &'t [u8],
        config: ChargerConfig,
        cause: ResetCause,
    ) -> Self {
        let table = TableView::parse(table);
        Self::with_table(source, dispatch, watchdog, table, config, cause)
    }

    /// The same for a table that was parsed already, as where many chargers share one.
    ///
    /// Not inlined: what is put together here must not lie on the stack while the table is parsed,
    /// which is where the stack is deepest.
    #[inline(never)]
    pub fn with_table(
        source: S,
        dispatch: D,
        watchdog: W,
        mut table: Result<TableView<'t>, TableError>,
        config: ChargerConfig,
        cause: ResetCause,
    ) -> Self {
        // A response needs no state estimate and knows no event.
        let always_on = table.as_ref().is_ok_and(|view| view.working().always_on);
        let (tick_ms, delay_ticks, droop, event) = match &table {
            Ok(view) => {
                let header = view.working();
                let event = (!always_on)
                    .then(|| EventWatch::new(config.event_end, header.outer, header.tick_ms));
                (header.tick_ms, header.delay_ticks, header.droop, event)
            }
            Err(_) => (TICK_MS_DEFAULT, 0, Droop::PAPER, None),
        };
        let plant = table.as_ref().ok().map(TableView::plant);
        let observer = plant.and_then(|plant| {
            let coefficients = ObserverConfig::new(&plant, tick_ms).ok()?;
            Some(Observer::at_rest(coefficients, 0))
        });
        // A chain that is too fast for the tick makes a table by games as useless as a broken one.
        let unusable = observer.is_none() && table.is_ok() && !always_on;
        if unusable {
            table = Err(TableError::bad_field(&field::GOVERNOR_TIME));
        }
        let warm_up_ticks = config.warm_up_ticks.unwrap_or_else(|| {
            let trusts = plant.filter(|_| !always_on);
            trusts.map_or(0, |plant| trust_ticks(&plant, tick_ms).max(delay_ticks))
        });
        let filter = Filter::new(config.filter_ticks);
        let misfits = match (&table, &config.installation) {
            (Ok(view), Some(installation)) => {
                let meter = MeterFacts::of(&source);
                misfits(&view.header(), installation, meter, &filter)
            }
            _ => Misfits::NONE,
        };
        let gate = Gate::new(
            config.gate,
            tick_ms,
            source.error_uhz(),
            source.stuck_after(),
        );
        Self {
            source,
            dispatch,
            watchdog,
            standing_faults: config.standing_faults,
            hold_ticks: config.hold_ticks,
            release_ppm: config.release_ppm,
            tick_ms,
            gate,
            filter,
            observer,
            control: ControlLoop::shifted(table, config.level_offset),
            droop,
            event,
            restarted: cause != ResetCause::PowerOn,
            misfits,
            warm_up_ticks,
            warm_up_left: warm_up_ticks,
            lost_ticks: 0,
            clock: TickClock::new(tick_ms),
            start: Start::new(config.start_delay),
            sequence: 0,
            f_uhz: 0,
            standing: Standing::FIRST,
            changes: ChangeLog::FIRST,
        }
    }

    /// Length of a tick \[ms\].
    pub const fn tick_ms(&self) -> u16 {
        self.tick_ms
    }

    /// Why the table was rejected, if it was.
    pub fn table_error(&self) -> Option<TableError> {
        self.control.table_error()
    }

    /// The table, if it was accepted.
    pub fn table(&self) -> Option<&TableView<'t>> {
        self.control.table()
    }

    /// What the proof of the table assumed otherwise.
    pub const fn misfits(&self) -> Misfits {
        self.misfits
    }

    /// The source, to hand it captures.
    pub const fn source_mut(&mut self) -> &mut S {
        &mut self.source
    }

    /// The dispatcher, to change its limits.
    pub const fn dispatch_mut(&mut self) -> &mut D {
        &mut self.dispatch
    }

    /// Between the ticks: lets the source take what was captured.
    pub fn poll(&mut self, now_ms: u32) {
        self.source.poll(now_ms);
    }

    /// One tick.
    pub fn tick(&mut self, now_ms: u32) -> Report {
        let mut faults = self.standing_faults;
        let due = self.ticks_due(now_ms, &mut faults);
        let reading = if faults.contains(Faults::CLOCK) {
            Err(FrequencyError::Clock)
        } else {
            self.source.read(now_ms)
        };
        match self.gate.admit(reading) {
            Ok(f_uhz) => {
                self.start.seen(f_uhz, now_ms);
                self.follow(f_uhz, due, &mut faults);
            }
            Err(error) => {
                faults.insert(error.into());
                self.without_frequency(due);
                if error == FrequencyError::NoSignal && self.standing.mode == Mode::Safe {
                    self.start.dark();
                }
            }
        }
        self.sequence = self.sequence.saturating_add(1);
        if self.control.table_error().is_some() {
            faults.insert(Faults::TABLE_REJECTED);
        }
        if !self.misfits.is_empty() {
            faults.insert(Faults::MISFIT);
        }
        let window_fills = self
            .control
            .response()
            .is_some_and(|response| !response.is_full());
        if self.standing.mode == Mode::WarmUp || self.warm_up_left > 0 || window_fills {
            if self.restarted {
                faults.insert(Faults::RESTARTED);
            }
        } else {
            self.restarted = false;
        }
        let applied = if self.start.ready(now_ms) {
            self.dispatch.apply(self.standing.participation, now_ms)
        } else {
            self.dispatch.rest(now_ms)
        };
        match applied {
            Ok(_) => self.watchdog.feed(),
            Err(_) => faults.insert(Faults::DISPATCH),
        }
        let standing = self.standing;
        let report = Report {
            sequence: self.sequence,
            now_ms,
            mode: standing.mode,
            phase: standing.phase,
            state: standing.state,
            loss_kw: standing.loss_kw,
            participation: standing.participation,
            set_point: applied.ok(),
            faults,
            misfits: self.misfits,
        };
        self.changes.note(&report);
        report
    }

    /// Ticks by which to advance; starts the observer again after a jump of the clock.
    fn ticks_due(&mut self, now_ms: u32, faults: &mut Faults) -> u16 {
        match self.clock.due(now_ms) {
            Due::Ticks(due) => {
                if due > 1 {
                    faults.insert(Faults::OVERRUN);
                }
                due
            }
            Due::Jumped => {
                faults.insert(Faults::CLOCK_JUMP);
                self.start_again();
                1
            }
        }
    }

    /// Forgets what the observer and the control loop know.
    fn start_again(&mut self) {
        self.warm_up_left = self.warm_up_ticks;
        self.filter.reset();
        self.control.lose_track();
        if let Some(event) = &mut self.event {
            event.reset();
        }
        if let Some(observer) = &mut self.observer {
            observer.restart(self.f_uhz);
        }
    }

    fn follow(&mut self, f_uhz: i32, due: u16, faults: &mut Faults) {
        let lost = self.lost_ticks;
        self.lost_ticks = 0;
        // The first reading: the best guess is a grid that has been there for long.
        if lost > self.hold_ticks || self.sequence == 0 {
            self.f_uhz = f_uhz;
            self.start_again();
        }
        let f_uhz = self.filter.step(f_uhz);
        let from = self.f_uhz;
        for n in 1..=due {
            // The missed ticks' frequencies lie on a line.
            let way = divide(u64::from(f_uhz.abs_diff(from)) * u64::from(n), due.into());
            let at = if f_uhz < from {
                from.wrapping_sub_unsigned(way)
            } else {
                from.wrapping_add_unsigned(way)
            };
            self.advance(at, n == due);
            if n < due {
                self.control.pass(at);
            }
        }
        if due > 0 {
            // What was held stayed held: one decision, however many ticks were missed.
            let missed = due - 1;
            self.control.skip(missed);
            self.warm_up_left = self.warm_up_left.saturating_sub(missed);
            self.decide(due, faults);
        }
    }

    /// One tick of the observer. Of several that are caught up only the last is asked for an
    /// estimate.
    fn advance(&mut self, f_uhz: i32, last: bool) {
        self.f_uhz = f_uhz;
        let acting = self.control.acting(self.standing.participation);
        self.standing.state = match &mut self.observer {
            Some(observer) if !last => {
                observer.pass(f_uhz, acting);
                return;
            }
            Some(observer) => {
                let state = observer.step(f_uhz);
                self.standing.loss_kw = observer.loss_kw(acting);
                state
            }
            None => State([f_uhz, 0, 0, 0]),
        };
    }

    /// One tick of the control loop, or of what stands in for it, `due` ticks after the last. Every
    /// path commands once.
    fn decide(&mut self, due: u16, faults: &mut Faults) {
        let state = self.standing.state;
        let warming_up = self.warm_up_left > 0;
        if warming_up || !self.misfits.is_empty() {
            self.warm_up_left = self.warm_up_left.saturating_sub(1);
            self.standing.mode = if warming_up {
                Mode::WarmUp
            } else {
                Mode::DroopMisfit
            };
            self.standing.phase = Phase::Fallback;
            let participation = self.droop.participation(state);
            self.standing.participation = self.control.command(participation);
            return;
        }
        let f_uhz = state.frequency_uhz();
        if let Some(event) = &mut self.event {
            match event.course(f_uhz, due) {
                Course::Release(participation) => {
                    self.standing.mode = Mode::Release;
                    self.standing.participation = self.control.command(participation);
                    return;
                }
                Course::Anew | Course::Over => self.control.end_event(),
                Course::Follow => {}
            }
        }
        // The last tick's.
        let before = self.standing.participation;
        let mut released = false;
        let event = &mut self.event;
        let action = self.control.step_or(state, |action| {
            let responding = action.phase != Phase::NoControl;
            let covered = action.source == Source::Table;
            if let Some(event) = event {
                released = event.ends(f_uhz, responding, covered, before, due);
            }
            if released {
                before
            } else {
                action.participation
            }
        });
        self.standing.participation = action.participation;
        self.standing.phase = action.phase;
        if action.source == Source::DroopOutside {
            faults.insert(Faults::OUTSIDE_DOMAIN);
        }
        self.standing.mode = match action.source {
            _ if released => Mode::Release,
            Source::Table => Mode::Table,
            Source::DroopNoTable => Mode::DroopNoTable,
            Source::DroopOutside => Mode::DroopOutside,
        };
    }

    fn without_frequency(&mut self, due: u16) {
        self.lost_ticks = self.lost_ticks.saturating_add(due);
        self.control.miss(due);
        if self.lost_ticks <= self.hold_ticks {
            self.standing.mode = Mode::Hold;
            // The chain follows the last frequency; the loss estimate would see a kink that was not
            // there.
            for n in 1..=due {
                self.advance(self.f_uhz, n == due);
            }
        } else {
            self.standing.mode = Mode::Safe;
            self.standing.phase = Phase::Fallback;
            let release = self.release_ppm.saturating_mul(u32::from(due));
            let ppm = self.standing.participation.ppm().saturating_sub(release);
            self.standing.participation = Participation::from_ppm(ppm);
            // A response goes on from what was commanded last; other tables start again anyway.
            let _ = self.control.command(self.standing.participation);
        }
        self.standing.loss_kw = None;
        if let Some(observer) = &mut self.observer {
            observer.reset_loss();
        }
    }
}
