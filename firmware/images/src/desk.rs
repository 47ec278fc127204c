//! The service link beside the charger: it answers, has orders in force at the next tick, takes
//! tables, and says who the charger is.
//!
//! # When the processor stands still
//! Flash of one bank stops the processor while it is erased, and so the loop: no tick, no look at
//! the car. Outputs stay as they are, for timers and pins go on. So
//!
//! - what writes settings or keys, and a table, waits until the charger rests ([`rests`]: nothing
//!   is given to the grid, and nothing is held or released) and offers nothing ([`is_idle`]);
//! - a block of challenges, written once in 64 of them, waits for rest alone. One of about forty
//!   such writes erases a sector: then a car is not looked at for half a second.
//!
//! # What goes wrong
//! Nothing here is in the way of a tick: it sets limits before one, and takes what is left of its
//! time after. Without a memory that can be opened nothing is offered, and no order is taken: the
//! charger says who and how it is.
//!
//! # Guarded
//! After starts that did not come to a run ([`firmware::retained`]) there is neither memory nor
//! slot, and after more of them no service: what comes on the line is let go by. Such a run ends by
//! itself after [`GUARDED_MS`], so that the next start tries everything again.

use embedded_storage::nor_flash::MultiwriteNorFlash;
use firmware::board::Attendant;
use firmware::charger::{MeterFacts, Report};
use firmware::dispatch::{Dispatch, SetPoint};
use firmware::fault::Mode;
use firmware::telemetry::{Frame, TableId};
use service::device::Device;
use service::facts::Facts;
use settings::config::Limited;
use settings::orders::Ordered;
use settings::values::Values;
use update::class::DeviceClass;
use update::key::Verify;
use update::mapped::Mapped;
use update::slots::Slots;
use update::trial::Trial;
use update::wire::{Inbox, Reason, Said, read_step, write_said};

/// Ticks between two times that a charger says by itself who it is: a minute at 100 ms.
pub const INTRODUCTION_TICKS: u16 = 600;
/// How long a guarded run lasts \[ms\]: ten minutes. The start after it tries everything: half a
/// second without a tick if it fails, once in ten minutes, and the contactor is open anyway. So a
/// cause that has gone needs nobody's help.
pub const GUARDED_MS: u32 = 600_000;
/// Longest container that is taken over the line: any table of a response, and the games' up to
/// 2,976 bytes. It is collected in memory before it is verified.
pub const CONTAINER_MAX: usize = 3_072;

/// Whether the charger can do without its processor for half a second: nothing is given to the
/// grid, and nothing is held or released.
pub fn rests(report: &Report) -> bool {
    let follows = !matches!(report.mode, Mode::Hold | Mode::Release);
    follows && report.participation.ppm() == 0
}

/// Whether it offers nothing: no car charges, and none is looked after.
pub const fn is_idle(report: &Report) -> bool {
    matches!(
        report.set_point,
        Some(SetPoint::Paused | SetPoint::Power { w: 0 })
    )
}

/// What the charger holds a container against.
pub fn judge<K: Verify>(
    trusted: K,
    class: DeviceClass,
    values: &Values,
    meter: MeterFacts,
) -> update::device::Device<K> {
    let filter = values.get(settings::key::Key::Filter);
    update::device::Device {
        trusted,
        class,
        installation: values.installation(),
        meter,
        filter_ticks: u8::try_from(filter).unwrap_or(u8::MAX),
    }
}

/// Who the charger is and how: what the service is told.
#[derive(Debug)]
struct Around<'b, G, K> {
    build: &'static str,
    serial: u32,
    table: Option<TableId>,
    frame: Option<Frame>,
    rests: bool,
    idle: bool,
    /// `None` in a guarded run.
    slots: Option<Slots<G, K>>,
    inbox: Inbox<'b>,
}

