use super::*;
use proptest::prelude::*;

fn source() -> ZeroCrossing {
    ZeroCrossing::new(1_000_000, 5, 0).expect("in range")
}

#[test]
fn reads_whole_windows_across_a_wrap_of_the_timer() {
    let mut source = source();
    let start = u32::MAX - 50_000;
    for k in 0..5 {
        source.capture(start.wrapping_add(20_000 * k), 20 * k);
        assert_eq!(source.read(20 * k), Err(FrequencyError::NoSignal));
    }
    source.capture(start.wrapping_add(100_000), 100);
    let reading = Reading {
        deviation_uhz: 0,
        age_ms: 7,
    };
    assert_eq!(source.read(107), Ok(reading));
    // 10 µs later than nominal: 5e6/100010 - 50 Hz = -4.9995 mHz, rounded down.
    source.capture(start.wrapping_add(120_010), 120);
    assert_eq!(source.read(120).map(|r| r.deviation_uhz), Ok(-5_000));
}

#[test]
fn ignores_glitches_and_restarts_after_a_gap() {
    let mut source = source();
    for k in 0..=5 {
        source.capture(20_000 * k, 0);
        source.capture(20_000 * k + 300, 0);
    }
    assert_eq!(source.glitches(), 6);
    assert_eq!(source.read(0).map(|r| r.deviation_uhz), Ok(0));
    source.capture(140_000, 140);
    assert_eq!(source.read(140), Err(FrequencyError::NoSignal));
}

#[test]
fn a_mains_that_goes_is_no_signal() {
    let mut source = source();
    let start = u32::MAX - 60;
    for k in 0..=5 {
        source.capture(20_000 * k, start.wrapping_add(20 * k));
    }
    let at = |source: &mut ZeroCrossing, ms: u32| source.read(start.wrapping_add(100 + ms));
    assert_eq!(at(&mut source, 1_000).map(|r| r.age_ms), Ok(1_000));
    for ms in [1_001, 65_536, 1 << 30] {
        assert_eq!(at(&mut source, ms), Err(FrequencyError::NoSignal));
    }
}

#[test]
fn error_and_lag_are_those_of_the_tradeoffs() {
    let source = ZeroCrossing::new(1_000_000, 5, 20).expect("in range");
    // A tick 500 µHz, jitter of 1 µs at either end 1 mHz, 20 ppm 1 mHz; each quotient rounded
    // up.
    let source = source.with_jitter_ns(1_000);
    assert_eq!(source.error_uhz(), 501 + 1001 + 1000);
    assert_eq!(source.lag_ms(), 50);
}

proptest! {
    #[test]
    fn any_ticks_give_a_reading_between_45_and_55_hz_or_an_error(
        stamps in proptest::collection::vec(any::<u32>(), 0..60),
        steps in proptest::collection::vec(17_000u32..24_000, 0..60),
    ) {
        let mut source = source();
        let mut at = 0u32;
        let walk = steps.iter().map(|step| { at = at.wrapping_add(*step); at });
        let all: std::vec::Vec<u32> = stamps.iter().copied().chain(walk).collect();
        for stamp in all {
            source.capture(stamp, stamp);
            if let Ok(reading) = source.read(stamp) {
                // Each period is within [timer/55, timer/45] rounded down, so 45 Hz to 55 Hz
                // and a rounding.
                prop_assert!(reading.deviation_uhz.abs() <= 5_004_000, "{reading:?}");
            }
        }
    }

    #[test]
    fn a_steady_frequency_is_read_within_the_stated_error(
        millihertz in 46_000u64..54_000, offset in any::<u32>(),
    ) {
        let mut source = source();
        for k in 0..=5u64 {
            let stamp = (k * 1_000_000_000 / millihertz) as u32;
            source.capture(offset.wrapping_add(stamp), 0);
        }
        let read = source.read(0).expect("a whole window").deviation_uhz;
        let truth = millihertz as i32 * 1000 - 50_000_000;
        // The stated error is for 50 Hz; one timer tick is worth f²/(50·f0) of it at f,
        // (54/50)² at most.
        let bound = source.error_uhz() * 117 / 100 + 1;
        prop_assert!(read.abs_diff(truth) <= bound, "{read} {truth}");
    }
}

/// Stamps of a mains at this frequency \[mHz\] on a timer of 1 MHz, from a count on; the
/// crossing with number n is late by `late(n)` µs.
fn stamps(
    millihertz: u64,
    from: u32,
    count: u64,
    late: impl Fn(u64) -> i32,
) -> impl Iterator<Item = u32> {
    (0..count).map(move |n| {
        let at = (n * 1_000_000_000 / millihertz) as u32;
        from.wrapping_add(at).wrapping_add_signed(late(n))
    })
}

/// µs of a phase angle at 49.75 Hz.
fn angle_us(degrees: i32) -> i32 {
    degrees * 20_100 / 360
}

