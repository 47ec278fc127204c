//! The response: a law of measured frequency and its slope, always on.
//!
//! ```text
//! r(t) = (f(t) - f(t - window)) / window
//! m(t) = max(m(t - tick) - release, clamp(slope_gain (-r - slope_threshold), 0, slope_most))
//! v(t) = clamp(droop_gain (setpoint - f) + m, 0, 1)
//! ```
//!
//! m is the slope response: its peak is held and let go step by step. v is the target; the droop
//! term may be negative, the sum is clamped. Nothing here knows the plant, the governors or the
//! loss. In ordinary operation f lies above the set-point and the target is zero.
//!
//! The command follows the target in steps. Targets 0 and 1 are taken exactly. Any other target
//! changes nothing while it lies less than `smallest_change` from the last command; else the
//! command becomes the nearest of this charger's own levels. They are `smallest_change` apart and
//! shifted by an offset of the charger's serial number, so that a fleet does not step together.
//! So `|command - v| < smallest_change` at every tick, for every offset, and a command is a level
//! of its charger, 0 or 1. The proof uses that, and how evenly a fleet's offsets are spread.
//!
//! **Numbers.** Everything is an integer and host and device agree to the bit. A slope is rounded
//! towards zero (below 1 µHz/s). A slope response is rounded down (below 1 ppm). A target is one
//! exact sum in 64 bits, rounded down (below 1 ppm).
//!
//! **Gaps.** After a gap in the readings the window starts anew: the slope is 0 until it is full
//! again. The slope response stays and is let go as time passes.

use crate::dispatch::fleet::spread;
use crate::units::{MICRO, Participation};
use crate::wide::divide;

/// Most ticks of a window.
pub const WINDOW_TICKS_MAX: u16 = 32;
/// Largest droop gain \[ppm/Hz\]: the fleet within 1 mHz. Keeps the target's sum inside 64 bits.
pub const DROOP_GAIN_MAX: u32 = 1_000_000_000;

/// The parameters of the law, as a table holds them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ResponseLaw {
    /// Share of the fleet for each Hz below the set-point \[ppm/Hz\], at most [`DROOP_GAIN_MAX`].
    pub droop_gain_ppm_per_hz: u32,
    /// Deviation at which the droop term is zero \[µHz\].
    pub setpoint_uhz: i32,
    /// Share of the fleet for each Hz/s of fall beyond the threshold \[ppm s/Hz\].
    pub slope_gain_ppm_s_per_hz: u32,
    /// Fall without a slope response \[µHz/s\].
    pub slope_threshold_uhz_per_s: u32,
    /// Window of the slope \[ticks\], 1..=[`WINDOW_TICKS_MAX`].
    pub window_ticks: u16,
    /// Largest slope response \[ppm\].
    pub slope_most_ppm: u32,
    /// What a tick lets go of the slope response \[ppm\].
    pub release_ppm: u32,
    /// Distance of a charger's levels, and the least change of its command \[ppm\]; not 0.
    pub smallest_change_ppm: u32,
}

impl ResponseLaw {
    /// Mean slope over the window \[µHz/s\], for the readings at its two ends, rounded towards
    /// zero.
    pub const fn slope_uhz_per_s(&self, then_uhz: i32, now_uhz: i32, tick_ms: u16) -> i32 {
        let span_ms = self.window_ticks as u32 * tick_ms as u32;
        let size = divide(now_uhz.abs_diff(then_uhz) as u64 * 1000, span_ms);
        let size = if size > i32::MAX as u32 {
            i32::MAX
        } else {
            size.cast_signed()
        };
        if now_uhz < then_uhz { -size } else { size }
    }

    /// What a slope asks for by itself \[ppm\], before the peak is held.
    pub const fn asked_ppm(&self, slope_uhz_per_s: i32) -> u32 {
        let beyond = -(slope_uhz_per_s as i64) - self.slope_threshold_uhz_per_s as i64;
        if beyond <= 0 {
            return 0;
        }
        let product = beyond as u64 * self.slope_gain_ppm_s_per_hz as u64;
        least(divide(product, MICRO as u32), self.slope_most_ppm)
    }

