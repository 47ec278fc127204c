//! A charger on a pseudo-terminal: the device's own code over flash in memory, with telemetry
//! between its answers. It measures and charges nothing.

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use firmware::charger::reference::products;
use firmware::telemetry::{self, Frame, TELEMETRY_VERSION, TableId, WireSetPoint};
use rustix::fs::{OFlags, fcntl_setfl};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use service::device::Device;
use service::facts::Facts;
use settings::store::Store;
use settings::testing::{Cells, Memory, RANGE, blank};
use settings::values::Build;
use update::class::DeviceClass;
use update::device::Device as Judge;
use update::key::PublicKey;
use update::layout::Layout;
use update::mapped::MemoryFlash;
use update::slots::Slots;
use update::wire::{Inbox, Reason, Said, read_step, write_said};

/// Its tick.
const TICK: Duration = Duration::from_millis(100);
/// Its serial number.
pub const SERIAL: u32 = 0x51_1E7;

/// A charger that runs until it is dropped.
#[derive(Debug)]
pub struct StandIn {
    path: PathBuf,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl StandIn {
    /// Starts one that was never set.
    ///
    /// # Errors
    /// There is no pseudo-terminal.
    pub fn start() -> io::Result<Self> {
        let line = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
        grantpt(&line)?;
        unlockpt(&line)?;
        let path = ptsname(&line, Vec::new())?;
        let path = PathBuf::from(path.to_string_lossy().into_owned());
        fcntl_setfl(&line, OFlags::NONBLOCK)?;
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let thread = std::thread::spawn(move || run(File::from(line), &stopped));
        Ok(Self {
            path,
            stop,
            thread: Some(thread),
        })
    }

    /// Where a program opens it.
    pub const fn path(&self) -> &PathBuf {
        &self.path
    }
}

impl Drop for StandIn {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // It has nothing to say.
            let _ = thread.join();
        }
    }
}

/// Bytes of a slot, and of the longest container that it takes.
const SLOT_LEN: usize = 4_096;
const CONTAINER_MAX: usize = 3_072;

struct Around<'m> {
    ticks: u32,
    now_ms: u32,
    inbox: Inbox<'m>,
    slots: Slots<MemoryFlash<'m>, PublicKey>,
}

impl Facts for Around<'_> {
    fn build(&self) -> &str {
        "stand-in"
    }

    fn serial(&self) -> u32 {
        SERIAL
    }

    fn table(&self) -> Option<TableId> {
        None
    }

    fn update(&mut self, sent: &[u8], answer: &mut [u8]) -> Option<usize> {
        let said = match read_step(sent) {
            Some(step) => self.inbox.step(&mut self.slots, &step, true),
            None => Said::Refused(Reason::MALFORMED),
        };
        write_said(&said, answer)
    }

    fn frame(&self) -> Option<Frame> {
        Some(Frame {
            version: TELEMETRY_VERSION,
            sequence: self.ticks,
            now_ms: self.now_ms,
            mode: 3,
            phase: 5,
            state: [0; 4],
            loss_kw: None,
            participation_ppm: 0,
            set_point: WireSetPoint::Paused,
            faults: 0x40,
            misfits: 0,
            table: None,
        })
    }
}

fn device(cells: &Cells) -> Option<Device<Memory<'_>>> {
    let store = Store::open(Memory(cells), RANGE, Build::REFERENCE);
    store.ok().map(Device::new)
}

fn run(mut line: File, stop: &AtomicBool) {
    let cells = blank();
    let Some(mut service) = device(&cells) else {
        return;
    };
    let (mut flash, mut collected) = (vec![0xFF; 2 * SLOT_LEN], vec![0; CONTAINER_MAX]);
    let Some(layout) = Layout::new(0, SLOT_LEN as u32, SLOT_LEN as u32) else {
        return;
    };
    let [product, ..] = products();
    let judge = Judge {
        trusted: PublicKey::DEVELOPMENT,
        class: DeviceClass::reference(false, false),
        installation: product.installation,
        meter: product.meter,
        filter_ticks: 1,
    };
    // Its slots know nothing of its starts: what was installed waits for ever.
    let mut around = Around {
        ticks: 0,
        now_ms: 0,
        inbox: Inbox::new(&mut collected),
        slots: Slots::start(MemoryFlash(&mut flash), layout, judge),
    };
    let mut next = Instant::now() + TICK;
    let mut bytes = [0; 256];
    while !stop.load(Ordering::Relaxed) {
        if Instant::now() >= next {
            next += TICK;
            around.ticks += 1;
            around.now_ms = around.now_ms.wrapping_add(100);
            service.tick(around.now_ms);
            if let Some(frame) = around.frame() {
                let mut buffer = [0; telemetry::FRAME_MAX];
                // A line that nobody reads is full after a while, as a real one's.
                let _ = line.write(telemetry::encode(&frame, &mut buffer));
            }
        }
        // Nothing there, or nobody has opened the other end yet.
        let length = line.read(&mut bytes).unwrap_or(0);
        for byte in bytes.get(..length).unwrap_or_default() {
            service.take(*byte, around.now_ms, &mut around);
            let mut answer = Vec::new();
            while let Some(byte) = service.to_send() {
                answer.push(byte);
                service.sent();
            }
            let _ = line.write_all(&answer);
        }
        if service.restarts() {
            let Some(again) = device(&cells) else {
                return;
            };
            service = again;
            (around.ticks, around.now_ms) = (0, 0);
        }
        if length == 0 {
            std::thread::sleep(Duration::from_millis(2));
        }
    }
}
