//! The C functions as C calls them: what they refuse, and that they do what the library does.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on fails"
)]

use std::ffi::c_void;
use std::mem::zeroed;
use std::ptr::{null, null_mut};

use firmware::limit_provider::LimitProvider;
use holdfast::captures::{
    Captures, holdfast_captures_add, holdfast_captures_init, holdfast_captures_lost,
    holdfast_captures_read, holdfast_captures_size,
};
use holdfast::numbers::{HOLDFAST_MISFIT_DIRECTION, HOLDFAST_MISFIT_POWER, HOLDFAST_NO_LIMIT};
use holdfast::numbers::{Mode, Status, TableFault};
use holdfast::provider::{
    Provider, holdfast_align, holdfast_default_config, holdfast_init, holdfast_size, holdfast_tick,
    holdfast_tick_ms,
};
use holdfast::records::{CapturesConfig, Config, Input, Output, TableInfo};
use holdfast::settings;
use holdfast::table::{holdfast_compare, holdfast_read_table};

static TABLE: &[u8] = include_bytes!("../../tables/gb-bi.bin");

fn default_config(direction: u8) -> Config {
    let mut config = zeroed_config();
    let status = unsafe { holdfast_default_config(&raw mut config, direction, 7) };
    assert_eq!(status, Status::Ok);
    config.meter_error_uhz = 3_000;
    config.meter_lag_ms = 50;
    config
}

fn zeroed_config() -> Config {
    // SAFETY: a record of integers.
    unsafe { zeroed() }
}

fn zeroed_provider() -> Box<Provider> {
    Box::new(Provider { words: [0; 256] })
}

fn init(provider: &mut Provider, table: &'static [u8], config: &Config) -> Status {
    let memory: *mut Provider = provider;
    // SAFETY: what the function asks for, by the references.
    unsafe {
        holdfast_init(
            memory.cast(),
            size_of::<Provider>(),
            table.as_ptr(),
            table.len(),
            config,
        )
    }
}

fn input(now_ms: u32, deviation_uhz: i32) -> Input {
    Input {
        now_ms,
        deviation_uhz,
        age_ms: 0,
        reading: 1,
        car_present: 1,
        limit_ma: HOLDFAST_NO_LIMIT,
        charge_limit_w: 28_000,
        discharge_limit_w: 28_000,
    }
}

fn any_output() -> Output {
    // SAFETY: a record of integers.
    let mut output: Output = unsafe { zeroed() };
    output.power_w = -1;
    output
}

#[test]
fn the_memory_has_the_size_that_the_header_says() {
    assert_eq!(holdfast_size(), size_of::<Provider>());
    assert_eq!(holdfast_align(), align_of::<Provider>());
    assert_eq!(holdfast_captures_size(), size_of::<Captures>());
}

#[test]
fn wrong_memory_is_refused() {
    let mut provider = zeroed_provider();
    let memory = (&raw mut *provider).cast::<c_void>();
    let (size, config) = (size_of::<Provider>(), default_config(1));
    let (table, length) = (TABLE.as_ptr(), TABLE.len());
    let odd = memory.cast::<u8>().wrapping_add(1).cast::<c_void>();
    let odd_config = (&raw const config)
        .cast::<u8>()
        .wrapping_add(1)
        .cast::<Config>();
    unsafe {
        let with = |memory, size, table, config| holdfast_init(memory, size, table, length, config);
        assert_eq!(with(null_mut(), size, table, &config), Status::Null);
        assert_eq!(with(memory, size, null(), &config), Status::Null);
        assert_eq!(with(memory, size, table, null()), Status::Null);
        assert_eq!(with(odd, size, table, &config), Status::Misaligned);
        assert_eq!(with(memory, size, table, odd_config), Status::Misaligned);
        assert_eq!(with(memory, size - 1, table, &config), Status::TooSmall);
        let endless = holdfast_init(memory, size, table, usize::MAX, &config);
        assert_eq!(endless, Status::TooSmall);
    }
    // None of them made a provider.
    assert!(provider.words.iter().all(|word| *word == 0));
    let mut output = any_output();
    let told = input(0, 0);
    unsafe {
        let status = holdfast_tick(&raw mut *provider, &told, &raw mut output);
        assert_eq!(status, Status::NotInitialised);
        assert_eq!(output.power_w, 0);
        output.power_w = -1;
        let status = holdfast_tick(null_mut(), &told, &raw mut output);
        assert_eq!((status, output.power_w), (Status::Null, 0));
        assert_eq!(holdfast_tick_ms(&raw mut *provider), 0);
        assert_eq!(holdfast_tick_ms(null_mut()), 0);
    }
    assert_eq!(init(&mut provider, TABLE, &config), Status::Ok);
    unsafe {
        let provider = &raw mut *provider;
        assert_eq!(holdfast_tick_ms(provider), 100);
        let status = holdfast_tick(provider, null(), &raw mut output);
        assert_eq!((status, output.power_w), (Status::Null, 0));
        assert_eq!(holdfast_tick(provider, &told, null_mut()), Status::Null);
        assert_eq!(holdfast_default_config(null_mut(), 0, 1), Status::Null);
    }
}

