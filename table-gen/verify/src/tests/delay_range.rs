//! A range of delays: fleets whose chargers follow a command at any moments within it, against the
//! prediction's error, the boxes of games and verifier, the verifier's tight sets and the guard
//! between the samples.

use firmware::prediction::History;
use firmware::table::TableView;
use firmware::units::{AXIS_F, State};

use super::Random;
use super::delay::{bare, delayed, extreme, level, load};
use super::late_fleet::{Fleet, Run, STYLES};
use crate::changeover::mixed;
use crate::closed_loop::Model;
use crate::delayed_loop::closed_loop;
use crate::successor::{Cells, index, successor};
use crate::zonotope::Zonotope;
use model::interval::Interval;
use model::plant::{Plant, STATES};
use model::spec::Spec;
use synth::abstraction::Abstraction;
use synth::abstraction::guard::Guard;
use synth::abstraction::tube::TubeGuard;
use synth::delay::{self, Delay};
use synth::problem::Problem;
use synth::synthesis;

/// Trials of a spec.
const TRIALS: u32 = 240;
/// Every so many trials the guard between the samples is built, which takes long.
const GUARDED: u32 = 61;
/// The integration against the flow \[micro-units\]; cells are thousands wide.
const DUST: f64 = 0.01;

fn specs() -> Vec<Spec> {
    vec![
        delayed(&["uncertainty.actuation_delay_s=[1.0,1.1]"]),
        // The device predicts nothing; a whole period for the changeover.
        delayed(&["uncertainty.actuation_delay_s=[0,0.1]"]),
        delayed(&["uncertainty.actuation_delay_s=[0,2]", "input.step=0.1"]),
        delayed(&["uncertainty.actuation_delay_s=[0.3,2]"]),
        // An end that is no whole tick.
        load("paper-bi", &["uncertainty.actuation_delay_s=[0.1,0.25]"]),
        load(
            "gb-uni-band",
            &[
                "uncertainty.actuation_delay_s=[0.2,0.5]",
                "sampling.period_s=0.5",
                "uncertainty.participation=0.3",
            ],
        ),
    ]
}

/// How near the fleets came to the bounds, as shares of them: 1 is the bound.
#[derive(Debug, Default)]
struct Nearest {
    /// Of the prediction's error, on any axis.
    prediction: f64,
    /// Of the tight set after a period, in f.
    tight: f64,
    /// Of the box that a cell goes to, in f.
    successor: f64,
    checked: u32,
}

#[test]
fn no_fleet_leaves_the_bounds_of_games_and_verifier() {
    for spec in specs() {
        let bytes = bare(&spec);
        let nearest = Bounds::of(&spec, &TableView::parse(&bytes).unwrap()).attacked();
        println!("{:?}: {nearest:?}", spec.uncertainty.actuation_delay_s);
        // The fleets come near the bounds, so the test can fail. A box holds a whole cell and
        // errors in both directions, which one trajectory does not meet together.
        assert!(nearest.checked > 30, "{nearest:?}");
        assert!(nearest.tight > 0.9, "{nearest:?}");
        assert!(nearest.successor > 0.6, "{nearest:?}");
    }
}

/// The same fleets against bounds of which one is that of a shorter range.
fn attack_broken(shorter: &str, breaks: impl Fn(&mut Bounds<'_>, Bounds<'_>)) {
    let key = "uncertainty.actuation_delay_s";
    let spec = delayed(&[&format!("{key}=[0.3,2]")]);
    let shorter = delayed(&[&format!("{key}={shorter}")]);
    let (bytes, others) = (bare(&spec), bare(&shorter));
    let (view, other) = (
        TableView::parse(&bytes).unwrap(),
        TableView::parse(&others).unwrap(),
    );
    let mut bounds = Bounds::of(&spec, &view);
    breaks(&mut bounds, Bounds::of(&shorter, &other));
    bounds.attacked();
}

#[test]
#[should_panic(expected = "games, axis 0")]
fn fleets_leave_the_games_boxes_of_a_fixed_delay() {
    attack_broken("0.3", |bounds, other| bounds.games = other.games);
}

#[test]
#[should_panic(expected = "verifier, axis 0")]
fn fleets_leave_the_verifiers_boxes_of_a_fixed_delay() {
    attack_broken("0.3", |bounds, other| {
        bounds.model.known.drifts = other.model.known.drifts;
    });
}

#[test]
#[should_panic(expected = "tight")]
fn fleets_leave_the_tight_sets_of_a_shorter_range() {
    attack_broken("[0.3,1.9]", |bounds, other| {
        bounds.model.changeover = other.model.changeover;
    });
}

