//! A container over a line: collected in memory, and installed once it is whole.
//!
//! An asker begins with the container's length, sends its bytes in parts, each with its place, and
//! asks for it to be installed. Every step is answered. A part that is sent again, since its answer
//! was lost, is answered as the first time. Nothing is written to flash before the whole container
//! has been verified, so whoever can send bytes cannot wear out the flash, or make the charger
//! stand still.
//!
//! Steps and answers are postcard records; who carries them is not this module's business.

use serde::{Deserialize, Serialize};

use crate::container::{HEADER_LEN, SIGNATURE_LEN};
use crate::key::Verify;
use crate::layout::Slot;
use crate::mapped::Mapped;
use crate::refusal::Refusal;
use crate::slots::Slots;

/// Most bytes in a part.
pub const PART_MAX: usize = 192;
/// Longest answer.
pub const SAID_MAX: usize = 24;

/// What is asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Step<'m> {
    /// What is in force, and how far is the container?
    State,
    /// A container of so many bytes comes; what came before is forgotten.
    Begin {
        /// Its bytes.
        len: u32,
    },
    /// Bytes of it.
    Part {
        /// Place of the first.
        at: u32,
        /// At most [`PART_MAX`].
        #[serde(borrow)]
        bytes: &'m [u8],
    },
    /// It is whole: verify it, write it, and have it in force from the next start on.
    Install {
        /// The time, if the asker knows it \[s since 1970\].
        now_s: Option<u32>,
    },
}

/// The answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Said {
    /// How it is.
    State(State),
    /// So many bytes of the container are there.
    Taken(u32),
    /// The container is in force from the next start on.
    Installed {
        /// Its version.
        version: u32,
    },
    /// It is not taken; what is in force stays so.
    Refused(Reason),
}

/// What is in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct State {
    /// Version in force; `None` for the table beside the code, or the droop.
    pub running: Option<u32>,
    /// Its slot: 0 A, 1 B.
    pub slot: u8,
    /// Whether it was confirmed; otherwise it is on trial.
    pub confirmed: bool,
    /// Version that is in force from the next start on.
    pub waiting: Option<u32>,
    /// Bytes of the container that are there.
    pub taken: u32,
    /// Bytes that a container may have.
    pub room: u32,
}

/// Why a container is not taken: a [`Refusal`] by number, with its two values where it has some.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reason {
    /// Number, as in [`Reason::text`].
    pub number: u8,
    /// First value of the refusal.
    pub first: u32,
    /// Second value.
    pub second: u32,
}

impl Reason {
    /// The bytes sent are no step.
    pub const MALFORMED: Self = Self::of(20, 0, 0);
    /// The charger responds to the grid or charges, and would have to stand still.
    pub const NOT_NOW: Self = Self::of(21, 0, 0);

    const fn of(number: u8, first: u32, second: u32) -> Self {
        Self {
            number,
            first,
            second,
        }
    }

    /// What the number means; `{a}` and `{b}` stand for the values.
    pub const fn text(self) -> &'static str {
        match self.number {
            1 => "{a} bytes, {b} are needed",
            2 => "{a} bytes, its header says {b}",
            3 => "it is no container",
            4 => "its format is {a}, the charger reads {b}",
            5 => "its field at {a} is out of range",
            6 => "it is not signed by the key that the charger trusts",
            7 => "it is for chargers of class {a}, this one is of class {b}",
            8 => "it is of version {a}, and {b} is in force or waits",
            9 => "version {a} is in force or waits already",
            10 => "version {a} was tried and rolled back",
            11 => "it is to be installed from second {a} on, and it is {b}",
            12 => "it was to be installed until second {a}, and it is {b}",
            13 => "it is valid for a time only, and nobody told the charger the time",
            14 => "the charger's reader rejects the table",
            15 => "the charger is not what the table's proof assumed: misfits {a}",
            16 => "{a} bytes, the charger takes {b}",
            17 => "the table in force is on trial",
            18 => "a part came out of turn: begin again",
            19 => "the flash did not take it",
            20 => "the charger does not know this step",
            21 => {
                "the charger charges, or responds to the grid, and would have to stand still: later"
            }
            _ => "for a reason that this program does not know",
        }
    }
}

impl From<Refusal> for Reason {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::Truncated { found, needed } => Self::of(1, found, needed),
            Refusal::TooMany { found, stated } => Self::of(2, found, stated),
            Refusal::NotAContainer { found } => Self::of(3, u32::from_le_bytes(found), 0),
            Refusal::UnsupportedFormat { found, supported } => {
                Self::of(4, u32::from(found), u32::from(supported))
            }
            Refusal::BadField { offset } => Self::of(5, u32::from(offset), 0),
            Refusal::BadSignature => Self::of(6, 0, 0),
            Refusal::WrongClass { found, own } => Self::of(7, found.0, own.0),
            Refusal::Older { found, running } => Self::of(8, found, running),
            Refusal::Replayed { version } => Self::of(9, version, 0),
            Refusal::RolledBack { version } => Self::of(10, version, 0),
            Refusal::NotYetValid { from_s, now_s } => Self::of(11, from_s, now_s),
            Refusal::Expired { until_s, now_s } => Self::of(12, until_s, now_s),
            Refusal::NoTime => Self::of(13, 0, 0),
            Refusal::Table(_) => Self::of(14, 0, 0),
            Refusal::Misfit(misfits) => Self::of(15, u32::from(misfits.bits()), 0),
            Refusal::TooLong { found, room } => Self::of(16, found, room),
            Refusal::TrialRuns => Self::of(17, 0, 0),
            Refusal::OutOfTurn => Self::of(18, 0, 0),
            Refusal::Flash => Self::of(19, 0, 0),
        }
    }
}

