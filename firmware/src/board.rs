//! A charger on its board: what a board must offer, and the loop that is the same on every board.
//!
//! One loop, no interrupts. It comes round far more often than the mains crosses zero. It ticks the
//! charger when a tick is due. In between it sends telemetry, one byte at a time, so that a slow
//! line never delays a tick. An [`Attendant`] shares loop and line: a service link, for one.

use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;
use embedded_hal::spi::SpiDevice;

use crate::charger::{Charger, ChargerConfig, Report, Watchdog};
use crate::dispatch::Dispatch;
use crate::dispatch::car::CarSense;
use crate::fault::ResetCause;
use crate::frequency::FrequencySource;
use crate::frequency::captures::Captures;
use crate::telemetry::{FRAME_MAX, Frame, TableId, encode};

/// What the loop asks of a board.
///
/// The implementation must not block: every call returns within microseconds.
pub trait Board {
    /// Microseconds by a counter that wraps at 2^32.
    fn now_us(&mut self) -> u32;

    /// Gives a byte to the telemetry line; `false` if the line does not take one now.
    fn send(&mut self, byte: u8) -> bool;

    /// The next byte that came on the telemetry line, if one did; for a board that keeps what comes
    /// while the loop is elsewhere.
    fn receive(&mut self) -> Option<u8> {
        None
    }
}

/// Whoever shares the loop and the telemetry line with a charger that is driven by `D`.
///
/// Whatever it does takes its time from the charger: a call returns within a fraction of a tick,
/// unless the implementation says when it takes longer and why the charger can bear it.
pub trait Attendant<D> {
    /// A byte has come.
    fn take(&mut self, byte: u8, now_ms: u32);

    /// A tick is about to be made: what is to be in force in it is set.
    fn before(&mut self, dispatch: &mut D, now_ms: u32);

    /// The tick was made.
    fn after(&mut self, report: &Report, frame: &Frame);

    /// The next byte of a frame of its own. A frame is sent without a break, between two of the
    /// charger's.
    fn to_send(&self) -> Option<u8>;

    /// The byte went out.
    fn sent(&mut self);

    /// Whether the loop is to end. Then the watchdog is fed no longer.
    fn ends(&self) -> bool {
        false
    }
}

/// Nobody shares the loop.
#[derive(Debug, Clone, Copy)]
pub struct Alone;

impl<D> Attendant<D> for Alone {
    fn take(&mut self, _byte: u8, _now_ms: u32) {}

    fn before(&mut self, _dispatch: &mut D, _now_ms: u32) {}

    fn after(&mut self, _report: &Report, _frame: &Frame) {}

    fn to_send(&self) -> Option<u8> {
        None
    }

    fn sent(&mut self) {}
}

/// Level of a line that nothing was set on yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rest {
    /// Low all the time.
    Low,
    /// High all the time.
    High,
}

/// The hardware that a board offers to whatever measures the mains and drives the car.
///
/// A build uses some of it. Each piece is set up when it is taken, and can be taken once: the
/// second time, and on a board without it, the answer is `None`.
pub trait Hardware {
    /// A metering chip's bus, which owns the chip select.
    type Spi: SpiDevice;
    /// Captures of zero crossings.
    type Captures: Captures;
    /// A line of [`crate::dispatch::pilot::PILOT_HZ`]: control pilot or power set-point.
    type Pwm: SetDutyCycle;
    /// The contactor's coil, open when taken.
    type Coil: OutputPin;
    /// What measures the pilot.
    type Car: CarSense;

    /// The bus in mode 3, at 1 MHz or less.
    fn spi(&mut self) -> Option<Self::Spi>;

    /// The captures.
    fn captures(&mut self) -> Option<Self::Captures>;

    /// The line, at rest until a duty is set.
    fn pwm(&mut self, rest: Rest) -> Option<Self::Pwm>;

    /// The coil.
    fn coil(&mut self) -> Option<Self::Coil>;

    /// What measures the pilot.
    fn car(&mut self) -> Option<Self::Car>;
}

