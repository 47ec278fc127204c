//! What the fleet delivers in a run in plain numbers: draws act a delay after they were commanded.
//!
//! Where the delay is a range, a command that changes changes over: any mixture of the old draw and
//! the new one is delivered until the most of the range, a new one every sample.

use std::collections::VecDeque;

use firmware::prediction::History;
use firmware::table::TableView;
use firmware::units::State;
use model::spec::Spec;

use crate::unit::unit;
use rand_pcg::Pcg64;

/// A draw that was made at a tick.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Draw {
    /// The delivered participation.
    pub(crate) delivered: f64,
    /// Whether the command is another one than before.
    pub(crate) changes: bool,
}

/// Draws under way, and what the device remembers of the commands.
pub(crate) struct UnderWay {
    history: History,
    waiting: VecDeque<Option<Draw>>,
    old: f64,
    acting: f64,
    /// Samples in which the commands may still be mixed.
    mixed: u32,
    /// Whole samples of a changeover.
    changeover: u32,
}

impl UnderWay {
    /// Nothing is under way. `sample_s` is the time between two samples.
    pub(crate) fn new(table: &TableView<'_>, spec: &Spec, sample_s: f64) -> Self {
        let ticks = usize::from(table.header().delay_ticks);
        let length_s = f64::from(spec.uncertainty.actuation_delay_s.span_ms()) / 1e3;
        Self {
            history: History::NONE,
            waiting: VecDeque::from(vec![None; ticks]),
            old: 0.0,
            acting: 0.0,
            mixed: 0,
            // No sample is mixed that ends after the changeover.
            changeover: (length_s / sample_s + 1e-9).floor() as u32,
        }
    }

    /// The state that the device decides on, from the one that it measures.
    pub(crate) fn ahead(&self, table: &TableView<'_>, measured: State) -> State {
        let prediction = table.prediction();
        prediction.map_or(measured, |part| part.predict(measured, &self.history))
    }

    /// Notes what a tick has decided, and lets the draw begin to act that is due.
    pub(crate) fn tick(&mut self, level: u8, draw: Option<Draw>) {
        self.history.push(level);
        self.waiting.push_back(draw);
        if let Some(due) = self.waiting.pop_front().flatten() {
            self.old = self.acting;
            self.acting = due.delivered;
            self.mixed = if due.changes { self.changeover } else { 0 };
        }
    }

    /// What is delivered over a sample.
    pub(crate) fn delivered(&mut self, random: &mut Pcg64) -> f64 {
        let Some(left) = self.mixed.checked_sub(1) else {
            return self.acting;
        };
        self.mixed = left;
        // An end in half of the samples.
        let share = (2.0 * unit(random) - 0.5).clamp(0.0, 1.0);
        self.acting + share * (self.old - self.acting)
    }
}
