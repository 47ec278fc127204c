//! The firmware on a recorded frequency: what would this charger have done?
//!
//! The loop is open: the recorded grid does not feel the chargers. The charger is the product's
//! own, from the gate over the filter to the control loop and the event's end; its meter plays the
//! record (`meter`). It has been in service for long when the record begins: it has seen the first
//! sample's frequency for as long as its observer needs to be trusted.

mod meter;

use firmware::charger::{Charger, ChargerConfig, Report, Watchdog, trust_ticks};
use firmware::dispatch::{Dispatch, DispatchError, SetPoint};
use firmware::fault::{Faults, ResetCause};
use firmware::table::{TableError, TableView};
use firmware::telemetry::{FRAME_MAX, Frame, TableId, encode};
use firmware::units::{MICRO, Participation};
use serde::Serialize;

use crate::record::{Record, RecordSample};
use crate::simulation::trajectory::{PhaseSpan, extend_phases};
use meter::RecordMeter;

/// A fall of this much \[Hz\] ...
const ONSET_FALL_HZ: f64 = 0.1;
/// ... within this time \[s\] is an event; quiet days stay below it.
const ONSET_WITHIN_S: f64 = 2.0;
/// Longest step of a record that shows when an event began \[s\]: two samples within
/// `ONSET_WITHIN_S`, and an onset that is known to half of it. From there on a reaction time says
/// more about the record than about the charger.
pub const REACTION_STEP_MAX_S: f64 = ONSET_WITHIN_S / 2.0;

/// One tick of a replay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReplaySample {
    /// Time since the start of the record \[s\].
    pub time_s: f64,
    /// Frequency by which the firmware went \[Hz\]; the last accepted one where a reading was
    /// refused.
    pub frequency_hz: f64,
    /// Participation that the firmware asked for.
    pub participation: f64,
}

/// Ticks with a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct FaultCount {
    /// Its name, as in telemetry.
    pub fault: &'static str,
    /// Ticks.
    pub ticks: usize,
}

/// What the firmware did.
#[derive(Debug, Clone, PartialEq)]
pub struct Replay {
    /// One sample a tick.
    pub samples: Vec<ReplaySample>,
    /// Phases in order.
    pub phases: Vec<PhaseSpan>,
    /// Start of the first event in the record \[s\]: the last sample before a fall of 0.1 Hz within
    /// 2 s; `None` if there is none, or if the samples are farther apart than
    /// [`REACTION_STEP_MAX_S`].
    pub onset_s: Option<f64>,
    /// First tick at or after the onset at which chargers respond \[s since the start\].
    pub first_response_s: Option<f64>,
    /// Times the chargers began to respond before the onset (or at all, without one).
    pub false_triggers: usize,
    /// Largest participation.
    pub max_participation: f64,
    /// Faults that occurred.
    pub faults: Vec<FaultCount>,
    /// What the charger would have sent on its serial line, a frame a tick.
    pub telemetry: Vec<u8>,
}

impl Replay {
    /// Time from the onset to the first response \[s\]; the onset is known to one step of the
    /// record.
    pub fn reaction_s(&self) -> Option<f64> {
        Some(self.first_response_s? - self.onset_s?)
    }
}

/// Takes every set-point.
#[derive(Debug)]
struct NoCar;

impl Dispatch for NoCar {
    fn apply(&mut self, _: Participation, _: u32) -> Result<SetPoint, DispatchError> {
        Ok(SetPoint::Paused)
    }

    fn rest(&mut self, _: u32) -> Result<SetPoint, DispatchError> {
        Ok(SetPoint::Paused)
    }
}

/// There is nothing to reset.
#[derive(Debug)]
struct NoWatchdog;

impl Watchdog for NoWatchdog {
    fn feed(&mut self) {}
}