#[test]
#[should_panic(expected = "prediction")]
fn fleets_leave_the_prediction_over_another_delay() {
    attack_broken("[0.2,2]", |bounds, other| bounds.late = other.late);
}

#[test]
#[should_panic(expected = "guard")]
fn fleets_leave_the_guard_of_a_fixed_delay() {
    attack_broken("0.3", |bounds, _| bounds.problem.changeover = None);
}

struct Bounds<'a> {
    spec: &'a Spec,
    view: &'a TableView<'a>,
    problem: Problem,
    games: synth::abstraction::affine::AffineAbstraction<STATES>,
    effective: [f64; STATES],
    model: Model,
    /// Ticks after which a command begins to act.
    late: u32,
}

impl<'a> Bounds<'a> {
    fn of(spec: &'a Spec, view: &'a TableView<'a>) -> Self {
        let problem = Problem::new(spec).unwrap();
        let model = closed_loop(view, spec);
        assert_eq!(model.known.limit, None);
        Self {
            spec,
            view,
            games: synthesis::abstraction(&problem).unwrap(),
            effective: Delay::of(spec)
                .unwrap()
                .map_or(problem.measurement, |delay| delay.effective),
            problem,
            model,
            late: delay::ticks(spec),
        }
    }

    fn attacked(&self) -> Nearest {
        let (mut random, mut nearest) = (Random::new(21), Nearest::default());
        for trial in 0..TRIALS {
            self.trial(&mut random, trial, &mut nearest);
        }
        nearest
    }

    fn trial(&self, random: &mut Random, trial: u32, nearest: &mut Nearest) {
        let (spec, grid) = (self.spec, self.view.header().grid);
        let tick_s = f64::from(spec.sampling.watch_ms()) / 1000.0;
        let (late, period) = (self.late, spec.sampling.ticks_per_period());
        let ends_s = *spec.uncertainty.actuation_delay_s.ends_s();
        let style = STYLES[trial as usize % STYLES.len()];
        let mut run = Run {
            spec,
            plant: Plant::new(spec),
            fleet: Fleet::new(random, style, ends_s),
            x: std::array::from_fn(|d| {
                let (low, width) = (grid.lower_edge()[d], grid.width()[d]);
                let span = f64::from(width) * f64::from(grid.count()[d]);
                f64::from(low) + span * (0.25 + 0.5 * random.unit())
            }),
            errors: [extreme(random), extreme(random)],
            pace: 100f64.powf(random.unit()),
            f: Vec::new(),
        };
        let predict = |measured: State, history: &History| match self.view.prediction() {
            Some(prediction) => prediction.predict(measured, history),
            None => measured,
        };
        let since = |tick: u32| f64::from(tick) * tick_s;
        // The command before the last, decided a period ago, so that its changeover is over now.
        let [older, old, new] = std::array::from_fn(|_| level(random, spec));
        let mut history = History::NONE;
        for tick in 0..period {
            history.push(old);
            run.tick(random, since(tick), [older, old]);
        }
        let known = predict(run.measured(random), &history);
        let Some(cell) = grid.quantise(known) else {
            return;
        };
        // Until the new command begins to act somewhere; then for a period.
        for tick in 0..late {
            history.push(new);
            run.tick(random, since(tick), [old, new]);
        }
        self.check_prediction(&run, known, nearest);
        let begun = run.x;
        run.f.clear();
        let mut next = None;
        for tick in late..late + period {
            if tick == period {
                next = Some(predict(run.measured(random), &history));
            }
            history.push(new);
            run.tick(random, since(tick), [old, new]);
        }
        // With no least delay the next decision comes at the end.
        let next = next.unwrap_or_else(|| predict(run.measured(random), &history));
        let at = cell.0.map(u32::from);
        self.check_tight(&run, begun, [old, new], nearest);
        self.check_cells(&run, cell, (new, next), nearest);
        if trial.is_multiple_of(GUARDED) {
            self.check_guard(&run, at, new);
        }
    }

    /// The real state in which the command begins to act.
    fn check_prediction(&self, run: &Run<'_>, known: State, nearest: &mut Nearest) {
        for d in 0..STATES {
            // The stored state is a floor.
            let off = (run.x[d] - f64::from(known.0[d]) - 0.5).abs() - 0.5;
            for bound in [self.effective[d], self.model.known.real[d]] {
                assert!(
                    off <= bound + DUST,
                    "prediction, axis {d}: {off} of {bound}"
                );
                if bound > 1.0 {
                    nearest.prediction = nearest.prediction.max(off / bound);
                }
            }
        }
    }

