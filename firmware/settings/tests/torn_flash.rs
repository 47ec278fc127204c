//! A power cut at any step of a write leaves the old value or the new one.
//!
//! The flash is simulated with torn writes and torn erasures: at a cut, any of the bits that were
//! to be cleared are, and an erased page holds in each byte what was there, nothing, or anything
//! between. Every step of a run of writes is cut, with several ways to tear each; and at random,
//! with cuts while the last cut is being repaired.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on fails"
)]

use std::cell::RefCell;
use std::rc::Rc;

use embedded_storage::nor_flash::{
    ErrorType, MultiwriteNorFlash, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use settings::key::Key;
use settings::store::{KEY_LEN, Origin, Store};
use settings::values::{Build, Values};

const PAGE: usize = 1024;
const PAGES: usize = 2;
/// Where the pages lie in the flash: not at its start.
const START: u32 = PAGE as u32;
const BUILD: Build = Build::REFERENCE;

/// The cells, which outlive a power cut, and the supply.
struct Cells {
    bytes: Vec<u8>,
    /// Steps until the supply is cut; `None` for never.
    left: Option<u32>,
    steps: u32,
    erasures: u32,
    random: Pcg64,
}

#[derive(Debug)]
struct Cut;

impl NorFlashError for Cut {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

#[derive(Clone)]
struct Flash(Rc<RefCell<Cells>>);

impl Flash {
    fn new(seed: u64) -> Self {
        Self(Rc::new(RefCell::new(Cells {
            bytes: vec![0xFF; PAGE * (PAGES + 2)],
            left: None,
            steps: 0,
            erasures: 0,
            random: Pcg64::seed_from_u64(seed),
        })))
    }

    fn cut_after(&self, steps: Option<u32>) {
        self.0.borrow_mut().left = steps;
    }

    /// What lies outside the pages.
    fn outside(&self) -> Vec<u8> {
        let bytes = &self.0.borrow().bytes;
        [&bytes[..PAGE], &bytes[PAGE * (PAGES + 1)..]].concat()
    }
}

impl Cells {
    /// Whether the supply is cut in this step.
    fn step(&mut self) -> Result<bool, Cut> {
        self.steps += 1;
        match &mut self.left {
            None => Ok(false),
            Some(0) => Err(Cut),
            Some(left) => {
                *left -= 1;
                Ok(*left == 0)
            }
        }
    }
}

impl ErrorType for Flash {
    type Error = Cut;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Cut> {
        let cells = self.0.borrow();
        if cells.left == Some(0) {
            return Err(Cut);
        }
        let at = offset as usize;
        bytes.copy_from_slice(&cells.bytes[at..at + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.borrow().bytes.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Cut> {
        let cells = &mut *self.0.borrow_mut();
        cells.erasures += 1;
        assert!(from.is_multiple_of(PAGE as u32) && to == from + PAGE as u32);
        let range = from as usize..to as usize;
        if !cells.step()? {
            cells.bytes[range].fill(0xFF);
            return Ok(());
        }
        // How far the erasure came, in the same page another in each byte.
        let mean: u32 = cells.random.random_range(0..=3);
        for byte in &mut cells.bytes[range] {
            *byte = match cells.random.random_range(0..4) + mean {
                0..=2 => *byte,
                3 => *byte | cells.random.random::<u8>(),
                _ => 0xFF,
            };
        }
        Err(Cut)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Cut> {
        let cells = &mut *self.0.borrow_mut();
        assert!(offset.is_multiple_of(4) && bytes.len().is_multiple_of(4));
        for (word, bytes) in bytes.chunks_exact(4).enumerate() {
            let at = offset as usize + 4 * word;
            let torn = cells.step()?;
            for (n, &byte) in bytes.iter().enumerate() {
                let kept = if torn { cells.random.random::<u8>() } else { 0 };
                cells.bytes[at + n] &= byte | kept;
            }
            if torn {
                return Err(Cut);
            }
        }
        Ok(())
    }
}

impl MultiwriteNorFlash for Flash {}

fn open(flash: &Flash) -> Result<Store<Flash>, settings::store::StoreError> {
    let range = START..START + (PAGE * PAGES) as u32;
    Store::open(flash.clone(), range, BUILD)
}

/// What is kept, each item apart.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Kept {
    values: Values,
    key: Option<[u8; KEY_LEN]>,
    ceiling: u32,
}

impl Kept {
    const NOTHING: Self = Self {
        values: Values::DEFAULT,
        key: None,
        ceiling: 0,
    };

    fn read(store: &mut Store<Flash>) -> Self {
        let loaded = store.settings();
        assert!(
            matches!(loaded.origin, Origin::Default | Origin::Stored),
            "{:?}",
            loaded.origin
        );
        Self {
            values: loaded.values,
            key: store.device_key().unwrap(),
            ceiling: store.ceiling().unwrap(),
        }
    }

    /// What it is to become by a random write.
    fn next(&self, random: &mut Pcg64) -> Self {
        let mut next = *self;
        match random.random_range(0..10) {
            0 => next.key = Some(random.random()),
            1 | 2 => next.ceiling += 64,
            _ => {
                for _ in 0..random.random_range(1..12) {
                    let key = Key::ALL[random.random_range(0..Key::ALL.len())];
                    let about = key.about();
                    let value = random.random_range(about.least..=about.most);
                    let with = next.values.with(&[(key.number(), value)], BUILD);
                    next.values = with.unwrap_or(next.values);
                }
            }
        }
        next
    }

    /// Writes what differs from `before`; whether the store says that it is done.
    fn write(&self, before: &Self, store: &mut Store<Flash>) -> bool {
        if self.key != before.key {
            return store.write_device_key(&self.key.unwrap()).is_ok();
        }
        if self.ceiling != before.ceiling {
            return store.write_ceiling(self.ceiling).is_ok();
        }
        store.write_settings(&self.values).is_ok()
    }
}

/// Reads after a cut: the old or the new, and the new if the store said so.
fn after_cut(flash: &Flash, old: &Kept, new: &Kept, done: bool) -> Kept {
    flash.cut_after(None);
    let found = Kept::read(&mut open(flash).unwrap());
    assert!(
        found == *new || (!done && found == *old),
        "{found:?}\n{old:?}\n{new:?}"
    );
    found
}

#[test]
fn every_step_of_a_run_of_writes() {
    // How many steps the run has: several fillings of both pages.
    const WRITES: usize = 48;
    let play = |flash: &Flash, cut: Option<u32>| {
        flash.cut_after(cut);
        let mut random = Pcg64::seed_from_u64(5);
        let mut kept = Kept::NOTHING;
        let mut store = open(flash).ok();
        for _ in 0..WRITES {
            let next = kept.next(&mut random);
            let done = store.as_mut().is_some_and(|store| next.write(&kept, store));
            if !done {
                return Some((kept, next));
            }
            kept = next;
        }
        None
    };
    let whole = Flash::new(0);
    assert_eq!(play(&whole, None), None);
    let (steps, erasures) = {
        let cells = whole.0.borrow();
        (cells.steps, cells.erasures)
    };
    assert!(erasures >= 3, "{erasures}");
    let (mut old, mut new) = (0, 0);
    for cut in 1..steps {
        for seed in 0..24 {
            let flash = Flash::new(seed);
            let (before, after) = play(&flash, Some(cut)).unwrap();
            let found = after_cut(&flash, &before, &after, false);
            old += u32::from(found == before);
            new += u32::from(found == after);
            // The charger goes on: what is written next is kept.
            let mut random = Pcg64::seed_from_u64(seed);
            let mut store = open(&flash).unwrap();
            let mut kept = found;
            for _ in 0..8 {
                let next = kept.next(&mut random);
                assert!(next.write(&kept, &mut store));
                kept = next;
            }
            assert_eq!(Kept::read(&mut open(&flash).unwrap()), kept);
            assert!(flash.outside().iter().all(|byte| *byte == 0xFF));
        }
    }
    println!("{steps} steps, {erasures} erasures, 24 ways to tear each: {old} old, {new} new");
    assert!(old > 0 && new > 0);
}

/// Cuts the supply while the last cut is being repaired; how often it was.
fn cut_repairs(flash: &Flash, random: &mut Pcg64) -> u32 {
    let mut cut = 0;
    while random.random_range(0..3) > 0 {
        flash.cut_after(Some(random.random_range(1..40)));
        if let Ok(mut store) = open(flash) {
            // Reading repairs too.
            let _ = (store.settings(), store.device_key(), store.ceiling());
        }
        cut += u32::from(flash.0.borrow().left == Some(0));
    }
    cut
}

/// Cuts at random, also while a cut is being repaired; how many of each.
fn random_cuts(seed: u64, cuts: u32) -> (u32, u32) {
    let flash = Flash::new(seed);
    let mut random = Pcg64::seed_from_u64(seed ^ 0x5EED);
    let mut kept = Kept::NOTHING;
    let (mut tried, mut in_repair) = (0, 0);
    while tried < cuts {
        let mut store = open(&flash).unwrap();
        flash.cut_after(Some(random.random_range(1..150)));
        loop {
            let next = kept.next(&mut random);
            let done = next.write(&kept, &mut store);
            if !done || flash.0.borrow().left == Some(0) {
                tried += 1;
                in_repair += cut_repairs(&flash, &mut random);
                kept = after_cut(&flash, &kept, &next, done);
                break;
            }
            kept = next;
        }
    }
    (tried, in_repair)
}

#[test]
fn cuts_at_random() {
    let (mut tried, mut in_repair) = (0, 0);
    for seed in 0..100 {
        let (cuts, repairs) = random_cuts(seed, 1_000);
        tried += cuts;
        in_repair += repairs;
    }
    println!("{tried} cuts, and {in_repair} more while the last one was repaired");
    assert!(in_repair > 0);
}

#[test]
fn a_range_that_does_not_suit_is_refused() {
    let backwards = core::ops::Range {
        start: 2048,
        end: 1024,
    };
    for range in [0..1024, 0..1536, 512..2560, 4096..6144, backwards] {
        let found = Store::open(Flash::new(1), range.clone(), BUILD).err();
        let layout = settings::flash::FlashError::Layout;
        assert_eq!(
            found,
            Some(settings::store::StoreError::Flash(layout)),
            "{range:?}"
        );
    }
}

#[test]
fn a_flash_full_of_something_else_offers_nothing_or_is_new() {
    let mut random = Pcg64::seed_from_u64(3);
    for _ in 0..2_000 {
        let flash = Flash::new(2);
        for byte in &mut flash.0.borrow_mut().bytes[PAGE..PAGE * (PAGES + 1)] {
            *byte = random.random();
        }
        let Ok(mut store) = open(&flash) else {
            continue;
        };
        let loaded = store.settings();
        match loaded.origin {
            Origin::Default => assert_eq!(loaded.values, Values::DEFAULT),
            Origin::Stored => panic!("noise was taken for settings"),
            Origin::Unreadable(_) => assert_eq!(loaded.values, Values::nothing_known(BUILD)),
        }
    }
}