/// A change of a configuration.
type Change = fn(&mut Config);

#[test]
fn each_wrong_field_has_its_own_answer() {
    let wrong: [(Change, Status); 20] = [
        (|c| c.version = 2, Status::WrongVersion),
        (|c| c.direction = 2, Status::BadDirection),
        (|c| c.phases = 0, Status::BadConnection),
        (|c| c.phases = 4, Status::BadConnection),
        (|c| c.voltage_v = 0, Status::BadConnection),
        (|c| c.voltage_v = 1001, Status::BadConnection),
        (|c| c.power_w = 0, Status::BadPower),
        (|c| c.tick_most_ms = 0, Status::BadTick),
        (|c| c.meter_error_uhz = u32::MAX, Status::BadMeter),
        (|c| c.range_uhz = 0, Status::BadGate),
        (|c| c.range_uhz = 10_000_001, Status::BadGate),
        (|c| c.rate_uhz_per_s = 0, Status::BadGate),
        (|c| c.age_ms = 0, Status::BadGate),
        (|c| c.filter_ticks = 0, Status::BadFilter),
        (|c| c.filter_ticks = 9, Status::BadFilter),
        (|c| c.release_ppm = 0, Status::BadRelease),
        (|c| c.release_ppm = 1_000_001, Status::BadRelease),
        (|c| c.recovered_release_s = 0, Status::BadRelease),
        (|c| c.reset_cause = 3, Status::BadResetCause),
        (|c| *c = zeroed_config(), Status::WrongVersion),
    ];
    let mut provider = zeroed_provider();
    for (change, status) in wrong {
        let mut config = default_config(1);
        change(&mut config);
        assert_eq!(init(&mut provider, TABLE, &config), status);
    }
    // A meter that nobody has told of is among them.
    let mut untold = zeroed_config();
    unsafe {
        assert_eq!(holdfast_default_config(&raw mut untold, 1, 7), Status::Ok);
        let refused = holdfast_default_config(&raw mut untold, 2, 7);
        assert_eq!(refused, Status::BadDirection);
    }
    assert_eq!(init(&mut provider, TABLE, &untold), Status::BadMeter);
}

#[test]
fn a_table_is_asked_before_it_is_used() {
    let mut region = [0xFF; 2048];
    region[..TABLE.len()].copy_from_slice(TABLE);
    let ask = |bytes: &[u8]| unsafe {
        let mut info: TableInfo = zeroed();
        let status = holdfast_read_table(bytes.as_ptr(), bytes.len(), &raw mut info);
        (status, info)
    };
    let (status, info) = ask(&region);
    assert_eq!(status, Status::Ok);
    assert_eq!(info.length as usize, TABLE.len());
    let crc = TABLE.last_chunk::<4>().unwrap();
    assert_eq!(info.crc, u32::from_le_bytes(*crc));
    assert_eq!((info.tick_ms, info.direction, info.fault), (100, 1, 0));
    assert_eq!(info.power_per_charger_w, 56_000);
    region[100] ^= 1;
    let (status, info) = ask(&region);
    assert_eq!(status, Status::TableRejected);
    assert_eq!(info.fault, TableFault::BadCrc as u8);
    let (status, info) = ask(&[0xFF; 2048]);
    assert_eq!(status, Status::TableRejected);
    assert_eq!(info.fault, TableFault::BadMagic as u8);
}

#[test]
fn a_charger_that_does_not_fit_is_told_so_before_and_after() {
    let compare = |config: &Config| unsafe {
        let mut found = 0xFF;
        let status = holdfast_compare(TABLE.as_ptr(), TABLE.len(), config, &raw mut found);
        (status, found)
    };
    assert_eq!(compare(&default_config(1)), (Status::Ok, 0));
    let other_way = default_config(0);
    let bits = HOLDFAST_MISFIT_DIRECTION | HOLDFAST_MISFIT_POWER;
    assert_eq!(compare(&other_way), (Status::Misfit, bits));
    let mut provider = zeroed_provider();
    assert_eq!(init(&mut provider, TABLE, &other_way), Status::Misfit);
    let mut output = any_output();
    let told = input(100, 0);
    let status = unsafe { holdfast_tick(&raw mut *provider, &told, &raw mut output) };
    assert_eq!(status, Status::Ok);
    assert_eq!(
        (output.mode, output.misfits),
        (Mode::DroopMisfit as u8, bits)
    );
    assert_eq!(
        init(&mut provider, &[0; 16], &other_way),
        Status::TableRejected
    );
}

