//! A value for every setting.
//!
//! A set of values is either whole and allowed, or it is not made: each value lies in its range,
//! and the values fit each other and the image that is to run with them.

use firmware::table::Direction;

use crate::key::{KEYS, Key};

/// What the image was built for: settings can say nothing else.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Build {
    /// Which way its output moves power.
    pub direction: Direction,
    /// What measures the mains: 0 zero crossings, 1 ADE7953.
    pub meter: u8,
}

impl Build {
    /// The image `holdfast`.
    pub const REFERENCE: Self = Self {
        direction: Direction::Unidirectional,
        meter: 0,
    };
}

/// What a bidirectional charger bears unless it is set: its power stage's 28 kW on three phases of
/// 230 V \[mA\].
pub const STAGE_MA: u32 = 41_000;
const _: () = assert!(3 * 230 * STAGE_MA / 1_000 >= Key::Power.about().default);

/// Why values are not allowed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ValueError {
    /// There is no setting of this number.
    Unknown {
        /// Number found.
        number: u8,
    },
    /// The value lies outside the setting's range, [`Key::about`].
    OutOfRange {
        /// The setting.
        key: Key,
        /// Value found.
        value: u32,
    },
    /// The image was built for another value.
    NotThisImage {
        /// The setting.
        key: Key,
        /// The value that this image has.
        built: u32,
    },
    /// The start's delay must cover the time for which the contactor stays open, for nobody knows
    /// when it opened before a reset.
    StartTooSoon {
        /// `start_fixed_s` found.
        start_s: u32,
        /// `contactor_off_least_s` found.
        off_s: u32,
    },
}

/// A value for every setting, each in its range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Values([u32; KEYS]);

impl Values {
    /// Those of a charger that was never set, of the image `holdfast`.
    pub const DEFAULT: Self = {
        let mut values = [0; KEYS];
        let mut at = 0;
        while at < KEYS {
            values[at] = Key::ALL[at].about().default;
            at += 1;
        }
        Self(values)
    };

    /// Those of a charger of this build that was never set.
    pub const fn defaults(build: Build) -> Self {
        let mut values = Self::DEFAULT;
        if let Direction::Bidirectional = build.direction {
            values.0[Key::RatedCurrent.place()] = STAGE_MA;
            values.0[Key::CableLimit.place()] = STAGE_MA;
        }
        values.0[Key::Direction.place()] = build.direction as u32;
        values.0[Key::Meter.place()] = build.meter as u32;
        values
    }

    /// Those of a charger whose settings cannot be read: nobody knows what its cable bears, so it
    /// offers nothing.
    pub const fn nothing_known(build: Build) -> Self {
        let mut values = Self::defaults(build);
        values.0[Key::CableLimit.place()] = 0;
        values.0[Key::DischargeLimit.place()] = 0;
        values
    }

    /// A setting's value.
    pub fn get(&self, key: Key) -> u32 {
        self.0.get(key.place()).copied().unwrap_or_default()
    }

    /// These values with some others, all or none of them.
    ///
    /// # Errors
    /// The first value that is not allowed, or why the whole is not.
    pub fn with(&self, changes: &[(u8, u32)], build: Build) -> Result<Self, ValueError> {
        let mut values = *self;
        for &(number, value) in changes {
            let key = Key::of_number(number).ok_or(ValueError::Unknown { number })?;
            let about = key.about();
            if !(about.least..=about.most).contains(&value) {
                return Err(ValueError::OutOfRange { key, value });
            }
            if let Some(slot) = values.0.get_mut(key.place()) {
                *slot = value;
            }
        }
        values.check(build)?;
        Ok(values)
    }

    /// Whether the values fit each other and the image.
    fn check(&self, build: Build) -> Result<(), ValueError> {
        let built = [
            (Key::Direction, build.direction as u32),
            (Key::Meter, u32::from(build.meter)),
        ];
        for (key, built) in built {
            if self.get(key) != built {
                return Err(ValueError::NotThisImage { key, built });
            }
        }
        let start_s = self.get(Key::StartFixed);
        let off_s = self.get(Key::ContactorOffLeast);
        if start_s < off_s {
            return Err(ValueError::StartTooSoon { start_s, off_s });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const BUILD: Build = Build::REFERENCE;

    #[test]
    fn the_defaults_are_allowed_for_every_build() {
        for direction in [Direction::Unidirectional, Direction::Bidirectional] {
            for meter in [0, 1] {
                let build = Build { direction, meter };
                let values = Values::defaults(build);
                assert_eq!(values.with(&[], build), Ok(values));
                let nothing = Values::nothing_known(build);
                assert_eq!(nothing.with(&[], build), Ok(nothing));
            }
        }
    }

    #[test]
    fn every_range_ends_where_it_says() {
        // The delay of the start must not be what refuses the contactor's time.
        let wide = [
            (Key::StartFixed.number(), 3_600),
            (Key::ContactorOffLeast.number(), 10),
        ];
        let base = Values::DEFAULT.with(&wide, BUILD).unwrap();
        for key in Key::ALL {
            let about = key.about();
            let set = |value| base.with(&[(key.number(), value)], BUILD);
            let refused = |value| Err(ValueError::OutOfRange { key, value });
            if about.least > 0 {
                assert_eq!(set(about.least - 1), refused(about.least - 1));
            }
            assert_eq!(set(about.most + 1), refused(about.most + 1));
            for value in [about.least, about.most] {
                match set(value) {
                    Ok(values) => assert_eq!(values.get(key), value),
                    Err(ValueError::NotThisImage { key: found, built }) => {
                        assert_eq!((found, built), (key, 0));
                    }
                    Err(other) => panic!("{other:?}"),
                }
            }
        }
    }

    #[test]
    fn what_does_not_fit_together_is_refused_as_a_whole() {
        let values = Values::DEFAULT;
        let sooner = [(Key::Phases.number(), 1), (Key::StartFixed.number(), 59)];
        let too_soon = ValueError::StartTooSoon {
            start_s: 59,
            off_s: 60,
        };
        assert_eq!(values.with(&sooner, BUILD), Err(too_soon));
        assert_eq!(
            values.with(&[(0, 1)], BUILD),
            Err(ValueError::Unknown { number: 0 })
        );
    }

    proptest! {
        /// Whatever is asked for: refused, or every value is in its range, and the rest stays.
        #[test]
        fn values_are_always_allowed(
            changes in proptest::collection::vec((0u8..30, prop_oneof![0u32..100, any::<u32>(), 5_000u32..90_000]), 0..6),
        ) {
            if let Ok(values) = Values::DEFAULT.with(&changes, BUILD) {
                for key in Key::ALL {
                    let about = key.about();
                    let value = values.get(key);
                    prop_assert!((about.least..=about.most).contains(&value));
                    let last = changes.iter().rev().find(|(number, _)| *number == key.number());
                    let expected = last.map_or(Values::DEFAULT.get(key), |(_, value)| *value);
                    prop_assert_eq!(value, expected);
                }
                prop_assert!(values.get(Key::StartFixed) >= values.get(Key::ContactorOffLeast));
            }
        }
    }
}
