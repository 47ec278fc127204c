//! Values to what the firmware takes.

use core::num::NonZeroU16;

use firmware::charger::{ChargerConfig, Installation, StartDelay, reference};
use firmware::dispatch::bidirectional::Bidirectional;
use firmware::dispatch::bidirectional::PowerStage;
use firmware::dispatch::car::CarSense;
use firmware::dispatch::contactor::ContactorTimes;
use firmware::dispatch::fleet::Threshold;
use firmware::dispatch::pace::Pace;
use firmware::dispatch::unidirectional::Unidirectional;
use firmware::dispatch::{LIMIT_SOURCES, LimitSource};
use firmware::event::EventEnd;
use firmware::fault::Faults;
use firmware::frequency::{FrequencyError, FrequencySource, NOMINAL_HZ, Reading};
use firmware::response::LevelOffset;
use firmware::table::{Direction, TICK_MS_MAX};
use firmware::wide::divide;

use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;

use crate::key::Key;
use crate::values::Values;

/// `threshold_ppm` that stands for the serial number's place.
const BY_SERIAL: u32 = 1_000_000;

/// A chip and its start, which settings do not say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Board {
    /// Serial number: the place in the fleet.
    pub serial: u32,
    /// Starts before this one since the supply came.
    pub starts: u8,
    /// What is wrong with the board in this run.
    pub faults: Faults,
}

impl Values {
    /// A value that its range keeps within 16 bits.
    fn short(&self, key: Key) -> u16 {
        u16::try_from(self.get(key)).unwrap_or(u16::MAX)
    }

    /// Power of a current in each phase \[W\].
    fn power_w(&self, current_ma: u32) -> u32 {
        // At most 3 phases of 1 kV and 80 A: 240 kW, and 2.4e11 mW.
        let milliwatts =
            u64::from(self.get(Key::Phases) * self.get(Key::Voltage)) * u64::from(current_ma);
        divide(milliwatts, 1_000)
    }

    /// Which way power can be moved.
    pub fn direction(&self) -> Direction {
        match self.get(Key::Direction) {
            0 => Direction::Unidirectional,
            _ => Direction::Bidirectional,
        }
    }

    /// The current of each phase that charger, installation and cable bear \[mA\].
    pub fn borne_ma(&self) -> u32 {
        self.get(Key::RatedCurrent).min(self.get(Key::CableLimit))
    }

    /// What the charger is, to be compared with what the proof of its table assumed.
    pub fn installation(&self) -> Installation {
        let power_w = match self.direction() {
            Direction::Unidirectional => self.power_w(self.borne_ma()),
            // From charging with all to discharging with all.
            Direction::Bidirectional => {
                self.charge_w(self.borne_ma()) + self.discharge_w(self.borne_ma())
            }
        };
        Installation {
            direction: self.direction(),
            power_w,
            tick_most_ms: TICK_MS_MAX,
            // At most 60 s.
            change_gap_ms: self.short(Key::PilotGap).saturating_mul(1_000),
        }
    }

    /// Charging power of a bidirectional power stage at a current's limit \[W\].
    fn charge_w(&self, current_ma: u32) -> u32 {
        self.get(Key::Power).min(self.power_w(current_ma))
    }

    /// Discharging power of it at the same limit \[W\].
    fn discharge_w(&self, current_ma: u32) -> u32 {
        self.get(Key::DischargeLimit).min(self.charge_w(current_ma))
    }

    /// The charger's configuration.
    pub fn charger(&self, board: &Board) -> ChargerConfig {
        let street = StartDelay {
            fixed_s: self.short(Key::StartFixed),
            random_s: self.short(Key::StartRandom),
            seed: board.serial,
        };
        ChargerConfig {
            filter_ticks: u8::try_from(self.get(Key::Filter)).unwrap_or(u8::MAX),
            hold_ticks: self.short(Key::Hold),
            release_ppm: self.get(Key::Release),
            level_offset: LevelOffset::of_serial(board.serial),
            installation: Some(self.installation()),
            event_end: EventEnd {
                recovered_s: self.short(Key::Recovered),
                release_s: self.short(Key::RecoveredRelease),
                ..EventEnd::DEFAULT
            },
            start_delay: street.after_starts(board.starts),
            standing_faults: board.faults,
            ..ChargerConfig::DEFAULT
        }
    }

