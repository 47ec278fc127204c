//! What the real meters make of an event, against what is assumed of them: edges with jitter by a
//! crystal that is off, and the metering chip's register, each through driver, gate and filter.
//!
//! Losses of 0.9 to 2.2 GW on the paper's plant, without any response, so that f falls as fast as
//! it can; each at 20 phases between the mains, the ticks and the event. A reading is what the
//! proof takes it for if it lies within the stated error of f at some moment of its window; the
//! window of a reading is the stated lag, with half a window and the age on both sides.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::cell::Cell;
use std::rc::Rc;

use firmware::charger::{ChargerConfig, reference};
use firmware::frequency::ade7953::{self, Ade7953, BusError, Registers};
use firmware::frequency::filter::Filter;
use firmware::frequency::gate::{Gate, GateLimits};
use firmware::frequency::zero_crossing::{CYCLES_DEFAULT, ZeroCrossing};
use firmware::frequency::{FrequencySource, Reading};
use model::plant::Plant;
use model::propagator::Propagator;
use model::spec::Spec;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;

/// Step of the simulated mains \[s\]: f bends by less than 0.3 Hz/s, so phases between two steps
/// are off by less than 0.3 · 0.0002² / 8 = 2e-9 of a turn, 3e-11 s.
const STEP_S: f64 = 0.0002;
/// Time before the event and after it \[s\].
const BEFORE_S: f64 = 1.0;
const AFTER_S: f64 = 6.0;
/// Tick of the charger \[ms\].
const TICK_MS: u32 = 100;
/// Phases of the event.
const PHASES: u32 = 20;

/// f over time and the moments of its crossings.
struct Mains {
    /// Deviation at each step \[Hz\].
    f_hz: Vec<f64>,
    /// Rising crossings \[s\].
    crossings_s: Vec<f64>,
}

impl Mains {
    fn new(loss_gw: f64, phase: f64) -> Self {
        let plant = Plant::new(&Spec::load("gb-bi", &[]).unwrap());
        let step = Propagator::new(&plant, STEP_S);
        // The event comes anywhere within a tick.
        let event_s = BEFORE_S + phase * f64::from(TICK_MS) / 1000.0;
        let (mut x, mut turns) = ([0.0; 4], phase);
        let mut mains = Self {
            f_hz: Vec::new(),
            crossings_s: Vec::new(),
        };
        for n in 0..((BEFORE_S + AFTER_S) / STEP_S) as usize {
            let t = n as f64 * STEP_S;
            mains.f_hz.push(x[0]);
            let loss = if t >= event_s { loss_gw } else { 0.0 };
            let next = step.step(&x, -loss);
            let gone = (50.0 + (x[0] + next[0]) / 2.0) * STEP_S;
            if (turns + gone).floor() > turns.floor() {
                let share = (turns.floor() + 1.0 - turns) / gone;
                mains.crossings_s.push(t + share * STEP_S);
            }
            turns += gone;
            x = next;
        }
        mains
    }

    /// How far a value is from all of f between two moments \[Hz\].
    fn distance_hz(&self, value_hz: f64, from_s: f64, to_s: f64) -> f64 {
        let at = |s: f64| (s / STEP_S).round() as usize;
        let range = &self.f_hz[at(from_s)..=at(to_s).min(self.f_hz.len() - 1)];
        let low = range.iter().copied().fold(f64::INFINITY, f64::min);
        let high = range.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        (low - value_hz).max(value_hz - high).max(0.0)
    }
}

/// What was found: the largest error \[Hz\], and how many readings it was of.
#[derive(Debug, Default)]
struct Found {
    largest_hz: f64,
    readings: u32,
}

/// Every loss and phase, judged by what a reading is off by.
fn all(mut one: impl FnMut(&Mains, u64, &mut Found)) -> Found {
    let mut found = Found::default();
    for tenths in 9..=22 {
        for phase in 0..PHASES {
            let mains = Mains::new(
                f64::from(tenths) / 10.0,
                f64::from(phase) / f64::from(PHASES),
            );
            one(&mains, u64::from(tenths * PHASES + phase), &mut found);
        }
    }
    found
}

/// The gate and the filter of a charger.
struct Believed {
    gate: Gate,
    filter: Filter,
}

impl Believed {
    fn new(source: &impl FrequencySource) -> Self {
        let gate = Gate::new(
            GateLimits::DEFAULT,
            TICK_MS as u16,
            source.error_uhz(),
            source.stuck_after(),
        );
        Self {
            gate,
            filter: Filter::new(ChargerConfig::DEFAULT.filter_ticks),
        }
    }

    /// What the charger works with \[Hz\]; every reading of a healthy mains is believed.
    fn take(&mut self, reading: Reading) -> f64 {
        let admitted = self.gate.admit(Ok(reading)).unwrap();
        f64::from(self.filter.step(admitted)) / 1e6
    }
}

