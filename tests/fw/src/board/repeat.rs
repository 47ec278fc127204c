//! A run of an image, repeated on the host: the library's loop is told what the image was told, and
//! must ask for the same in the same order and send the same bytes.

use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;

use embedded_hal::digital::{ErrorType as PinError, OutputPin};
use embedded_hal::pwm::{ErrorType as PwmError, SetDutyCycle};
use firmware::board::{Board, Parts, Runner};
use firmware::charger::{MeterFacts, Watchdog, reference};
use firmware::dispatch::Dispatch;
use firmware::dispatch::car::{CarSense, CarState};
use firmware::fault::{Faults, ResetCause};
use firmware::frequency::captures::Captures;
use firmware::frequency::zero_crossing::Captured;
use firmware::table::Direction;
use product::desk::{CONTAINER_MAX, Desk, judge};
use product::output;
use service::device::Device;
use settings::config::{Board as Chip, Judged, Limited};
use settings::orders::Ordered;
use settings::store::Store;
use settings::testing::{Memory, RANGE, blank};
use settings::values::{Build, Values};
use update::class::DeviceClass;
use update::key::PublicKey;
use update::layout::Layout;
use update::mapped::MemoryFlash;
use update::slots::Slots;

/// Bytes of a chip's UID.
const UID_LEN: usize = 12;
/// Bytes of the name of the build.
const BUILD_LEN: usize = 32;
/// Bytes of a slot on the board.
const SLOT_LEN: usize = 16 * 1024;
/// Bytes of the board's ring of what came.
const RING_LEN: usize = 512;
/// Bytes of an item: its kind and a word.
const ITEM_LEN: usize = 5;
/// Conversions of the pilot in one measurement of the reference board.
const PILOT_SAMPLES: usize = 320;
/// Steps of the pilot's timer.
const PWM_STEPS: u16 = 42_000;

/// How much was equal.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Done {
    /// Bytes of telemetry.
    pub bytes: usize,
    /// Turns of the loop.
    pub turns: usize,
}

/// What an image asked and was told, in order.
///
/// | kind | register | asked by |
/// |---|---|---|
/// | T | counter of the loop's timer | the loop |
/// | S | status of the captures' timer | whether a capture was lost; whether there is one |
/// | C | the capture | |
/// | A | the converter's result | the measurement of the pilot |
/// | D | items left of the receiver's DMA; above 16 bits the byte that is read next | the loop |
/// | U | status of the serial line | whether it takes a byte |
/// | B | the byte sent | |
#[derive(Debug, Default)]
struct Items {
    items: Vec<(u8, u32)>,
    at: usize,
    bytes: usize,
    wrong: Option<String>,
}

type Tape = Rc<RefCell<Items>>;

/// The next item, which must be of this kind; 0 from the end or the first difference on.
fn next(tape: &Tape, kind: u8) -> u32 {
    let mut tape = tape.borrow_mut();
    let at = tape.at;
    let Some(&(found, word)) = tape.items.get(at) else {
        return 0;
    };
    tape.at += 1;
    if found == kind {
        return word;
    }
    differ(
        &mut tape,
        format!(
            "asked for {}, the image for {}",
            kind as char, found as char
        ),
    );
    0
}

fn differ(tape: &mut Items, what: String) {
    let at = tape.at;
    tape.wrong.get_or_insert(format!("item {at}: {what}"));
    tape.at = tape.items.len();
}

struct Lines {
    tape: Tape,
    /// Place of the next byte in the ring.
    next: usize,
}

impl Board for Lines {
    fn now_us(&mut self) -> u32 {
        next(&self.tape, b'T')
    }

    fn receive(&mut self) -> Option<u8> {
        let word = next(&self.tape, b'D') as usize;
        let filled = RING_LEN.saturating_sub(word & 0xFFFF) % RING_LEN;
        if word == 0 || self.next == filled {
            return None;
        }
        self.next = (self.next + 1) % RING_LEN;
        Some((word >> 16) as u8)
    }

