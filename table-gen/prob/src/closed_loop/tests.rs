//! Real runs are followed through the nodes: wherever a run goes, the nodes go with it.

use firmware::phase::Decision;
use firmware::table::TableView;
use firmware::units::State;
use model::flow::Flow;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::flight::Ball;
use crate::value;

const TABLE: &[u8] = include_bytes!("../../../../firmware/tables/paper-bi.bin");

fn settings(horizon_s: f64) -> Settings {
    Settings {
        bin_gw: 0.02,
        nodes_max: 100_000,
        horizon_s,
    }
}

/// A run in plain numbers.
struct Real {
    x: [f64; STATES],
    tick: Flow<STATES>,
    modes: Modes,
}

impl Real {
    fn fly(&mut self, v: f64) {
        self.x = std::array::from_fn(|i| {
            let free: f64 = (0..STATES)
                .map(|j| self.tick.phi[i][j].mid() * self.x[j])
                .sum();
            free + self.tick.gamma[i].mid() * v
        });
    }

    fn measured(&self) -> State {
        State(self.x.map(|x| (x * 1e6).floor() as i32))
    }

    /// Whether the state is in a set. Plain numbers err by less than 1e-9 over a run.
    fn is_in(&self, ball: &Ball) -> bool {
        self.modes
            .blocks
            .iter()
            .zip(&ball.radius)
            .all(|(block, radius)| {
                let away = block.axes().map(|i| {
                    let m: f64 = (0..STATES)
                        .map(|j| self.modes.into[i][j].mid() * self.x[j])
                        .sum();
                    (m - ball.centre[i]).powi(2)
                });
                away.sum::<f64>().sqrt() <= radius + 1e-9
            })
    }

    fn node(&self, ends: &Ends, whole: &Loop<'_>, left: bool) -> Key {
        let Ends::In(keys) = ends else {
            panic!("a run that goes on is in a failed branch");
        };
        let holds = |key: &&Key| key.left == left && self.is_in(&whole.cover.ball(key.cell, left));
        *keys
            .iter()
            .find(holds)
            .unwrap_or_else(|| panic!("{:?} in none of {keys:?}", self.x))
    }
}

#[test]
fn real_runs_stay_in_the_nodes() {
    let table = TableView::parse(TABLE).unwrap();
    let spec = Spec::load("paper-bi", &[]).unwrap();
    let kind = Participation::Gaussian {
        sigma: 0.05,
        tail: 5.0,
    };
    let (whole, start, _) = prepared(&table, &spec, &kind, &settings(120.0)).unwrap();
    let (a, b) = Plant::new(&spec).matrices();
    let mut random = Pcg64::seed_from_u64(3);
    let mut unit = || (random.next_u64() >> 11) as f64 * 2f64.powi(-53);
    let mut fixed = 0;
    for _ in 0..40 {
        let mut real = Real {
            x: [0.0; STATES],
            tick: Flow::over(&a, &b, 0.1 * unit()),
            modes: Modes::new(&a).unwrap(),
        };
        real.fly(-2.0);
        real.tick = Flow::over(&a, &b, 0.1);
        while real.x[0] >= -0.3 {
            real.fly(-2.0);
        }
        let begun = start.ends.iter().find_map(|ends| match ends {
            Ends::In(keys) => keys
                .iter()
                .find(|key| real.is_in(&whole.cover.ball(key.cell, key.left))),
            Ends::Failed => None,
        });
        let mut key = *begun.unwrap();
        for _ in 0..40 {
            let state = PhaseState {
                phase: key.phase,
                level: key.level,
                ticks_left: 0,
            };
            let (next, decision) = state.step(&table, real.measured());
            let ball = whole.cover.ball(key.cell, key.left);
            assert!(
                whole
                    .regions
                    .outcomes(&table, state, &ball)
                    .contains(&(next, decision))
            );
            assert!(!key.left || next != state);
            let Decision::Level(level) = decision else {
                panic!("no entry at {:?}", real.x);
            };
            let bins = &whole.bins[usize::from(level)];
            let bin = bins[(unit() * bins.len() as f64) as usize];
            let share = bin.delivered.low + (bin.delivered.high - bin.delivered.low) * unit();
            let v = 1.4 * share - 2.0;
            if next.phase == Phase::Fixed {
                fixed += 1;
                let decided = whole.fixed(&ball, level, &[bin]);
                let mut left = false;
                for tick in 1..=15 {
                    real.fly(v);
                    left = !table.header().inner.contains(real.measured());
                    if left && tick < 15 {
                        break;
                    }
                    // At the end of a period the whole set is one node, unless all of it is
                    // outside.
                    if tick == 15 {
                        let Ends::In(keys) = &decided[0].1 else {
                            panic!("failed")
                        };
                        left = !keys.iter().any(|key| !key.left);
                    }
                }
                key = real.node(&decided[0].1, &whole, left);
            } else {
                let lowest = whole.flights.lowest(&ball, whole.net(bin.delivered), 15);
                let age = key.age.max(1) + 15;
                let decided = whole.period(&ball, (level, age), &[bin]);
                for _ in 0..15 {
                    real.fly(v);
                    assert!(real.x[0] >= lowest);
                }
                key = real.node(&decided[0].1, &whole, false);
            }
        }
    }
    // Runs that never came to Fixed would have shown little.
    assert!(fixed > 100, "{fixed}");
}

