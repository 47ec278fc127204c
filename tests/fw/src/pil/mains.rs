//! The mains as a charger sees it: a frequency as readings, register values or zero crossings.

use firmware::link::session::TIMER_HZ;
use firmware::link::{Mains, SourceKind};

/// Turns a frequency per tick into what the session's source reads.
#[derive(Debug, Clone)]
pub struct MainsModel {
    source: SourceKind,
    /// Mains phase since the last crossing, in periods.
    phase: f64,
    /// Time since the start \[s\].
    time_s: f64,
}

impl MainsModel {
    /// A mains whose first crossing comes a period after the start.
    pub const fn new(source: SourceKind) -> Self {
        Self {
            source,
            phase: 0.0,
            time_s: 0.0,
        }
    }

    /// The tick that ends now, at this deviation \[Hz\], constant over the tick.
    pub fn tick(&mut self, deviation_hz: f64, tick_s: f64) -> Mains {
        let hz = 50.0 + deviation_hz;
        let start_s = self.time_s;
        self.time_s += tick_s;
        match self.source {
            SourceKind::Deviation => Mains::Deviation {
                uhz: (deviation_hz * 1e6).floor() as i32,
                age_ms: 0,
            },
            SourceKind::Ade7953 => Mains::Period((223_750.0 / hz - 1.0) as u16),
            SourceKind::ZeroCrossing => {
                let mut stamps = [0; 8];
                let mut count = 0u8;
                let mut next_s = start_s + (1.0 - self.phase) / hz;
                while next_s <= self.time_s && usize::from(count) < stamps.len() {
                    // The timer is 32 bits wide and wraps.
                    let ticks = (next_s * f64::from(TIMER_HZ)) as u64;
                    stamps[usize::from(count)] = ticks as u32;
                    count += 1;
                    next_s += 1.0 / hz;
                }
                self.phase = (self.phase + hz * tick_s).fract();
                Mains::Crossings { count, stamps }
            }
        }
    }
}
