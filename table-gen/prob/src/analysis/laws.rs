//! Laws by games: the verifier for the size of the loss, and for a drawn participation the better
//! of two bounds.
//!
//! | bound | how |
//! |---|---|
//! | union | all draws within an error for which the verifier proves all claims |
//! | chain | a set-valued Markov chain ([`crate::closed_loop`]) |

use firmware::table::TableView;
use model::spec::Spec;

use super::answer::{AnalysisError, Answer, Cut, Layer, Layers, Question};
use super::certain;
use crate::bands::BandProof;
use crate::closed_loop::{self, ClosedLoop, ClosedLoopError, Pace};
use crate::loss::{LossBand, Losses};
use crate::participation::{Drawn, Participation};
use crate::{reward, value};

/// What is asked, of which table.
struct Laws<'a> {
    table: &'a TableView<'a>,
    spec: &'a Spec,
    question: &'a Question,
    tick_s: f64,
    period_ticks: u32,
}

/// Bounds for a drawn participation, at one band of losses.
struct OfDraws {
    /// By a union of draws; nothing where no error is proven.
    union: Option<f64>,
    /// By a chain, for every number of steps; or why there is none.
    chain: Result<(ClosedLoop, Vec<f64>), ClosedLoopError>,
}

impl OfDraws {
    fn of_chain(&self) -> Option<f64> {
        let (_, bounds) = self.chain.as_ref().ok()?;
        bounds.last().copied()
    }

    fn best(&self) -> f64 {
        let union = self.union.unwrap_or(0.0);
        self.of_chain().unwrap_or(0.0).max(union)
    }
}

/// What is proven of some bands.
pub(super) fn proofs(
    table: &TableView<'_>,
    spec: &Spec,
    question: &Question,
    bands: &[LossBand],
    go_on: &dyn Fn(f64) -> bool,
) -> Result<Vec<BandProof>, AnalysisError> {
    let laws = Laws::new(table, spec, question);
    let each = bands.iter().enumerate().map(|(index, band)| {
        let share = index as f64 / bands.len() as f64;
        laws.proven(*band, &|| go_on(share))
    });
    each.collect()
}

/// The layers of laws by games.
pub(super) fn of_laws(
    table: &TableView<'_>,
    spec: &Spec,
    question: &Question,
    proofs: Vec<BandProof>,
    go_on: &dyn Fn(f64) -> bool,
) -> Result<Answer, AnalysisError> {
    Laws::new(table, spec, question).answer(proofs, go_on)
}

impl<'a> Laws<'a> {
    fn new(table: &'a TableView<'a>, spec: &'a Spec, question: &'a Question) -> Self {
        let header = table.header();
        Self {
            table,
            spec,
            question,
            tick_s: f64::from(header.tick_ms) / 1e3,
            period_ticks: u32::from(header.period_ticks),
        }
    }

    fn answer(
        &self,
        proofs: Vec<BandProof>,
        go_on: &dyn Fn(f64) -> bool,
    ) -> Result<Answer, AnalysisError> {
        let question = self.question;
        let certain = Losses::certain(self.spec.uncertainty.loss_gw);
        let losses = question.losses.as_ref().unwrap_or(&certain);
        let mut own: Option<OfDraws> = None;
        // Of a single size nothing else is asked.
        let several = question
            .losses
            .as_ref()
            .filter(|losses| losses.bands.len() > 1);
        if let (Some(kind), Some(_)) = (&question.participation, several) {
            let proof = self.proven(certain.bands[0], &|| go_on(0.0))?;
            own = Some(self.of_draws(kind, &proof, &|| go_on(0.0))?);
        }
        let (mut exact, mut drawn) = (Vec::new(), Vec::new());
        for (index, proof) in proofs.iter().enumerate() {
            let go_on = || go_on(index as f64 / proofs.len() as f64);
            let holds = f64::from(u8::from(proof.holds));
            exact.push(holds);
            drawn.push(match &question.participation {
                None => holds,
                Some(kind) => {
                    let found = self.of_draws(kind, proof, &go_on)?;
                    let best = found.best();
                    own.get_or_insert(found);
                    best
                }
            });
        }
        let loss = losses.mean(&exact);
        // The band of the spec is certain: a mean of one would lose roundings.
        let [loss, all] = match &question.losses {
            None => [exact[0], drawn[0]],
            Some(losses) => [loss, losses.mean(&drawn)],
        };
        let mut answer = self.layers(losses, proofs, loss, all);
        if let (Some(kind), Some(own)) = (&question.participation, own) {
            self.with_draws(&mut answer, kind, own, loss)?;
        }
        Ok(answer)
    }