    /// The contactor's times.
    pub fn contactor(&self) -> ContactorTimes {
        ContactorTimes {
            open_after_ms: self.get(Key::ContactorOpenAfter) * 1_000,
            off_min_ms: self.get(Key::ContactorOffLeast) * 1_000,
        }
    }

    /// The pace of the pilot.
    pub fn pace(&self) -> Pace {
        Pace::new(self.get(Key::PilotGap) * 1_000)
    }

    /// The place in the fleet.
    pub fn threshold(&self, serial: u32) -> Threshold {
        match self.get(Key::Threshold) {
            BY_SERIAL.. => Threshold::of_serial(serial),
            ppm => Threshold::from_ppm(ppm),
        }
    }

    /// Limits while nobody has ordered others \[mA\], in the order of [`LimitSource`].
    pub fn limits_ma(&self) -> [u32; LIMIT_SOURCES] {
        [
            self.get(Key::UserLimit),
            self.get(Key::SiteLimit),
            self.borne_ma(),
        ]
    }
}

/// A dispatcher whose limits can be set by current.
pub trait Limited {
    /// Replaces one source's limit \[mA in each phase\]; in force from the next tick.
    fn limit(&mut self, source: LimitSource, ma: u32, values: &Values);
}

impl<P: SetDutyCycle, O: OutputPin, C: CarSense> Limited for Unidirectional<P, O, C> {
    fn limit(&mut self, source: LimitSource, ma: u32, _values: &Values) {
        self.set_limit(source, ma);
    }
}

impl<S: PowerStage> Limited for Bidirectional<S> {
    fn limit(&mut self, source: LimitSource, ma: u32, values: &Values) {
        self.set_limits(source, values.charge_w(ma), values.discharge_w(ma));
    }
}

/// A source whose clock and jitter are worse than those that it was built for: its error says so.
#[derive(Debug)]
pub struct Judged<S> {
    source: S,
    added_uhz: u32,
}

impl<S: FrequencySource> Judged<S> {
    /// A source with the clock and jitter of these values, that was built for
    /// [`reference::CLOCK_PPM`] and [`reference::JITTER_NS`]. Better ones are not believed: the
    /// error is at least what the source says of itself.
    pub fn new(source: S, values: &Values) -> Self {
        let ppm = values
            .get(Key::Clock)
            .saturating_sub(u32::from(reference::CLOCK_PPM));
        let ns = values.get(Key::Jitter).saturating_sub(reference::JITTER_NS);
        // 1 ppm of 50 Hz is 50 µHz. A window of n cycles whose two ends are wrong by t is wrong by
        // 2 f² t / n; 1 covers every window: 5 µHz a ns at 50 Hz.
        let jitter = ns.saturating_mul(2 * NOMINAL_HZ * NOMINAL_HZ / 1_000);
        let added_uhz = ppm.saturating_mul(NOMINAL_HZ).saturating_add(jitter);
        Self { source, added_uhz }
    }
}

impl<S: FrequencySource> FrequencySource for Judged<S> {
    fn error_uhz(&self) -> u32 {
        self.source.error_uhz().saturating_add(self.added_uhz)
    }

    fn lag_ms(&self) -> u16 {
        self.source.lag_ms()
    }

    fn stuck_after(&self) -> Option<NonZeroU16> {
        self.source.stuck_after()
    }

    fn poll(&mut self, now_ms: u32) {
        self.source.poll(now_ms);
    }