    fn send(&mut self, byte: u8) -> bool {
        // Bit 7: the transmitter's register is empty.
        if next(&self.tape, b'U') & 1 << 7 == 0 {
            return false;
        }
        let sent = next(&self.tape, b'B');
        let mut tape = self.tape.borrow_mut();
        if tape.at < tape.items.len() {
            tape.bytes += 1;
            if sent != u32::from(byte) {
                differ(
                    &mut tape,
                    format!("sends {byte:#04x}, the image {sent:#04x}"),
                );
            }
        }
        true
    }
}

struct Stamps(Tape);

impl Captures for Stamps {
    const TIMER_HZ: u32 = reference::TIMER_HZ;
    const CLOCK_PPM: u16 = reference::CLOCK_PPM;
    const JITTER_NS: u32 = reference::JITTER_NS;

    fn take(&mut self) -> Option<u32> {
        (next(&self.0, b'S') & 1 << 1 != 0).then(|| next(&self.0, b'C'))
    }

    fn lost(&mut self) -> bool {
        next(&self.0, b'S') & 1 << 9 != 0
    }
}

struct Pilot(Tape);

impl CarSense for Pilot {
    fn state(&mut self) -> Option<CarState> {
        let highest = (0..PILOT_SAMPLES).map(|_| next(&self.0, b'A')).max()?;
        // 3.3 V are 4096; 1.65 V on the pin are 0 V on the pilot, and a volt on the pin is eight.
        let pin_mv = (highest * 3_300) >> 12;
        Some(CarState::of_level((pin_mv.cast_signed() - 1_650) * 8))
    }
}

struct Coil;

impl PinError for Coil {
    type Error = Infallible;
}

