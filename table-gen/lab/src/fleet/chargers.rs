//! All chargers in time: whose tick it is, and what is under way.
//!
//! The chargers lie in ten slots, by the part of the tick in which they tick next. One whose clock
//! is off by some ppm moves to the slot before or after now and then. Responses are summed as whole
//! ppm, so that the result does not depend on the number of threads.

use std::collections::VecDeque;

use firmware::table::TableView;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;

use super::config::{FleetConfig, PARTS};
use super::instance::{Counts, Instance, Tally};
use crate::simulation::chance::unit;
use model::spec::Spec;

/// Chargers that a thread takes at once.
const CHUNK: usize = 256;

/// The fleet's chargers.
pub(super) struct Chargers<'t> {
    slots: Vec<Vec<Instance<'t>>>,
    /// The whole fleet \[ppm\].
    total_ppm: f64,
    /// Deviations where the last parts began \[µHz\], the latest first.
    f_uhz: VecDeque<i32>,
    /// Changes of the response that are under way \[ppm\], the next part's first.
    under_way: VecDeque<i64>,
    acting_ppm: i64,
    part: u64,
}

impl<'t> Chargers<'t> {
    /// The working chargers on a grid that has been at a deviation \[µHz\] for long.
    pub(super) fn new(
        spec: &Spec,
        table: &TableView<'t>,
        config: &FleetConfig,
        rest_uhz: i32,
    ) -> Self {
        let slots = build(spec, table, config);
        let all = || slots.iter().flatten();
        let lag = all().map(|one| one.lag_parts).max().unwrap_or(0);
        let delay = all().map(|one| one.delay_parts).max().unwrap_or(0);
        Self {
            total_ppm: config.instances as f64 * 1e6,
            f_uhz: vec![rest_uhz; lag + 1].into(),
            under_way: vec![0; delay + 1].into(),
            acting_ppm: 0,
            part: 0,
            slots,
        }
    }

    /// Chargers that work.
    pub(super) fn working(&self) -> usize {
        self.slots.iter().map(Vec::len).sum()
    }

    /// Of them, those that do not do what they are told.
    pub(super) fn hostile(&self) -> usize {
        let all = self.slots.iter().flatten();
        all.filter(|one| !one.is_honest()).count()
    }

    /// The next part, at a true deviation \[µHz\]: the response of the fleet as a share of it, and
    /// what the chargers that ticked did.
    pub(super) fn part(&mut self, f_uhz: i32) -> (f64, Tally) {
        self.f_uhz.pop_back();
        self.f_uhz.push_front(f_uhz);
        let (part, slot) = (self.part, (self.part % PARTS as u64) as usize);
        let (f_uhz, delays) = (&self.f_uhz, self.under_way.len());
        let none = || (Tally::default(), vec![0i64; delays]);
        let ready = self.slots[slot].par_iter_mut().with_min_len(CHUNK);
        let (tally, changes) = ready
            .filter(|one| one.is_due(part))
            .fold(none, |(tally, mut changes), one| {
                let read = f_uhz.get(one.lag_parts).copied().unwrap_or_default();
                let did = one.tick(read);
                if let Some(change) = changes.get_mut(one.delay_parts) {
                    *change += did.given_ppm;
                }
                (tally + did, changes)
            })
            .reduce(none, |(a, mut sum), (b, changes)| {
                for (sum, change) in sum.iter_mut().zip(changes) {
                    *sum += change;
                }
                (a + b, sum)
            });
        for (sum, change) in self.under_way.iter_mut().zip(changes) {
            *sum += change;
        }
        self.acting_ppm += self.under_way.pop_front().unwrap_or(0);
        self.under_way.push_back(0);
        self.part += 1;
        self.move_on(slot);
        (self.acting_ppm as f64 / self.total_ppm, tally)
    }

    /// Moves those that tick in another part of the tick from now on.
    fn move_on(&mut self, slot: usize) {
        let of = |one: &Instance<'_>| (one.due_parts.floor() as u64 % PARTS as u64) as usize;
        let mut index = 0;
        while let Some(one) = self.slots[slot].get(index) {
            let next = of(one);
            if next == slot {
                index += 1;
                continue;
            }
            let moved = self.slots[slot].swap_remove(index);
            self.slots[next].push(moved);
        }
    }

    /// The event: what was counted before is forgotten.
    pub(super) fn event(&mut self) {
        self.slots.iter_mut().flatten().for_each(Instance::event);
    }

    /// What was counted of each, and the ticks that all of them missed together.
    pub(super) fn counts(&mut self) -> (Vec<Counts>, u64) {
        let mut missed = 0;
        let mut counts = Vec::with_capacity(self.working());
        for one in self.slots.iter_mut().flatten() {
            counts.push(one.counts());
            missed += u64::from(one.missed_ticks());
        }
        (counts, missed)
    }
}

/// The working chargers by the part of the tick in which they tick.
fn build<'t>(spec: &Spec, table: &TableView<'t>, config: &FleetConfig) -> Vec<Vec<Instance<'t>>> {
    let mut random = Pcg64::seed_from_u64(config.seed);
    let mut slots: Vec<Vec<Instance<'t>>> = (0..PARTS).map(|_| Vec::new()).collect();
    let failed = (config.failed_share * config.instances as f64).round() as usize;
    // The failed ones are drawn without replacement: each of the rest fails with probability left /
    // remaining.
    let mut failed_left = failed.min(config.instances);
    for index in 0..config.instances {
        let remaining = config.instances - index;
        let fails = unit(&mut random) * (remaining as f64) < failed_left as f64;
        let slot = (random.next_u64() % PARTS as u64) as usize;
        if fails {
            failed_left -= 1;
            continue;
        }
        let slot = if config.spread_clocks { slot } else { 0 };
        slots[slot].push(Instance::new(spec, table, config, index as u32, slot));
    }
    slots
}
