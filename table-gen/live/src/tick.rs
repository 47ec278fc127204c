//! A frame as the page shows it: every text is made here, so that the page cannot differ from what
//! `monitor` prints.

use firmware::fault::Faults;
use firmware::telemetry::Frame;
use lab::simulation::NOMINAL_HZ;
use lab::telemetry_lines::{fault_names, loss_text, mode_name, phase_name, set_point};
use serde::Serialize;

/// What the proof assumes of a charger and a frame can contradict.
const HYPOTHESES: [(&str, &[Faults]); 5] = [
    (
        "frequency measured and believed",
        &[
            Faults::BUS,
            Faults::NO_SIGNAL,
            Faults::STALE,
            Faults::STUCK,
            Faults::OUT_OF_RANGE,
            Faults::IMPLAUSIBLE,
            Faults::CLOCK,
        ],
    ),
    (
        "table in force, state inside its domain",
        &[Faults::TABLE_REJECTED, Faults::OUTSIDE_DOMAIN],
    ),
    (
        "ticks on time, estimate trusted",
        &[
            Faults::OVERRUN,
            Faults::CLOCK_JUMP,
            Faults::RESTARTED,
            Faults::STOPPED,
        ],
    ),
    ("set-point taken by the hardware", &[Faults::DISPATCH]),
    (
        "meter, tick, direction and power as the proof has them",
        &[Faults::MISFIT, Faults::GUARDED],
    ),
];

/// A hypothesis of the proof at a tick.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Hypothesis {
    /// In words.
    pub name: &'static str,
    /// Whether the frame bears it out.
    pub holds: bool,
}

/// A tick of a charger.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tick {
    /// Name of the charger: that of its port or recording.
    pub charger: String,
    /// Ticks since its start.
    pub sequence: u32,
    /// Its clock \[s\].
    pub time_s: f64,
    /// Frequency \[Hz\], as a number for the curve.
    pub f_hz: f64,
    /// The same as text.
    pub frequency: String,
    /// Share of the fleet that is to respond \[%\].
    pub participation: String,
    /// What the charger was told.
    pub set_point: String,
    /// The law in force.
    pub phase: &'static str,
    /// Who decides.
    pub mode: &'static str,
    /// Lost power \[GW\].
    pub loss: String,
    /// Faults, `-` for none.
    pub faults: String,
    /// What the proof assumes.
    pub hypotheses: Vec<Hypothesis>,
}

impl Tick {
    /// The tick of a frame.
    pub fn of(charger: &str, frame: &Frame) -> Self {
        let f_hz = NOMINAL_HZ + f64::from(frame.state[0]) * 1e-6;
        let faults = Faults::from_bits(frame.faults);
        let hypothesis = |(name, against): (&'static str, &[Faults])| Hypothesis {
            name,
            holds: !against.iter().any(|fault| faults.contains(*fault)),
        };
        Self {
            charger: charger.to_owned(),
            sequence: frame.sequence,
            time_s: f64::from(frame.now_ms) / 1000.0,
            f_hz,
            frequency: format!("{f_hz:.4}"),
            participation: format!("{:.2}", f64::from(frame.participation_ppm) * 1e-4),
            set_point: set_point(frame.set_point),
            phase: phase_name(frame.phase),
            mode: mode_name(frame.mode),
            loss: loss_text(frame.loss_kw),
            faults: fault_names(frame),
            hypotheses: HYPOTHESES.map(hypothesis).to_vec(),
        }
    }
}