#[test]
fn the_first_seconds_are_bounded() {
    let table = TableView::parse(TABLE).unwrap();
    let spec = Spec::load("paper-bi", &[]).unwrap();
    let bound = |kind: &Participation, horizon_s| {
        // Sets of ±12 mHz: with twice as much some reach past the table's domain within 4 s.
        let fine = Settings {
            bin_gw: 0.005,
            ..settings(horizon_s)
        };
        let built = build(&table, &spec, kind, &fine, &|_, _| true).unwrap();
        value::bounds(&built.chain, built.steps)
    };
    let exact = bound(&Participation::Exact, 4.0);
    assert_eq!(
        exact.len() as u32,
        1 + Pace::of(&table.header()).steps_in(40)
    );
    assert_eq!(exact.last(), Some(&1.0));
    // A small error: few bins, so that the test is quick.
    let kind = Participation::Gaussian {
        sigma: 0.002,
        tail: 5.0,
    };
    let drawn = bound(&kind, 2.0);
    let last = *drawn.last().unwrap();
    // Four steps, each with at most 5.74e-7 outside all bins: nothing else fails in two seconds.
    assert!((1.0 - 4.0 * 5.75e-7..1.0).contains(&last), "{drawn:?}");
    for pair in drawn.windows(2) {
        assert!(pair[1] <= pair[0]);
    }
}

#[test]
fn what_is_not_covered_is_named() {
    let table = TableView::parse(TABLE).unwrap();
    for option in [
        "uncertainty.actuation_delay_s=0.5",
        "uncertainty.damping_gw_per_hz=[0.9,1.1]",
        // A tick of 0.1 s: past 16 bits, and shorter than a tick.
        "requirements.settle_within_s=6600",
        "requirements.settle_within_s=0.05",
    ] {
        let spec = Spec::load("paper-bi", &[option.to_owned()]).unwrap();
        let found = build(
            &table,
            &spec,
            &Participation::Exact,
            &settings(4.0),
            &|_, _| true,
        );
        assert!(
            matches!(found, Err(ClosedLoopError::Unsupported { .. })),
            "{option}"
        );
    }
}

/// A chain that is cut bounds what the whole one does: the same as far as it was followed, and
/// never more afterwards.
#[test]
fn a_cut_chain_is_a_lower_bound() {
    let table = TableView::parse(TABLE).unwrap();
    let spec = Spec::load("paper-bi", &[]).unwrap();
    let kind = Participation::Gaussian {
        sigma: 0.002,
        tail: 3.0,
    };
    let chain = |nodes_max| {
        let settings = Settings {
            bin_gw: 0.005,
            nodes_max,
            ..settings(4.0)
        };
        build(&table, &spec, &kind, &settings, &|_, _| true).unwrap()
    };
    let whole = chain(200_000);
    assert_eq!(whole.cut, None);
    let whole_bounds = value::bounds(&whole.chain, whole.steps);
    let (mut cuts, mut differs, mut agrees) = (0, 0, 0);
    for nodes_max in [0, whole.nodes / 64, whole.nodes / 16, whole.nodes / 4] {
        let few = chain(nodes_max);
        // A limit that is passed in the last layer alone cuts nothing.
        let Some(cut) = few.cut else {
            assert_eq!(few.chain, whole.chain);
            continue;
        };
        cuts += 1;
        assert!(few.nodes > nodes_max && cut.nodes > 0 && cut.steps < few.steps);
        let bounds = value::bounds(&few.chain, few.steps);
        for (steps, (bound, known)) in bounds.iter().zip(&whole_bounds).enumerate() {
            assert!(bound <= known);
            if steps as u32 <= cut.steps {
                // The same products and sums, in the same order.
                assert_eq!(bound, known, "{nodes_max} {steps}");
                agrees += 1;
            }
            differs += u32::from(bound < known);
        }
    }
    // Cuts that change nothing, or everything, would show nothing.
    assert!(
        cuts > 1 && differs > 0 && agrees > 4,
        "{cuts} {differs} {agrees}"
    );
}

/// The exact participation, over the whole horizon of the spec, with sets that are fine enough: the
/// chain closes, and what the verifier proves is certain here too.
#[test]
fn two_minutes_with_the_participation_exact_are_certain() {
    let table = TableView::parse(TABLE).unwrap();
    let spec = Spec::load("paper-bi", &[]).unwrap();
    let fine = Settings {
        bin_gw: 0.0025,
        ..settings(120.0)
    };
    let built = build(&table, &spec, &Participation::Exact, &fine, &|_, _| true).unwrap();
    assert_eq!(built.cut, None);
    let bounds = value::bounds(&built.chain, built.steps);
    assert_eq!(bounds.last(), Some(&1.0));
}
