//! Which of two slots a charger starts with, and how the other is written.
//!
//! # Start
//! A slot counts if it is marked complete and its container passes every check of [`Device::runs`].
//! The newest that counts is in force: at once if it is confirmed; on trial if not and a trial is
//! left, which is noted before the table is used. A slot without trials left does not count. So a
//! table that does not run, however it fails, is left after [`TRIALS`] starts: roll-back.
//!
//! # Update
//! The slot that is not in force is voided, erased, written, read back, verified and marked
//! complete, in this order. The new table is in force from the next start. Nothing is written while
//! a trial runs, since the other slot is the way back.
//!
//! # Why no cut of the supply hurts
//! A write that is cut leaves each bit that was to become 0 as it was, written, or reading as
//! either from one time to the next. The other bits stay. An erase that is cut leaves anything.
//!
//! 1. *The slot in force is never erased, and its container never written*: only marks are added to
//!    it, whose cells nothing else shares.
//! 2. *A container that counts is whole.* It was written and verified before the first bit of
//!    "complete" was, and "complete" is voided before the first bit of the slot is erased. A cell
//!    that was cut can only read as "complete" if it was being written as that.
//! 3. *Complete is solid once it matters.* It is written again before a trial is noted, so while a
//!    trial reads as noted, complete no longer depends on luck. Before that a start may find the
//!    new table or the one before: both are whole.
//! 4. *Confirmed is solid once it matters.* "Settled" is begun after "confirmed" was ended. While
//!    "settled" does not read, each start that reads "confirmed" writes both again. Before that a
//!    start may find the table confirmed, or on trial, or, all trials used, the one before.
//! 5. *Confirmed tables are not left for older ones*: the newest that counts is in force, and what
//!    is written beside it was newer than it.
//!
//! A trial that was cut may read as blank: then its cell is written again, and the table has had
//! one start more.

use core::ops::Range;

use crate::container::{Container, HEADER_LEN, Header};
use crate::device::Device;
use crate::key::Verify;
use crate::layout::{Layout, Slot};
use crate::mapped::Mapped;
use crate::marks::{CELL_LEN, MARKS_LEN, Mark, Marks, TRIALS, all_blank};
use crate::refusal::Refusal;

/// The table in force.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Running {
    /// Its slot.
    pub slot: Slot,
    /// Version of its container.
    pub version: u32,
    /// Whether it was confirmed; otherwise it is on trial.
    pub confirmed: bool,
    /// Where the table's bytes lie in the flash \[bytes from its start\].
    pub table: Range<u32>,
}

/// A slot that is complete and whose table this charger could run.
#[derive(Debug, Clone)]
struct Candidate {
    slot: Slot,
    version: u32,
    marks: Marks,
    table: Range<u32>,
}

impl Candidate {
    /// It had its trials and was not confirmed.
    const fn has_failed(&self) -> bool {
        !self.marks.confirmed && self.marks.tried >= TRIALS
    }
}

/// A container that is being written.
#[derive(Debug, Clone)]
struct Incoming {
    slot: Slot,
    header: Header,
    now_s: Option<u32>,
    /// Bytes of the whole container.
    len: u32,
    taken: u32,
    /// The bytes since the last whole cell; blank behind them.
    cell: [u8; CELL_LEN],
}

/// Two slots of a flash, and the table in force.
#[derive(Debug)]
pub struct Slots<F, K> {
    flash: F,
    layout: Layout,
    device: Device<K>,
    running: Option<Running>,
    /// Version of a container that is complete and in force from the next start.
    waiting: Option<u32>,
    incoming: Option<Incoming>,
}

impl<F: Mapped, K: Verify> Slots<F, K> {
    const WRITES_CELLS: () = assert!(CELL_LEN.is_multiple_of(F::WRITE_SIZE));

    /// Chooses the table for this run; a trial is noted. Flash that takes no mark leaves what is
    /// confirmed in force.
    pub fn start(flash: F, layout: Layout, device: Device<K>) -> Self {
        let () = Self::WRITES_CELLS;
        let mut slots = Self {
            flash,
            layout,
            device,
            running: None,
            waiting: None,
            incoming: None,
        };
        let [a, b] = [Slot::A, Slot::B].map(|slot| slots.candidate(slot));
        let b_is_newer = match (&a, &b) {
            (Some(a), Some(b)) => b.version > a.version,
            _ => false,
        };
        let newest_first = if b_is_newer { [b, a] } else { [a, b] };
        slots.running = newest_first
            .into_iter()
            .flatten()
            .find(|candidate| slots.takes(candidate))
            .map(|candidate| Running {
                slot: candidate.slot,
                version: candidate.version,
                confirmed: candidate.marks.confirmed,
                table: candidate.table,
            });
        slots
    }

