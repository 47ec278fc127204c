//! Any signed container, and any slots: refused, or a table that the charger can run.
//!
//! Not in the list of `lib.rs`: it needs the package `update`, which depends on the firmware.

use firmware::charger::reference::products;
use firmware::table::TableView;
use update::class::DeviceClass;
use update::container::{Container, HEADER_LEN, SIGNATURE_LEN};
use update::device::Device;
use update::key::Verify;
use update::layout::Layout;
use update::mapped::MemoryFlash;
use update::slots::Slots;

/// Believes every signature, so that what is behind it is reached.
#[derive(Debug, Clone, Copy)]
struct Anybody;

impl Verify for Anybody {
    fn verifies(&self, _: &[u8], _: &[u8; SIGNATURE_LEN]) -> bool {
        true
    }
}

/// Bytes of a slot.
const SLOT_LEN: usize = 8 * 1024;

/// Reads the bytes as a container, as slots, and as a container in parts; whether they were a
/// container.
pub fn run(bytes: &[u8]) -> bool {
    let [_, product, ..] = products();
    let device = Device {
        trusted: Anybody,
        class: DeviceClass::reference(true, false),
        installation: product.installation,
        meter: product.meter,
        filter_ticks: 1,
    };
    let Some(layout) = Layout::new(0, SLOT_LEN as u32, SLOT_LEN as u32) else {
        return false;
    };
    // As slots: a flash that somebody else has written.
    let mut memory = vec![0xFF; 2 * SLOT_LEN];
    for (to, from) in memory.iter_mut().zip(bytes) {
        *to = *from;
    }
    check(&Slots::start(MemoryFlash(&mut memory), layout, device));
    // As a container, whole and in parts, for a charger without one.
    memory.fill(0xFF);
    let parsed = Container::parse(bytes);
    if let Ok(container) = &parsed {
        let stated = HEADER_LEN + container.table.len() + SIGNATURE_LEN;
        assert_eq!(stated, bytes.len());
    }
    let installed = Slots::start(MemoryFlash(&mut memory), layout, device).install(bytes, None);
    let after = Slots::start(MemoryFlash(&mut memory), layout, device);
    check(&after);
    assert_eq!(installed.is_ok(), after.running().is_some());
    let mut in_parts = vec![0xFF; 2 * SLOT_LEN];
    let mut slots = Slots::start(MemoryFlash(&mut in_parts), layout, device);
    let mut by_parts = || {
        slots
            .begin(bytes.first_chunk().ok_or(())?, None)
            .map_err(drop)?;
        for part in bytes[HEADER_LEN..].chunks(100) {
            slots.part(part).map_err(drop)?;
        }
        slots.finish().map_err(drop)
    };
    // Both ways give the same answer.
    assert_eq!(by_parts().is_ok(), installed.is_ok());
    parsed.is_ok()
}

/// What is in force is a table of this charger's.
fn check(slots: &Slots<MemoryFlash<'_>, Anybody>) {
    assert_eq!(slots.running().is_some(), slots.table().is_some());
    if let Some(table) = slots.table() {
        assert!(TableView::parse(table).is_ok());
    }
}