/// What a charger is made of, on a board that has started.
#[derive(Debug)]
pub struct Parts<B, S, D, W> {
    /// Time and telemetry.
    pub board: B,
    /// What measures the mains.
    pub source: S,
    /// What drives the car or the power stage.
    pub dispatch: D,
    /// The watchdog, running.
    pub watchdog: W,
    /// Why the controller started.
    pub cause: ResetCause,
}

/// Milliseconds from a microsecond counter that wraps.
#[derive(Debug, Clone, Copy, Default)]
struct Milliseconds {
    last_us: u32,
    rest_us: u32,
    ms: u32,
}

impl Milliseconds {
    /// The time now; to be asked at least once while the counter goes round (71 minutes).
    fn at(&mut self, now_us: u32) -> u32 {
        self.rest_us = self
            .rest_us
            .saturating_add(now_us.wrapping_sub(self.last_us));
        self.last_us = now_us;
        self.ms = self.ms.wrapping_add(self.rest_us / 1000);
        self.rest_us %= 1000;
        self.ms
    }
}

/// A frame on its way to the line.
#[derive(Debug)]
struct Outbox {
    frame: [u8; FRAME_MAX],
    sent: usize,
    length: usize,
}

/// Whose frame is on the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Speaker {
    Nobody,
    Charger,
    Attendant,
}

/// The loop of a charger.
#[derive(Debug)]
pub struct Runner<'t, B, S, D, W> {
    board: B,
    charger: Charger<'t, S, D, W>,
    table: Option<TableId>,
    time: Milliseconds,
    next_ms: u32,
    outbox: Outbox,
    speaker: Speaker,
}

impl<'t, B: Board, S: FrequencySource, D: Dispatch, W: Watchdog> Runner<'t, B, S, D, W> {
    /// A charger before its first tick. `table` is the flash image, checked here.
    pub fn new(parts: Parts<B, S, D, W>, table: &'t [u8], config: ChargerConfig) -> Self {
        let Parts {
            board,
            source,
            dispatch,
            watchdog,
            cause,
        } = parts;
        let charger = Charger::new(source, dispatch, watchdog, table, config, cause);
        let table = charger.table().map(TableId::of);
        Self {
            board,
            table,
            time: Milliseconds::default(),
            next_ms: u32::from(charger.tick_ms()),
            charger,
            outbox: Outbox {
                frame: [0; FRAME_MAX],
                sent: 0,
                length: 0,
            },
            speaker: Speaker::Nobody,
        }
    }

    /// The table, if it was accepted.
    pub const fn table(&self) -> Option<TableId> {
        self.table
    }

    /// Goes round for ever.
    pub fn run(mut self) -> ! {
        loop {
            self.turn();
        }
    }

    /// Goes round until the attendant ends it.
    pub fn run_with(&mut self, attendant: &mut impl Attendant<D>) {
        while !attendant.ends() {
            self.turn_with(attendant);
        }
    }

    /// Goes round once: takes what was captured, ticks if a tick is due, sends a byte if the line
    /// takes it.
    pub fn turn(&mut self) {
        self.turn_with(&mut Alone);
    }

    /// The same, and hands the attendant a byte that came.
    pub fn turn_with(&mut self, attendant: &mut impl Attendant<D>) {
        let now_ms = self.time.at(self.board.now_us());
        self.charger.poll(now_ms);
        if let Some(byte) = self.board.receive() {
            attendant.take(byte, now_ms);
        }
        if now_ms.wrapping_sub(self.next_ms) < u32::MAX / 2 {
            let tick_ms = u32::from(self.charger.tick_ms());
            // Ticks that were missed are made good by this one: none of them is made by itself.
            let missed = now_ms.wrapping_sub(self.next_ms) / tick_ms.max(1);
            self.next_ms = self.next_ms.wrapping_add(tick_ms * (missed + 1));
            attendant.before(self.charger.dispatch_mut(), now_ms);
            let report = self.charger.tick(now_ms);
            let frame = Frame::new(&report, self.table);
            // A frame that is not out yet is finished first; this tick's is left out.
            if self.outbox.sent == self.outbox.length {
                self.outbox.length = encode(&frame, &mut self.outbox.frame).len();
                self.outbox.sent = 0;
            }
            attendant.after(&report, &frame);
        }
        self.speak(attendant);
    }

