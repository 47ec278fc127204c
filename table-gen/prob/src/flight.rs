//! A held input: where a set of states is at each tick, and the lowest frequency in between.
//!
//! With the input held, `m(t) = M(t) m(0) + G(t) v`, and a loss that moves within ±r adds at most
//! `r ∫ |T^-1 exp(A s) b|`.
//!
//! Between ticks, the time is cut into steps of [`STEP_S`]. Within the step from s, f is `e_f tube
//! Φ(s) x + (γ(s) + [0, h] e_f tube Φ(s) b) v`, tube enclosing exp(A σ) for all σ of a step.

use std::ops::Range;

use firmware::units::{AXIS_F, STATES};
use model::flow::{Flow, Matrix, Vector, absolute_integral, apply, product, tube};
use model::interval::Interval;

use crate::modes::{Block, Modes};

/// Longest step in which f is bounded at once \[s\]: the tube is then wide by less than (5 · 0.01)²
/// of the state.
const STEP_S: f64 = 0.01;
/// Times are products of the tick, off by less than 1e-14 s, and commanded powers are off by less
/// than 1e-15 GW: states that move by less than 10 units a second are then off by less than this.
const CLOCK: f64 = 1e-12;

/// One number of ticks.
#[derive(Debug, Clone)]
pub(crate) struct Span {
    map: Matrix<STATES>,
    drive: Vector<STATES>,
    /// Norms of the map's blocks, `[to][from]`, in the order of the modes' blocks.
    norms: Vec<Vec<f64>>,
    /// Length of the drive in each block.
    reach: Vec<f64>,
    /// What a moving unit of loss adds in each block.
    moving: Vec<f64>,
}

/// Bounds of f during one tick.
#[derive(Debug, Clone)]
struct Tick {
    steps: Vec<Row>,
}

/// f within a step: row, its length in each block, and the drive's factor.
#[derive(Debug, Clone)]
struct Row {
    row: Vector<STATES>,
    lengths: Vec<f64>,
    gamma: Interval,
}

/// All spans up to a period.
#[derive(Debug, Clone)]
pub(crate) struct Flights {
    blocks: Vec<Block>,
    spans: Vec<Span>,
    ticks: Vec<Tick>,
    /// What a moving unit of loss adds to f.
    moving_f: f64,
}

/// A set: a centre, and a radius for each block.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Ball {
    pub(crate) centre: [f64; STATES],
    pub(crate) radius: Vec<f64>,
}

/// The net power: what is drawn and known, and by how much the loss moves around it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NetPower {
    pub(crate) range: Interval,
    pub(crate) moving: f64,
}

/// The image of a centre, to be driven.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Free(Vector<STATES>);

impl Flights {
    /// The flights of 0 to `ticks` ticks.
    pub(crate) fn new(
        modes: &Modes,
        a: &Matrix<STATES>,
        b: &Vector<STATES>,
        tick_s: f64,
        ticks: u32,
    ) -> Self {
        let count = (tick_s / STEP_S).ceil().max(1.0) as u32;
        // A length that exceeds the exact quotient: the steps then cover the tick.
        let h = (tick_s / f64::from(count)).next_up();
        let step = Flow::over(a, b, h);
        let within = tube(a, h);
        let time = Interval { low: 0.0, high: h };
        let blocks = modes.blocks.clone();
        let mut spans = Vec::new();
        let mut bounds = Vec::new();
        for tick in 0..=ticks {
            // The header's clock: whole milliseconds, so a product of a whole number and one
            // correctly rounded quotient.
            let flow = Flow::over(a, b, tick_s * f64::from(tick));
            spans.push(Span::new(modes, &flow, a, b, tick_s * f64::from(tick)));
            let mut at = flow;
            let mut steps = Vec::new();
            for _ in 0..count {
                let flows = product(&within, &at.phi);
                let row = product(&flows, &modes.out)[AXIS_F];
                let gamma = at.gamma[AXIS_F] + time * apply(&flows, b)[AXIS_F];
                let lengths = blocks
                    .iter()
                    .map(|block| Modes::length(&row, *block))
                    .collect();
                steps.push(Row {
                    row,
                    lengths,
                    gamma,
                });
                at = at.then(&step);
            }
            bounds.push(Tick { steps });
        }
        let moving_f = absolute_integral(a, b, tick_s * f64::from(ticks))[AXIS_F];
        Self {
            blocks,
            spans,
            ticks: bounds,
            moving_f,
        }
    }