/// Runs the charger with a table on a record.
///
/// # Errors
/// A table that the charger rejects, such as one of a plant that its observer cannot follow.
pub fn replay(table: &TableView<'_>, record: &Record) -> Result<Replay, TableError> {
    let header = table.header();
    let tick_s = f64::from(header.tick_ms) / 1000.0;
    let early_ticks = trust_ticks(&header.plant, header.tick_ms).max(header.delay_ticks);
    let mut charger = Charger::with_table(
        RecordMeter::new(record, tick_s, early_ticks.into()),
        NoCar,
        NoWatchdog,
        Ok(table.clone()),
        ChargerConfig::DEFAULT,
        ResetCause::PowerOn,
    );
    if let Some(error) = charger.table_error() {
        return Err(error);
    }
    let mut now_ms: u32 = 0;
    let mut tick = || {
        let report = charger.tick(now_ms);
        // The charger's clock wraps too.
        now_ms = now_ms.wrapping_add(header.tick_ms.into());
        report
    };
    for _ in 0..early_ticks {
        tick();
    }
    let ticks = (record.end_s() / tick_s + 1e-6).floor() as usize;
    let mut seen = Seen::new(record.nominal_hz, tick_s, ticks, TableId::of(table));
    for index in 0..=ticks {
        seen.note(index, &tick());
    }
    Ok(seen.judged(record))
}

/// What is noted tick by tick.
struct Seen {
    nominal_hz: f64,
    tick_s: f64,
    samples: Vec<ReplaySample>,
    phases: Vec<PhaseSpan>,
    fault_ticks: [usize; Faults::NAMES.len()],
    table: TableId,
    telemetry: Vec<u8>,
}

impl Seen {
    fn new(nominal_hz: f64, tick_s: f64, ticks: usize, table: TableId) -> Self {
        Self {
            nominal_hz,
            tick_s,
            samples: Vec::with_capacity(ticks + 1),
            phases: Vec::new(),
            fault_ticks: [0; Faults::NAMES.len()],
            table,
            telemetry: Vec::new(),
        }
    }

    fn note(&mut self, index: usize, report: &Report) {
        let time_s = index as f64 * self.tick_s;
        extend_phases(&mut self.phases, report.phase, time_s, time_s + self.tick_s);
        for (ticks, (fault, _)) in self.fault_ticks.iter_mut().zip(Faults::NAMES) {
            *ticks += usize::from(report.faults.contains(fault));
        }
        let frame = Frame::new(report, Some(self.table));
        self.telemetry
            .extend_from_slice(encode(&frame, &mut [0; FRAME_MAX]));
        let share = |micro: f64| micro / f64::from(MICRO);
        self.samples.push(ReplaySample {
            time_s,
            frequency_hz: self.nominal_hz + share(report.state.frequency_uhz().into()),
            participation: share(report.participation.ppm().into()),
        });
    }

    fn judged(self, record: &Record) -> Replay {
        let samples = self.samples;
        let onset_s = onset(record);
        let after = |s: &&ReplaySample| onset_s.is_some_and(|onset| s.time_s >= onset);
        let mut later = samples.iter().filter(after);
        let first_response_s = later.find(|s| s.participation > 0.0).map(|s| s.time_s);
        let false_triggers = samples
            .windows(2)
            .filter(|pair| pair[0].participation == 0.0 && pair[1].participation > 0.0)
            .filter(|pair| onset_s.is_none_or(|onset| pair[1].time_s < onset))
            .count();
        let max_participation = samples.iter().map(|s| s.participation).fold(0.0, f64::max);
        let faults = self
            .fault_ticks
            .into_iter()
            .zip(Faults::NAMES)
            .filter(|(ticks, _)| *ticks > 0)
            .map(|(ticks, (_, fault))| FaultCount { fault, ticks })
            .collect();
        Replay {
            samples,
            phases: self.phases,
            onset_s,
            first_response_s,
            false_triggers,
            max_participation,
            faults,
            telemetry: self.telemetry,
        }
    }
}