/// A fall by 0.25 Hz/s to 49.4 Hz, through C and through the library.
#[test]
fn c_does_what_the_library_does() {
    let mut config = default_config(1);
    (config.start_fixed_s, config.start_random_s) = (0, 0);
    let mut provider = zeroed_provider();
    assert_eq!(init(&mut provider, TABLE, &config), Status::Ok);
    let (settings, cause) = settings::checked(&config).unwrap();
    let mut library = LimitProvider::new(TABLE, &settings, cause);
    let mut lowest_w = i32::MAX;
    for tick in 0..600 {
        let told = input(100 * tick, -(25_000 * tick.min(24)).cast_signed());
        // C may move the memory between calls.
        *provider = Provider {
            words: provider.words,
        };
        let mut output = any_output();
        let status = unsafe { holdfast_tick(&raw mut *provider, &told, &raw mut output) };
        assert_eq!(status, Status::Ok);
        let (report, allowed) = library.tick(told.now_ms, &settings::inputs(&told));
        assert_eq!(output, Output::of(&report, &allowed));
        lowest_w = lowest_w.min(output.power_w);
    }
    assert!(lowest_w < 0, "the car was never discharged: {lowest_w} W");
}

#[test]
fn crossings_become_readings() {
    let mut config = default_config(0);
    let setup = CapturesConfig {
        timer_hz: 1_000_000,
        jitter_ns: 0,
        clock_ppm: 20,
        cycles: 5,
        nominal_hz: 60,
    };
    let mut captures = Box::new(Captures { words: [0; 40] });
    let memory = &raw mut *captures;
    let size = size_of::<Captures>();
    let mut told = input(0, 0);
    unsafe {
        let init = |setup: &CapturesConfig, size, config: *mut Config| {
            holdfast_captures_init(memory.cast(), size, setup, config)
        };
        let status = holdfast_captures_add(memory, 0, 0);
        assert_eq!(status, Status::NotInitialised);
        assert_eq!(init(&setup, size - 1, &raw mut config), Status::TooSmall);
        assert_eq!(init(&setup, size, null_mut()), Status::Null);
        let wrong = [
            (
                CapturesConfig {
                    timer_hz: 1,
                    ..setup
                },
                Status::BadTimer,
            ),
            (
                CapturesConfig {
                    cycles: 17,
                    ..setup
                },
                Status::BadCycles,
            ),
            (
                CapturesConfig {
                    nominal_hz: 55,
                    ..setup
                },
                Status::BadNominal,
            ),
            (
                CapturesConfig {
                    clock_ppm: 1001,
                    ..setup
                },
                Status::BadClock,
            ),
            (
                CapturesConfig {
                    jitter_ns: 1_000_001,
                    ..setup
                },
                Status::BadClock,
            ),
        ];
        for (setup, status) in wrong {
            assert_eq!(init(&setup, size, &raw mut config), status);
        }
        assert_eq!(init(&setup, size, &raw mut config), Status::Ok);
        // 60 Hz over 5 cycles of a 1 MHz timer: 721 uHz for a timer tick, 1 and 1200 uHz for clock
        // and rounding; half of 83 ms.
        assert_eq!((config.meter_error_uhz, config.meter_lag_ms), (1_922, 41));
        let read = |now_ms, told: &mut Input| holdfast_captures_read(memory, now_ms, told);
        assert_eq!(read(10, &mut told), Status::Ok);
        assert_eq!((told.now_ms, told.reading), (10, 0));
        for n in 0..6 {
            let status = holdfast_captures_add(memory, 16_000 * n, 16 * n);
            assert_eq!(status, Status::Ok);
        }
        assert_eq!(read(85, &mut told), Status::Ok);
        // 62.5 Hz.
        let reading = (told.reading, told.deviation_uhz, told.age_ms);
        assert_eq!(reading, (1, 2_500_000, 5));
        assert_eq!(holdfast_captures_lost(memory), Status::Ok);
        assert_eq!(read(90, &mut told), Status::Ok);
        assert_eq!(told.reading, 0);
        assert_eq!(holdfast_captures_read(memory, 0, null_mut()), Status::Null);
        assert_eq!(holdfast_captures_lost(null_mut()), Status::Null);
    }
}