    /// The set that is followed from a real state, with the levels known.
    fn check_tight(
        &self,
        run: &Run<'_>,
        begun: [f64; STATES],
        levels: [u8; 2],
        near: &mut Nearest,
    ) {
        let [old, new] = levels.map(|level| self.model.drives[usize::from(level)]);
        let from = Zonotope::of_box(&begun.map(Interval::point));
        let (range, set) = if levels[0] == levels[1] {
            let period = &self.model.period;
            (period.frequency(&from, new), from.after(period, new))
        } else {
            let changeover = self.model.changeover.as_ref().unwrap();
            changeover.period(&from, mixed(old, new), new)
        };
        let (lowest, highest) = run.lowest_and_highest();
        assert!(
            lowest >= range.low - DUST && highest <= range.high + DUST,
            "tight f, {levels:?} {:?}: {lowest} {highest} {range:?}",
            run.fleet.style
        );
        for d in 0..STATES {
            let bounds = set.bounds(d);
            let x = run.x[d];
            assert!(
                bounds.low - DUST <= x && x <= bounds.high + DUST,
                "tight, axis {d} {levels:?} {:?}: {x} {bounds:?}",
                run.fleet.style
            );
        }
        let bounds = set.bounds(AXIS_F);
        if bounds.radius() > 1.0 {
            let share = (run.x[AXIS_F] - bounds.mid()).abs() / bounds.radius();
            near.tight = near.tight.max(share);
        }
    }

    /// The boxes of a cell, whatever the level before was, and f between the samples.
    fn check_cells(
        &self,
        run: &Run<'_>,
        cell: firmware::grid::Cell,
        (new, next): (u8, State),
        nearest: &mut Nearest,
    ) {
        let (model, grid) = (&self.model, self.view.header().grid);
        let bounds = grid.bounds(cell).unwrap();
        let widened = |by: &[f64; STATES]| -> [Interval; STATES] {
            std::array::from_fn(|d| Interval {
                low: f64::from(bounds[d].0) - by[d],
                high: f64::from(bounds[d].1) + by[d],
            })
        };
        let at = cell.0.map(u32::from);
        let effect = &model.known.drifts[usize::from(new)];
        let verifiers = successor(&grid, model, &widened(&model.known.before), effect);
        let games = self
            .games
            .successor(&self.games.anchor(at), new.into())
            .map(|cells| Cells {
                low: cells.low.map(|i| i as u16),
                high: cells.high.map(|i| i as u16),
            });
        for (whose, cells) in [("verifier", &verifiers), ("games", &games)] {
            let Some(cells) = cells else { continue };
            for d in 0..STATES {
                let one = index(&grid, d, f64::from(next.0[d]));
                let inside = one.is_some_and(|i| (cells.low[d]..=cells.high[d]).contains(&i));
                assert!(
                    inside,
                    "{whose}, axis {d}, {:?}: {next:?} {cells:?}",
                    run.fleet.style
                );
            }
            let (low, width) = (grid.lower_edge()[AXIS_F], grid.width()[AXIS_F]);
            let (low, width) = (f64::from(low), f64::from(width));
            let ends =
                [cells.low[AXIS_F], cells.high[AXIS_F] + 1].map(|i| low + width * f64::from(i));
            let middle = 0.5 * (ends[0] + ends[1]);
            let share = (f64::from(next.0[AXIS_F]) - middle).abs() / (ends[1] - middle);
            nearest.successor = nearest.successor.max(share);
        }
        nearest.checked += u32::from(verifiers.is_some() && games.is_some());

        let (lowest, highest) = run.lowest_and_highest();
        let from = widened(&model.known.real);
        let drive = model.drives[usize::from(new)];
        let range = model.changeover.as_ref().unwrap().frequency(&from, drive);
        assert!(lowest >= range.low - DUST && highest <= range.high + DUST);
    }

    /// The guard must not let a level pass for a band that f has left.
    fn check_guard(&self, run: &Run<'_>, at: [u32; STATES], new: u8) {
        let (lowest, highest) = run.lowest_and_highest();
        for band in [
            (lowest + 1.0, f64::INFINITY),
            (f64::NEG_INFINITY, highest - 1.0),
        ] {
            let problem = &self.problem;
            let guard = TubeGuard::with_changeover(
                &problem.shape,
                &problem.inputs,
                (problem.period_s, problem.changeover.as_ref()),
                problem.known_within,
                AXIS_F,
                band,
            );
            let permitted = guard.permitted(at, 1 << new);
            assert_eq!(permitted, 0, "guard, {:?}: {band:?}", run.fleet.style);
        }
    }
}
