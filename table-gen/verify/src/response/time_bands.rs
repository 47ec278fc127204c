//! Time constants in bands, and the plant in the middle of them. What follows for the proof is in
//! `unknown`.

use model::flow::{Matrix, apply};
use model::interval::Interval;
use model::plant::{Plant, STATES};
use model::spec::Spec;

/// Time constants \[s\], each anywhere in its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeBands {
    /// T_G, above 0.
    pub governor: Interval,
    /// T_t, above 0.
    pub turbine: Interval,
    /// T_1, at least 0.
    pub lead: Interval,
    /// T_2, above 0.
    pub lag: Interval,
}

impl TimeBands {
    /// Those of a plant that is known.
    pub const fn known(plant: &Plant) -> Self {
        Self {
            governor: Interval::point(plant.governor_time),
            turbine: Interval::point(plant.turbine_time),
            lead: Interval::point(plant.lead_time),
            lag: Interval::point(plant.lag_time),
        }
    }

    /// Those of a spec.
    pub fn of(spec: &Spec) -> Self {
        let bands = spec.time_constant_bands();
        let [governor, turbine, lead, lag] = bands.map(|[low, high]| Interval { low, high });
        Self {
            governor,
            turbine,
            lead,
            lag,
        }
    }

    /// All combinations of the pieces of each.
    pub(super) fn cut(&self, pieces: impl Fn(Interval) -> Vec<Interval>) -> Vec<Self> {
        let mut out = vec![*self];
        let set: [fn(&mut Self, Interval); 4] = [
            |times, piece| times.governor = piece,
            |times, piece| times.turbine = piece,
            |times, piece| times.lead = piece,
            |times, piece| times.lag = piece,
        ];
        for (band, set) in [self.governor, self.turbine, self.lead, self.lag]
            .into_iter()
            .zip(set)
        {
            let with = |times: &Self| {
                let mut of_piece = *times;
                let pieces = pieces(band).into_iter();
                pieces
                    .map(move |piece| {
                        set(&mut of_piece, piece);
                        of_piece
                    })
                    .collect::<Vec<_>>()
            };
            out = out.iter().flat_map(with).collect();
        }
        out
    }

    /// A plant with time constants in the middle, as the chain is linear in them.
    pub(super) fn middle(&self, plant: Plant) -> Plant {
        let of_inverse = |band: Interval| {
            if is_point(band) {
                band.low
            } else {
                1.0 / (Interval::ONE / band).mid()
            }
        };
        let (governor_time, lag_time) = (of_inverse(self.governor), of_inverse(self.lag));
        let lead_time = if [self.lead, self.governor, self.lag].map(is_point) == [true; 3] {
            self.lead.low
        } else {
            self.lead_rate().mid() * governor_time * lag_time
        };
        Plant {
            governor_time,
            turbine_time: of_inverse(self.turbine),
            lead_time,
            lag_time,
            ..plant
        }
    }

    /// r = T_1 / (T_G T_2) \[1/s\].
    pub(super) fn lead_rate(&self) -> Interval {
        self.lead / (self.governor * self.lag)
    }

    /// Bound of what lead and lag are asked for, `|T_1/T_G a + (1 - T_1/T_G) g|`, from bounds of
    /// |a| and |g| \[GW\]: convex in T_1/T_G, so that an end is the worst.
    pub(super) fn lead_most(&self, asked: f64, g: f64) -> f64 {
        let of = |lead: f64| lead.abs() * asked + (1.0 - lead).abs() * g;
        if is_point(self.lead) && is_point(self.governor) {
            return of(self.lead.low / self.governor.low);
        }
        let ratio = self.lead / self.governor;
        of(ratio.low).max(of(ratio.high))
    }
}

/// Radii of what the chain is linear in, and how each acts within a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnknownTimes {
    /// Of 1/T_G \[1/s\].
    pub governor: f64,
    /// Of T_1 / (T_G T_2) \[1/s\].
    pub lead: f64,
    /// Of 1/T_2 \[1/s\].
    pub lag: f64,
    /// Of 1/T_t \[1/s\].
    pub turbine: f64,
    /// Bounds of `|exp(A s) e|` within a step for the unit vectors of g, l and p.
    pub spread: [[f64; STATES]; 3],
}

impl UnknownTimes {
    /// Around the plant in the middle, whose exponentials within a step are given; nothing where
    /// all time constants are known.
    pub(super) fn of(times: &TimeBands, middle: &Plant, within: &Matrix<STATES>) -> Option<Self> {
        let all = [times.governor, times.turbine, times.lead, times.lag];
        if all.map(is_point) == [true; 4] {
            return None;
        }
        let at = TimeBands::known(middle);
        let radius = |of: fn(&TimeBands) -> Interval| (of(times) - of(&at)).magnitude();
        let unit = |axis: usize| {
            let mut unit = [Interval::ZERO; STATES];
            unit[axis] = Interval::ONE;
            apply(within, &unit).map(Interval::magnitude)
        };
        Some(Self {
            governor: radius(|times| Interval::ONE / times.governor),
            lead: radius(TimeBands::lead_rate),
            lag: radius(|times| Interval::ONE / times.lag),
            turbine: radius(|times| Interval::ONE / times.turbine),
            spread: [unit(1), unit(2), unit(3)],
        })
    }
}

/// Whether a band is one number.
pub(super) fn is_point(band: Interval) -> bool {
    band.low == band.high
}