    fn read(&mut self, now_ms: u32) -> Result<Reading, FrequencyError> {
        self.source.read(now_ms)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::values::{Build, STAGE_MA};

    const BOARD: Board = Board {
        serial: 7,
        starts: 0,
        faults: Faults::NONE,
    };

    /// What the images are configured as without settings, `firmware/images/holdfast.rs`.
    #[test]
    fn the_defaults_are_the_images() {
        for (direction, installation) in [
            (
                Direction::Unidirectional,
                Installation::REFERENCE_UNIDIRECTIONAL,
            ),
            (
                Direction::Bidirectional,
                Installation::REFERENCE_BIDIRECTIONAL,
            ),
        ] {
            let values = Values::defaults(Build {
                direction,
                meter: 0,
            });
            let expected = ChargerConfig {
                level_offset: LevelOffset::of_serial(7),
                start_delay: StartDelay::street(7).after_starts(0),
                installation: Some(installation),
                ..ChargerConfig::DEFAULT
            };
            assert_eq!(values.charger(&BOARD), expected);
            assert_eq!(values.contactor(), ContactorTimes::DEFAULT);
            assert_eq!(values.threshold(7), Threshold::of_serial(7));
            let borne = match direction {
                Direction::Unidirectional => 32_000,
                Direction::Bidirectional => STAGE_MA,
            };
            assert_eq!(values.limits_ma().iter().min(), Some(&borne));
        }
    }

    #[test]
    fn each_value_reaches_what_it_is_for() {
        let set = |changes: &[(Key, u32)]| {
            let changes: std::vec::Vec<_> = changes
                .iter()
                .map(|(key, value)| (key.number(), *value))
                .collect();
            Values::DEFAULT.with(&changes, Build::REFERENCE).unwrap()
        };
        let one_phase = set(&[(Key::Phases, 1), (Key::RatedCurrent, 16_000)]);
        assert_eq!(one_phase.installation().power_w, 3_680);
        assert_eq!(one_phase.limits_ma(), [80_000, 80_000, 16_000]);
        let thin = set(&[(Key::CableLimit, 20_000), (Key::PilotGap, 5)]);
        assert_eq!(thin.installation().power_w, 13_800);
        assert_eq!(thin.installation().change_gap_ms, 5_000);
        let charger = set(&[
            (Key::Filter, 2),
            (Key::Hold, 20),
            (Key::Release, 3_000),
            (Key::StartFixed, 120),
            (Key::StartRandom, 30),
            (Key::Recovered, 400),
            (Key::RecoveredRelease, 900),
        ])
        .charger(&BOARD);
        assert_eq!((charger.filter_ticks, charger.hold_ticks), (2, 20));
        assert_eq!(charger.release_ppm, 3_000);
        let start = charger.start_delay;
        assert_eq!((start.fixed_s, start.random_s), (120, 30));
        let end = charger.event_end;
        assert_eq!((end.recovered_s, end.release_s), (400, 900));
        let times = set(&[(Key::ContactorOpenAfter, 20), (Key::ContactorOffLeast, 30)]).contactor();
        assert_eq!((times.open_after_ms, times.off_min_ms), (20_000, 30_000));
        assert_eq!(
            set(&[(Key::Threshold, 5)]).threshold(7),
            Threshold::from_ppm(5)
        );
    }

    #[test]
    fn unreadable_settings_offer_nothing() {
        let values = Values::nothing_known(Build::REFERENCE);
        assert_eq!(values.limits_ma().iter().min(), Some(&0));
        assert_eq!(values.installation().power_w, 0);
    }

    #[test]
    fn a_worse_clock_is_a_larger_error_and_a_better_one_is_not_believed() {
        struct Mains;
        impl FrequencySource for Mains {
            fn error_uhz(&self) -> u32 {
                2_000
            }
            fn lag_ms(&self) -> u16 {
                50
            }
            fn stuck_after(&self) -> Option<NonZeroU16> {
                None
            }
            fn read(&mut self, _: u32) -> Result<Reading, FrequencyError> {
                Err(FrequencyError::NoSignal)
            }
        }
        let error = |clock, jitter| {
            let changes = [(Key::Clock.number(), clock), (Key::Jitter.number(), jitter)];
            let values = Values::DEFAULT.with(&changes, Build::REFERENCE).unwrap();
            Judged::new(Mains, &values).error_uhz()
        };
        assert_eq!(error(20, 500), 2_000);
        assert_eq!(error(0, 0), 2_000);
        assert_eq!(error(30, 500), 2_500);
        assert_eq!(error(20, 700), 3_000);
    }
}
