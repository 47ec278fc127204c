//! The falsifier: adversaries that try to break a table, with the firmware's own control loop.
//!
//! It proves nothing, and it shares nothing with the proof but the spec: a claim that the verifier
//! accepts and the falsifier breaks is a defect of the verifier. This package does not reach the
//! verifier's.
//!
//! | module | holds |
//! |---|---|
//! | [`trajectory`] | plant and firmware, from the event until a claim breaks |
//! | `under_way` | commands that act late, anywhere within a range of delays |
//! | [`adversaries`] | who chooses the disturbances |
//! | [`crowd`] | chargers with own clocks and errors; commands act anywhere within the delays |
//! | `readers` | the same crowd where the law is a response: what reads the same decides once |
//! | `sliding` | its least and greatest commands under way
//! | `draw` | what is drawn of a trajectory against a fleet |
//! | `judge` | the claims about f along it |
//! | `fleet` | the search against a whole fleet, on a plant and losses that are drawn |
//! | [`witness`] | for a verdict's failure: a real trajectory that shows it |
//!
//! Where a spec knows a fleet (own clocks, limited governors, or a response), the search is
//! `fleet`'s. Else one charger decides for all, each follows after its own delay, every trajectory
//! has a plant of its own where the spec has bands of it, and the search takes turns between three
//! kinds of trajectory:
//!
//! | kind | chooses |
//! |---|---|
//! | constant | a corner of every range, held |
//! | bang-bang | corners switched at random, at a random pace |
//! | resonant | the sign of the net power, by a linear functional of the state |
//!
//! The best functional so far is mutated. The search is deterministic in its seed.

pub mod adversaries;
pub mod crowd;
mod draw;
mod fleet;
mod found;
mod judge;
mod observer;
mod readers;
mod sliding;
pub mod trajectory;
mod under_way;
pub mod witness;

use firmware::table::{TableError, TableView};
use model::spec::Spec;

use adversaries::{BangBang, Constant, Random, Resonant, draw_times, drawn_plant};
pub use found::Falsification;
use trajectory::{Adversary, Breach, Trajectories};
use witness::real_path;

/// Length of a trajectory without a horizon \[s\]: several periods of the slow oscillation (28 s
/// for the paper's plant).
const TRAJECTORY_S: f64 = 120.0;

/// Searches for a trajectory that breaks a claim, for at least so many control steps or until one
/// is found.
///
/// # Errors
/// A table that the firmware rejects.
pub fn falsify(
    bytes: &[u8],
    spec: &Spec,
    steps: u64,
    seed: u64,
) -> Result<Falsification, TableError> {
    let table = TableView::parse(bytes)?;
    if knows_a_fleet(spec) || table.response().is_some() {
        return Ok(fleet::Fleets::new(&table, spec).search(steps, seed));
    }
    Ok(Search::new(&table, spec).run(steps, seed))
}

/// Draws so many fleets, plants, losses and states from a spec's bands and runs each once, or until
/// a claim breaks. A table or a spec that knows no fleet is attacked as by [`falsify`], for as many
/// trajectories as there are runs.
///
/// # Errors
/// A table that the firmware rejects.
pub fn sample(
    bytes: &[u8],
    spec: &Spec,
    runs: u64,
    seed: u64,
) -> Result<Falsification, TableError> {
    let table = TableView::parse(bytes)?;
    if knows_a_fleet(spec) || table.response().is_some() {
        return Ok(fleet::Fleets::new(&table, spec).sample(runs, seed));
    }
    let search = Search::new(&table, spec);
    // A trajectory that breaks nothing has this many steps.
    Ok(search.run(runs * u64::from(search.ticks), seed))
}

/// Whether a spec says more of the fleet than one participation, or more of the plant than linear
/// equations.
fn knows_a_fleet(spec: &Spec) -> bool {
    spec.uncertainty.own_clocks || !spec.plant.governor.is_absent()
}

struct Search<'a> {
    table: &'a TableView<'a>,
    spec: &'a Spec,
    /// On the spec's own plant.
    nominal: Trajectories<'a>,
    ticks: u32,
}

