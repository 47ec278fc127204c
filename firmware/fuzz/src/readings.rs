//! Any register values, time stamps and clocks through the drivers and the whole charger.

use firmware::fault::Mode;
use firmware::frequency::ade7953::deviation_uhz;
use firmware::link::session::{Session, Wires};
use firmware::link::{Mains, Request, Response, Setup, SourceKind};

/// Bytes of a tick.
const TICK_LEN: usize = 8;

/// The first byte is the charger, each eight after it are a tick; whether a tick was not in a mode
/// that gives nothing.
pub fn run(bytes: &[u8]) -> bool {
    let Some((kind, rest)) = bytes.split_first() else {
        return false;
    };
    let wires = Wires::default();
    let mut session = Session::new(&wires, super::table::SHIPPED[usize::from(kind >> 7)]);
    let sources = [
        SourceKind::Deviation,
        SourceKind::Ade7953,
        SourceKind::ZeroCrossing,
    ];
    let setup = Setup {
        source: sources[usize::from(kind % 3)],
        bidirectional: kind & 4 == 0,
        serial: u32::from(*kind),
        limit: u32::from(*kind) * 1000,
        warm_up_ticks: Some(u16::from(kind >> 4)),
        brown_out: kind & 8 == 0,
    };
    session.handle(&Request::Start(setup));
    let mut responded = false;
    let mut now_ms = 0u32;
    for chunk in rest.chunks_exact(TICK_LEN) {
        let word = |at: usize| u16::from_le_bytes([chunk[at], chunk[at + 1]]);
        now_ms = now_ms.wrapping_add(u32::from(word(0)) << (chunk[2] & 16));
        let value = u32::from_le_bytes([chunk[3], chunk[4], chunk[5], chunk[6]]);
        let _ = deviation_uhz(word(4));
        let mains = match setup.source {
            SourceKind::Deviation => Mains::Deviation {
                uhz: value as i32,
                age_ms: u16::from(chunk[7]),
            },
            SourceKind::Ade7953 => Mains::Period(word(4)),
            SourceKind::ZeroCrossing => {
                let mut stamps = [value; 8];
                for (n, stamp) in stamps.iter_mut().enumerate() {
                    *stamp = stamp.wrapping_add(n as u32 * (u32::from(word(6)) % 30_000));
                }
                Mains::Crossings {
                    count: chunk[7],
                    stamps,
                }
            }
        };
        let response = session.handle(&Request::Tick { now_ms, mains });
        let Response::Tick { frame, .. } = response else {
            panic!("{response:?}");
        };
        assert!(frame.participation_ppm <= 1_000_000);
        assert!(usize::from(frame.mode) < Mode::ALL.len());
        responded |= frame.mode != Mode::WarmUp as u8 && frame.mode != Mode::Safe as u8;
    }
    responded
}