    /// The centre after so many ticks without a drive.
    pub(crate) fn free(&self, centre: &[f64; STATES], ticks: u32) -> Free {
        let point = centre.map(Interval::point);
        Free(apply(&self.spans[ticks as usize].map, &point))
    }

    /// The set after so many ticks.
    pub(crate) fn after(&self, free: Free, radius: &[f64], net: NetPower, ticks: u32) -> Ball {
        let span = &self.spans[ticks as usize];
        let middle = net.range.mid();
        let half = if net.range.low == net.range.high {
            0.0
        } else {
            net.range.radius()
        };
        let at: [Interval; STATES] =
            std::array::from_fn(|i| free.0[i] + span.drive[i] * Interval::point(middle));
        let centre = at.map(Interval::mid);
        let rounding = at.map(|axis| Interval::point(axis.radius()));
        let grown = self.blocks.iter().enumerate().map(|(to, block)| {
            let mut sum = Modes::length(&rounding, *block) + CLOCK;
            for (from, radius) in radius.iter().enumerate() {
                sum = (sum + (span.norms[to][from] * radius).next_up()).next_up();
            }
            sum = (sum + (span.reach[to] * half).next_up()).next_up();
            (sum + (span.moving[to] * net.moving).next_up()).next_up()
        });
        Ball {
            centre,
            radius: grown.collect(),
        }
    }

    /// The lowest frequency \[Hz\] in the first so many ticks.
    pub(crate) fn lowest(&self, ball: &Ball, net: NetPower, ticks: u32) -> f64 {
        self.range(ball, net, 0..ticks).low
    }

    /// The frequencies \[Hz\] in some ticks, at least one, of a power that is held from tick 0 on.
    pub(crate) fn range(&self, ball: &Ball, net: NetPower, ticks: Range<u32>) -> Interval {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for tick in &self.ticks[ticks.start as usize..ticks.end as usize] {
            for step in &tick.steps {
                let f = along(&step.row, &step.lengths, ball) + step.gamma * net.range;
                (low, high) = (low.min(f.low), high.max(f.high));
            }
        }
        let moving = (self.moving_f * net.moving).next_up();
        Interval {
            low: (low - moving).next_down(),
            high: (high + moving).next_up(),
        }
    }

    /// Takes away from a set what a net power has added to it over the last so many ticks. The
    /// power may have varied within its range.
    pub(crate) fn without(&self, ball: &Ball, power: NetPower, ticks: u32) -> Ball {
        let span = &self.spans[ticks as usize];
        let middle = Interval::point(power.range.mid());
        let half = if power.range.low == power.range.high {
            0.0
        } else {
            power.range.radius()
        };
        let at: Vector<STATES> =
            std::array::from_fn(|i| Interval::point(ball.centre[i]) - span.drive[i] * middle);
        let varied = (half + power.moving).next_up();
        let mut out = self.pushed(ball, &at);
        for (radius, moving) in out.radius.iter_mut().zip(&span.moving) {
            *radius = ((*radius + (moving * varied).next_up()).next_up() + CLOCK).next_up();
        }
        out
    }

    /// A set with another centre, which is known within bounds.
    pub(crate) fn pushed(&self, ball: &Ball, centre: &Vector<STATES>) -> Ball {
        let off = centre.map(|axis| Interval::point(axis.radius()));
        let radii = self.blocks.iter().zip(&ball.radius);
        let grown = radii.map(|(block, radius)| (Modes::length(&off, *block) + radius).next_up());
        Ball {
            centre: centre.map(Interval::mid),
            radius: grown.collect(),
        }
    }

    /// In how many of the first so many ticks f may be below a limit \[Hz\].
    pub(crate) fn ticks_below(&self, ball: &Ball, net: NetPower, ticks: u32, limit: f64) -> u32 {
        let moving = (self.moving_f * net.moving).next_up();
        let may = |tick: &&Tick| {
            tick.steps.iter().any(|step| {
                let f = along(&step.row, &step.lengths, ball) + step.gamma * net.range;
                (f.low - moving).next_down() < limit
            })
        };
        self.ticks[..ticks as usize].iter().filter(may).count() as u32
    }

    /// Contraction of each block over so many ticks, and what half a unit of drive adds.
    pub(crate) fn of_block(&self, block: usize, ticks: u32) -> (f64, f64, f64) {
        let span = &self.spans[ticks as usize];
        (
            span.norms[block][block],
            span.reach[block],
            span.moving[block],
        )
    }
}