/// Last sample before the first fall of [`ONSET_FALL_HZ`] within [`ONSET_WITHIN_S`]. A sample that
/// is off by itself is no event.
fn onset(record: &Record) -> Option<f64> {
    if record.step_s > REACTION_STEP_MAX_S + 1e-3 {
        return None;
    }
    let all = &record.samples;
    let believed = |at: &usize| !meter::stands_alone(all, *at);
    let samples: Vec<RecordSample> = (0..all.len()).filter(believed).map(|at| all[at]).collect();
    let begins = |(index, from): &(usize, &RecordSample)| {
        let after = &samples[index + 1..];
        let lowest_hz = after
            .iter()
            .take_while(|to| to.time_s <= from.time_s + ONSET_WITHIN_S)
            .map(|to| to.frequency_hz)
            .fold(f64::INFINITY, f64::min);
        let falls_next = after
            .first()
            .is_some_and(|next| next.frequency_hz < from.frequency_hz);
        falls_next && from.frequency_hz - lowest_hz >= ONSET_FALL_HZ
    };
    let first = samples.iter().enumerate().find(begins);
    first.map(|(_, sample)| sample.time_s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::telemetry_lines::Splitter;

    /// A record of these frequencies.
    pub(super) fn record(hz: &[f64], step_s: f64) -> Record {
        let sample = |(k, hz): (usize, &f64)| RecordSample {
            time_s: k as f64 * step_s,
            frequency_hz: *hz,
        };
        Record {
            start: String::new(),
            nominal_hz: 50.0,
            step_s,
            samples: hz.iter().enumerate().map(sample).collect(),
            filled_s: 0.0,
            skipped: Vec::new(),
        }
    }

    fn replayed(record: &Record) -> Replay {
        let path = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../firmware/tables/paper-bi.bin"
        );
        let bytes = std::fs::read(path).unwrap();
        replay(&TableView::parse(&bytes).unwrap(), record).unwrap()
    }

    #[test]
    fn onset_is_the_last_sample_before_the_fall() {
        let at = |hz: &[f64], step_s: f64| onset(&record(hz, step_s));
        assert_eq!(at(&[50.0, 50.01, 49.99, 49.9, 49.8], 1.0), Some(1.0));
        assert_eq!(at(&[50.0, 49.96, 49.93, 49.9], 1.0), None);
        assert_eq!(at(&[50.0], 1.0), None);
        assert_eq!(at(&[50.0, 50.0, 48.0, 50.0], 1.0), None);
        assert_eq!(at(&[50.0, 49.8, 49.6], 2.0), None);
    }

    #[test]
    fn a_single_sample_of_48_hz_is_refused_as_in_the_charger() {
        for step_s in [0.1, 0.5, 1.0] {
            let mut hz = vec![50.0; 40];
            hz[20] = 48.0;
            let found = replayed(&record(&hz, step_s));
            let expected = FaultCount {
                fault: "implausible",
                ticks: 1,
            };
            assert_eq!(found.faults, [expected], "{step_s} s");
            assert_eq!(found.max_participation, 0.0, "{step_s} s");
            assert_eq!(found.onset_s, None, "{step_s} s");
        }
    }

    #[test]
    fn telemetry_says_what_the_samples_say() {
        let hz: Vec<f64> = (0..20).map(|k| 50.0 - 0.05 * f64::from(k)).collect();
        let found = replayed(&record(&hz, 1.0));
        let mut frames = Vec::new();
        Splitter::default().push(&found.telemetry, |stretch| frames.push(stretch.unwrap()));
        assert_eq!(frames.len(), found.samples.len());
        assert!(found.max_participation > 0.0);
        for (frame, sample) in frames.iter().zip(&found.samples) {
            let [f_hz, participation] = [
                f64::from(frame.state[0]),
                f64::from(frame.participation_ppm),
            ]
            .map(|micro| micro / f64::from(MICRO));
            assert_eq!(50.0 + f_hz, sample.frequency_hz);
            assert_eq!(participation, sample.participation);
        }
    }

    #[test]
    fn a_fall_is_answered_and_timed() {
        // 0.2 Hz/s for three seconds, then flat.
        let fall = |k: usize| 50.0 - 0.2 * (k as f64 - 10.0).clamp(0.0, 3.0);
        let hz: Vec<f64> = (0..40).map(fall).collect();
        let found = replayed(&record(&hz, 1.0));
        assert_eq!(found.onset_s, Some(10.0));
        // I1 ends at -0.3 Hz, which the line reaches 1.5 s after the onset; No control is examined
        // every tick, of 0.1 s.
        let reaction_s = found.reaction_s().unwrap();
        assert!((1.5..=1.6 + 1e-9).contains(&reaction_s), "{reaction_s}");
        assert!(
            found
                .faults
                .iter()
                .all(|count| count.fault == "outside-domain")
        );
    }
}
