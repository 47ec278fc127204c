//! The product's image: the loop of [`firmware::board`] on a board, with a meter and an output.
//!
//! This file is the list of boards and outputs that a build can choose from, by cargo feature. The
//! list of meters is [`firmware::frequency`].
#![no_std]
#![no_main]

#[cfg(feature = "log")]
use defmt_rtt as _;

use cortex_m_rt::entry;
use firmware::board::{Parts, Runner};
use firmware::charger::{ChargerConfig, StartDelay};
use firmware::flash;
use firmware::frequency::meter;
use firmware::response::LevelOffset;

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

#[entry]
fn main() -> ! {
    let _ = charge();
    // The board did not start: the watchdog ends this, if it runs.
    loop {
        cortex_m::asm::wfi();
    }
}

/// Charges for ever; comes back only if a part of the board does not start.
fn charge() -> Option<()> {
    let mut started = board::start()?;
    let parts = Parts {
        source: meter::on(&mut started.hardware)?,
        dispatch: output::on(&mut started.hardware, started.serial)?,
        board: started.board,
        watchdog: started.watchdog,
        cause: started.cause,
    };
    let table = flash::image(table_region::bytes());
    let config = ChargerConfig {
        level_offset: LevelOffset::of_serial(started.serial),
        start_delay: StartDelay::street(started.serial).after_starts(started.starts),
        standing_faults: started.faults,
        installation: Some(output::INSTALLATION),
        ..ChargerConfig::DEFAULT
    };
    Runner::new(parts, table, config).run()
}