impl Span {
    fn new(
        modes: &Modes,
        flow: &Flow<STATES>,
        a: &Matrix<STATES>,
        b: &Vector<STATES>,
        time_s: f64,
    ) -> Self {
        let map = modes.map(&flow.phi);
        let drive = modes.vector(&flow.gamma);
        let norms = modes
            .blocks
            .iter()
            .map(|to| {
                modes
                    .blocks
                    .iter()
                    .map(|from| Modes::norm(&map, *to, *from))
                    .collect()
            })
            .collect();
        let reach = modes
            .blocks
            .iter()
            .map(|block| Modes::length(&drive, *block))
            .collect();
        // In m the plant is (T^-1 A T, T^-1 b).
        let (a, b) = (modes.map(a), modes.vector(b));
        let moving = if time_s > 0.0 {
            absolute_integral(&a, &b, time_s)
        } else {
            [0.0; STATES]
        };
        let moving = moving.map(Interval::point);
        let moving = modes
            .blocks
            .iter()
            .map(|block| Modes::length(&moving, *block))
            .collect();
        Self {
            map,
            drive,
            norms,
            reach,
            moving,
        }
    }
}

/// Range of `row · m` over a set; the lengths are those of the row in each block.
pub(crate) fn along(row: &Vector<STATES>, lengths: &[f64], ball: &Ball) -> Interval {
    let mut sum = Interval::ZERO;
    for (coefficient, centre) in row.iter().zip(&ball.centre) {
        sum = sum + *coefficient * Interval::point(*centre);
    }
    let mut radius = 0.0f64;
    for (length, r) in lengths.iter().zip(&ball.radius) {
        radius = (radius + (length * r).next_up()).next_up();
    }
    sum + Interval::hull(-radius, radius)
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::plant::Plant;
    use model::spec::Spec;
    use rand::{Rng, SeedableRng};
    use rand_pcg::Pcg64;

    /// Points of a set, flown in small steps of plain numbers, stay in the flown set and above the
    /// lowest frequency.
    #[test]
    fn flown_points_stay_in_the_flown_set() {
        let spec = Spec::load("paper-bi", &[]).unwrap();
        let plant = Plant::new(&spec);
        let (a, b) = plant.matrices();
        let modes = Modes::new(&a).unwrap();
        let flights = Flights::new(&modes, &a, &b, 0.1, 15);
        let mut random = Pcg64::seed_from_u64(1);
        let fine = Flow::over(&a, &b, 0.01);
        for _ in 0..200 {
            let mut unit = || (random.next_u64() >> 11) as f64 * 2f64.powi(-52) - 1.0;
            let ball = Ball {
                centre: std::array::from_fn(|_| 0.3 * unit()),
                radius: vec![0.02; modes.blocks.len()],
            };
            // A corner of the square in the disc, or an end of the interval.
            let mut m = ball.centre;
            for block in &modes.blocks {
                let share = if block.pair { 0.7 } else { 1.0 };
                for i in block.axes() {
                    m[i] += 0.02 * share * unit().signum();
                }
            }
            let net = NetPower {
                range: Interval::hull(-2.0, -1.6),
                moving: 0.1,
            };
            let (drawn, ticks) = (-1.8 + 0.2 * unit(), 1 + (7.0 * (unit() + 1.0)) as u32);
            let lowest = flights.lowest(&ball, net, ticks);
            let mut x: [f64; STATES] =
                std::array::from_fn(|i| (0..STATES).map(|j| modes.out[i][j].mid() * m[j]).sum());
            for _ in 0..10 * ticks {
                let v = drawn + 0.1 * unit();
                x = std::array::from_fn(|i| {
                    let free: f64 = (0..STATES).map(|j| fine.phi[i][j].mid() * x[j]).sum();
                    free + fine.gamma[i].mid() * v
                });
                assert!(x[0] >= lowest);
            }
            let after = flights.after(flights.free(&ball.centre, ticks), &ball.radius, net, ticks);
            for (block, radius) in modes.blocks.iter().zip(&after.radius) {
                let away = block.axes().map(|i| {
                    let m: f64 = (0..STATES).map(|j| modes.into[i][j].mid() * x[j]).sum();
                    (m - after.centre[i]).powi(2)
                });
                // Plain numbers err by less than 1e-12 here.
                assert!(away.sum::<f64>().sqrt() <= radius + 1e-12);
            }
        }
    }
}