/// Edges that come too late or too early by the whole jitter, by a crystal at the end of its
/// tolerance.
fn edges(mains: &Mains, seed: u64, found: &mut Found) {
    let mut random = Pcg32::seed_from_u64(seed);
    let mut sign = || if random.random::<bool>() { 1.0 } else { -1.0 };
    let jitter_s = f64::from(reference::JITTER_NS) * 1e-9;
    let clock = 1.0 + sign() * f64::from(reference::CLOCK_PPM) * 1e-6;
    let mut source = ZeroCrossing::new(reference::TIMER_HZ, CYCLES_DEFAULT, reference::CLOCK_PPM)
        .unwrap()
        .with_jitter_ns(reference::JITTER_NS);
    let mut believed = Believed::new(&source);
    let cycles = usize::from(CYCLES_DEFAULT);
    let mut captured = 0;
    for tick in 1..((BEFORE_S + AFTER_S) * 1000.0) as u32 / TICK_MS {
        let now_ms = tick * TICK_MS;
        let now_s = f64::from(now_ms) / 1000.0;
        while captured < mains.crossings_s.len() && mains.crossings_s[captured] <= now_s {
            let at_s = mains.crossings_s[captured];
            let ticks = (at_s + sign() * jitter_s) * clock * f64::from(reference::TIMER_HZ);
            // The counter wraps.
            let stamp = ticks.max(0.0) as u64 as u32;
            source.capture(stamp, (at_s * 1000.0) as u32);
            captured += 1;
        }
        if captured <= cycles {
            continue;
        }
        let reading = source.read(now_ms).unwrap();
        let value = believed.take(reading);
        // Cycles over time are the mean of f over the window.
        let (from_s, to_s) = (
            mains.crossings_s[captured - 1 - cycles],
            mains.crossings_s[captured - 1],
        );
        let mean_hz = f64::from(CYCLES_DEFAULT) / (to_s - from_s) - 50.0;
        let error = (value - mean_hz).abs();
        found.largest_hz = found.largest_hz.max(error);
        found.readings += 1;
    }
}

/// The chip, on its side of the bus; PERIOD is what the mains was last.
struct Chip {
    period: Rc<Cell<u16>>,
    last: u16,
}

impl Registers for Chip {
    fn write_u8(&mut self, _address: u16, _value: u8) -> Result<(), BusError> {
        Ok(())
    }

    fn write_u16(&mut self, _address: u16, value: u16) -> Result<(), BusError> {
        self.last = value;
        Ok(())
    }

    fn read_u16(&mut self, address: u16) -> Result<u16, BusError> {
        self.last = match address {
            ade7953::PERIOD => self.period.get(),
            ade7953::REQUIRED => ade7953::REQUIRED_VALUE,
            _ => self.last,
        };
        Ok(self.last)
    }
}

/// The register holds the last whole period, counted by a clock at an end of its tolerance.
fn chip(mains: &Mains, seed: u64, found: &mut Found) {
    let sign = if seed.is_multiple_of(2) { 1.0 } else { -1.0 };
    let clock = 1.0 + sign * f64::from(ade7953::CLOCK_PPM) * 1e-6;
    let period = Rc::new(Cell::new(0));
    let mut source = Ade7953::new(Chip {
        period: Rc::clone(&period),
        last: 0,
    });
    let mut believed = Believed::new(&source);
    let mut crossed = 1;
    for now_ms in 0..((BEFORE_S + AFTER_S) * 1000.0) as u32 {
        let now_s = f64::from(now_ms) / 1000.0;
        while crossed < mains.crossings_s.len() && mains.crossings_s[crossed] <= now_s {
            let period_s = mains.crossings_s[crossed] - mains.crossings_s[crossed - 1];
            let counts = (period_s * clock * f64::from(ade7953::PERIOD_CLOCK_HZ)).floor();
            period.set(counts as u16 - 1);
            crossed += 1;
        }
        // Five samples, and the period that the first is about.
        if crossed < 8 {
            continue;
        }
        if now_ms % TICK_MS != 0 {
            source.poll(now_ms);
            continue;
        }
        let value = believed.take(source.read(now_ms).unwrap());
        // Five samples 20 ms apart; the oldest is of a period that ended up to 20 ms before it.
        let oldest_s = now_s - 0.02 * 7.0;
        let error = mains.distance_hz(value, oldest_s, now_s);
        found.largest_hz = found.largest_hz.max(error);
        found.readings += 1;
    }
}

/// Of 14 losses at 20 phases, 70 ticks each but the first that fill the window.
const READINGS_LEAST: u32 = 14 * 20 * 66;

fn judge(name: &str, found: &Found, stated_uhz: u32) {
    let stated_hz = f64::from(stated_uhz) / 1e6;
    println!(
        "{name}: {} readings, off by {:.3} mHz at most, {:.3} mHz are stated",
        found.readings,
        found.largest_hz * 1e3,
        stated_hz * 1e3
    );
    assert!(found.readings >= READINGS_LEAST, "{found:?}");
    assert!(found.largest_hz <= stated_hz, "{found:?}");
    // The bound is not idle.
    assert!(found.largest_hz >= stated_hz / 3.0, "{found:?}");
}

#[test]
fn captured_edges_are_within_what_the_source_states_and_the_specs_assume() {
    let found = all(edges);
    let stated = reference::products()[0].meter.error_uhz;
    judge("captured edges", &found, stated);
    for name in ["gb-bi", "gb-uni"] {
        let spec = Spec::load(name, &[]).unwrap();
        let assumed_hz = spec.uncertainty.measurement[0];
        assert!(found.largest_hz <= assumed_hz && found.largest_hz >= assumed_hz / 3.0);
        // What the verdict works out from [meter] covers what the source says of itself.
        assert!(f64::from(stated) / 1e6 <= verify::response::error_hz(&spec));
    }
}

#[test]
fn the_metering_chip_is_within_what_it_states() {
    let found = all(chip);
    judge("metering chip", &found, ade7953::ERROR_UHZ);
}
