//! One tick of the charger: a state in, an action out.
//!
//! The loop never fails: a rejected table or a state that no law covers is answered by the baseline
//! droop, and the action says so.
//!
//! A table that is a response ([`crate::response`]) needs f alone. Its law is total, so there is no
//! outside and no event to end.
//!
//! ## Commands that act late
//! Where the table's commands act with a delay, the loop remembers those that are under way and
//! decides on the predicted state ([`crate::prediction`]). The memory holds levels. So the droop
//! then answers in whole levels too, and the prediction knows exactly what is under way. The end of
//! an event keeps the memory: what was commanded last still acts when the next event begins within
//! the delay.
//!
//! So the loop must be told of every command, its own or not, once a tick. Each of the ways to a
//! command notes it: [`ControlLoop::step`], [`ControlLoop::step_or`] and [`ControlLoop::command`].

use crate::droop::Droop;
use crate::phase::{Decision, Phase, PhaseState};
use crate::prediction::{DELAY_TICKS_MAX, History};
use crate::response::{LevelOffset, Response};
use crate::table::{TableError, TableView, Working};
use crate::units::{Participation, State};

/// Who decided the participation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The table, by the law of the action's phase.
    Table,
    /// The baseline droop, because no law of the table covers the state.
    DroopOutside,
    /// The baseline droop, because the table was rejected at start-up.
    DroopNoTable,
}

/// What the charger does until the next tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Action {
    /// Share of the fleet that is to respond.
    pub participation: Participation,
    /// The law in force.
    pub phase: Phase,
    /// Who decided.
    pub source: Source,
}

/// The control loop over a table that was accepted or rejected at start-up.
#[derive(Debug, Clone)]
pub struct ControlLoop<'t> {
    table: Result<TableView<'t>, TableError>,
    droop: Droop,
    state: PhaseState,
    history: History,
    /// `None` for a table by games.
    response: Option<Response>,
}

impl<'t> ControlLoop<'t> {
    /// A loop before the event. `bytes` is the flash image of the table. If it is rejected,
    /// [`Droop::PAPER`] is in force for good.
    pub fn new(bytes: &'t [u8]) -> Self {
        Self::with_table(TableView::parse(bytes))
    }

    /// The same for a table that was parsed already.
    pub fn with_table(table: Result<TableView<'t>, TableError>) -> Self {
        Self::shifted(table, LevelOffset::NONE)
    }

    /// The same with this charger's levels of a response shifted. What [`ControlLoop::with_offset`]
    /// does to a loop, without moving it.
    #[inline]
    pub fn shifted(table: Result<TableView<'t>, TableError>, offset: LevelOffset) -> Self {
        let droop = match &table {
            Ok(view) => view.working().droop,
            Err(_) => Droop::PAPER,
        };
        let response = table.as_ref().ok().and_then(|view| {
            let tick_ms = view.working().tick_ms;
            let law = view.response()?;
            Some(Response::new(law, tick_ms, offset))
        });
        let mut state = PhaseState::INITIAL;
        if response.is_some() {
            state.phase = Phase::Response;
        }
        Self {
            table,
            droop,
            state,
            history: History::NONE,
            response,
        }
    }

    /// The same with this charger's levels of a response shifted.
    #[must_use]
    pub const fn with_offset(mut self, offset: LevelOffset) -> Self {
        if let Some(response) = &mut self.response {
            response.set_offset(offset);
        }
        self
    }

    /// What a response remembers; `None` for a table by games, and without a table.
    pub const fn response(&self) -> Option<&Response> {
        self.response.as_ref()
    }

    /// Why the table was rejected, if it was.
    pub fn table_error(&self) -> Option<TableError> {
        self.table.as_ref().err().copied()
    }