    /// What is proven with certainty. The first error is the spec's.
    fn proven(&self, band: LossBand, go_on: &dyn Fn() -> bool) -> Result<BandProof, AnalysisError> {
        let known = self.spec.uncertainty.participation;
        let mut errors = vec![known];
        if self.question.participation.is_some() {
            errors.extend(self.question.errors.iter().filter(|error| **error > known));
            errors.sort_by(f64::total_cmp);
            errors.dedup();
        }
        let horizon_s = self.question.settings.horizon_s;
        let proof = certain::of_laws(self.table, self.spec, band, &errors, horizon_s, go_on)?;
        Ok(proof)
    }

    /// Steps that may begin within the horizon; each has one draw at most.
    fn steps(&self) -> u32 {
        let ticks = (self.question.settings.horizon_s / self.tick_s).ceil() as u32;
        Pace::of(&self.table.header()).steps_in(ticks)
    }

    fn of_draws(
        &self,
        kind: &Participation,
        proof: &BandProof,
        go_on: &dyn Fn() -> bool,
    ) -> Result<OfDraws, AnalysisError> {
        let absolute = self.spec.uncertainty.participation_absolute;
        let union = proof
            .participation
            .filter(|_| proof.holds)
            .map(|error| kind.all_within(u64::from(self.steps()), error, absolute));
        let mut spec = self.spec.clone();
        spec.uncertainty.loss_gw = [proof.band.low_gw, proof.band.high_gw];
        // What is drawn takes the place of what the spec leaves to an adversary.
        spec.uncertainty.participation = 0.0;
        spec.uncertainty.participation_absolute = 0.0;
        let settings = &self.question.settings;
        let built = closed_loop::build(self.table, &spec, kind, settings, &|_, _| go_on());
        let chain = match built {
            Err(ClosedLoopError::Interrupted) => return Err(ClosedLoopError::Interrupted.into()),
            built => built.map(|built| {
                let bounds = value::bounds(&built.chain, built.steps);
                (built, bounds)
            }),
        };
        Ok(OfDraws { union, chain })
    }

    fn layers(&self, losses: &Losses, bands: Vec<BandProof>, loss: f64, all: f64) -> Answer {
        Answer {
            lower_bound: all,
            states: 0,
            transitions: 0,
            horizon_s: self.question.settings.horizon_s,
            layers: Layers {
                loss: Layer {
                    lower_bound: loss,
                    how: "share of the losses in bands for which all claims are proven".to_owned(),
                },
                participation: None,
                noise: None,
            },
            dominates: format!(
                "losses for which the claims are not proven: {:.1e}",
                1.0 - loss
            ),
            assumptions: vec![
                losses.assumption.clone(),
                "the fleet acts as one; the estimate errs within uncertainty.measurement as an adversary likes".to_owned(),
            ],
            bands,
            rates: Vec::new(),
            over_time: Vec::new(),
            cut: None,
            failures: None,
            reach_hz: None,
            seconds_below_49_5: None,
            below: None,
            chain: None,
            no_chain: None,
            steps: 0,
        }
    }

