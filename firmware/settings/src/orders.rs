//! Limits and the owner's override: ordered over the line, in force for a while or until the next
//! start, and not kept.
//!
//! An order of a limit takes the place of the setting of the same source, and where its time is
//! over the setting is in force again. What charger and cable bear holds in any case.
//!
//! A charger with an override is one that does not take part: to the grid it is missing. The owner
//! may do that; the proof knows it as an error of the delivered participation.

use firmware::dispatch::{Dispatch, DispatchError, LIMIT_SOURCES, LimitSource, SetPoint};
use firmware::units::Participation;

use crate::config::Limited;
use crate::key::Key;
use crate::values::Values;

/// Longest time of an order \[s\]: a day.
pub const ORDER_MOST_S: u32 = 86_400;
/// Largest limit that can be ordered \[mA\].
pub const LIMIT_MOST_MA: u32 = Key::SiteLimit.about().most;

/// What the owner wants whatever the grid needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Override {
    /// To charge within the limits: the response is left out.
    Charge,
    /// Not to charge: the user's limit is 0.
    Pause,
}

/// Something in force for a while.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Timed<T> {
    what: T,
    since_ms: u32,
    /// `None` until the next start.
    for_ms: Option<u32>,
}

impl<T: Copy> Timed<T> {
    /// In force from now; 0 s and more than [`ORDER_MOST_S`] until the next start.
    const fn new(what: T, now_ms: u32, for_s: u32) -> Self {
        let for_ms = if for_s == 0 || for_s > ORDER_MOST_S {
            None
        } else {
            Some(for_s * 1_000)
        };
        Self {
            what,
            since_ms: now_ms,
            for_ms,
        }
    }

    /// Time left \[ms\]; `u32::MAX` until the next start.
    const fn left_ms(&self, now_ms: u32) -> u32 {
        match self.for_ms {
            None => u32::MAX,
            Some(for_ms) => for_ms.saturating_sub(now_ms.wrapping_sub(self.since_ms)),
        }
    }
}

/// What is ordered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Orders {
    limits_ma: [Option<Timed<u32>>; LIMIT_SOURCES],
    owner: Option<Timed<Override>>,
}

impl Orders {
    /// Nothing.
    pub const NONE: Self = Self {
        limits_ma: [None; LIMIT_SOURCES],
        owner: None,
    };

    /// Orders a limit \[mA\] for some seconds, 0 until the next start.
    pub fn limit(&mut self, source: LimitSource, ma: u32, for_s: u32, now_ms: u32) {
        if let Some(slot) = self.limits_ma.get_mut(source as usize) {
            *slot = Some(Timed::new(ma, now_ms, for_s));
        }
    }

    /// Gives a source's limit back to its setting.
    pub fn lift(&mut self, source: LimitSource) {
        if let Some(slot) = self.limits_ma.get_mut(source as usize) {
            *slot = None;
        }
    }

    /// Orders an override for some seconds, 0 until the next start; `None` ends it.
    pub fn owner(&mut self, what: Option<Override>, for_s: u32, now_ms: u32) {
        self.owner = what.map(|what| Timed::new(what, now_ms, for_s));
    }

    /// Forgets what is over. To be called at every tick: the clock wraps.
    pub fn expire(&mut self, now_ms: u32) {
        for slot in &mut self.limits_ma {
            slot.take_if(|timed| timed.left_ms(now_ms) == 0);
        }
        self.owner.take_if(|timed| timed.left_ms(now_ms) == 0);
    }

    /// The override in force, and the time left \[ms\], `u32::MAX` until the next start.
    pub fn override_now(&self, now_ms: u32) -> Option<(Override, u32)> {
        let timed = self.owner?;
        let left_ms = timed.left_ms(now_ms);
        (left_ms > 0).then_some((timed.what, left_ms))
    }

    /// The limits in force \[mA\], in the order of [`LimitSource`].
    pub fn limits_ma(&self, values: &Values, now_ms: u32) -> [u32; LIMIT_SOURCES] {
        let mut limits = values.limits_ma();
        for (limit, ordered) in limits.iter_mut().zip(&self.limits_ma) {
            if let Some(timed) = ordered
                && timed.left_ms(now_ms) > 0
            {
                *limit = timed.what;
            }
        }
        let [user, site, cable] = limits;
        let paused = matches!(self.override_now(now_ms), Some((Override::Pause, _)));
        let user = if paused { 0 } else { user };
        // An order may say that the cable bears less, never that it bears more.
        [user, site, cable.min(values.borne_ma())]
    }

    /// The participation that is left of what the response wants.
    pub fn participation(&self, wanted: Participation, now_ms: u32) -> Participation {
        match self.override_now(now_ms) {
            Some((Override::Charge, _)) => Participation::NONE,
            _ => wanted,
        }
    }
}

/// A dispatcher under orders.
#[derive(Debug)]
pub struct Ordered<D> {
    inner: D,
    values: Values,
    orders: Orders,
}

impl<D: Limited> Ordered<D> {
    /// A dispatcher with these settings and no orders.
    pub const fn new(inner: D, values: Values) -> Self {
        Self {
            inner,
            values,
            orders: Orders::NONE,
        }
    }

    /// Replaces the orders and the settings that are in force at once; both from the next tick.
    pub const fn set(&mut self, orders: Orders, values: Values) {
        self.orders = orders;
        self.values = values;
    }
}

impl<D: Dispatch + Limited> Dispatch for Ordered<D> {
    fn apply(
        &mut self,
        participation: Participation,
        now_ms: u32,
    ) -> Result<SetPoint, DispatchError> {
        self.orders.expire(now_ms);
        let sources = [LimitSource::User, LimitSource::Site, LimitSource::Cable];
        let limits = self.orders.limits_ma(&self.values, now_ms);
        for (source, ma) in sources.into_iter().zip(limits) {
            self.inner.limit(source, ma, &self.values);
        }
        let left = self.orders.participation(participation, now_ms);
        self.inner.apply(left, now_ms)
    }