/// Collects a container in memory.
#[derive(Debug)]
pub struct Inbox<'b> {
    buffer: &'b mut [u8],
    len: usize,
    taken: usize,
    /// What is in the buffer was installed: its version.
    installed: Option<u32>,
}

impl<'b> Inbox<'b> {
    /// An inbox for containers that fit into the buffer.
    pub const fn new(buffer: &'b mut [u8]) -> Self {
        Self {
            buffer,
            len: 0,
            taken: 0,
            installed: None,
        }
    }

    /// The longest container.
    const fn room(&self) -> u32 {
        self.buffer.len() as u32
    }

    /// One step. `may_stand_still`: whether the charger can do without its processor for as long as
    /// the flash takes to be erased.
    pub fn step<F: Mapped, K: Verify>(
        &mut self,
        slots: &mut Slots<F, K>,
        step: &Step<'_>,
        may_stand_still: bool,
    ) -> Said {
        let said = match *step {
            Step::State => return Said::State(self.state(slots)),
            Step::Begin { len } => self.begin(len),
            Step::Part { at, bytes } => self.part(at, bytes),
            Step::Install { .. } if !may_stand_still => return Said::Refused(Reason::NOT_NOW),
            Step::Install { now_s } => return self.install(slots, now_s),
        };
        said.map_or_else(
            |refusal| Said::Refused(refusal.into()),
            |()| Said::Taken(self.taken as u32),
        )
    }

    fn state<F: Mapped, K: Verify>(&self, slots: &Slots<F, K>) -> State {
        let running = slots.running();
        State {
            running: running.map(|running| running.version),
            slot: running.map_or(0, |running| u8::from(running.slot == Slot::B)),
            confirmed: running.is_some_and(|running| running.confirmed),
            waiting: slots.waiting(),
            taken: self.taken as u32,
            room: self.room(),
        }
    }

    fn begin(&mut self, len: u32) -> Result<(), Refusal> {
        (self.len, self.taken, self.installed) = (0, 0, None);
        let least = (HEADER_LEN + SIGNATURE_LEN) as u32;
        let room = self.room();
        if len > room {
            return Err(Refusal::TooLong { found: len, room });
        }
        if len < least {
            return Err(Refusal::Truncated {
                found: len,
                needed: least,
            });
        }
        self.len = len as usize;
        Ok(())
    }

    fn part(&mut self, at: u32, bytes: &[u8]) -> Result<(), Refusal> {
        let at = usize::try_from(at).unwrap_or(usize::MAX);
        let end = at.saturating_add(bytes.len());
        if at > self.taken || end > self.len {
            return Err(Refusal::OutOfTurn);
        }
        let place = self.buffer.get_mut(at..end).ok_or(Refusal::OutOfTurn)?;
        // As long as the bytes, for `end` is below `self.len`; copied in a way that cannot panic.
        for (to, from) in place.iter_mut().zip(bytes) {
            *to = *from;
        }
        self.installed = None;
        // What is sent again may stand in front of what is there.
        self.taken = self.taken.max(end);
        Ok(())
    }

    fn install<F: Mapped, K: Verify>(
        &mut self,
        slots: &mut Slots<F, K>,
        now_s: Option<u32>,
    ) -> Said {
        // Asked again since the answer was lost.
        if let Some(version) = self.installed {
            return Said::Installed { version };
        }
        let whole = self.buffer.get(..self.len);
        let whole = whole.filter(|_| self.len > 0 && self.taken == self.len);
        let installed = match whole {
            Some(container) => slots.install(container, now_s),
            None => Err(Refusal::OutOfTurn),
        };
        match (installed, slots.waiting()) {
            (Ok(()), Some(version)) => {
                self.installed = Some(version);
                Said::Installed { version }
            }
            (Ok(()), None) => Said::Refused(Refusal::Flash.into()),
            (Err(refusal), _) => Said::Refused(refusal.into()),
        }
    }
}

/// A step of its bytes.
pub fn read_step(bytes: &[u8]) -> Option<Step<'_>> {
    match postcard::take_from_bytes(bytes) {
        Ok((step, [])) => Some(step),
        _ => None,
    }
}

/// The bytes of a step, at the start of the buffer; empty if they do not fit.
pub fn write_step<'b>(step: &Step<'_>, buffer: &'b mut [u8]) -> &'b [u8] {
    postcard::to_slice(step, buffer).map_or(&[], |bytes| bytes)
}

/// An answer of its bytes.
pub fn read_said(bytes: &[u8]) -> Option<Said> {
    match postcard::take_from_bytes(bytes) {
        Ok((said, [])) => Some(said),
        _ => None,
    }
}

/// Writes an answer at the start of the buffer; its length, `None` if it does not fit.
pub fn write_said(said: &Said, buffer: &mut [u8]) -> Option<usize> {
    let written = postcard::to_slice(said, buffer).ok()?;
    Some(written.len())
}
