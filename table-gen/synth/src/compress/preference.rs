//! What a controller should do where the game leaves it free.
//!
//! A game says which inputs are allowed, not which are good. The preferred law says what is good,
//! and the table follows it where the game allows it. With P the fleet's power, w the loss that the
//! table is made for (the middle of its band) and p the turbines' output,
//!
//! ```text
//! P u = w - p + D f + 2 H k (f_ref - f)        clamped to 0 ≤ u ≤ 1
//! ```
//!
//! Under it f' = k (f_ref - f): f goes straight to f_ref, with the time constant 1/k. While f falls
//! below I1 the right side is more than the whole fleet, so every charger helps until the nadir is
//! behind. Near f_ref the law asks for what is missing and no more, and the input held in Fixed is
//! a good one.

use firmware::grid::Cell;
use firmware::table::{AFFINE_FRACTION_BITS, AffineFunction};
use firmware::units::{AXIS_F, AXIS_P};

use model::grid_shape::GridShape;
use model::plant::STATES;
use model::spec::Spec;

use super::CompressError;
use crate::drives::{MICRO, middle_power};
use crate::game::levels::{nearest, widened};

/// The preferred law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Preference {
    /// How fast f goes to its aim, k \[1/s\], 0 or more.
    pub recovery_per_s: f64,
    /// Where f should go, as a deviation \[Hz\].
    pub aim_hz: f64,
}

impl Preference {
    /// That of a spec, to the middle of I2; `None` if it has none. 1/s is a good one: slower laws
    /// leave f nearer to I2's lower end, and cells of C2 in which they are not allowed.
    pub fn of(spec: &Spec) -> Option<Self> {
        let [low, high] = spec.requirements.inner_hz;
        Some(Self {
            recovery_per_s: spec.preference.recovery_per_s?,
            aim_hz: 0.5 * (low + high),
        })
    }

    /// The law in levels, as the device's integers, over cells by their centres.
    ///
    /// # Errors
    /// A law so steep that a factor does not fit the format.
    pub fn law(
        &self,
        spec: &Spec,
        shape: &GridShape<STATES>,
    ) -> Result<AffineFunction, CompressError> {
        let plant = &spec.plant;
        let gain_gw_per_hz = 2.0 * plant.inertia_gw_s_per_hz * self.recovery_per_s;
        let loss_gw = -middle_power(spec, 0) / MICRO;
        // Of a level, in micro-units of power as the grid's cells are.
        let per_level = spec.fleet_power_gw() * spec.input.value(1) * MICRO;
        let mut slopes = [0.0; STATES];
        slopes[AXIS_F] = (plant.damping_gw_per_hz - gain_gw_per_hz) / per_level;
        slopes[AXIS_P] = -1.0 / per_level;
        // Half a level more turns the reader's floor into rounding to nearest.
        let mut constant = (loss_gw + gain_gw_per_hz * self.aim_hz) * MICRO / per_level + 0.5;
        let scale = f64::from(1u32 << AFFINE_FRACTION_BITS);
        let mut factors = [0i16; STATES];
        for d in 0..STATES {
            constant += slopes[d] * (shape.lower[d] + 0.5 * shape.width[d]);
            let factor = (slopes[d] * shape.width[d] * scale).round();
            if factor.abs() > f64::from(i16::MAX) {
                return Err(CompressError::TooSteep);
            }
            factors[d] = factor as i16;
        }
        let constant = (constant * scale).round();
        if constant.abs() > f64::from(i32::MAX) {
            return Err(CompressError::TooSteep);
        }
        Ok(AffineFunction {
            factors,
            constant: constant as i32,
        })
    }
}

/// A preferred law on a grid's cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Preferred {
    /// The law.
    pub law: AffineFunction,
    /// Input levels.
    pub levels: u8,
    /// Levels by which a leaf may depart from the law where that is allowed.
    pub slack: u32,
}

impl Preferred {
    /// The preferred level in a cell.
    pub fn level(&self, cell: [u16; STATES]) -> u8 {
        self.law.level(Cell(cell), self.levels)
    }

    /// Of the allowed inputs of a cell (bit u for level u) those nearest to the preferred one:
    /// none, one or two.
    pub fn nearest(&self, cell: [u16; STATES], allowed: u32) -> u32 {
        nearest(allowed, self.level(cell))
    }

    /// Of the allowed inputs of a cell those that a leaf may give it: at most `slack` from the
    /// preferred one. Where none is that near, all that are allowed: the leaf takes the nearest
    /// that fits its box.
    pub fn good(&self, cell: [u16; STATES], allowed: u32) -> u32 {
        match widened(1 << self.level(cell), self.slack) & allowed {
            0 => allowed,
            near => near,
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]
mod tests {
    use super::*;
    use crate::problem::Problem;

    #[test]
    fn the_law_of_the_papers_fleet_is_what_its_equation_says() {
        // Levels are 0.05 of 1.4 GW, so 0.07 GW each; w = 2 GW, D = 1 GW/Hz, 2H = 8 GW s/Hz.
        // Cell centres are at f = -1 + 0.05 i and p = 0.05 i.
        let spec = Spec::load("paper-bi", &[]).unwrap();
        let shape = Problem::new(&spec).unwrap().shape;
        let preference = Preference {
            recovery_per_s: 0.5,
            aim_hz: -0.1,
        };
        let law = preference.law(&spec, &shape).unwrap();
        let level = |f: u16, p: u16| law.level(Cell([f, 9, 3, p]), 21);
        // f = -0.3, p = 2: 2 - 2 - 0.3 + 4 (-0.1 + 0.3) = 0.5 GW are 7.14 levels.
        assert_eq!(level(14, 40), 7);
        // f = -0.1, p = 1.5: 2 - 1.5 - 0.1 = 0.4 GW are 5.71 levels.
        assert_eq!(level(18, 30), 6);
        // f = 0, p = 3: less than nothing. f = -0.8, p = 0: more than all.
        assert_eq!((level(20, 60), level(4, 0)), (0, 20));
    }

    #[test]
    fn a_spec_has_a_preferred_law_only_where_it_says_so() {
        assert_eq!(Preference::of(&Spec::load("paper-bi", &[]).unwrap()), None);
        let set = ["preference.recovery_per_s=1".to_owned()];
        let found = Preference::of(&Spec::load("paper-bi", &set).unwrap()).unwrap();
        // I2 is [-0.15, 0].
        assert_eq!(found.recovery_per_s, 1.0);
        assert!((found.aim_hz + 0.075).abs() < 1e-12);
    }

    #[test]
    fn a_leaf_follows_the_law_where_it_may_and_is_free_where_it_may_not() {
        // Level 0 at f's cell 0, one more with each cell of f.
        let preferred = Preferred {
            law: AffineFunction {
                factors: [1 << AFFINE_FRACTION_BITS, 0, 0, 0],
                constant: 0,
            },
            levels: 8,
            slack: 1,
        };
        let cell = [4, 0, 0, 0];
        assert_eq!(preferred.level(cell), 4);
        assert_eq!(preferred.good(cell, 0b1111_1111), 0b0011_1000);
        assert_eq!(preferred.good(cell, 0b1101_0001), 0b0001_0000);
        assert_eq!(preferred.good(cell, 0b1100_0001), 0b1100_0001);
        assert_eq!(preferred.nearest(cell, 0b1100_0001), 0b0100_0000);
        assert_eq!(preferred.nearest(cell, 0b0100_0101), 0b0100_0100);
    }
}
