//! Telemetry of a charger, live from a serial port or from a recording: bytes in, one decoded tick
//! a line out.
//!
//! The stream is cut at zero bytes; whatever does not decode is counted and skipped, so that
//! joining in the middle or a disturbed line costs frames and nothing else. The format is
//! `docs/telemetry.md`.

use std::fmt::Write as _;
use std::io::{self, Read, Write};

use firmware::charger::Misfits;
use firmware::fault::{Faults, Mode};
use firmware::phase::Phase;
use firmware::telemetry::{DecodeError, FRAME_MAX, Frame, WireSetPoint, decode};
use serde::Serialize;

use crate::simulation::NOMINAL_HZ;

/// Bytes read at a time.
const CHUNK: usize = 4096;

/// Cuts a byte stream into frames.
#[derive(Debug, Default)]
pub struct Splitter {
    pending: Vec<u8>,
    /// The stretch is longer than any frame: skip to the next delimiter.
    overlong: bool,
}

/// A stretch between two delimiters.
pub type Stretch = Result<Frame, DecodeError>;

impl Splitter {
    /// Takes bytes and hands every complete stretch to `each`.
    pub fn push(&mut self, bytes: &[u8], mut each: impl FnMut(Stretch)) {
        for byte in bytes {
            if *byte != 0 {
                if self.pending.len() < FRAME_MAX {
                    self.pending.push(*byte);
                } else {
                    self.overlong = true;
                }
                continue;
            }
            if self.overlong {
                each(Err(DecodeError::Malformed));
            } else if !self.pending.is_empty() {
                each(decode(&mut self.pending));
            }
            self.pending.clear();
            self.overlong = false;
        }
    }
}

/// What a stream came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Summary {
    /// Frames decoded.
    pub frames: u64,
    /// Frames that were sent but not received, by their sequence numbers.
    pub lost: u64,
    /// Stretches that are no frame.
    pub rejected: u64,
    /// Frames of another version of the telemetry.
    pub other_version: u64,
}

/// Name of a phase by its number in a frame, `?` for an unknown one.
pub fn phase_name(phase: u8) -> &'static str {
    let known = Phase::ALL.get(usize::from(phase)).copied();
    known.map_or("?", Phase::name)
}

/// Name of a mode by its number in a frame, `?` for an unknown one.
pub fn mode_name(mode: u8) -> &'static str {
    match Mode::ALL.get(usize::from(mode)) {
        Some(Mode::WarmUp) => "warm-up",
        Some(Mode::Table) => "table",
        Some(Mode::DroopOutside) => "droop, outside",
        Some(Mode::DroopNoTable) => "droop, no table",
        Some(Mode::Hold) => "hold",
        Some(Mode::Safe) => "safe",
        Some(Mode::Release) => "release",
        Some(Mode::DroopMisfit) => "droop, misfit",
        None => "?",
    }
}

/// Lost power \[GW\], `-` while it is not known.
pub fn loss_text(loss_kw: Option<i32>) -> String {
    loss_kw.map_or_else(|| "-".into(), |kw| format!("{:.2}", f64::from(kw) * 1e-6))
}

/// A set-point with its unit.
pub fn set_point(set_point: WireSetPoint) -> String {
    match set_point {
        WireSetPoint::Unknown => "refused".into(),
        WireSetPoint::Paused => "paused".into(),
        WireSetPoint::CurrentMa(ma) => format!("{:.1} A", f64::from(ma) / 1000.0),
        WireSetPoint::PowerW(w) => format!("{:.1} kW", f64::from(w) / 1000.0),
    }
}

/// The names of a frame's faults, each misfit among them, `-` for none.
pub fn fault_names(frame: &Frame) -> String {
    let faults = Faults::from_bits(frame.faults);
    let mut names: Vec<&str> = Faults::NAMES
        .iter()
        .filter(|(fault, _)| faults.contains(*fault))
        .map(|(_, name)| *name)
        .collect();
    let misfits = Misfits::NAMES
        .iter()
        .filter(|(misfit, _)| frame.misfits & misfit.bits() != 0);
    names.extend(misfits.map(|(_, name)| *name));
    if names.is_empty() {
        "-".into()
    } else {
        names.join(" ")
    }
}

/// The columns' names.
pub const HEADING: &str = "    time s        f Hz   g GW   l GW   p GW   w GW   part. %  set-point  phase       mode             faults";

/// One line of a tick.
pub fn line(frame: &Frame) -> String {
    let [f, g, l, p] = frame.state.map(|value| f64::from(value) * 1e-6);
    let loss = loss_text(frame.loss_kw);
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = write!(
        text,
        "{:>10.1}  {:>10.4}  {g:>5.2}  {l:>5.2}  {p:>5.2}  {loss:>5}  {:>8.2}  {:>9}  {:<10}  {:<15}  {}",
        f64::from(frame.now_ms) / 1000.0,
        NOMINAL_HZ + f,
        f64::from(frame.participation_ppm) * 1e-4,
        set_point(frame.set_point),
        phase_name(frame.phase),
        mode_name(frame.mode),
        fault_names(frame),
    );
    text
}