    /// The slope response after a tick \[ppm\], from that of the tick before and this tick's slope.
    pub const fn held_ppm(&self, before_ppm: u32, slope_uhz_per_s: i32) -> u32 {
        let left = before_ppm.saturating_sub(self.release_ppm);
        let asked = self.asked_ppm(slope_uhz_per_s);
        if asked > left { asked } else { left }
    }

    /// The target v at a deviation, with this slope response.
    pub const fn target(&self, f_uhz: i32, held_ppm: u32) -> Participation {
        let below = self.setpoint_uhz as i64 - f_uhz as i64;
        // At most 2^30 · 2^32 and 2^32 · 2^20.
        let sum = self.droop_gain_ppm_per_hz as i64 * below + held_ppm as i64 * MICRO as i64;
        if sum <= 0 {
            return Participation::NONE;
        }
        Participation::from_ppm(divide(sum.cast_unsigned(), MICRO as u32))
    }

    /// The command for a target: the last one, or the nearest of the charger's own levels.
    pub const fn command(
        &self,
        target: Participation,
        last: Participation,
        offset: LevelOffset,
    ) -> Participation {
        let (target, step) = (target.ppm(), self.smallest_change_ppm);
        let exact = target == 0 || target >= Participation::ALL.ppm();
        if !exact && target.abs_diff(last.ppm()) < step {
            return last;
        }
        self.nearest_level(target, offset)
    }

    /// The charger's own level that is nearest to a participation \[ppm\]; 0 and 1 are levels.
    const fn nearest_level(&self, ppm: u32, offset: LevelOffset) -> Participation {
        let step = self.smallest_change_ppm;
        if ppm == 0 || ppm >= Participation::ALL.ppm() || step == 0 {
            return Participation::from_ppm(ppm);
        }
        // Levels stand at `offset + (k - 1) step`, k from 0; the lowest counts as 0.
        let from_lowest = ppm + step - offset.ppm(step);
        let level = (from_lowest + step / 2) / step;
        let above = level * step + offset.ppm(step);
        Participation::from_ppm(above.saturating_sub(step))
    }
}

const fn least(a: u32, b: u32) -> u32 {
    if a < b { a } else { b }
}

/// By how much a charger's levels are shifted, as a share of their distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LevelOffset(u32);

impl LevelOffset {
    /// Levels that begin at 0.
    pub const NONE: Self = Self(0);

    /// The offset of a serial number. Consecutive numbers are spread evenly, as in
    /// [`crate::dispatch::fleet`].
    pub const fn of_serial(serial: u32) -> Self {
        Self(spread(serial))
    }

    /// The shift as a share of the levels' distance, in units of 2^-32.
    pub const fn units(self) -> u32 {
        self.0
    }

    /// The shift for levels `step` apart \[ppm\]: 0..step.
    const fn ppm(self, step: u32) -> u32 {
        ((self.0 as u64 * step as u64) >> 32) as u32
    }
}

/// The readings of a window, the slope response and the command: what the law remembers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Response {
    law: ResponseLaw,
    tick_ms: u16,
    offset: LevelOffset,
    /// The last `window` readings; the oldest stands at `next` once all are there.
    readings_uhz: [i32; WINDOW_TICKS_MAX as usize],
    next: u16,
    known: u16,
    held_ppm: u32,
    command: Participation,
}

impl Response {
    /// A response at rest that has read nothing yet.
    pub const fn new(law: ResponseLaw, tick_ms: u16, offset: LevelOffset) -> Self {
        Self {
            law,
            tick_ms,
            offset,
            readings_uhz: [0; WINDOW_TICKS_MAX as usize],
            next: 0,
            known: 0,
            held_ppm: 0,
            command: Participation::NONE,
        }
    }

    /// The law.
    pub const fn law(&self) -> &ResponseLaw {
        &self.law
    }

