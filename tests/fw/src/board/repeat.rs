//! A run of an image, repeated on the host: the library's loop is told what the image was told, and
//! must ask for the same in the same order and send the same bytes.

use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;

use embedded_hal::digital::{ErrorType as PinError, OutputPin};
use embedded_hal::pwm::{ErrorType as PwmError, SetDutyCycle};
use firmware::board::{Board, Parts, Runner};
use firmware::charger::{ChargerConfig, Installation, StartDelay, Watchdog, reference};
use firmware::dispatch::bidirectional::Bidirectional;
use firmware::dispatch::car::{CarSense, CarState};
use firmware::dispatch::contactor::ContactorTimes;
use firmware::dispatch::fleet::Threshold;
use firmware::dispatch::power_line::PowerLine;
use firmware::dispatch::unidirectional::Unidirectional;
use firmware::dispatch::{Dispatch, Limits};
use firmware::fault::ResetCause;
use firmware::frequency::zero_crossing::{Captured, Captures};
use firmware::response::LevelOffset;

/// Bytes of a chip's UID.
const UID_LEN: usize = 12;
/// Bytes of an item: its kind and a word.
const ITEM_LEN: usize = 5;
/// Conversions of the pilot in one measurement of the reference board.
const PILOT_SAMPLES: usize = 320;
/// Steps of the pilot's timer.
const PWM_STEPS: u16 = 42_000;
/// Current of the reference charger \[mA\], and power of the reference power stage \[W\].
const CABLE_MA: u32 = 32_000;
const SPAN_W: u32 = 28_000;

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

struct Lines(Tape);

impl Board for Lines {
    fn now_us(&mut self) -> u32 {
        next(&self.0, b'T')
    }

    fn send(&mut self, byte: u8) -> bool {
        // Bit 7: the transmitter's register is empty.
        if next(&self.0, b'U') & 1 << 7 == 0 {
            return false;
        }
        let sent = next(&self.0, b'B');
        let mut tape = self.0.borrow_mut();
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

/// Repeats a run from power-on on.
///
/// # Errors
/// The first difference, or why the tape is none.
pub fn repeat(tape: &[u8], table: &[u8], bidirectional: bool) -> Result<Done, String> {
    let Some((uid, items)) = tape.split_first_chunk::<UID_LEN>() else {
        return Err("the tape has no UID".to_owned());
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
    let serial = serial_of(uid);
    let installation = if bidirectional {
        Installation::REFERENCE_BIDIRECTIONAL
    } else {
        Installation::REFERENCE_UNIDIRECTIONAL
    };
    let config = ChargerConfig {
        level_offset: LevelOffset::of_serial(serial),
        start_delay: StartDelay::street(serial).after_starts(0),
        installation: Some(installation),
        ..ChargerConfig::DEFAULT
    };
    let turns = if bidirectional {
        let limits = Limits::all(SPAN_W);
        let stage = PowerLine::new(Line, SPAN_W);
        play(
            &shared,
            Bidirectional::new(stage, limits, limits),
            table,
            config,
        )
    } else {
        let charger = Unidirectional::new(
            Line,
            Coil,
            ContactorTimes::DEFAULT,
            Threshold::of_serial(serial),
            Limits::all(CABLE_MA),
        );
        play(
            &shared,
            charger.with_car(Pilot(shared.clone())),
            table,
            config,
        )
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
fn play<D: Dispatch>(
    tape: &Tape,
    dispatch: D,
    table: &[u8],
    config: ChargerConfig,
) -> Result<usize, String> {
    let source = Captured::new(Stamps(tape.clone())).map_err(|error| format!("{error:?}"))?;
    let parts = Parts {
        board: Lines(tape.clone()),
        source,
        dispatch,
        watchdog: Dog,
        cause: ResetCause::PowerOn,
    };
    let mut runner = Runner::new(parts, table, config);
    let mut turns = 0;
    let left = |tape: &Tape| {
        let tape = tape.borrow();
        tape.at < tape.items.len()
    };
    while left(tape) {
        runner.turn();
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
        let mut tape = vec![0; UID_LEN];
        let mut put = |kind: u8, word: u32| {
            tape.push(kind);
            tape.extend(word.to_le_bytes());
        };
        for n in 1..=turns {
            put(b'T', 1_000 * n);
            put(b'S', 0);
            put(b'S', 0);
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
        tape[UID_LEN] = b'S';
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
