//! What happens to the grid and the charger in a run: the paper's event, the recorded day, and
//! random ones with faults.

use firmware::link::{Mains, Setup, SourceKind};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// A fault of the measurement or of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fault {
    /// Nothing is measured.
    Silent,
    /// The reading is this old \[ms\].
    Old(u16),
    /// The reading jumps by this much \[Hz\].
    Jump(f64),
    /// Any register or reading value.
    Noise(u16),
    /// The clock gains this much \[ms\].
    Late(i32),
}

/// A run in closed loop.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// The charger.
    pub setup: Setup,
    /// Ticks.
    pub ticks: u32,
    /// Ticks after which a command acts on the grid.
    pub delay_ticks: u16,
    /// Lost power \[GW\], from the tick.
    pub losses: Vec<(u32, f64)>,
    /// Measurement noise \[Hz\].
    pub noise_hz: f64,
    /// First tick, number of ticks, fault.
    pub faults: Vec<(u32, u32, Fault)>,
    /// Seed of the noise.
    pub seed: u64,
}

/// The paper's event: 2 GW at rest, full precision, 120 s.
pub fn event(bidirectional: bool) -> Scenario {
    Scenario {
        setup: Setup {
            source: SourceKind::Deviation,
            bidirectional,
            serial: 1,
            limit: if bidirectional { 28_000 } else { 32_000 },
            warm_up_ticks: Some(0),
            brown_out: false,
        },
        ticks: 1200,
        delay_ticks: 0,
        losses: vec![(0, 2.0)],
        noise_hz: 0.0,
        faults: Vec::new(),
        seed: 0,
    }
}

/// The paper's event to its end: reserves replace the lost power from 200 s to 500 s, and the fleet
/// is released; 25 min.
pub fn recovery() -> Scenario {
    let replaced = (0..=20u32).map(|n| (2000 + 150 * n, 2.0 - 0.1 * f64::from(n)));
    Scenario {
        ticks: 15_000,
        losses: [(0, 2.0)].into_iter().chain(replaced).collect(),
        ..event(true)
    }
}

/// The n-th random scenario: any source, any charger, up to three losses or returns of load, up to
/// four faults.
pub fn random(n: u64, ticks: u32) -> Scenario {
    let mut random = Pcg64::seed_from_u64(n);
    let source = [
        SourceKind::Deviation,
        SourceKind::Ade7953,
        SourceKind::ZeroCrossing,
    ][random.random_range(0..3)];
    let bidirectional = random.random_bool(0.5);
    let losses = (0..random.random_range(1..=3))
        .map(|_| {
            (
                random.random_range(0..ticks),
                random.random_range(-1.0..2.2),
            )
        })
        .collect();
    let faults = (0..random.random_range(0..=4))
        .map(|_| {
            let fault = match random.random_range(0..5) {
                0 => Fault::Silent,
                1 => Fault::Old(random.random_range(0..2000)),
                2 => Fault::Jump(random.random_range(-6.0..6.0)),
                3 => Fault::Noise(random.random_range(0..=u16::MAX)),
                _ => Fault::Late(random.random_range(-3000..3000)),
            };
            let length = [1, 2, 5, 15, 40][random.random_range(0..5)];
            (random.random_range(0..ticks), length, fault)
        })
        .collect();
    Scenario {
        setup: Setup {
            source,
            bidirectional,
            serial: random.random_range(0..=u32::MAX),
            limit: random.random_range(0..100_000),
            warm_up_ticks: Some(random.random_range(0..100)),
            brown_out: random.random_bool(0.3),
        },
        ticks,
        delay_ticks: 0,
        losses,
        noise_hz: [0.0, 0.001, 0.01][random.random_range(0..3)],
        faults,
        seed: random.random_range(0..=u64::MAX),
    }
}

impl Fault {
    /// What the charger reads under this fault instead.
    pub fn disturb(self, mains: Mains) -> Mains {
        match (self, mains) {
            (Self::Silent, _) => Mains::Silent,
            (Self::Old(age_ms), Mains::Deviation { uhz, .. }) => Mains::Deviation { uhz, age_ms },
            (Self::Jump(hz), Mains::Deviation { uhz, age_ms }) => Mains::Deviation {
                uhz: uhz.saturating_add((hz * 1e6) as i32),
                age_ms,
            },
            (Self::Noise(value), Mains::Deviation { age_ms, .. }) => Mains::Deviation {
                uhz: i32::from(value) * 40_000 - 1_300_000_000,
                age_ms,
            },
            (Self::Jump(_) | Self::Noise(_), Mains::Period(period)) => {
                let value = if let Self::Noise(value) = self {
                    value
                } else {
                    50
                };
                Mains::Period(period ^ value)
            }
            (Self::Noise(value), Mains::Crossings { count, mut stamps }) => {
                for (n, stamp) in stamps.iter_mut().enumerate() {
                    *stamp ^= u32::from(value) << (n * 2);
                }
                Mains::Crossings { count, stamps }
            }
            (_, mains) => mains,
        }
    }
}