    /// Sends a byte of whoever's frame is on the line; the charger's goes first.
    fn speak(&mut self, attendant: &mut impl Attendant<D>) {
        let own = self.outbox.frame.get(self.outbox.sent);
        let own = own.filter(|_| self.outbox.sent < self.outbox.length);
        let other = attendant.to_send();
        self.speaker = match (self.speaker, own, other) {
            (Speaker::Attendant, _, Some(_)) | (_, None, Some(_)) => Speaker::Attendant,
            (_, Some(_), _) => Speaker::Charger,
            (_, None, None) => Speaker::Nobody,
        };
        match (self.speaker, own, other) {
            (Speaker::Charger, Some(byte), _) if self.board.send(*byte) => self.outbox.sent += 1,
            (Speaker::Attendant, _, Some(byte)) if self.board.send(byte) => attendant.sent(),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::dispatch::{DispatchError, SetPoint};
    use crate::frequency::{FrequencyError, Reading};
    use crate::telemetry::decode;
    use crate::units::Participation;
    use core::num::NonZeroU16;
    use std::vec::Vec;

    /// A board whose counter is moved by the test and whose line takes every n-th byte offered.
    struct Bench {
        now_us: u32,
        takes_every: u32,
        offered: u32,
        line: Vec<u8>,
        came: Option<u8>,
    }

    struct Mains {
        polled: u32,
    }

    struct Nothing;

    impl FrequencySource for Mains {
        fn error_uhz(&self) -> u32 {
            1
        }

        fn lag_ms(&self) -> u16 {
            0
        }

        fn stuck_after(&self) -> Option<NonZeroU16> {
            None
        }

        fn poll(&mut self, _now_ms: u32) {
            self.polled += 1;
        }

        fn read(&mut self, _now_ms: u32) -> Result<Reading, FrequencyError> {
            Ok(Reading {
                deviation_uhz: -400_000,
                age_ms: 0,
            })
        }
    }

    impl Dispatch for Nothing {
        fn apply(&mut self, _: Participation, _: u32) -> Result<SetPoint, DispatchError> {
            Ok(SetPoint::Paused)
        }

        fn rest(&mut self, _: u32) -> Result<SetPoint, DispatchError> {
            Ok(SetPoint::Paused)
        }
    }

    impl Watchdog for Nothing {
        fn feed(&mut self) {}
    }

    impl Board for Bench {
        fn now_us(&mut self) -> u32 {
            self.now_us
        }

        fn send(&mut self, byte: u8) -> bool {
            self.offered += 1;
            let takes = self.offered.is_multiple_of(self.takes_every);
            if takes {
                self.line.push(byte);
            }
            takes
        }

        fn receive(&mut self) -> Option<u8> {
            self.came.take()
        }
    }

    fn runner(takes_every: u32) -> Runner<'static, Bench, Mains, Nothing, Nothing> {
        let parts = Parts {
            board: Bench {
                now_us: 0,
                takes_every,
                offered: 0,
                line: Vec::new(),
                came: None,
            },
            source: Mains { polled: 0 },
            dispatch: Nothing,
            watchdog: Nothing,
            cause: ResetCause::PowerOn,
        };
        Runner::new(parts, &[], ChargerConfig::DEFAULT)
    }

    /// The frames on the line, each whole; the last one may be under way.
    fn frames(line: &[u8]) -> Vec<Frame> {
        line.split_inclusive(|byte| *byte == 0)
            .filter(|frame| frame.last() == Some(&0))
            .map(|frame| decode(&mut frame.to_vec()).unwrap())
            .collect()
    }

    #[test]
    fn ticks_when_due_and_polls_at_every_turn() {
        let mut runner = runner(1);
        for turn in 0..=1_000_000 / 50 {
            runner.board.now_us = 50 * turn;
            runner.turn();
        }
        assert_eq!(runner.charger.source_mut().polled, 20_001);
        // 1 s: ticks at 100, 200, .. 1000 ms; the last frame is under way.
        let frames = frames(&runner.board.line);
        let ticks: Vec<u32> = frames.iter().map(|frame| frame.now_ms).collect();
        assert_eq!(ticks, [100, 200, 300, 400, 500, 600, 700, 800, 900]);
    }

    #[test]
    fn a_loop_that_stood_still_ticks_once_and_goes_on_in_step() {
        let mut runner = runner(1);
        let times = (0..40).chain(153..=240).map(|n| 10_000 * n);
        for now_us in times {
            runner.board.now_us = now_us;
            for _ in 0..100 {
                runner.turn();
            }
        }
        let frames = frames(&runner.board.line);
        let ticks: Vec<u32> = frames.iter().map(|frame| frame.now_ms).collect();
        assert_eq!(
            ticks,
            [
                100, 200, 300, 1530, 1600, 1700, 1800, 1900, 2000, 2100, 2200, 2300, 2400
            ]
        );
    }

    #[test]
    fn a_slow_line_loses_whole_frames_and_delays_no_tick() {
        // A byte every 5 ms: a frame of some 30 bytes takes more than a tick.
        let mut runner = runner(100);
        for turn in 0..=1_000_000 / 50 {
            runner.board.now_us = 50 * turn;
            runner.turn();
        }
        let frames = frames(&runner.board.line);
        assert!((2..=9).contains(&frames.len()), "{}", frames.len());
        for frame in &frames {
            assert_eq!(frame.now_ms, 100 * frame.sequence);
        }
    }

    /// Answers every byte with a frame of two bytes, and never stops talking once it began.
    #[derive(Default)]
    struct Echo {
        heard: Vec<u8>,
        left: Vec<u8>,
        ticks: u32,
    }

    impl Attendant<Nothing> for Echo {
        fn take(&mut self, byte: u8, _: u32) {
            self.heard.push(byte);
            self.left = std::vec![0, byte];
        }

        fn before(&mut self, _: &mut Nothing, _: u32) {}

        fn after(&mut self, report: &Report, frame: &Frame) {
            self.ticks += 1;
            assert_eq!(report.sequence, frame.sequence);
        }

        fn to_send(&self) -> Option<u8> {
            self.left.last().copied()
        }

        fn sent(&mut self) {
            self.left.pop();
        }

        fn ends(&self) -> bool {
            self.ticks == 9
        }
    }

    #[test]
    fn an_attendants_frames_stand_between_the_chargers() {
        let mut runner = runner(1);
        let mut echo = Echo::default();
        // A byte in the middle of a frame, and one while nothing is sent.
        let at = [3_010, 8_000];
        for turn in 0.. {
            if echo.ends() {
                break;
            }
            runner.board.now_us = 50 * turn;
            runner.board.came = at.contains(&turn).then_some(7);
            runner.turn_with(&mut echo);
        }
        assert_eq!(echo.heard, [7, 7]);
        let line = &runner.board.line;
        let frames: Vec<_> = line.split_inclusive(|byte| *byte == 0).collect();
        assert_eq!(frames.iter().filter(|frame| **frame == [7, 0]).count(), 2);
        let own: Vec<u8> = frames
            .into_iter()
            .filter(|frame| *frame != [7, 0])
            .flatten()
            .copied()
            .collect();
        let ticks: Vec<u32> = self::frames(&own).iter().map(|f| f.sequence).collect();
        assert_eq!(ticks, [1, 2, 3, 4, 5, 6, 7, 8]);
    }

    #[test]
    fn the_counter_may_wrap() {
        let mut time = Milliseconds::default();
        let mut counter = 0u32;
        // Steps of 999 983 µs, past the wrap at 4 294.967 s.
        for n in 1..=5_000u64 {
            counter = counter.wrapping_add(999_983);
            assert_eq!(u64::from(time.at(counter)), n * 999_983 / 1000);
        }
    }
}
