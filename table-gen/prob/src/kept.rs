//! Whether a run in plain numbers keeps the promise.
//!
//! f stays above containment. I2 is reached within `settle_within_s` of leaving I1 (or I2, after
//! Fixed). With Hold it is reached once: from the moment at which Hold's first command begins to
//! act, f stays in I2 and every decision is Hold's.

use firmware::phase::{Decision, Phase};
use firmware::table::TableView;
use model::spec::Spec;

/// One run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Run {
    /// Whether the promise was kept.
    pub kept: bool,
    /// Lowest frequency \[Hz\].
    pub lowest_hz: f64,
}

/// The promise while a run goes on.
pub(crate) struct Kept {
    /// Whether it was kept until now.
    pub(crate) holds: bool,
    lowest_hz: f64,
    containment_hz: f64,
    inner_hz: [f64; 2],
    settle_ticks: u32,
    delay_ticks: u32,
    /// Ticks since the tick before the band was left; none outside an excursion.
    age: Option<u32>,
    /// Ticks since Hold decided first.
    held: Option<u32>,
}

impl Kept {
    /// Before the event.
    pub(crate) fn new(table: &TableView<'_>, spec: &Spec) -> Self {
        let header = table.header();
        let tick_s = f64::from(header.tick_ms) / 1000.0;
        let requirements = &spec.requirements;
        Self {
            holds: true,
            lowest_hz: f64::INFINITY,
            containment_hz: requirements.containment_hz.unwrap_or(f64::NEG_INFINITY),
            inner_hz: requirements.inner_hz,
            settle_ticks: (requirements.settle_within_s / tick_s).floor() as u32,
            delay_ticks: u32::from(header.delay_ticks),
            age: None,
            held: None,
        }
    }

    /// Takes a frequency \[Hz\].
    pub(crate) fn see(&mut self, f_hz: f64) {
        self.lowest_hz = self.lowest_hz.min(f_hz);
        let [low, high] = self.inner_hz;
        let acts = self.held.is_some_and(|ticks| ticks >= self.delay_ticks);
        self.holds &= f_hz >= self.containment_hz;
        self.holds &= !acts || (low <= f_hz && f_hz <= high);
    }

    /// Takes what a tick has decided.
    pub(crate) fn decided(&mut self, phase: Phase, decision: Decision) {
        self.holds &= decision != Decision::Outside;
        self.holds &= self.held.is_none() || phase == Phase::Hold;
        // Reached when the command begins to act.
        let late = |age: u32| age + self.delay_ticks > self.settle_ticks;
        match phase {
            Phase::NoControl => {}
            Phase::Fixed | Phase::Hold => {
                self.holds &= !self.age.is_some_and(late);
                self.age = None;
                if phase == Phase::Hold {
                    self.held.get_or_insert(0);
                }
            }
            _ => {
                let ran = self.age.unwrap_or(1);
                self.holds &= !late(ran);
                self.age = Some(ran);
            }
        }
    }

    /// A tick has passed.
    pub(crate) fn tick(&mut self) {
        self.age = self.age.map(|age| age + 1);
        self.held = self.held.map(|ticks| ticks + 1);
    }

    /// The run.
    pub(crate) const fn run(&self) -> Run {
        Run {
            kept: self.holds,
            lowest_hz: self.lowest_hz,
        }
    }
}