/// Reads a stream to its end (a port: until `stop`) and writes a line for every `every`-th tick and
/// every tick whose mode, phase or faults changed. Without `out` it only counts.
///
/// # Errors
/// The stream cannot be read, or the lines cannot be written.
pub fn watch(
    input: &mut dyn Read,
    mut out: Option<&mut dyn Write>,
    every: u32,
    stop: &dyn Fn() -> bool,
) -> io::Result<Summary> {
    let mut splitter = Splitter::default();
    let mut summary = Summary::default();
    let mut last: Option<Frame> = None;
    let mut failed = None;
    let mut chunk = [0; CHUNK];
    if let Some(out) = &mut out {
        writeln!(out, "{HEADING}")?;
    }
    while !stop() {
        let read = match input.read(&mut chunk) {
            Ok(0) => break,
            Ok(read) => read,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(error) => return Err(error),
        };
        splitter.push(&chunk[..read], |stretch| {
            let frame = match stretch {
                Ok(frame) => frame,
                Err(DecodeError::UnsupportedVersion { .. }) => {
                    summary.other_version += 1;
                    return;
                }
                Err(_) => {
                    summary.rejected += 1;
                    return;
                }
            };
            summary.frames += 1;
            let key = |frame: &Frame| (frame.mode, frame.phase, frame.faults);
            // A sequence that went back is a charger that restarted: nothing was lost.
            let gap = last.map_or(1, |last| frame.sequence.saturating_sub(last.sequence));
            summary.lost += u64::from(gap.saturating_sub(1));
            let changed = last.is_none_or(|last| key(&last) != key(&frame));
            last = Some(frame);
            let due = changed || frame.sequence.is_multiple_of(every.max(1));
            if let (true, Some(out)) = (due, &mut out)
                && let Err(error) = writeln!(out, "{}", line(&frame)).and_then(|()| out.flush())
            {
                failed.get_or_insert(error);
            }
        });
        if let Some(error) = failed {
            return Err(error);
        }
    }
    Ok(summary)
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::telemetry::{TELEMETRY_VERSION, encode};
    use proptest::prelude::*;

    fn frame(sequence: u32, faults: u16) -> Frame {
        Frame {
            version: TELEMETRY_VERSION,
            sequence,
            now_ms: sequence * 100,
            mode: 1,
            phase: 1,
            state: [-412_345, 1_500_000, 700_000, 650_000],
            loss_kw: Some(1_998_000),
            participation_ppm: 350_000,
            set_point: WireSetPoint::CurrentMa(20_800),
            faults,
            misfits: 0,
            table: None,
        }
    }

    fn stream(frames: &[Frame]) -> Vec<u8> {
        let mut bytes = Vec::new();
        for frame in frames {
            bytes.extend_from_slice(encode(frame, &mut [0; FRAME_MAX]));
        }
        bytes
    }

    fn watched(bytes: &[u8], every: u32) -> (Summary, String) {
        let mut text = Vec::new();
        let mut input = bytes;
        let summary = watch(&mut input, Some(&mut text), every, &|| false).unwrap();
        (summary, String::from_utf8(text).unwrap())
    }

    #[test]
    fn prints_every_nth_tick_and_every_change() {
        let frames: Vec<Frame> = (1..=20)
            .map(|n| frame(n, if n == 13 { 0x81 } else { 0 }))
            .collect();
        let (summary, text) = watched(&stream(&frames), 10);
        assert_eq!((summary.frames, summary.lost, summary.rejected), (20, 0, 0));
        let lines: Vec<&str> = text.lines().skip(1).collect();
        // The first, 10, the fault at 13 and its end at 14, 20.
        assert_eq!(lines.len(), 5, "{text}");
        assert!(lines[2].ends_with("bus outside-domain"));
        let whole = "       2.0     49.5877   1.50   0.70   0.65   2.00     35.00     20.8 A  C1          table            -";
        assert_eq!(lines[4], whole);
    }

    #[test]
    fn joins_in_the_middle_and_counts_what_was_lost() {
        let bytes = stream(&[frame(1, 0), frame(2, 0), frame(5, 0), frame(1, 0)]);
        let (summary, _) = watched(&bytes[7..], 1);
        let expected = Summary {
            frames: 3,
            lost: 2,
            rejected: 1,
            other_version: 0,
        };
        assert_eq!(summary, expected);
    }

    #[test]
    fn an_overlong_stretch_is_one_rejection() {
        let mut bytes = vec![7; 10_000];
        bytes.push(0);
        bytes.extend(stream(&[frame(1, 0)]));
        let (summary, _) = watched(&bytes, 1);
        assert_eq!((summary.frames, summary.rejected), (1, 1));
    }

    proptest! {
        #[test]
        fn any_bytes_are_survived_and_the_next_frame_is_read(
            noise in proptest::collection::vec(any::<u8>(), 0..500),
        ) {
            let mut bytes = noise;
            bytes.push(0);
            bytes.extend(stream(&[frame(1, 0)]));
            let (summary, _) = watched(&bytes, 1);
            prop_assert!(summary.frames >= 1);
        }
    }
}
