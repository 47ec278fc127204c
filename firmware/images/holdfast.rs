//! The product's image: the loop of [`firmware::board`] on a board, with a meter and an output.
//!
//! This file is the list of boards and outputs that a build can choose from, by cargo feature. The
//! list of meters is [`firmware::frequency`].
#![no_std]
#![no_main]

#[cfg(feature = "log")]
use defmt_rtt as _;

use core::cell::UnsafeCell;

use cortex_m_rt::entry;
use firmware::board::{Parts, Runner};
use firmware::charger::MeterFacts;
use firmware::frequency::meter;
use firmware::retained::Care;
use product::desk::{CONTAINER_MAX, Desk, judge};
use service::device::Device;
use settings::config::{Board, Judged};
use settings::store::{Store, StoreError};
use settings::values::Build;
use update::class::DeviceClass;
use update::key::PublicKey;
use update::slots::Slots;

#[path = "boards/stm32f405.rs"]
mod board;

#[cfg_attr(feature = "bidirectional", path = "holdfast/power_line.rs")]
#[cfg_attr(not(feature = "bidirectional"), path = "holdfast/pilot.rs")]
mod output;
#[path = "table_region.rs"]
mod table_region;

/// The table, byte for byte at the start of its flash sector; empty if the build found none.
#[unsafe(link_section = ".holdfast_table")]
#[used]
static TABLE: [u8; include_bytes!(concat!(env!("OUT_DIR"), "/table.bin")).len()] =
    *include_bytes!(concat!(env!("OUT_DIR"), "/table.bin"));

/// Who this build is and whom it trusts: `BUILD` and `TRUSTED`, by the build script.
mod built {
    include!(concat!(env!("OUT_DIR"), "/built.rs"));
}

/// The private half of the key of experiments is known to everybody, so a build that trusts it says
/// so in its name, and a key file with it is refused.
const _: () = {
    let (trusted, known) = (built::TRUSTED.0, PublicKey::DEVELOPMENT.0);
    let mut at = 0;
    while at < known.len() && trusted[at] == known[at] {
        at += 1;
    }
    let name = built::BUILD.as_bytes();
    let told = matches!(name, [.., b'd', b'e', b'v', b'-', b'k', b'e', b'y']);
    assert!(
        at < known.len() || told,
        "HOLDFAST_TRUST names the key of experiments: leave it out for an experiment"
    );
};

/// What the settings of this image must say.
const BUILD: Build = Build {
    direction: output::DIRECTION,
    meter: cfg!(feature = "ade7953") as u8,
};
/// The class of this product's tables.
const CLASS: DeviceClass =
    DeviceClass::reference(cfg!(feature = "bidirectional"), cfg!(feature = "ade7953"));

/// Where containers are collected before they are verified.
struct Collected(UnsafeCell<[u8; CONTAINER_MAX]>);

// SAFETY: `charge` alone takes it, once, and there is one thread.
unsafe impl Sync for Collected {}

static COLLECTED: Collected = Collected(UnsafeCell::new([0; CONTAINER_MAX]));

#[entry]
fn main() -> ! {
    let _ = charge();
    // The board did not start, or is to start again: the watchdog ends this, if it runs.
    loop {
        cortex_m::asm::wfi();
    }
}

/// Charges until a start is ordered, or as long as all parts of the board start.
fn charge() -> Option<()> {
    let mut started = board::start()?;
    let (settings_flash, slot_flash) = started.places;
    let store = match started.care {
        Care::None => Store::open(settings_flash, board::flash::SETTINGS, BUILD),
        Care::Guarded | Care::Deaf => Err(StoreError::NotOpened),
    };
    // Without a memory nobody knows what the cable bears: nothing is offered.
    let device = Device::opened(store, BUILD);
    let values = *device.in_force();
    let device = (started.care != Care::Deaf).then_some(device);
    let source = Judged::new(meter::on(&mut started.hardware)?, &values);
    let slots = if started.care == Care::None {
        let judge = judge(built::TRUSTED, CLASS, &values, MeterFacts::of(&source));
        Some(Slots::start(slot_flash, board::flash::SLOTS?, judge))
    } else {
        None
    };
    let table = slots.as_ref().and_then(Slots::running).map_or_else(
        || firmware::flash::image(table_region::bytes()),
        |running| board::flash::table(running.table.clone()),
    );
    let parts = Parts {
        source,
        dispatch: output::on(&mut started.hardware, started.serial, &values)?,
        board: started.board,
        watchdog: started.watchdog,
        cause: started.cause,
    };
    let config = values.charger(&Board {
        serial: started.serial,
        starts: started.starts,
        faults: started.faults,
    });
    let mut runner = Runner::new(parts, table, config);
    // SAFETY: this function runs once, so nobody else has the buffer.
    let collected = unsafe { &mut *COLLECTED.0.get() };
    let mut desk = Desk::new(
        device,
        slots,
        runner.table(),
        collected,
        built::BUILD,
        started.serial,
    );
    runner.run_with(&mut desk);
    Some(())
}