    /// Adds what is known of the drawn participation.
    fn with_draws(
        &self,
        answer: &mut Answer,
        kind: &Participation,
        own: OfDraws,
        loss: f64,
    ) -> Result<(), AnalysisError> {
        let best = own.best();
        let by_chain = own.of_chain();
        let union = own.union.map(|union| {
            format!(
                "a union bound over {} draws of {kind}: {union:.9}",
                self.steps()
            )
        });
        let at = match self
            .question
            .losses
            .as_ref()
            .map(|losses| &losses.bands[..])
        {
            Some([only]) => format!("a loss of {} GW", only.high_gw),
            _ => "the spec's loss".to_owned(),
        };
        let mut how: Vec<String> = union.into_iter().collect();
        let chain = match own.chain {
            // Neither bound exists: what is missing is the answer.
            Err(error) if own.union.is_none() => return Err(error.into()),
            Err(error) => {
                how.push(format!("no chain ({error})"));
                answer.no_chain = Some(error.to_string());
                None
            }
            Ok(chain) => Some(chain),
        };
        let lost_by_draws = match &chain {
            Some((own, _)) if by_chain == Some(best) => self.outside(kind) * f64::from(own.steps),
            // Every draw outside counts as lost, and nothing else does.
            _ => 1.0 - best,
        };
        if let Some((own, bounds)) = chain {
            let left = own.cut.as_ref().map_or(String::new(), |cut| {
                format!(
                    ", cut after {} steps: {} nodes were not followed and count as failed",
                    cut.steps, cut.nodes
                )
            });
            how.push(format!(
                "a chain of {} states{left}: {:.9}",
                own.chain.states(),
                by_chain.unwrap_or(0.0)
            ));
            self.with_chain(answer, own, &bounds);
        }
        answer.layers.participation = Some(Layer {
            lower_bound: best,
            how: format!("at {at}, the better of: {}", how.join("; ")),
        });
        answer.assumptions.push(format!(
            "the participation's error is drawn as {kind}, independently, at every decision and in Fixed every {} s",
            self.tick_s * f64::from(self.period_ticks)
        ));
        answer.dominates = dominates(answer, loss, lost_by_draws);
        Ok(())
    }

    fn with_chain(&self, answer: &mut Answer, own: ClosedLoop, bounds: &[f64]) {
        // The bound over T is that of the steps that may begin in T.
        let over = |steps: usize| {
            let (ticks, used) = own.pace.covered(steps as u32)?;
            let bound = bounds.get(used as usize)?;
            Some((used as usize, [self.tick_s * f64::from(ticks), *bound]))
        };
        let times =
            (0..bounds.len()).filter_map(|steps| over(steps).filter(|(used, _)| *used == steps));
        answer.over_time = times.map(|(_, point)| point).collect();
        answer.cut = own.cut.map(|cut| {
            let whole = over(cut.steps as usize).map(|(_, point)| point);
            Cut {
                steps: cut.steps,
                nodes: cut.nodes,
                until_s: whole.map_or(0.0, |[until_s, _]| until_s),
                lower_bound: whole.map(|[_, bound]| bound),
            }
        });
        answer.states = own.chain.states();
        answer.transitions = own.chain.transitions();
        answer.failures = Some(own.failures);
        answer.reach_hz = Some(own.reach_hz);
        let after = reward::expected(&own.chain, &own.below, own.steps);
        let horizon_s = self.question.settings.horizon_s;
        answer.seconds_below_49_5 = Some((own.below_before_s + after).next_up().min(horizon_s));
        answer.below = Some(own.below);
        answer.steps = own.steps;
        answer.chain = Some(own.chain);
    }

    /// Most that the bins of a level leave over.
    fn outside(&self, kind: &Participation) -> f64 {
        let header = self.table.header();
        let outside = (1..header.levels).map(|level| {
            let command = f64::from(header.participation(level).ppm()) / 1e6;
            let bins = kind.bins(
                command,
                self.question.settings.bin_gw / self.spec.fleet_power_gw(),
            );
            1.0 - bins.iter().map(|bin| bin.probability).sum::<f64>()
        });
        outside.fold(0.0, f64::max).max(0.0)
    }
}

/// What the bound loses most by.
fn dominates(answer: &Answer, loss: f64, by_draws: f64) -> String {
    let rest = 1.0 - answer.lower_bound;
    let by_draws = by_draws.min(rest);
    if rest > 0.0 && 1.0 - loss > 0.5 * rest {
        format!(
            "losses for which the claims are not proven: {:.1e}",
            1.0 - loss
        )
    } else if by_draws >= 0.5 * rest {
        format!("draws outside all bins: {by_draws:.1e} of {rest:.1e}")
    } else if answer.cut.is_some() {
        format!(
            "nodes past --nodes-max, which count as failed: {:.1e} of {rest:.1e}",
            rest - by_draws
        )
    } else {
        format!(
            "the adversary's choices inside sets and bins: {:.1e} of {rest:.1e}",
            rest - by_draws
        )
    }
}
