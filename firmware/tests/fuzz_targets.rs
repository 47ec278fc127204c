//! The fuzz targets on a bounded corpus that is the same each time: seeds, and mutations of them.
//!
//! The seeds are what the firmware itself writes, so that the mutations get past the first checks;
//! each test shows that some did and some did not.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on fails"
)]

#[path = "../fuzz/src/lib.rs"]
#[allow(unreachable_pub, reason = "the files are a library of their own")]
mod fuzz;

mod bounded;

use bounded::bounded;
use firmware::link::{self, Mains, Request, Setup, SourceKind};
use firmware::telemetry::{self, Frame, TELEMETRY_VERSION, TableId, WireSetPoint};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

#[test]
fn any_flash_region_is_rejected_or_answers() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tables");
    let seeds: Vec<Vec<u8>> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "bin"))
        .map(|path| std::fs::read(path).unwrap())
        .collect();
    assert!(seeds.iter().all(|seed| fuzz::table::run(seed)));
    bounded(&seeds, 20_000, fuzz::table::run);
}

#[test]
fn any_telemetry_is_rejected_or_a_frame() {
    let frame = Frame {
        version: TELEMETRY_VERSION,
        sequence: 70_000,
        now_ms: u32::MAX,
        mode: 1,
        phase: 2,
        state: [-150_000, 0, 2_000_000, -1],
        loss_kw: Some(-2_000_000),
        participation_ppm: 1_000_000,
        set_point: WireSetPoint::PowerW(-28_000),
        faults: u16::MAX,
        misfits: 0x3F,
        table: Some(TableId {
            spec_hash: [0xA5; 16],
            crc: 0x1234_5678,
        }),
    };
    let short = Frame {
        loss_kw: None,
        table: None,
        set_point: WireSetPoint::Unknown,
        ..frame
    };
    let mut seeds = Vec::new();
    for frame in [frame, short] {
        let mut buffer = [0; telemetry::FRAME_MAX];
        seeds.push(telemetry::encode(&frame, &mut buffer).to_vec());
        let mut record = [0; telemetry::FRAME_MAX];
        seeds.push(postcard::to_slice(&frame, &mut record).unwrap().to_vec());
    }
    assert!(seeds.iter().all(|seed| fuzz::telemetry::run(seed)));
    bounded(&seeds, 200_000, fuzz::telemetry::run);
}

#[test]
fn any_frames_of_the_link_are_answered() {
    let setup = |source, bidirectional| Setup {
        source,
        bidirectional,
        serial: 7,
        limit: 32_000,
        warm_up_ticks: Some(0),
        brown_out: false,
    };
    let stamps = [0, 20_000, 40_000, 60_000, 80_000, 100_000, 120_000, 140_000];
    let played = [
        vec![
            Request::Hello,
            Request::Start(setup(SourceKind::Deviation, true)),
            Request::Tick {
                now_ms: 0,
                mains: Mains::Deviation {
                    uhz: -310_000,
                    age_ms: 0,
                },
            },
            Request::Tick {
                now_ms: 100,
                mains: Mains::Silent,
            },
        ],
        vec![
            Request::Start(setup(SourceKind::Ade7953, false)),
            Request::Tick {
                now_ms: 0,
                mains: Mains::Period(4474),
            },
            Request::Reset,
            Request::State([-310_000, 1_000_000, 0, 0]),
            Request::Lookup {
                law: 2,
                state: [-310_000, 0, 0, 0],
            },
        ],
        vec![
            Request::Start(setup(SourceKind::ZeroCrossing, false)),
            Request::Tick {
                now_ms: u32::MAX,
                mains: Mains::Crossings { count: 8, stamps },
            },
            Request::Stop,
        ],
    ];
    let seeds = played.map(|requests| {
        let mut buffer = [0; link::FRAME_MAX];
        let frames = requests.iter();
        frames
            .flat_map(|request| link::encode(request, &mut buffer).to_vec())
            .collect()
    });
    assert!(seeds.iter().all(|seed: &Vec<u8>| fuzz::link::run(seed)));
    bounded(&seeds, 50_000, fuzz::link::run);
}

#[test]
fn any_readings_give_a_participation() {
    let mut random = Pcg64::seed_from_u64(2);
    let ticks = 64;
    // Plausible readings at 100 ms: what a mutation leaves of them is a fault in a sound run.
    let seeds: Vec<Vec<u8>> = (0..=u8::MAX)
        .map(|kind| {
            let mut bytes = vec![kind];
            for _ in 0..ticks {
                let uhz: i32 = random.random_range(-500_000..0);
                let deviation = uhz.to_le_bytes();
                bytes.extend([100, 0, 0]);
                bytes.extend(deviation);
                bytes.push(0);
            }
            bytes
        })
        .collect();
    bounded(&seeds, 5_000, fuzz::readings::run);
}
