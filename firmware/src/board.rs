//! A charger on its board: what a board must offer, and the loop that is the same on every board.
//!
//! One loop, no interrupts. It comes round far more often than the mains crosses zero. It ticks the
//! charger when a tick is due. In between it sends telemetry, one byte at a time, so that a slow
//! line never delays a tick.

use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;
use embedded_hal::spi::SpiDevice;

use crate::charger::{Charger, ChargerConfig, Watchdog};
use crate::dispatch::Dispatch;
use crate::dispatch::car::CarSense;
use crate::fault::ResetCause;
use crate::frequency::FrequencySource;
use crate::frequency::zero_crossing::Captures;
use crate::telemetry::{FRAME_MAX, Frame, TableId, encode};

/// What the loop asks of a board.
///
/// The implementation must not block: every call returns within microseconds.
pub trait Board {
    /// Microseconds by a counter that wraps at 2^32.
    fn now_us(&mut self) -> u32;

    /// Gives a byte to the telemetry line; `false` if the line does not take one now.
    fn send(&mut self, byte: u8) -> bool;
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

/// The loop of a charger.
#[derive(Debug)]
pub struct Runner<'t, B, S, D, W> {
    board: B,
    charger: Charger<'t, S, D, W>,
    table: Option<TableId>,
    time: Milliseconds,
    next_ms: u32,
    outbox: Outbox,
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
        }
    }

    /// Goes round for ever.
    pub fn run(mut self) -> ! {
        loop {
            self.turn();
        }
    }

    /// Goes round once: takes what was captured, ticks if a tick is due, sends a byte if the line
    /// takes it.
    pub fn turn(&mut self) {
        let now_ms = self.time.at(self.board.now_us());
        self.charger.poll(now_ms);
        if now_ms.wrapping_sub(self.next_ms) < u32::MAX / 2 {
            let tick_ms = u32::from(self.charger.tick_ms());
            self.next_ms = self.next_ms.wrapping_add(tick_ms);
            let report = self.charger.tick(now_ms);
            // A frame that is not out yet is finished first; this tick's is left out.
            if self.outbox.sent == self.outbox.length {
                let frame = Frame::new(&report, self.table);
                self.outbox.length = encode(&frame, &mut self.outbox.frame).len();
                self.outbox.sent = 0;
            }
        }
        if self.outbox.sent < self.outbox.length
            && let Some(byte) = self.outbox.frame.get(self.outbox.sent)
            && self.board.send(*byte)
        {
            self.outbox.sent += 1;
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
    }

    fn runner(takes_every: u32) -> Runner<'static, Bench, Mains, Nothing, Nothing> {
        let parts = Parts {
            board: Bench {
                now_us: 0,
                takes_every,
                offered: 0,
                line: Vec::new(),
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