    fn rest(&mut self, now_ms: u32) -> Result<SetPoint, DispatchError> {
        self.orders.expire(now_ms);
        self.inner.rest(now_ms)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::values::Build;
    use firmware::dispatch::Limits;
    use firmware::dispatch::bidirectional::{Bidirectional, PowerStage};
    use firmware::table::Direction;
    use proptest::prelude::*;

    #[test]
    fn an_order_ends_in_time_and_its_setting_is_in_force_again() {
        let values = Values::DEFAULT;
        // The clock wraps on the way.
        let start = u32::MAX - 5_000;
        let at = |ms: u32| start.wrapping_add(ms);
        let mut orders = Orders::NONE;
        orders.limit(LimitSource::Site, 10_000, 10, at(0));
        orders.limit(LimitSource::User, 16_000, 0, at(0));
        assert_eq!(
            orders.limits_ma(&values, at(9_999)),
            [16_000, 10_000, 32_000]
        );
        assert_eq!(
            orders.limits_ma(&values, at(10_000)),
            [16_000, 80_000, 32_000]
        );
        orders.expire(at(10_000));
        // Half a round of the clock later it does not come back.
        assert_eq!(orders.limits_ma(&values, at(5)), [16_000, 80_000, 32_000]);
        orders.lift(LimitSource::User);
        assert_eq!(orders, Orders::NONE);
    }

    #[test]
    fn the_owner_charges_or_pauses_for_a_while() {
        let values = Values::DEFAULT;
        let mut orders = Orders::NONE;
        orders.owner(Some(Override::Charge), 60, 0);
        assert_eq!(
            orders.participation(Participation::ALL, 59_999),
            Participation::NONE
        );
        assert_eq!(
            orders.participation(Participation::ALL, 60_000),
            Participation::ALL
        );
        orders.owner(Some(Override::Pause), 60, 0);
        assert_eq!(orders.limits_ma(&values, 0), [0, 80_000, 32_000]);
        assert_eq!(
            orders.participation(Participation::ALL, 0),
            Participation::ALL
        );
        orders.owner(None, 0, 0);
        assert_eq!(orders, Orders::NONE);
    }

    /// The last set-point.
    struct Stage(i32);

    impl PowerStage for Stage {
        type Error = ();
        fn set_power_w(&mut self, power_w: i32) -> Result<(), ()> {
            self.0 = power_w;
            Ok(())
        }
    }

    fn bidirectional() -> (Ordered<Bidirectional<Stage>>, Values) {
        let values = Values::defaults(Build {
            direction: Direction::Bidirectional,
            meter: 0,
        });
        let limits = Limits::all(u32::MAX);
        let inner = Bidirectional::new(Stage(0), limits, limits);
        (Ordered::new(inner, values), values)
    }

    #[test]
    fn a_power_stage_keeps_to_a_current() {
        let (mut ordered, values) = bidirectional();
        let set = |w| Ok(SetPoint::Power { w });
        assert_eq!(ordered.apply(Participation::NONE, 0), set(28_000));
        assert_eq!(ordered.apply(Participation::ALL, 0), set(-28_000));
        let mut orders = Orders::NONE;
        // 10 A on three phases of 230 V.
        orders.limit(LimitSource::Site, 10_000, 1, 100);
        ordered.set(orders, values);
        assert_eq!(ordered.apply(Participation::NONE, 100), set(6_900));
        assert_eq!(ordered.apply(Participation::ALL, 200), set(-6_900));
        assert_eq!(ordered.apply(Participation::ALL, 1_100), set(-28_000));
        orders.owner(Some(Override::Charge), 0, 1_100);
        ordered.set(orders, values);
        assert_eq!(ordered.apply(Participation::ALL, 1_200), set(28_000));
        assert_eq!(ordered.rest(1_300), set(0));
    }

    proptest! {
        /// Whatever is ordered: what charger and cable bear holds, and a limit is kept to.
        #[test]
        fn no_order_lifts_what_is_borne(
            orders in proptest::collection::vec((0u8..5, any::<u32>(), 0u32..90_000), 0..20),
            ppm: u32, borne in 6_000u32..=80_000,
        ) {
            let (_, values) = bidirectional();
            let build = Build { direction: Direction::Bidirectional, meter: 0 };
            let changes = [(Key::CableLimit.number(), borne)];
            let values = values.with(&changes, build).unwrap();
            let limits = Limits::all(u32::MAX);
            let mut ordered = Ordered::new(Bidirectional::new(Stage(0), limits, limits), values);
            let mut all = Orders::NONE;
            for (what, ma, for_s) in orders {
                match what {
                    0 => all.limit(LimitSource::User, ma, for_s, 0),
                    1 => all.limit(LimitSource::Site, ma, for_s, 0),
                    2 => all.limit(LimitSource::Cable, ma, for_s, 0),
                    3 => all.owner(Some(Override::Charge), for_s, 0),
                    _ => all.owner(Some(Override::Pause), for_s, 0),
                }
                ordered.set(all, values);
                let lowest = all.limits_ma(&values, 0).into_iter().min().unwrap();
                prop_assert!(lowest <= borne);
                let Ok(SetPoint::Power { w }) = ordered.apply(Participation::from_ppm(ppm), 0) else {
                    return Err(TestCaseError::fail("no set-point"));
                };
                prop_assert!(u64::from(w.unsigned_abs()) <= u64::from(lowest) * 690 / 1_000);
            }
        }
    }
}