    /// The slope response \[ppm\].
    pub const fn held_ppm(&self) -> u32 {
        self.held_ppm
    }

    /// Whether the window is full, so that slopes are known.
    pub const fn is_full(&self) -> bool {
        self.known >= self.law.window_ticks
    }

    /// The same with another offset of the levels.
    pub const fn set_offset(&mut self, offset: LevelOffset) {
        self.offset = offset;
    }

    /// Advances by one tick with the deviation read at it; what is to be commanded.
    pub fn step(&mut self, f_uhz: i32) -> Participation {
        self.pass(f_uhz);
        let target = self.law.target(f_uhz, self.held_ppm);
        self.command = self.law.command(target, self.command, self.offset);
        self.command
    }

    /// The same for a tick at which nothing is decided: the command stays.
    pub fn pass(&mut self, f_uhz: i32) {
        let slope = self.read(f_uhz);
        self.held_ppm = self.law.held_ppm(self.held_ppm, slope);
    }

    /// Takes the reading into the window; the slope over it, 0 until it is full.
    fn read(&mut self, f_uhz: i32) -> i32 {
        let full = self.is_full();
        let window = self.law.window_ticks;
        let Some(oldest) = self.readings_uhz.get_mut(usize::from(self.next)) else {
            return 0;
        };
        let then = core::mem::replace(oldest, f_uhz);
        self.next = if self.next + 1 < window {
            self.next + 1
        } else {
            0
        };
        if full {
            return self.law.slope_uhz_per_s(then, f_uhz, self.tick_ms);
        }
        self.known += 1;
        0
    }

    /// Ticks without a reading: the window starts anew, the slope response is let go.
    pub const fn miss(&mut self, ticks: u16) {
        let gone = self.law.release_ppm.saturating_mul(ticks as u32);
        self.held_ppm = self.held_ppm.saturating_sub(gone);
        self.restart();
    }

    /// The window starts anew; slope response and command stay.
    pub const fn restart(&mut self) {
        self.next = 0;
        self.known = 0;
    }

    /// At rest, as in the beginning.
    pub const fn reset(&mut self) {
        *self = Self::new(self.law, self.tick_ms, self.offset);
    }