    /// What is in force in this run; `None` for the built-in table or the droop.
    pub const fn running(&self) -> Option<&Running> {
        self.running.as_ref()
    }

    /// The bytes of the table in force.
    pub fn table(&self) -> Option<&[u8]> {
        let table = &self.running.as_ref()?.table;
        self.flash
            .bytes()
            .get(table.start as usize..table.end as usize)
    }

    /// Version that is in force from the next start, if one was installed in this run.
    pub const fn waiting(&self) -> Option<u32> {
        self.waiting
    }

    /// The flash.
    pub const fn flash(&self) -> &F {
        &self.flash
    }

    /// The table in force has run well: it is kept. Without one, or if it was confirmed before,
    /// nothing is done.
    ///
    /// # Errors
    /// [`Refusal::Flash`]: the table stays on trial.
    pub fn confirm(&mut self) -> Result<(), Refusal> {
        let Some(running) = self.running.clone().filter(|running| !running.confirmed) else {
            return Ok(());
        };
        self.settle(running.slot)?;
        self.running = Some(Running {
            confirmed: true,
            ..running
        });
        Ok(())
    }

    /// Installs a container that is at hand as a whole. It is verified before the flash is touched,
    /// and again as the flash holds it. It is in force from the next start.
    ///
    /// # Errors
    /// Every [`Refusal`]; what is in force stays so.
    pub fn install(&mut self, container: &[u8], now_s: Option<u32>) -> Result<(), Refusal> {
        self.device.runs(&Container::parse(container)?)?;
        let (header, rest) = container
            .split_first_chunk::<HEADER_LEN>()
            .ok_or(Refusal::OutOfTurn)?;
        self.begin(header, now_s)?;
        self.part(rest)?;
        self.finish()
    }

    /// Begins to install a container that comes in parts, by its header. Takes as long as the slot
    /// takes to be erased: up to seconds.
    ///
    /// # Errors
    /// Whatever the header alone says against it, before the flash is touched.
    pub fn begin(&mut self, header: &[u8; HEADER_LEN], now_s: Option<u32>) -> Result<(), Refusal> {
        self.incoming = None;
        if self.running.as_ref().is_some_and(|table| !table.confirmed) {
            return Err(Refusal::TrialRuns);
        }
        let first = header;
        let header = Header::read(first)?;
        self.device.is_for(header.class)?;
        self.is_new(header.version)?;
        header.validity.check(now_s)?;
        let (room, len) = (self.layout.room(), header.container_len());
        let len = len.filter(|len| *len <= room).ok_or(Refusal::TooLong {
            found: len.unwrap_or(u32::MAX),
            room,
        })?;
        let slot = match &self.running {
            Some(running) => running.slot.other(),
            None => Slot::A,
        };
        self.waiting = None;
        self.put(slot, Mark::Void)?;
        let Range { start, end } = self.layout.range(slot);
        self.flash.erase(start, end).map_err(|_| Refusal::Flash)?;
        self.incoming = Some(Incoming {
            slot,
            header,
            now_s,
            len,
            taken: 0,
            cell: [0xFF; CELL_LEN],
        });
        self.part(first)
    }

    /// The next bytes of the container.
    ///
    /// # Errors
    /// [`Refusal::OutOfTurn`], [`Refusal::TooMany`], [`Refusal::Flash`]: to be begun again.
    pub fn part(&mut self, bytes: &[u8]) -> Result<(), Refusal> {
        let mut incoming = self.incoming.take().ok_or(Refusal::OutOfTurn)?;
        let found = (bytes.len() as u32).saturating_add(incoming.taken);
        if found > incoming.len {
            let stated = incoming.len;
            return Err(Refusal::TooMany { found, stated });
        }
        for byte in bytes {
            let at = incoming.taken as usize % CELL_LEN;
            if let Some(place) = incoming.cell.get_mut(at) {
                *place = *byte;
            }
            incoming.taken += 1;
            if at + 1 == CELL_LEN {
                self.put_cell(&mut incoming)?;
            }
        }
        self.incoming = Some(incoming);
        Ok(())
    }

