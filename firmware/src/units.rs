//! Quantities as integers in micro-units: frequency in µHz, power in kW (which is µGW), time in µs.
//!
//! The grid model works in Hz and GW; one micro-unit is 1e-6 of either. A state variable is stored
//! as the *floor* of its value in micro-units. Cell edges are whole micro-units too, so flooring
//! never moves a state across an edge: the real value lies in a half-open cell exactly when the
//! stored integer does.

/// Number of state variables.
pub const STATES: usize = 4;
/// Axis of the frequency deviation f \[µHz\].
pub const AXIS_F: usize = 0;
/// Axis of the governor output g \[kW\].
pub const AXIS_G: usize = 1;
/// Axis of the lead-lag output l \[kW\].
pub const AXIS_L: usize = 2;
/// Axis of the turbine output p \[kW\].
pub const AXIS_P: usize = 3;
/// Micro-units in one Hz, one GW, one second, or the whole fleet.
pub const MICRO: i32 = 1_000_000;

/// Grid state (f, g, l, p) as deviation from nominal, in micro-units: µHz, then kW three times.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct State(pub [i32; STATES]);

impl State {
    /// Deviation of the frequency from 50 Hz \[µHz\].
    pub const fn frequency_uhz(self) -> i32 {
        self.0[AXIS_F]
    }
}

/// Share of the fleet that responds, in parts per million: 0 is none, 1 000 000 every charger.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Participation(u32);

impl Participation {
    /// No charger responds.
    pub const NONE: Self = Self(0);
    /// Every charger responds.
    pub const ALL: Self = Self(MICRO as u32);

    /// From parts per million; more than the whole fleet is clamped to the whole fleet.
    pub const fn from_ppm(ppm: u32) -> Self {
        if ppm > MICRO as u32 {
            Self::ALL
        } else {
            Self(ppm)
        }
    }

    /// Parts per million, 0..=1 000 000.
    pub const fn ppm(self) -> u32 {
        self.0
    }
}

/// A closed interval of frequency deviation \[µHz\].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Band {
    /// Lowest deviation inside \[µHz\].
    pub low_uhz: i32,
    /// Highest deviation inside \[µHz\].
    pub high_uhz: i32,
}

impl Band {
    /// Whether the stored frequency lies in the band. The stored integer is the floor of the real
    /// frequency, so at the upper end the real one may be up to 1 µHz above it.
    pub const fn contains(self, state: State) -> bool {
        let f = state.frequency_uhz();
        self.low_uhz <= f && f <= self.high_uhz
    }
}
