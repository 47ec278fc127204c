//! The crowd of [`super::crowd`] for tables that are a response, many times as fast.
//!
//! A response knows the charger's own readings of f and nothing else. Chargers that decide in the
//! same part of a tick and whose meters err alike read the same, so that slope, slope response and
//! target are the same for them: those are computed once for all of them. What differs is the
//! level that each takes of the target, by its serial number. All of it is the firmware's code.
//! What may act at a part depends on the clock alone, so that the least and the greatest of the
//! commands under way are sought row by row ([`super::sliding`]), and only where a row differs from
//! the one before.
//!
//! The same seed gives the same crowd as [`super::crowd::Crowd::draw`], to the bit.

use std::collections::VecDeque;
use std::ops::Range;

use firmware::response::{LevelOffset, Response, ResponseLaw};
use firmware::table::TableView;
use firmware::units::{MICRO, Participation, STATES};

use super::adversaries::Random;
use super::crowd::{Answers, CrowdTimes, DrawnMember, Error, PARTS, UnderWay, draw_members};
use super::sliding::Sliding;

/// Chargers of one clock whose meters err alike.
#[derive(Debug, Clone)]
struct Readers {
    error: Error,
    /// Readings and slope response; the commands are `Clock`'s.
    response: Response,
    /// Their places among those of the clock.
    members: Range<usize>,
}

/// Chargers that decide in the same part of a tick.
#[derive(Debug, Clone)]
struct Clock {
    /// That part.
    part: usize,
    ticks: usize,
    readers: Vec<Readers>,
    offsets: Vec<LevelOffset>,
    /// Commands of the last ticks \[ppm\], one row a tick, the latest at `ticks - 1` modulo the
    /// number of rows.
    commands_ppm: Vec<Vec<u32>>,
    /// Whether a row differs from that of the tick before.
    differs: Vec<bool>,
    /// The last tick whose row does.
    changed: usize,
    /// Sums over the chargers of the least and the greatest that may act now \[ppm\].
    sums_ppm: (u64, u64),
    /// Least and greatest of each charger.
    sliding: Sliding,
}

/// The chargers.
#[derive(Debug, Clone)]
pub(super) struct SharedCrowd {
    law: ResponseLaw,
    /// By the part in which they decide, and those that are none are left out.
    clocks: Vec<Clock>,
    /// For each part of a tick, the clocks of which others of the commands may act there.
    moving: [Vec<usize>; PARTS],
    /// Sums over all chargers \[ppm\].
    sums_ppm: (u64, u64),
    times: CrowdTimes,
    /// Bound of the readings' errors \[Hz\].
    bound_hz: f64,
    /// f where the last parts began, the latest first \[Hz\].
    readings_hz: VecDeque<f64>,
    members: f64,
    part: usize,
    random: Random,
}

impl SharedCrowd {
    /// A crowd drawn, as [`super::crowd::Crowd::draw`] draws it; nothing for laws by games.
    pub(super) fn draw(
        table: &TableView<'_>,
        number: usize,
        times: CrowdTimes,
        bound: [f64; STATES],
        rest: [f64; STATES],
        seed: u64,
    ) -> Option<Self> {
        let law = table.response()?;
        let header = table.header();
        // Commands that act late are whole levels of the table.
        if header.delay_ticks > 0 {
            return None;
        }
        let (drawn, random) = draw_members(number, seed);
        let clocks = (0..PARTS).filter_map(|part| {
            let members = drawn.iter().enumerate();
            let of_clock: Vec<(usize, &DrawnMember)> =
                members.filter(|(_, drawn)| drawn.clock == part).collect();
            let response = Response::new(law, header.tick_ms, LevelOffset::NONE);
            (!of_clock.is_empty()).then(|| Clock::new(part, &of_clock, &response, times.kept()))
        });
        let clocks: Vec<Clock> = clocks.collect();
        let moving = std::array::from_fn(|part| {
            let places = clocks.iter().enumerate();
            let moves = places.filter(|(_, clock)| times.moves(part, clock.part));
            moves.map(|(place, _)| place).collect()
        });
        Some(Self {
            law,
            clocks,
            moving,
            sums_ppm: (0, 0),
            times,
            bound_hz: bound[0],
            readings_hz: vec![rest[0]; times.lag + 1].into(),
            members: number as f64,
            part: 0,
            random,
        })
    }
}

impl Answers for SharedCrowd {
    fn part(&mut self, x: [f64; STATES]) -> (f64, f64) {
        self.readings_hz.pop_back();
        self.readings_hz.push_front(x[0]);
        let seen_hz = self.readings_hz.back().copied().unwrap_or(x[0]);
        let now = self.part % PARTS;
        if let Some(clock) = self.clocks.iter_mut().find(|clock| clock.part == now) {
            clock.decide(&self.law, seen_hz, self.bound_hz, &mut self.random);
        }
        for place in &self.moving[now] {
            let clock = &mut self.clocks[*place];
            let before = clock.sums_ppm;
            clock.sums_ppm = clock.sums(&self.times.under_way(self.part, clock.part));
            let change = |sum: u64, from: u64, to: u64| sum + to - from;
            self.sums_ppm.0 = change(self.sums_ppm.0, before.0, clock.sums_ppm.0);
            self.sums_ppm.1 = change(self.sums_ppm.1, before.1, clock.sums_ppm.1);
        }
        self.part += 1;
        let all = f64::from(MICRO) * self.members;
        (self.sums_ppm.0 as f64 / all, self.sums_ppm.1 as f64 / all)
    }
}

