//! Scenarios of the processor in the loop as calls from C: the host plays the grid, the library
//! closes the loop, and the calls are recorded.

use std::fmt;

use firmware::link::{Mains, SourceKind};
use firmware::table::{Direction, PlantParameters, TableView};
use holdfast::numbers::{HOLDFAST_NO_LIMIT, HOLDFAST_WARM_UP_BY_PLANT, Reading};
use holdfast::records::{CapturesConfig, Config, Input};
use holdfast::settings;
use model::propagator::Propagator;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::calls::Recording;
use super::error::CApiError;
use crate::pil::mains::MainsModel;
use crate::pil::run::plant;
use crate::pil::scenario::{self, Fault, Scenario};

/// Length of a tick \[ms\].
const TICK_MS: u32 = 100;
/// What separates the draws of this module from those of the scenario.
const SEED: u64 = 0x4341_5049;

/// What a recording came to, for a person.
#[derive(Debug, Clone, Copy, Default)]
pub struct Tally {
    /// Ticks.
    pub ticks: u64,
    /// Lowest deviation \[Hz\].
    pub lowest_hz: f64,
    /// Largest participation \[ppm\].
    pub most_ppm: u32,
    /// Ticks by mode's number.
    pub modes: [u64; 8],
    /// All faults seen.
    pub faults: u16,
    /// All misfits seen.
    pub misfits: u8,
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [warm_up, table, outside, none, hold, safe, release, misfit] = self.modes;
        write!(
            f,
            "lowest {:.3} Hz, participation up to {:.3}, faults {:#06x}, misfits {:#04x}; ticks: {warm_up} warm-up, \
             {table} table, {outside} outside, {none} no table, {hold} hold, {safe} safe, {release} release, {misfit} misfit",
            50.0 + self.lowest_hz,
            f64::from(self.most_ppm) * 1e-6,
            self.faults,
            self.misfits
        )
    }
}

/// Sets a charger up for a table: as its proof assumed.
fn fitting(table: &[u8], scenario: &Scenario) -> Result<Config, CApiError> {
    let setup = &scenario.setup;
    let failed = |text: String| CApiError::Failed(text);
    let mut config = settings::defaults(u8::from(setup.bidirectional), setup.serial)
        .map_err(|status| failed(format!("{status:?}")))?;
    config.meter_error_uhz = 0;
    config.reset_cause = u8::from(setup.brown_out);
    config.warm_up_ticks = setup.warm_up_ticks.unwrap_or(HOLDFAST_WARM_UP_BY_PLANT);
    (config.start_fixed_s, config.start_random_s) = (0, 0);
    if let Ok(view) = TableView::parse(table) {
        let assumed = &view.header().hypotheses;
        let [least_ms, _] = assumed.meter_lag_ms;
        config.meter_lag_ms = least_ms;
        config.power_w = assumed.power_per_charger_w;
        config.direction = match assumed.direction {
            Direction::Unidirectional => 0,
            Direction::Bidirectional => 1,
        };
    }
    Ok(config)
}

/// What the crossings of a scenario are stamped with: the timer of the link.
const CAPTURES: CapturesConfig = CapturesConfig {
    timer_hz: firmware::link::session::TIMER_HZ,
    jitter_ns: 0,
    clock_ppm: 20,
    cycles: 5,
    nominal_hz: 50,
};

/// The paper's event over the table of this number.
///
/// # Errors
/// As [`Recording::start`].
pub fn event(
    recording: &mut Recording<'_>,
    tables: &[Vec<u8>],
    table: usize,
    tally: &mut Tally,
) -> Result<(), CApiError> {
    let bytes = tables.get(table).map_or(&[][..], Vec::as_slice);
    let bidirectional = TableView::parse(bytes)
        .is_ok_and(|view| view.header().hypotheses.direction == Direction::Bidirectional);
    let scenario = scenario::event(bidirectional);
    let config = fitting(bytes, &scenario)?;
    recording.start(table, &config, None)?;
    play(recording, &scenario, None, tally);
    Ok(())
}

/// The n-th random scenario over one of the tables. One in ten is set up with a field that does not
/// fit; limits, start and car differ from scenario to scenario.
///
/// # Errors
/// As [`Recording::start`].
pub fn random(
    recording: &mut Recording<'_>,
    tables: &[Vec<u8>],
    n: u64,
    ticks: u32,
    tally: &mut Tally,
) -> Result<(), CApiError> {
    let scenario = scenario::random(n, ticks);
    let mut random = Pcg64::seed_from_u64(n ^ SEED);
    let table = random.random_range(0..tables.len());
    let bytes = tables.get(table).map_or(&[][..], Vec::as_slice);
    let mut config = fitting(bytes, &scenario)?;
    if random.random_bool(0.1) {
        config.power_w = random.random_range(1..=200_000);
    }
    config.phases = random.random_range(1..=3);
    config.voltage_v = random.random_range(100..=400);
    config.filter_ticks = if random.random_bool(0.2) {
        random.random_range(2..=8)
    } else {
        1
    };
    config.stuck_after_ticks = [0, 0, 20][random.random_range(0..3)];
    config.start_random_s = [0, 0, 0, 20][random.random_range(0..4)];
    let window = (scenario.setup.source == SourceKind::ZeroCrossing).then_some(&CAPTURES);
    recording.start(table, &config, window)?;
    play(recording, &scenario, Some(random), tally);
    Ok(())
}