    /// Takes note that something else is commanded. The law goes on from its own level nearest to
    /// that: every command it keeps is one of its own, as the proof has it.
    pub const fn impose(&mut self, command: Participation) {
        self.command = self.law.nearest_level(command.ppm(), self.offset);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The bidirectional fleet of 1.4 GW: 6 GW/Hz, 2 GW s/Hz, 0.9 GW and 0.05 GW/s of it.
    const LAW: ResponseLaw = ResponseLaw {
        droop_gain_ppm_per_hz: 4_285_714,
        setpoint_uhz: -50_000,
        slope_gain_ppm_s_per_hz: 1_428_571,
        slope_threshold_uhz_per_s: 30_000,
        window_ticks: 5,
        slope_most_ppm: 642_857,
        release_ppm: 3_571,
        smallest_change_ppm: 50_000,
    };
    const TICK_MS: u16 = 100;

    fn ppm(ppm: u32) -> Participation {
        Participation::from_ppm(ppm)
    }

    #[test]
    fn slopes_by_hand() {
        let slope = |then, now| LAW.slope_uhz_per_s(then, now, TICK_MS);
        assert_eq!(slope(0, -100_000), -200_000);
        assert_eq!(slope(-100_000, 0), 200_000);
        // 3 µHz in 0.5 s.
        assert_eq!(slope(0, 3), 6);
        let third = ResponseLaw {
            window_ticks: 3,
            ..LAW
        };
        // 1 µHz in 0.3 s: 3.33 µHz/s, towards zero on both sides.
        assert_eq!(third.slope_uhz_per_s(0, 1, TICK_MS), 3);
        assert_eq!(third.slope_uhz_per_s(0, -1, TICK_MS), -3);
        assert_eq!(slope(i32::MIN, i32::MAX), i32::MAX);
        assert_eq!(slope(i32::MAX, i32::MIN), -i32::MAX);
    }

    /// Levels 0.05 apart, the offset of serial 0 is none: 0.62 is nearest to 0.6, which is kept
    /// while the target is near.
    #[test]
    fn what_was_imposed_is_gone_on_from_by_the_nearest_level() {
        let mut response = Response::new(LAW, TICK_MS, LevelOffset::of_serial(0));
        response.impose(ppm(620_000));
        // 0.05 Hz and 0.14 Hz below: 4.285714 · 0.14 = 0.59999...
        assert_eq!(response.step(-190_000), ppm(600_000));
        for exact in [0, 1_000_000] {
            response.impose(ppm(exact));
            assert_eq!(response.command, ppm(exact));
        }
    }

    #[test]
    fn slope_responses_by_hand() {
        assert_eq!(LAW.asked_ppm(0), 0);
        assert_eq!(LAW.asked_ppm(500_000), 0, "a rise asks for nothing");
        assert_eq!(LAW.asked_ppm(-30_000), 0);
        // 70 mHz/s beyond the threshold: 1.428571 · 70 000 = 99 999.97 ppm, rounded down.
        assert_eq!(LAW.asked_ppm(-100_000), 99_999);
        assert_eq!(LAW.asked_ppm(i32::MIN), 642_857);
        assert_eq!(LAW.held_ppm(99_999, -29_000), 96_428);
        assert_eq!(LAW.held_ppm(99_999, -100_000), 99_999);
        assert_eq!(LAW.held_ppm(3_000, 0), 0);
    }

    #[test]
    fn targets_by_hand() {
        let at = |f, held| LAW.target(f, held).ppm();
        assert_eq!(at(0, 0), 0);
        assert_eq!(at(-50_000, 0), 0);
        // 100 mHz below the set-point: 428 571.4 ppm.
        assert_eq!(at(-150_000, 0), 428_571);
        assert_eq!(at(-150_000, 100_000), 528_571);
        // Above the set-point the droop term takes from the slope response: 300 000 - 214 285.7.
        assert_eq!(at(0, 300_000), 85_714);
        assert_eq!(at(100_000, 300_000), 0);
        assert_eq!(at(-283_334, 0), 1_000_000);
        assert_eq!(at(i32::MIN, u32::MAX), 1_000_000);
        assert_eq!(at(i32::MAX, 0), 0);
    }

    #[test]
    fn commands_by_hand() {
        let command = |v, last| LAW.command(ppm(v), ppm(last), LevelOffset::NONE).ppm();
        assert_eq!(command(0, 500_000), 0);
        assert_eq!(command(1_000_000, 960_000), 1_000_000);
        assert_eq!(command(49_999, 0), 0, "too small a change");
        assert_eq!(command(50_000, 0), 50_000);
        assert_eq!(command(74_999, 0), 50_000);
        assert_eq!(command(75_000, 0), 100_000);
        assert_eq!(command(960_000, 1_000_000), 1_000_000);
        assert_eq!(command(1, 49_999), 49_999);
        // Half a step above: levels at 25 000, 75 000, ...
        let half = LevelOffset(1 << 31);
        let command = |v, last| LAW.command(ppm(v), ppm(last), half).ppm();
        assert_eq!(command(60_000, 0), 75_000);
        assert_eq!(command(990_000, 0), 975_000);
        assert_eq!(command(10_000, 500_000), 25_000);
        // The nearest level is -25 000, or 25 000 at the same distance; below that it counts as 0.
        assert_eq!(
            LAW.command(ppm(9_000), ppm(500_000), LevelOffset(3 << 30))
                .ppm(),
            0
        );
    }

    #[test]
    fn an_event_by_hand() {
        let mut response = Response::new(LAW, TICK_MS, LevelOffset::NONE);
        // f falls by 25 mHz a tick: 250 mHz/s, of which 220 are beyond the threshold.
        let fall: [(i32, u32, u32); 7] = [
            (0, 0, 0),
            (-25_000, 0, 0),
            (-50_000, 0, 0),
            // Target 107 142; 25 mHz below the set-point.
            (-75_000, 0, 100_000),
            // 214 285.
            (-100_000, 0, 200_000),
            // The window is full: 1.428571 · 220 000 = 314 285 beside 321 428: 635 713.
            (-125_000, 314_285, 650_000),
            // 428 571 and 314 285.
            (-150_000, 314_285, 750_000),
        ];
        for (f, held, command) in fall {
            assert_eq!(response.step(f).ppm(), command, "{f}");
            assert_eq!(response.held_ppm(), held, "{f}");
        }
        // The fall ends: 1.428571 · (200 - 30) mHz/s = 242 857 is less than 314 285 - 3 571.
        assert_eq!(response.step(-150_000).ppm(), 750_000);
        assert_eq!(response.held_ppm(), 310_714);
        // Three ticks without a reading, then a jump of 200 mHz: no slope is made of it.
        response.miss(3);
        assert_eq!(response.held_ppm(), 300_001);
        assert!(!response.is_full());
        for n in 1..=5 {
            assert_eq!(response.step(-350_000), Participation::ALL);
            assert_eq!(response.held_ppm(), 300_001 - n * 3_571);
        }
        assert!(response.is_full());
    }

    #[test]
    fn offsets_spread_the_levels_of_a_fleet() {
        // 1000 consecutive serial numbers command 1000 targets' means: the mean command is the
        // target to within a thousandth of a step and the golden ratio's discrepancy (below 12 of
        // 1000).
        for target in [60_000, 333_333, 777_777] {
            let sum: u64 = (40_000..41_000)
                .map(|serial| {
                    let offset = LevelOffset::of_serial(serial);
                    u64::from(LAW.command(ppm(target), Participation::NONE, offset).ppm())
                })
                .sum();
            let off = (sum / 1000).abs_diff(u64::from(target));
            assert!(off <= 50_000 * 12 / 1000 + 1, "{target}: {off}");
        }
    }

    /// Any law that the table's reader accepts.
    fn any_law() -> impl Strategy<Value = ResponseLaw> {
        (
            0..=DROOP_GAIN_MAX,
            any::<i32>(),
            any::<u32>(),
            any::<u32>(),
            1..=WINDOW_TICKS_MAX,
            0..=1_000_000u32,
            0..=1_000_000u32,
            1..=1_000_000u32,
        )
            .prop_map(
                |(gain, setpoint, slope_gain, threshold, window, most, release, change)| {
                    ResponseLaw {
                        droop_gain_ppm_per_hz: gain,
                        setpoint_uhz: setpoint,
                        slope_gain_ppm_s_per_hz: slope_gain,
                        slope_threshold_uhz_per_s: threshold,
                        window_ticks: window,
                        slope_most_ppm: most,
                        release_ppm: release,
                        smallest_change_ppm: change,
                    }
                },
            )
    }

    proptest! {
        #[test]
        fn the_command_is_always_near_the_target(
            law in any_law(),
            target in 0..=1_000_000u32,
            last in 0..=1_000_000u32,
            serial in any::<u32>(),
        ) {
            let command = law.command(ppm(target), ppm(last), LevelOffset::of_serial(serial)).ppm();
            prop_assert!(command.abs_diff(target) < law.smallest_change_ppm);
            if target == 0 || target == 1_000_000 {
                prop_assert_eq!(command, target);
            }
            // A second time nothing changes: no charger toggles at a constant target.
            let again = law.command(ppm(target), ppm(command), LevelOffset::of_serial(serial));
            prop_assert_eq!(again.ppm(), command);
        }

        #[test]
        fn whole_numbers_are_within_their_rounding_of_the_real_law(
            law in any_law(),
            then in -2_000_000i32..2_000_000,
            now in -2_000_000i32..2_000_000,
            tick in 1u16..=200,
            before in 0..=1_000_000u32,
        ) {
            let span_s = f64::from(law.window_ticks) * f64::from(tick) / 1000.0;
            let real = f64::from(now - then) / span_s;
            let slope = law.slope_uhz_per_s(then, now, tick);
            // 4e9 µHz/s is the largest slope of these readings; those past 32 bits saturate.
            if real.abs() < f64::from(i32::MAX) {
                // A millionth for the f64 quotient.
                prop_assert!((f64::from(slope) - real).abs() <= 1.0 + 1e-6 && f64::from(slope.unsigned_abs()) <= real.abs() + 1e-6);
            }
            let beyond = -f64::from(slope) - f64::from(law.slope_threshold_uhz_per_s);
            let asked = (f64::from(law.slope_gain_ppm_s_per_hz) * beyond / 1e6)
                .clamp(0.0, f64::from(law.slope_most_ppm));
            let held = asked.max(f64::from(before) - f64::from(law.release_ppm));
            let stored = law.held_ppm(before, slope);
            prop_assert!(f64::from(stored) <= held.max(0.0) + 1e-3 && f64::from(stored) > held - 1.0 - 1e-3);
            let below = f64::from(law.setpoint_uhz) - f64::from(now);
            let exact = f64::from(law.droop_gain_ppm_per_hz) * below / 1e6 + f64::from(stored);
            let target = f64::from(law.target(now, stored).ppm());
            let exact = exact.clamp(0.0, 1e6);
            // f64 keeps 1e18/1e6 to 1e-3 here only where it is not clamped.
            prop_assert!(target <= exact + 1e-3 && target > exact - 1.0 - 1e-3);
        }

        #[test]
        fn targets_fall_with_f_and_rise_with_the_slope_response(
            law in any_law(),
            f in any::<i32>(),
            higher in 0..i32::MAX,
            held in 0..=1_000_000u32,
            more in 0..=1_000_000u32,
        ) {
            let here = law.target(f, held);
            prop_assert!(law.target(f.saturating_add(higher), held) <= here);
            prop_assert!(law.target(f, held + more) >= here);
        }

        #[test]
        fn any_readings_give_a_command(
            law in any_law(),
            tick in 1u16..=200,
            readings in proptest::collection::vec(proptest::option::of(any::<i32>()), 1..200),
        ) {
            let mut response = Response::new(law, tick, LevelOffset::NONE);
            for reading in readings {
                let before = response.held_ppm();
                let Some(f_uhz) = reading else {
                    response.miss(1);
                    continue;
                };
                let command = response.step(f_uhz).ppm();
                let held = response.held_ppm();
                prop_assert!(held <= law.slope_most_ppm && held + law.release_ppm >= before);
                let target = law.target(f_uhz, held).ppm();
                prop_assert!(command.abs_diff(target) < law.smallest_change_ppm);
            }
        }

        #[test]
        fn a_ramp_gives_its_slope_once_the_window_is_full(
            window in 1..=WINDOW_TICKS_MAX,
            step in -100_000i32..100_000,
            gap_after in 0u16..80,
        ) {
            let law = ResponseLaw { window_ticks: window, slope_threshold_uhz_per_s: 0, slope_gain_ppm_s_per_hz: 1, slope_most_ppm: 1_000_000, release_ppm: 1_000_000, ..LAW };
            let mut response = Response::new(law, TICK_MS, LevelOffset::NONE);
            let mut known = 0u16;
            for n in 0..120u16 {
                if n == gap_after {
                    response.miss(1);
                    known = 0;
                    continue;
                }
                response.step(step * i32::from(n));
                // 10 ticks a second; 1e-6 of the fleet for each Hz/s of fall.
                let expected = if known >= window { (-step).max(0).unsigned_abs() * 10 / 1_000_000 } else { 0 };
                prop_assert_eq!(response.held_ppm(), expected, "tick {}", n);
                known = known.saturating_add(1);
            }
        }
    }
}