impl Clock {
    /// Chargers with their serial numbers, the latter rising.
    fn new(
        part: usize,
        members: &[(usize, &DrawnMember)],
        response: &Response,
        kept: usize,
    ) -> Self {
        let mut groups: Vec<(Error, Vec<usize>)> = Vec::new();
        for (serial, drawn) in members {
            let known = groups.iter_mut().find(|(error, _)| *error == drawn.error);
            match known {
                // Each meter that errs anyhow draws for itself, in the order of serial numbers.
                Some((error, serials)) if *error != Error::Random => serials.push(*serial),
                _ => groups.push((drawn.error, vec![*serial])),
            }
        }
        let mut offsets = Vec::with_capacity(members.len());
        let readers = groups.iter().map(|(error, serials)| {
            let first = offsets.len();
            let shifted = serials.iter().map(|serial| *serial as u32);
            offsets.extend(shifted.map(LevelOffset::of_serial));
            Readers {
                error: *error,
                response: *response,
                members: first..offsets.len(),
            }
        });
        Self {
            part,
            ticks: 0,
            readers: readers.collect(),
            offsets,
            commands_ppm: vec![vec![0; members.len()]; kept],
            differs: vec![false; kept],
            changed: 0,
            sums_ppm: (0, 0),
            sliding: Sliding::new(members.len(), kept),
        }
    }

    fn decide(&mut self, law: &ResponseLaw, f_hz: f64, bound_hz: f64, random: &mut Random) {
        let kept = self.commands_ppm.len();
        let before = (self.ticks + kept - 1) % kept;
        let place = self.ticks % kept;
        let mut row = std::mem::take(&mut self.commands_ppm[place]);
        row.copy_from_slice(&self.commands_ppm[before]);
        let mut differs = false;
        for readers in &mut self.readers {
            let error = readers.error.at(self.ticks as u32, random);
            let f_uhz = ((f_hz + error * bound_hz) * f64::from(MICRO)).floor() as i32;
            readers.response.pass(f_uhz);
            let target = law.target(f_uhz, readers.response.held_ppm());
            let members = readers.members.clone();
            for (command, offset) in row[members.clone()].iter_mut().zip(&self.offsets[members]) {
                let next = law.command(target, Participation::from_ppm(*command), *offset);
                differs |= next.ppm() != *command;
                *command = next.ppm();
            }
        }
        self.commands_ppm[place] = row;
        self.differs[place] = differs;
        if differs {
            self.changed = self.ticks;
        }
        self.ticks += 1;
    }

    /// Sums of the least and the greatest of the commands under way, charger by charger.
    fn sums(&mut self, under_way: &UnderWay) -> (u64, u64) {
        let UnderWay { ticks, or_nothing } = under_way;
        let sum = |row: &[u32]| row.iter().map(|ppm| u64::from(*ppm)).sum::<u64>();
        let kept = self.commands_ppm.len();
        if ticks.is_empty() {
            return (0, 0);
        }
        let first = &self.commands_ppm[ticks.start % kept];
        let (least_ppm, most_ppm) = if self.changed <= ticks.start {
            let all = sum(first);
            (all, all)
        } else {
            let (rows, differs) = (&self.commands_ppm, &self.differs);
            let ends = self.sliding.ends(ticks.clone(), rows, differs);
            (sum(&ends.least), sum(&ends.most))
        };
        (if *or_nothing { 0 } else { least_ppm }, most_ppm)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails where it unwraps nothing")]
    use super::super::crowd::Crowd;
    use super::*;
    use model::spec::Spec;
    use proptest::prelude::*;
    use synth::pipeline;

    /// Responses with different steps, windows and slopes.
    const SPECS: [&str; 4] = ["gb-bi", "gb-uni", "gb-bi-ade7953", "gb-uni-cars"];

    proptest! {
        /// The crowd that runs the whole control loop of every charger is the reference: the same
        /// draws, the same responses in every part.
        #[test]
        fn what_reads_the_same_may_decide_once(
            spec in 0..SPECS.len(),
            number in 1usize..90,
            least in 0usize..25,
            more in 0usize..70,
            lag in 0usize..5,
            seed in any::<u64>(),
            start in -0.1f64..0.1,
            moves in proptest::collection::vec(-0.02f64..0.019, 300),
        ) {
            let spec = Spec::load(SPECS[spec], &[]).unwrap();
            let bytes = pipeline::response(&spec).unwrap();
            let table = TableView::parse(&bytes).unwrap();
            let times = CrowdTimes { delay: (least, least + more), lag };
            let (bound, rest) = ([0.004, 0.1, 0.1, 0.1], [start, 0.0, 0.0, 0.0]);
            let mut each = Crowd::draw(&table, number, times, bound, rest, seed);
            let mut shared = SharedCrowd::draw(&table, number, times, bound, rest, seed).unwrap();
            let mut x = rest;
            for (part, change) in moves.iter().enumerate() {
                // Falls, rests and rises.
                x[0] += if part % 90 < 30 { 0.0 } else { *change };
                prop_assert_eq!(each.part(x), shared.part(x), "part {}", part);
            }
        }
    }
}