impl<G: Mapped, K: Verify> Facts for Around<'_, G, K> {
    fn build(&self) -> &str {
        self.build
    }

    fn serial(&self) -> u32 {
        self.serial
    }

    fn table(&self) -> Option<TableId> {
        self.table
    }

    fn frame(&self) -> Option<Frame> {
        self.frame
    }

    fn may_write(&self) -> bool {
        self.rests && self.idle
    }

    fn may_count(&self) -> bool {
        self.rests
    }

    fn update(&mut self, sent: &[u8], answer: &mut [u8]) -> Option<usize> {
        let may_stand_still = self.may_write();
        let slots = self.slots.as_mut()?;
        let said = match read_step(sent) {
            Some(step) => self.inbox.step(slots, &step, may_stand_still),
            None => Said::Refused(Reason::MALFORMED),
        };
        write_said(&said, answer)
    }
}

/// The service link of a charger.
#[derive(Debug)]
pub struct Desk<'b, F: MultiwriteNorFlash, G, K> {
    device: Option<Device<F>>,
    around: Around<'b, G, K>,
    trial: Trial,
    /// Ticks until the charger says who it is.
    introduction: u16,
    /// A guarded run has lasted for its time.
    is_over: bool,
}

impl<'b, F: MultiwriteNorFlash, G: Mapped, K: Verify> Desk<'b, F, G, K> {
    /// A desk of a charger before its first tick. `device` is the service; `None` lets go by what
    /// comes. Without `slots` the run is a guarded one. `table` is what the charger runs; `inbox`
    /// is where containers are collected.
    #[inline(never)]
    pub const fn new(
        device: Option<Device<F>>,
        slots: Option<Slots<G, K>>,
        table: Option<TableId>,
        inbox: &'b mut [u8],
        build: &'static str,
        serial: u32,
    ) -> Self {
        Self {
            device,
            around: Around {
                build,
                serial,
                table,
                frame: None,
                rests: false,
                idle: false,
                slots,
                inbox: Inbox::new(inbox),
            },
            trial: Trial::DEFAULT,
            introduction: 0,
            is_over: false,
        }
    }

    /// Keeps a table on trial once it has run well, and sees when a guarded run is over.
    fn watch_trial(&mut self, report: &Report) {
        let Some(slots) = &mut self.around.slots else {
            self.is_over = report.now_ms >= GUARDED_MS;
            return;
        };
        let running = slots.running();
        if running.is_some_and(|running| !running.confirmed) && self.trial.tick(report) {
            // Where the flash does not take it the table stays on trial, and runs well once more.
            let _ = slots.confirm();
            self.trial = Trial::DEFAULT;
        }
    }
}

impl<D, F, G, K> Attendant<Ordered<D>> for Desk<'_, F, G, K>
where
    D: Dispatch + Limited,
    F: MultiwriteNorFlash,
    G: Mapped,
    K: Verify,
{
    fn take(&mut self, byte: u8, now_ms: u32) {
        if let Some(device) = &mut self.device {
            device.take(byte, now_ms, &mut self.around);
        }
    }

    fn before(&mut self, dispatch: &mut Ordered<D>, now_ms: u32) {
        if let Some(device) = &mut self.device {
            device.tick(now_ms);
            dispatch.set(device.orders(), *device.in_force());
        }
    }

    fn after(&mut self, report: &Report, frame: &Frame) {
        self.around.frame = Some(*frame);
        self.around.rests = rests(report);
        self.around.idle = is_idle(report);
        self.watch_trial(report);
        let Some(device) = &mut self.device else {
            return;
        };
        if self.around.rests {
            device.look_ahead();
        }
        if self.introduction > 0 {
            self.introduction -= 1;
        } else if device.introduce(&self.around) {
            self.introduction = INTRODUCTION_TICKS;
        }
    }

    fn to_send(&self) -> Option<u8> {
        self.device.as_ref()?.to_send()
    }

    fn sent(&mut self) {
        if let Some(device) = &mut self.device {
            device.sent();
        }
    }

    fn ends(&self) -> bool {
        self.is_over || self.device.as_ref().is_some_and(Device::restarts)
    }
}