/// Limits and car of a tick.
struct Surroundings {
    random: Option<Pcg64>,
    now: Input,
}

impl Surroundings {
    fn new(scenario: &Scenario, random: Option<Pcg64>) -> Self {
        let limit = scenario.setup.limit;
        let now = Input {
            now_ms: 0,
            deviation_uhz: 0,
            age_ms: 0,
            reading: Reading::None as u8,
            car_present: 1,
            limit_ma: if random.is_some() {
                limit
            } else {
                HOLDFAST_NO_LIMIT
            },
            charge_limit_w: 28_000,
            discharge_limit_w: 28_000,
        };
        Self { random, now }
    }

    /// The next tick's: something changes once in a hundred ticks.
    fn next(&mut self, now_ms: u32) -> Input {
        self.now.now_ms = now_ms;
        if let Some(random) = &mut self.random {
            let any = |random: &mut Pcg64| {
                [
                    random.random_range(0..40_000),
                    random.random(),
                    HOLDFAST_NO_LIMIT,
                ][random.random_range(0..3)]
            };
            match random.random_range(0..400) {
                0 => self.now.car_present = u8::from(random.random_bool(0.7)),
                1 => self.now.limit_ma = any(random),
                2 => self.now.charge_limit_w = any(random),
                3 => self.now.discharge_limit_w = any(random),
                _ => {}
            }
        }
        self.now
    }
}

/// What a meter of the scenario's kind would have told.
fn tell(input: &mut Input, mains: &Mains) {
    match *mains {
        Mains::Silent | Mains::Crossings { .. } => input.reading = Reading::None as u8,
        Mains::Deviation { uhz, age_ms } => {
            input.reading = Reading::Valid as u8;
            (input.deviation_uhz, input.age_ms) = (uhz, age_ms);
        }
        // A chip with a counter of 223.75 kHz, read over a bus.
        Mains::Period(period) => {
            let uhz = 223_750_000_000_i64 / (i64::from(period) + 1) - 50_000_000;
            input.reading = if period == 0 {
                Reading::MeterFailed as u8
            } else {
                Reading::Valid as u8
            };
            input.deviation_uhz = i32::try_from(uhz).unwrap_or(i32::MAX);
            input.age_ms = 0;
        }
    }
}

/// Plays a scenario in closed loop with the library, and records the calls.
fn play(
    recording: &mut Recording<'_>,
    scenario: &Scenario,
    random: Option<Pcg64>,
    tally: &mut Tally,
) {
    let tick_s = f64::from(TICK_MS) / 1000.0;
    let fleet_gw = f64::from(PlantParameters::PAPER.fleet_kw) * 1e-6;
    let step = Propagator::new(&plant(fleet_gw), tick_s);
    let mut noise = Pcg64::seed_from_u64(scenario.seed);
    let mut mains = MainsModel::new(scenario.setup.source);
    let mut around = Surroundings::new(scenario, random);
    let (mut x, mut now_ms) = ([0.0; 4], 0u32);
    for tick in 0..scenario.ticks {
        let noise_hz = if scenario.noise_hz > 0.0 {
            noise.random_range(-scenario.noise_hz..=scenario.noise_hz)
        } else {
            0.0
        };
        let mut seen = mains.tick(x[0] + noise_hz, tick_s);
        for (first, length, fault) in &scenario.faults {
            if !(*first..first + length).contains(&tick) {
                continue;
            }
            match fault {
                Fault::Late(ms) if tick == *first => now_ms = now_ms.wrapping_add_signed(*ms),
                fault => seen = fault.disturb(seen),
            }
        }
        let mut input = around.next(now_ms);
        tell(&mut input, &seen);
        if let Mains::Crossings { count, stamps } = seen {
            for stamp in stamps.iter().take(usize::from(count)) {
                recording.crossing(*stamp, now_ms);
            }
        }
        let output = recording.tick(&input);
        let share = f64::from(output.participation_ppm) * 1e-6;
        tally.ticks += 1;
        tally.most_ppm = tally.most_ppm.max(output.participation_ppm);
        tally.faults |= output.faults;
        tally.misfits |= output.misfits;
        if let Some(ticks) = tally.modes.get_mut(usize::from(output.mode)) {
            *ticks += 1;
        }
        now_ms = now_ms.wrapping_add(TICK_MS);
        let begun = scenario.losses.iter().filter(|(from, _)| *from <= tick);
        let loss_gw = begun
            .max_by_key(|(from, _)| *from)
            .map_or(0.0, |(_, gw)| *gw);
        x = step.step(&x, fleet_gw * share - loss_gw);
        tally.lowest_hz = tally.lowest_hz.min(x[0]);
    }
}