#[test]
fn a_step_of_the_phase_is_no_frequency() {
    for degrees in [-20, -6, -4, -2, 2, 4, 6, 20] {
        let mut source = source();
        let late = |n: u64| if n >= 20 { angle_us(degrees) } else { 0 };
        let mut read = 0;
        for stamp in stamps(49_750, u32::MAX - 300_000, 60, late) {
            source.capture(stamp, 0);
            if let Ok(reading) = source.read(0) {
                read += 1;
                // Two ticks of 0.5 mHz: one in the window, one in the period that stands in.
                let off = reading.deviation_uhz.abs_diff(-250_000);
                assert!(off <= 1_001, "{degrees} degrees: {}", reading.deviation_uhz);
            }
        }
        assert_eq!((read, source.steps()), (55, 1), "no reading is lost");
    }
}

#[test]
fn a_late_crossing_leaves_nothing_behind() {
    let mut source = source();
    for stamp in stamps(50_000, 7, 60, |n| if n == 20 { 400 } else { 0 }) {
        source.capture(stamp, 0);
        if let Ok(reading) = source.read(0) {
            assert_eq!(reading.deviation_uhz, 0);
        }
    }
    assert_eq!(source.steps(), 2);
}

#[test]
fn a_frequency_that_falls_fast_is_followed() {
    // 1.9 Hz/s from 50 Hz on for 0.6 s: nothing is taken for a step, and the reading lags by
    // the 50 ms that are stated, 95 mHz, to a cycle's worth of 0.04 Hz.
    let mut source = source();
    let (mut at_us, mut hz) = (0.0f64, 50.0f64);
    for _ in 0..29 {
        at_us += 1e6 / hz;
        hz -= 1.9 / hz;
        source.capture(at_us as u32, 0);
    }
    assert_eq!(source.steps(), 0);
    let read = source.read(0).expect("a whole window").deviation_uhz;
    let lagged = (hz - 50.0) * 1e6 + 95_000.0;
    assert!(
        (f64::from(read) - lagged).abs() < 40_000.0,
        "{read} {lagged}"
    );
}

#[test]
fn two_steps_the_same_way_start_the_window_again() {
    let mut source = source();
    let late = |n: u64| angle_us(3) * (n.clamp(19, 21) as i32 - 19);
    let read = stamps(50_000, 0, 40, late).map(|stamp| {
        source.capture(stamp, 0);
        source.read(0).is_ok()
    });
    let read: std::vec::Vec<bool> = read.collect();
    // The second step is at crossing 21; the new window is whole five crossings later.
    let gap = read.iter().skip(5).position(|ok| !ok).map(|at| at + 5);
    assert_eq!(gap, Some(21));
    assert!(read[26..].iter().all(|ok| *ok) && !read[21..26].iter().any(|ok| *ok));
}

#[test]
fn an_exact_source_is_healthy_for_ever() {
    use super::super::gate::{Gate, GateLimits};
    let mut source = source();
    let (error, stuck) = (source.error_uhz(), source.stuck_after());
    let mut gate = Gate::new(GateLimits::DEFAULT, 100, error, stuck);
    for tick in 0..36_000u32 {
        for n in 0..5 {
            source.capture(tick * 100_000 + n * 20_000, tick * 100);
        }
        let admitted = gate.admit(source.read(tick * 100));
        assert!(tick < 1 || admitted == Ok(0), "tick {tick}: {admitted:?}");
    }
}

#[test]
fn sixty_hertz() {
    let mut source = source().with_nominal(Nominal::Hz60);
    for stamp in stamps(59_700, 0, 20, |_| 0) {
        source.capture(stamp, 0);
    }
    let read = source.read(0).expect("a whole window").deviation_uhz;
    // One tick in 83 752 of the window: 0.72 mHz.
    assert!(read.abs_diff(-300_000) <= 720, "{read}");
    assert_eq!((source.glitches(), source.lag_ms()), (0, 41));
}

/// Captures that a test writes.
struct Script(std::vec::Vec<(bool, u32)>);

impl Captures for Script {
    const TIMER_HZ: u32 = 1_000_000;
    const CLOCK_PPM: u16 = 0;
    const JITTER_NS: u32 = 0;

    fn take(&mut self) -> Option<u32> {
        (!self.0.is_empty()).then(|| self.0.remove(0).1)
    }

    fn lost(&mut self) -> bool {
        self.0.first().is_some_and(|(lost, _)| *lost)
    }
}

#[test]
fn a_capture_that_was_overwritten_starts_the_window_again() {
    // The crossing at 120 ms is lost; the next one is captured in time.
    let script = (0..14u32).map(|n| (n == 7, n * 20_000));
    let mut source = Captured::new(Script(script.collect())).expect("in range");
    let read: std::vec::Vec<bool> = (0..14)
        .map(|_| {
            source.poll(0);
            source.read(0).is_ok()
        })
        .collect();
    assert_eq!(read.iter().filter(|ok| **ok).count(), 4);
    assert!(read[5] && read[6] && !read[7] && !read[11] && read[12] && read[13]);
}