    /// The end of the container: verified as the flash holds it, then marked complete.
    ///
    /// # Errors
    /// Every [`Refusal`] but those of the header, which came first.
    pub fn finish(&mut self) -> Result<(), Refusal> {
        let mut incoming = self.incoming.take().ok_or(Refusal::OutOfTurn)?;
        let (found, needed) = (incoming.taken, incoming.len);
        if found != needed {
            return Err(Refusal::Truncated { found, needed });
        }
        if !(found as usize).is_multiple_of(CELL_LEN) {
            incoming.taken = found.next_multiple_of(CELL_LEN as u32);
            self.put_cell(&mut incoming)?;
        }
        let bytes = self.slot(incoming.slot);
        let written = bytes.get(MARKS_LEN..).unwrap_or_default();
        let container = Container::at_start(written)?;
        self.device.runs(&container)?;
        if container.header != incoming.header || !all_blank(bytes) {
            return Err(Refusal::Flash);
        }
        incoming.header.validity.check(incoming.now_s)?;
        self.put(incoming.slot, Mark::Complete)?;
        self.waiting = Some(incoming.header.version);
        Ok(())
    }

    /// Whether a version is newer than whatever is or will be in force, and was not tried in vain.
    fn is_new(&self, version: u32) -> Result<(), Refusal> {
        let running = self.running.as_ref().map(|running| running.version);
        if let Some(running) = running.max(self.waiting) {
            if version == running {
                return Err(Refusal::Replayed { version });
            }
            if version < running {
                return Err(Refusal::Older {
                    found: version,
                    running,
                });
            }
        }
        let failed = [Slot::A, Slot::B]
            .into_iter()
            .filter_map(|slot| self.candidate(slot))
            .any(|candidate| candidate.version == version && candidate.has_failed());
        if failed {
            return Err(Refusal::RolledBack { version });
        }
        Ok(())
    }

    /// The slot, if it counts.
    fn candidate(&self, slot: Slot) -> Option<Candidate> {
        let bytes = self.slot(slot);
        let marks = Marks::read(bytes);
        if !marks.complete {
            return None;
        }
        let container = Container::at_start(bytes.get(MARKS_LEN..)?).ok()?;
        self.device.runs(&container).ok()?;
        let start = self.layout.start(slot) + (MARKS_LEN + HEADER_LEN) as u32;
        Some(Candidate {
            slot,
            version: container.header.version,
            marks,
            table: start..start + container.table.len() as u32,
        })
    }

    /// Whether a candidate is in force in this run; notes a trial, and ends what was not settled.
    fn takes(&mut self, candidate: &Candidate) -> bool {
        let Candidate { slot, marks, .. } = *candidate;
        if marks.confirmed {
            if !marks.settled {
                // Without it the next start does the same.
                let _ = self.settle(slot);
            }
            return true;
        }
        let Some(trial) = marks.next else {
            return false;
        };
        // A trial that is not noted would never end.
        let noted = self
            .put(slot, Mark::Complete)
            .and_then(|()| self.put(slot, Mark::Trial(trial)));
        noted.is_ok()
    }

    /// Marks a slot confirmed, and then that this is whole.
    fn settle(&mut self, slot: Slot) -> Result<(), Refusal> {
        self.put(slot, Mark::Confirmed)?;
        self.put(slot, Mark::Settled)
    }

    /// A slot's bytes; none if the layout leaves the flash.
    fn slot(&self, slot: Slot) -> &[u8] {
        let Range { start, end } = self.layout.range(slot);
        let bytes = self.flash.bytes().get(start as usize..end as usize);
        bytes.unwrap_or_default()
    }

    fn put(&mut self, slot: Slot, mark: Mark) -> Result<(), Refusal> {
        let at = self.layout.start(slot) + mark.offset();
        let written = self.flash.write(at, mark.bytes());
        written.map_err(|_| Refusal::Flash)
    }

    /// Writes the cell that ends at `taken`.
    fn put_cell(&mut self, incoming: &mut Incoming) -> Result<(), Refusal> {
        let container = self.layout.start(incoming.slot) + MARKS_LEN as u32;
        let at = container + incoming.taken - CELL_LEN as u32;
        let written = self.flash.write(at, &incoming.cell);
        written.map_err(|_| Refusal::Flash)?;
        incoming.cell = [0xFF; CELL_LEN];
        Ok(())
    }
}