    /// The table, if it was accepted.
    pub fn table(&self) -> Option<&TableView<'t>> {
        self.table.as_ref().ok()
    }

    /// Phase, level and clock as they stand.
    pub fn phase_state(&self) -> PhaseState {
        self.state
    }

    /// Advances by one tick (`sampling.watch_s`) with the state measured at it. The action is
    /// commanded.
    pub fn step(&mut self, state: State) -> Action {
        self.step_or(state, |action| action.participation)
    }

    /// The same for a caller that may command something else: `choose` sees what the loop decided
    /// and says what is commanded. The action that comes back holds the latter.
    pub fn step_or(
        &mut self,
        state: State,
        choose: impl FnOnce(&Action) -> Participation,
    ) -> Action {
        let mut action = self.decide(state);
        action.participation = self.command(choose(&action));
        action
    }

    fn decide(&mut self, state: State) -> Action {
        let Ok(table) = &self.table else {
            self.state.phase = Phase::Fallback;
            return Action {
                participation: self.droop.participation(state),
                phase: Phase::Fallback,
                source: Source::DroopNoTable,
            };
        };
        if let Some(response) = &mut self.response {
            return Action {
                participation: response.step(state.frequency_uhz()),
                phase: Phase::Response,
                source: Source::Table,
            };
        }
        let ahead = || match table.prediction() {
            Some(prediction) => prediction.predict(state, &self.history),
            None => state,
        };
        let (next, step) = self.state.step_ahead(table, state, ahead);
        self.state = next;
        let (participation, source) = match step {
            Decision::Level(level) => (table.working().participation(level), Source::Table),
            Decision::Outside => (self.droop.participation(state), Source::DroopOutside),
        };
        Action {
            participation,
            phase: next.phase,
            source,
        }
    }

    /// One tick at which the loop is not asked: this participation was decided elsewhere. Returns
    /// what is to be commanded: with a delay the nearest level of the table, else the same. A
    /// level's own participation is that level again.
    #[must_use = "this, not the participation given, is what the loop has noted as commanded"]
    #[inline(never)]
    pub fn command(&mut self, participation: Participation) -> Participation {
        if let Some(response) = &mut self.response {
            response.impose(participation);
        }
        let Some(header) = self.delayed() else {
            return participation;
        };
        let step = header.input_step_ppm;
        // With a single level, or steps of nothing, there is nothing else to command.
        let nearest = (participation.ppm() + step / 2)
            .checked_div(step)
            .unwrap_or(0);
        let level = nearest.min(u32::from(header.levels) - 1) as u8;
        let commanded = header.participation(level);
        self.history.push(level);
        commanded
    }

    /// The participation that acts until the next tick is decided: with a delay an earlier command,
    /// else the last one, which is given.
    pub fn acting(&self, last: Participation) -> Participation {
        match self.delayed() {
            Some(header) => header.participation(self.history.level(header.delay_ticks)),
            None => last,
        }
    }

    /// What is at hand of a table whose commands act late.
    fn delayed(&self) -> Option<&Working> {
        let header = self.table.as_ref().ok()?.working();
        (header.delay_ticks > 0).then_some(header)
    }

    /// Lets the period's clock run on by ticks that nobody measured. A decision that fell due
    /// meanwhile is made at the next [`ControlLoop::step`].
    pub fn skip(&mut self, ticks: u16) {
        self.state.ticks_left = self.state.ticks_left.saturating_sub(ticks);
        self.hold(ticks);
    }

    /// Takes a frequency into a response's window for a tick at which nothing is decided: the tick
    /// was missed, and its frequency lies between its neighbours'. Tables by games need no more
    /// than [`ControlLoop::skip`].
    pub fn pass(&mut self, f_uhz: i32) {
        if let Some(response) = &mut self.response {
            response.pass(f_uhz);
        }
    }

    /// Takes note that for so many ticks there was no reading, and that the last command was held.
    pub fn miss(&mut self, ticks: u16) {
        if let Some(response) = &mut self.response {
            response.miss(ticks);
        }
        self.hold(ticks);
    }

    /// Takes note that the last command was held for ticks at which nothing was decided.
    #[inline(never)]
    fn hold(&mut self, ticks: u16) {
        if self.delayed().is_some() {
            let last = self.history.level(0);
            for _ in 0..ticks.min(DELAY_TICKS_MAX) {
                self.history.push(last);
            }
        }
    }

    /// Forgets the event: back to No control. The commands under way are still known. A response
    /// knows no event.
    pub const fn end_event(&mut self) {
        if self.response.is_none() {
            self.state = PhaseState::INITIAL;
        }
    }

    /// Forgets the event and the commands under way, as after a restart: nobody knows them until
    /// the delay has passed.
    pub fn reset(&mut self) {
        self.lose_track();
        if let Some(response) = &mut self.response {
            response.reset();
        }
    }

    /// The readings that follow have nothing to do with those before. As [`ControlLoop::reset`],
    /// but a response keeps its command and its slope response.
    pub fn lose_track(&mut self) {
        self.end_event();
        self.history = History::NONE;
        if let Some(response) = &mut self.response {
            response.restart();
        }
    }
}
