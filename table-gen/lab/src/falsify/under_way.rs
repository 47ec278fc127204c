//! Commands on their way to the power that they ask for, by a fleet whose delays are anywhere
//! within a range.
//!
//! A charger with the delay d follows at s the last command decided at s - d or before. So within
//! a tick the fleet gives a mean of the commands from the one of the least delay to the one of the
//! most. Where the most is no whole number of ticks, the oldest of these is another in the first
//! part of the tick than in the second. All means of the two ends are tried; with commands that
//! change at most once within the range there are no others.

use std::collections::VecDeque;

use firmware::phase::Phase;
use model::spec::Spec;

/// A time that is no time \[s\].
const DUST_S: f64 = 1e-9;

/// A command on its way to the power that it asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Command {
    pub(super) phase: Phase,
    /// Share of the fleet, in \[0, 1\].
    pub(super) participation: f64,
}

impl Command {
    pub(super) const NONE: Self = Self {
        phase: Phase::NoControl,
        participation: 0.0,
    };
}

/// A part of every tick: its length, and how old a command may be that is followed in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Part {
    /// Length \[s\].
    pub(super) length_s: f64,
    /// Age of the oldest command \[ticks\].
    oldest: usize,
}

/// How late commands act.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Lateness {
    least: usize,
    pub(super) is_range: bool,
    pub(super) parts: Vec<Part>,
}

impl Lateness {
    pub(super) fn of(spec: &Spec, tick_s: f64) -> Self {
        let delay = spec.uncertainty.actuation_delay_s;
        let ticks = |s: f64| ((s + DUST_S) / tick_s).floor() as usize;
        let (least, most) = (ticks(delay.least_s()), ticks(delay.most_s()));
        let first_s = delay.most_s() - most as f64 * tick_s;
        let part = |length_s, oldest| Part { length_s, oldest };
        let parts = if delay.exact_s().is_some() || first_s < DUST_S {
            vec![part(tick_s, most)]
        } else {
            vec![part(first_s, most + 1), part(tick_s - first_s, most)]
        };
        Self {
            least,
            is_range: delay.exact_s().is_none(),
            parts,
        }
    }
}

/// The commands that may still be followed.
#[derive(Debug, Clone)]
pub(super) struct UnderWay {
    least: usize,
    /// The latest first.
    commands: VecDeque<Command>,
}

impl UnderWay {
    /// Nothing is under way.
    pub(super) fn new(lateness: &Lateness) -> Self {
        let oldest = lateness.parts.iter().map(|part| part.oldest).max();
        Self {
            least: lateness.least,
            commands: vec![Command::NONE; oldest.unwrap_or(0) + 1].into(),
        }
    }

    /// Notes what a tick has decided.
    pub(super) fn note(&mut self, command: Command) {
        self.commands.pop_back();
        self.commands.push_front(command);
    }

    /// The latest command that a charger may follow.
    pub(super) fn latest(&self) -> Command {
        self.aged(self.least)
    }

    /// What the fleet gives in a part of the tick if this share of it follows the latest command
    /// and the rest the oldest.
    pub(super) fn given(&self, part: &Part, early: f64) -> f64 {
        let (latest, oldest) = (self.latest(), self.aged(part.oldest));
        early * latest.participation + (1.0 - early) * oldest.participation
    }

    fn aged(&self, ticks: usize) -> Command {
        self.commands.get(ticks).copied().unwrap_or(Command::NONE)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails where it unwraps nothing")]
    use super::*;

    /// A tick of 0.1 s, delays of 0.1 to 0.25 s: a charger with the most follows the command of
    /// three ticks ago for 0.05 s, then that of two.
    #[test]
    fn the_oldest_command_changes_in_the_middle_of_a_tick() {
        let set = ["uncertainty.actuation_delay_s=[0.1, 0.25]".to_owned()];
        let lateness = Lateness::of(&Spec::load("paper-bi", &set).unwrap(), 0.1);
        let mut under_way = UnderWay::new(&lateness);
        for participation in [0.1, 0.2, 0.3, 0.4] {
            under_way.note(Command {
                phase: Phase::C1,
                participation,
            });
        }
        let [first, second] = lateness.parts[..] else {
            panic!("{lateness:?}")
        };
        assert!((first.length_s - 0.05).abs() < 1e-9 && (second.length_s - 0.05).abs() < 1e-9);
        assert_eq!(under_way.given(&first, 1.0), 0.3);
        assert_eq!(under_way.given(&first, 0.0), 0.1);
        assert_eq!(under_way.given(&second, 0.0), 0.2);
        assert!((under_way.given(&second, 0.5) - 0.25).abs() < 1e-12);
    }
}
