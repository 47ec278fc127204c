//! Records in which nothing trips: a response must be quiet in them, and must not let go where f
//! stays low.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use firmware::table::TableView;
use lab::record::{Record, RecordSample};
use lab::replay::{ReplaySample, replay};

/// Tables that are responses.
const TABLES: [&str; 2] = ["gb-bi", "gb-uni"];

/// A record with one sample each `step_s`.
fn record(hz: impl Iterator<Item = f64>, step_s: f64) -> Record {
    let sample = |(index, frequency_hz): (usize, f64)| RecordSample {
        time_s: index as f64 * step_s,
        frequency_hz,
    };
    Record {
        start: "2026-01-01T00:00:00Z".to_owned(),
        nominal_hz: 50.0,
        step_s,
        samples: hz.enumerate().map(sample).collect(),
        filled_s: 0.0,
        skipped: Vec::new(),
    }
}

/// What the charger with a shipped table did on a record.
fn samples(table: &str, record: &Record) -> Vec<ReplaySample> {
    let path = tests::root().join(format!("firmware/tables/{table}.bin"));
    let bytes = std::fs::read(path).unwrap();
    let table = TableView::parse(&bytes).unwrap();
    assert!(table.response().is_some());
    replay(&table, record).unwrap().samples
}

/// Distance of a shipped table's levels, a participation.
fn smallest_change(table: &str) -> f64 {
    let path = tests::root().join(format!("firmware/tables/{table}.bin"));
    let bytes = std::fs::read(path).unwrap();
    let law = TableView::parse(&bytes).unwrap().response().unwrap();
    f64::from(law.smallest_change_ppm) / 1e6
}

/// Changes of the command.
fn changes(samples: &[ReplaySample]) -> usize {
    let differ = |pair: &&[ReplaySample]| pair[0].participation != pair[1].participation;
    samples.windows(2).filter(differ).count()
}

/// A small ripple that is never the same twice: 1 mHz to either side.
fn ripple(second: usize) -> f64 {
    0.001 * (second as f64 * 12.9898).sin()
}

/// 49.9 down to 49.63 Hz in an hour and back. The law is monotone in a slow f: each of the
/// levels is passed once on the way down and once on the way up. A ripple of 2 mHz in all moves
/// the target by less than the smallest change, so that no level toggles.
#[test]
fn a_slow_drift_passes_each_level_once() {
    let down = |second: usize| 49.9 - 0.27 * second as f64 / 3600.0;
    let hz = (0..=3600).chain((0..3600).rev());
    let drift = hz.enumerate().map(|(index, s)| down(s) + ripple(index));
    let drift = record(drift, 1.0);
    for table in TABLES {
        let samples = samples(table, &drift);
        let step = smallest_change(table);
        let levels = (1.0 / step).ceil() as usize + 1;
        assert!(
            changes(&samples) <= 2 * levels,
            "{table}: {}",
            changes(&samples)
        );
        let most = samples.iter().map(|s| s.participation).fold(0.0, f64::max);
        assert!(most > 0.0, "{table}: nothing was asked for");
        // No jump: a change is one level, and at the ends of the scale less.
        let steps = samples
            .windows(2)
            .map(|pair| pair[1].participation - pair[0].participation);
        let largest = steps.map(f64::abs).fold(0.0, f64::max);
        assert!(largest < 2.0 * step, "{table}: {largest}");
    }
}

/// One sample of 48.0 Hz in a quiet record, at every rate that records come in.
#[test]
fn a_single_low_sample_starts_no_response() {
    for step_s in [0.1, 0.5, 1.0] {
        let quiet = (0..600).map(|index| 49.98 + ripple(index));
        let mut glitch = record(quiet, step_s);
        glitch.samples[300].frequency_hz = 48.0;
        for table in TABLES {
            let samples = samples(table, &glitch);
            let most = samples.iter().map(|s| s.participation).fold(0.0, f64::max);
            assert_eq!(most, 0.0, "{table} at {step_s} s");
        }
    }
}

/// f falls to 49.62 Hz within two seconds and stays there for five minutes: 0.33 Hz below the
/// set-point, or nearly so. From the fall on the command never falls to nothing.
#[test]
fn a_low_frequency_that_lasts_is_answered_as_long_as_it_lasts() {
    let fall = |tick: i32| 50.0 - 0.38 * f64::from(tick.clamp(0, 20)) / 20.0;
    let low = record((-100..3000).map(fall), 0.1);
    for table in TABLES {
        let samples = samples(table, &low);
        // From one second after the fall has begun.
        let after = &samples[110..];
        let least = after.iter().map(|s| s.participation).fold(1.0, f64::min);
        assert!(least > 0.1, "{table}: {least}");
        assert!(changes(after) <= 21, "{table}: {}", changes(after));
    }
}