impl OutputPin for Coil {
    fn set_low(&mut self) -> Result<(), Infallible> {
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

struct Line;

impl PwmError for Line {
    type Error = Infallible;
}

impl SetDutyCycle for Line {
    fn max_duty_cycle(&self) -> u16 {
        PWM_STEPS
    }

    fn set_duty_cycle(&mut self, _duty: u16) -> Result<(), Infallible> {
        Ok(())
    }
}

struct Dog;

impl Watchdog for Dog {
    fn feed(&mut self) {}
}

/// The serial number that the reference board makes of a UID: places on the wafer (16 bits each),
/// wafer, and seven letters of the lot.
fn serial_of(uid: &[u8; UID_LEN]) -> u32 {
    let [x0, x1, y0, y1, wafer, lot @ ..] = *uid;
    let lot = lot.iter().fold(0u32, |number, byte| {
        number.wrapping_mul(31).wrapping_add(u32::from(*byte))
    });
    let (x, y) = (u16::from_le_bytes([x0, x1]), u16::from_le_bytes([y0, y1]));
    let die = (u32::from(x) << 16) ^ u32::from(y);
    lot.wrapping_mul(0x0100_0193) ^ die ^ (u32::from(wafer) << 8)
}

/// What the image was built for and as.
#[derive(Debug, Clone, Copy)]
struct Image {
    build: Build,
    name: &'static str,
    serial: u32,
}

impl Image {
    fn class(&self) -> DeviceClass {
        let bidirectional = self.build.direction == Direction::Bidirectional;
        DeviceClass::reference(bidirectional, self.build.meter == 1)
    }
}

/// Repeats a run from power-on on, of a charger whose flash was never written.
///
/// # Errors
/// The first difference, or why the tape is none.
pub fn repeat(tape: &[u8], table: &[u8], bidirectional: bool) -> Result<Done, String> {
    let Some((uid, rest)) = tape.split_first_chunk::<UID_LEN>() else {
        return Err("the tape has no UID".to_owned());
    };
    let Some((name, items)) = rest.split_first_chunk::<BUILD_LEN>() else {
        return Err("the tape has no build".to_owned());
    };
    if items.len() < ITEM_LEN || !items.len().is_multiple_of(ITEM_LEN) {
        return Err("the tape has no whole number of items".to_owned());
    }
    let items = items.chunks_exact(ITEM_LEN).map(|item| {
        let word = [item[1], item[2], item[3], item[4]];
        (item[0], u32::from_le_bytes(word))
    });
    let shared: Tape = Rc::new(RefCell::new(Items {
        items: items.collect(),
        ..Items::default()
    }));
    let name = String::from_utf8_lossy(name);
    let image = Image {
        build: Build {
            direction: if bidirectional {
                Direction::Bidirectional
            } else {
                Direction::Unidirectional
            },
            meter: 0,
        },
        // For the rest of a program that repeats some runs and ends.
        name: Box::leak(name.trim_end_matches('\0').into()),
        serial: serial_of(uid),
    };
    let values = Values::defaults(image.build);
    let turns = if bidirectional {
        play(&shared, output::power_line(Line, &values), table, image)
    } else {
        let car = Pilot(shared.clone());
        let charger = output::pilot(Line, Coil, car, image.serial, &values);
        play(&shared, charger, table, image)
    }?;
    let tape = shared.borrow();
    match &tape.wrong {
        Some(wrong) => Err(wrong.clone()),
        None => Ok(Done {
            bytes: tape.bytes,
            turns,
        }),
    }
}

/// Goes round until the tape is at its end; how often.
fn play<D: Dispatch + Limited>(
    tape: &Tape,
    dispatch: Ordered<D>,
    table: &[u8],
    image: Image,
) -> Result<usize, String> {
    let cells = blank();
    let store = Store::open(Memory(&cells), RANGE, image.build);
    let device = Device::new(store.map_err(|error| format!("{error:?}"))?);
    let values = *device.in_force();
    let source = Captured::new(Stamps(tape.clone())).map_err(|error| format!("{error:?}"))?;
    let source = Judged::new(source, &values);
    let mut flash = vec![0xFF; 2 * SLOT_LEN];
    let layout = Layout::new(0, SLOT_LEN as u32, SLOT_LEN as u32);
    let layout = layout.ok_or("the slots cannot be")?;
    let meter = MeterFacts::of(&source);
    let judge = judge(PublicKey::DEVELOPMENT, image.class(), &values, meter);
    let slots = Slots::start(MemoryFlash(&mut flash), layout, judge);
    let parts = Parts {
        board: Lines {
            tape: tape.clone(),
            next: 0,
        },
        source,
        dispatch,
        watchdog: Dog,
        cause: ResetCause::PowerOn,
    };
    let config = values.charger(&Chip {
        serial: image.serial,
        starts: 0,
        faults: Faults::NONE,
    });
    let mut runner = Runner::new(parts, table, config);
    let mut collected = [0; CONTAINER_MAX];
    let mut desk = Desk::new(
        Some(device),
        Some(slots),
        runner.table(),
        &mut collected,
        image.name,
        image.serial,
    );
    let mut turns = 0;
    let left = |tape: &Tape| {
        let tape = tape.borrow();
        tape.at < tape.items.len()
    };
    while left(tape) {
        runner.turn_with(&mut desk);
        turns += 1;
    }
    Ok(turns)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]
mod tests {
    use super::*;

    /// A tape of turns 1 ms apart, in which nothing is captured and the line is never free.
    fn silent(turns: u32) -> Vec<u8> {
        let mut tape = vec![0; UID_LEN + BUILD_LEN];
        let mut put = |kind: u8, word: u32| {
            tape.push(kind);
            tape.extend(word.to_le_bytes());
        };
        for n in 1..=turns {
            put(b'T', 1_000 * n);
            put(b'S', 0);
            put(b'S', 0);
            put(b'D', RING_LEN as u32);
            // From the first tick on there is a frame to send.
            if n >= 100 {
                put(b'U', 0);
            }
        }
        tape
    }

    #[test]
    fn a_run_by_hand_is_repeated() {
        let done = repeat(&silent(150), &[], false).unwrap();
        assert_eq!(
            done,
            Done {
                bytes: 0,
                turns: 150
            }
        );
    }

    #[test]
    fn another_order_and_another_byte_are_named() {
        let mut tape = silent(99);
        tape[UID_LEN + BUILD_LEN] = b'S';
        let wrong = repeat(&tape, &[], false).unwrap_err();
        assert_eq!(wrong, "item 1: asked for T, the image for S");
        // A frame that begins with no code of COBS.
        let mut tape = silent(100);
        let at = tape.len() - 4;
        tape[at] = 0x80;
        tape.extend([b'B', 0, 0, 0, 0, b'T', 0, 0, 0, 0]);
        let wrong = repeat(&tape, &[], false).unwrap_err();
        assert!(wrong.contains("the image 0x00"), "{wrong}");
    }
}