/// One trajectory's outcome.
struct Outcome {
    steps: u64,
    margin_hz: f64,
    breach: Option<Breach>,
}

impl<'a> Search<'a> {
    fn new(table: &'a TableView<'a>, spec: &'a Spec) -> Self {
        let nominal = Trajectories::new(table, spec);
        let length_s = spec.requirements.horizon_s.unwrap_or(TRAJECTORY_S);
        Self {
            table,
            spec,
            ticks: (length_s / nominal.tick_s()).ceil() as u32,
            nominal,
        }
    }

    /// On a plant that is drawn, if the spec has bands of it.
    fn drawn(&self, draw: u64) -> Option<Trajectories<'a>> {
        /// Sets these draws apart from the adversary's.
        const PLANT: u64 = 0x706c_616e_7400_0000;
        self.spec.has_plant_band().then(|| {
            let mut random = Random::new(draw ^ PLANT);
            let mut plant = drawn_plant(&mut random, self.spec);
            draw_times(&mut random, self.spec, &mut plant);
            Trajectories::on(self.table, self.spec, plant)
        })
    }

    fn run(&self, steps: u64, seed: u64) -> Falsification {
        let mut out = Falsification {
            steps: 0,
            trajectories: 0,
            smallest_margin_hz: f64::INFINITY,
            violation: None,
        };
        let mut random = Random::new(seed);
        let mut best: Option<(f64, Resonant)> = None;
        while out.steps < steps {
            let draw = random.number();
            let kind = out.trajectories % 4;
            let resonant = match &best {
                // Every other resonant trajectory starts from the best so far.
                Some((_, best)) if kind == 3 => best.mutated(draw),
                _ => Resonant::new(draw),
            };
            let make = || -> Box<dyn Adversary> {
                match kind {
                    0 => Box::new(constant(draw)),
                    1 => Box::new(bang_bang(draw)),
                    _ => Box::new(resonant.clone()),
                }
            };
            let drawn = self.drawn(draw);
            let trajectories = drawn.as_ref().unwrap_or(&self.nominal);
            let outcome = self.outcome(trajectories, make().as_mut());
            out.steps += outcome.steps;
            out.trajectories += 1;
            out.smallest_margin_hz = out.smallest_margin_hz.min(outcome.margin_hz);
            if kind >= 2
                && best
                    .as_ref()
                    .is_none_or(|(margin, _)| outcome.margin_hz < *margin)
            {
                best = Some((outcome.margin_hz, resonant.clone()));
            }
            if let Some(breach) = outcome.breach {
                let mut samples = Vec::new();
                trajectories.run(make().as_mut(), self.ticks, &mut |sample| {
                    samples.push(*sample);
                });
                let name = format!("kind {kind} of trajectory, draw {draw}");
                out.violation = Some(real_path(breach, &samples, &name));
                break;
            }
        }
        out
    }

    fn outcome(&self, on: &Trajectories<'_>, adversary: &mut dyn Adversary) -> Outcome {
        let mut margin = f64::INFINITY;
        let breach = on.run(adversary, self.ticks, &mut |sample| {
            margin = margin.min(on.margin_hz(sample));
        });
        Outcome {
            steps: breach.map_or(u64::from(self.ticks), |breach| u64::from(breach.tick) + 1),
            margin_hz: margin,
            breach,
        }
    }
}

fn constant(draw: u64) -> Constant {
    let mut random = Random::new(draw);
    Constant {
        corner: std::array::from_fn(|_| if random.sign() > 0.0 { 1.0 } else { 0.0 }),
        moment: random.unit(),
        share: random.sign(),
        error: random.sign(),
        early: share_early(&mut random),
    }
}

fn bang_bang(draw: u64) -> BangBang {
    let mut random = Random::new(draw);
    // From every tick to every 100 ticks, evenly on a logarithmic scale.
    let hold_ticks = 100f64.powf(random.unit());
    BangBang {
        share: random.sign(),
        random,
        hold_ticks,
        early: 1.0,
    }
}

/// A fleet that answers early, late, or in two groups.
fn share_early(random: &mut Random) -> f64 {
    match random.number() % 3 {
        0 => 0.0,
        1 => 1.0,
        _ => random.unit(),
    }
}
