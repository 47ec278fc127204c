//! Every setting: its number, name, unit, range and default.
//!
//! The number stands in flash and on the line, so it stays for ever: a setting that is removed
//! leaves its number unused. To add one, add it to [`Key`], to [`Key::ALL`] and to [`Key::about`].

/// What is known of a setting.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct About {
    /// Its name, with the unit last.
    pub name: &'static str,
    /// Smallest value.
    pub least: u32,
    /// Largest value.
    pub most: u32,
    /// Value of a charger that was never set.
    pub default: u32,
    /// What it is.
    pub says: &'static str,
}

const fn of(name: &'static str, range: [u32; 2], default: u32, says: &'static str) -> About {
    let [least, most] = range;
    About {
        name,
        least,
        most,
        default,
        says,
    }
}

/// A setting.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Key {
    /// Largest current of a phase.
    RatedCurrent = 1,
    /// Phases that carry it.
    Phases = 2,
    /// Nominal voltage of a phase.
    Voltage = 3,
    /// Which way power can be moved.
    Direction = 4,
    /// Power stage's limit.
    Power = 5,
    /// What measures the mains.
    Meter = 6,
    /// The user's limit.
    UserLimit = 7,
    /// The site's limit.
    SiteLimit = 8,
    /// The cable's limit.
    CableLimit = 9,
    /// Limit on discharging.
    DischargeLimit = 10,
    /// Place in the fleet.
    Threshold = 11,
    /// Error of the clock.
    Clock = 12,
    /// Jitter of a crossing.
    Jitter = 13,
    /// Moving average.
    Filter = 14,
    /// How long the last participation is held without frequency.
    Hold = 15,
    /// How fast it is then released.
    Release = 16,
    /// Delay of a start.
    StartFixed = 17,
    /// Random part of that delay.
    StartRandom = 18,
    /// When an event is over.
    Recovered = 19,
    /// How long the way back takes.
    RecoveredRelease = 20,
    /// How long a pause lasts before the contactor opens.
    ContactorOpenAfter = 21,
    /// How long it then stays open.
    ContactorOffLeast = 22,
    /// Least time between two changes of the pilot.
    PilotGap = 23,
}

/// Number of settings.
pub const KEYS: usize = Key::ALL.len();

impl Key {
    /// Every setting, in the order of the numbers.
    pub const ALL: [Self; 23] = [
        Self::RatedCurrent,
        Self::Phases,
        Self::Voltage,
        Self::Direction,
        Self::Power,
        Self::Meter,
        Self::UserLimit,
        Self::SiteLimit,
        Self::CableLimit,
        Self::DischargeLimit,
        Self::Threshold,
        Self::Clock,
        Self::Jitter,
        Self::Filter,
        Self::Hold,
        Self::Release,
        Self::StartFixed,
        Self::StartRandom,
        Self::Recovered,
        Self::RecoveredRelease,
        Self::ContactorOpenAfter,
        Self::ContactorOffLeast,
        Self::PilotGap,
    ];

    /// The number in flash and on the line.
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// The setting of a number; `None` if there is none.
    pub fn of_number(number: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|key| key.number() == number)
    }

    /// The setting of a name; `None` if there is none.
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|key| key.about().name == name)
    }

    /// Its place in [`Key::ALL`].
    pub(crate) const fn place(self) -> usize {
        self as usize - 1
    }

    /// What is known of it.
    pub const fn about(self) -> About {
        match self {
            Self::RatedCurrent => of(
                "rated_current_ma",
                [6_000, 80_000],
                32_000,
                "what charger and installation bear in each phase",
            ),
            Self::Phases => of("phases", [1, 3], 3, "phases that carry the current"),
            Self::Voltage => of(
                "voltage_v",
                [100, 1_000],
                230,
                "nominal voltage between phase and neutral",
            ),
            Self::Direction => of(
                "direction",
                [0, 1],
                0,
                "0 can only charge, 1 can discharge the car; as the image was built",
            ),
            Self::Power => of(
                "power_w",
                [1, 1_000_000],
                28_000,
                "limit of a bidirectional power stage, both ways",
            ),
            Self::Meter => of(
                "meter",
                [0, 1],
                0,
                "0 zero crossings, 1 ADE7953; as the image was built",
            ),
            Self::UserLimit => of(
                "user_limit_ma",
                [0, 80_000],
                80_000,
                "limit in each phase while the user has ordered no other",
            ),
            Self::SiteLimit => of(
                "site_limit_ma",
                [0, 80_000],
                80_000,
                "limit in each phase while the site has ordered no other",
            ),
            Self::CableLimit => of(
                "cable_limit_ma",
                [0, 80_000],
                32_000,
                "what cable and socket bear in each phase",
            ),
            Self::DischargeLimit => of(
                "discharge_limit_w",
                [0, 1_000_000],
                28_000,
                "most that a bidirectional charger takes out of the car; 0 forbids it",
            ),
            Self::Threshold => of(
                "threshold_ppm",
                [0, 1_000_000],
                1_000_000,
                "place in the fleet below 6 A; 1000000 takes the serial number's",
            ),
            Self::Clock => of(
                "clock_ppm",
                [0, 1_000],
                20,
                "error of the crystal, temperature and ageing included",
            ),
            Self::Jitter => of(
                "jitter_ns",
                [0, 50_000],
                500,
                "jitter of a crossing, the mains' noise included",
            ),
            Self::Filter => of("filter_ticks", [1, 8], 1, "moving average; 1 is none"),
            Self::Hold => of(
                "hold_ticks",
                [0, 600],
                10,
                "how long the last participation is held without frequency",
            ),
            Self::Release => of(
                "release_ppm",
                [1, 1_000_000],
                1_667,
                "participation that is then released in a tick",
            ),
            Self::StartFixed => of(
                "start_fixed_s",
                [10, 3_600],
                60,
                "delay after a start, the same for all; at least contactor_off_least_s",
            ),
            Self::StartRandom => of(
                "start_random_s",
                [0, 3_600],
                600,
                "most of the random delay that is added",
            ),
            Self::Recovered => of(
                "recovered_s",
                [1, 36_000],
                300,
                "how long 49.9 Hz must have been kept until an event is over",
            ),
            Self::RecoveredRelease => of(
                "recovered_release_s",
                [1, 36_000],
                600,
                "time in which an event's participation is then released",
            ),
            Self::ContactorOpenAfter => of(
                "contactor_open_after_s",
                [5, 600],
                10,
                "how long a limit's pause lasts before the contactor opens",
            ),
            Self::ContactorOffLeast => of(
                "contactor_off_least_s",
                [10, 3_600],
                60,
                "how long it then stays open",
            ),
            Self::PilotGap => of(
                "pilot_gap_s",
                [0, 60],
                0,
                "least time between two changes of the pilot, pauses and limits apart",
            ),
        }
    }
}

// What `place` goes by, and that every default is allowed.
const _: () = {
    let mut at = 0;
    while at < KEYS {
        let key = Key::ALL[at];
        let about = key.about();
        assert!(key.place() == at);
        assert!(about.least <= about.default && about.default <= about.most);
        at += 1;
    }
};
