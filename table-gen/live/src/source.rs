//! A port or a recording to ticks.

use std::io::{self, Read};
use std::time::{Duration, Instant};

use lab::telemetry_lines::Splitter;

use crate::feed::Feed;
use crate::tick::Tick;

/// Bytes read at a time.
const CHUNK: usize = 4096;
/// Longest sleep between two looks at `stop`.
const NAP: Duration = Duration::from_millis(50);
/// Longest pause that a recording is played with: a restart of the charger is no pause.
const PAUSE_MAX_S: f64 = 2.0;

/// How fast ticks are handed on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pace {
    /// As they come: a port.
    Live,
    /// By the charger's clock, so many times as fast: a recording.
    Times(f64),
}

/// Reads a stream to its end, or until `stop`; the number of frames.
///
/// # Errors
/// The stream cannot be read.
pub fn play(
    charger: &str,
    input: &mut dyn Read,
    pace: Pace,
    feed: &Feed,
    stop: &dyn Fn() -> bool,
) -> io::Result<u64> {
    let mut splitter = Splitter::default();
    let mut buffer = [0; CHUNK];
    let mut frames = 0;
    let mut clock = None;
    loop {
        let length = match input.read(&mut buffer) {
            Ok(0) => return Ok(frames),
            Ok(length) => length,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => 0,
            Err(error) => return Err(error),
        };
        let mut ready = Vec::new();
        splitter.push(&buffer[..length], |stretch| ready.extend(stretch));
        for frame in &ready {
            if let Pace::Times(factor) = pace {
                let waited = wait_for(frame.now_ms, factor, &mut clock, stop);
                if !waited {
                    return Ok(frames);
                }
            }
            feed.push(&Tick::of(charger, frame));
            frames += 1;
        }
        if stop() {
            return Ok(frames);
        }
    }
}

/// Waits until a tick is due; false if stopped before.
fn wait_for(
    now_ms: u32,
    factor: f64,
    clock: &mut Option<(u32, Instant)>,
    stop: &dyn Fn() -> bool,
) -> bool {
    let Some((before_ms, at)) = *clock else {
        *clock = Some((now_ms, Instant::now()));
        return !stop();
    };
    let step_s = f64::from(now_ms.wrapping_sub(before_ms)) / 1000.0;
    let pause_s = step_s.min(PAUSE_MAX_S) / factor;
    let due = at + Duration::from_secs_f64(pause_s);
    loop {
        if stop() {
            return false;
        }
        let left = due.saturating_duration_since(Instant::now());
        if left.is_zero() {
            // By when it was due, not when it was done: pauses do not add up.
            *clock = Some((now_ms, due));
            return true;
        }
        std::thread::sleep(left.min(NAP));
    }
}
