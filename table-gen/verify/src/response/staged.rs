//! An event whose losses come in stages, each of a known size at a moment known within bounds: what
//! is proven for one recorded event, such as that of 9 August 2019.
//!
//! # Derivation
//! Let a stage of `p` GW be lost at one moment, or little by little, between its earliest and its
//! latest. Then the loss lies, at every time t, between the sum of the stages whose latest moment
//! is not after t and the sum of those whose earliest is not after t: a band that moves with time
//! (`FleetLoop::loss_in_step`, outward over a step). The sweep lets an adversary move the loss
//! inside it as he likes, so every order and every course of the stages is covered. Before the
//! event the loss is 0, and the first sample is at it.
//!
//! After the last stage's latest moment the band is that of the sum for ever. The bounds that
//! reproduce themselves must rest on samples that lie after that moment alone, for their sweeps
//! know the last band only: the event is followed for so long.

use model::interval::Interval;
use model::spec::Spec;

use firmware::table::TableView;
use model::verdict::Method;
use rayon::prelude::*;

use super::cases::{Case, Found, Resolution};
use super::event::Event;
use super::fleet_loop::{Assumed, FleetLoop, LossProfile, LossStage};
use super::for_ever;
use super::meter;
use super::plan::{self, LOSS_BAND_GW, Summary};
use super::proof::{Proof, case_of, judged};
use super::window::{F_MOST_HZ, Window};
use crate::VerifyError;

/// How finely an event is followed, in turn until it is enough.
const RESOLUTIONS: [Resolution; 2] = [
    Resolution {
        step_s: 0.05,
        follow_s: 30.0,
        memory_s: 25.0,
    },
    Resolution {
        step_s: 0.025,
        follow_s: 30.0,
        memory_s: 25.0,
    },
];
/// Time beyond the memory for which readings and slopes may look back \[s\]: the longest delay that
/// a table can state, a tick and a slope's window are below it.
const LOOK_BACK_S: f64 = 10.0;

/// The band of everything that is lost in the end, with the 0 before it.
fn total(stages: &[LossStage]) -> Interval {
    let sum = stages
        .iter()
        .fold(0.0f64, |sum, stage| (sum + stage.power_gw.high).next_up());
    Interval {
        low: 0.0,
        high: sum,
    }
}

/// Bounds for one case under a loss in stages; times in what is found count from the last stage's
/// latest moment. Nothing as for [`super::examine`], or if a stage is below 0.
pub fn examine_staged(case: &Case, stages: &[LossStage], resolution: Resolution) -> Option<Found> {
    if stages
        .iter()
        .any(|stage| stage.power_gw.low < 0.0 || stage.earliest_s < 0.0)
    {
        return None;
    }
    let assumed = Assumed {
        loss: total(stages),
        profile: LossProfile::Band,
        ..case.assumed
    };
    let number =
        FleetLoop::new(&case.plant, case.law, assumed, resolution.step_s).with_stages(stages);
    let window = Window::new(&number)?;
    let memory = number.steps_up(resolution.memory_s);
    let last_s = stages
        .iter()
        .map(|stage| stage.latest_s)
        .fold(0.0, f64::max);
    let follow_s = last_s + resolution.follow_s + resolution.memory_s + LOOK_BACK_S;
    let event = Event::follow(&number, window, None, follow_s, memory);
    let count = event.samples.samples.len();
    let tube: Vec<Interval> = (0..count.saturating_sub(1))
        .map(|k| event.tube(k))
        .collect();
    let followed = tube.iter().copied().reduce(Interval::join)?;
    if followed.magnitude() >= F_MOST_HZ || count <= number.steps_up(follow_s) {
        return None;
    }
    let last = number.steps_down(last_s);
    // What reproduces itself must rest on samples after the last stage.
    let rests_on = count.checked_sub(memory + for_ever::look_back(&window))?;
    if rests_on <= last + 1 {
        return None;
    }
    let for_ever = for_ever::after(&event.samples, &event.past, memory);
    Some(Found {
        f: for_ever.map_or(followed, |after| followed.join(after)),
        for_ever,
        tube: tube.get(last..).unwrap_or_default().to_vec(),
        step_s: resolution.step_s,
    })
}

/// Examines the response of a table against a spec whose loss comes in stages, whatever the spec
/// says of it: the claims about f. `go_on` is told how much is done, in \[0, 1\], and may end it.
///
/// # Errors
/// A table or a spec that is no response, or an end by `go_on`. A claim that fails is a result.
pub fn verify_staged(
    table: &TableView<'_>,
    spec: &Spec,
    stages: &[LossStage],
    go_on: &dyn Fn(f64) -> bool,
) -> Result<Proof, VerifyError> {
    let mut all = case_of(table, spec)?;
    all.assumed.profile = LossProfile::Band;
    all.assumed.loss = total(stages);
    all.last = all.assumed.loss;
    let requirements = &spec.requirements;
    let inner = Interval::hull(requirements.inner_hz[0], requirements.inner_hz[1]);
    let enough = |found: &Found| {
        let contained = requirements
            .containment_hz
            .is_none_or(|limit| found.f.low >= limit);
        contained && found.inside_from_s(inner).is_some()
    };
    let cases = plan::cases(&all, LOSS_BAND_GW);
    let best = |case: &Case| {
        let mut found = None;
        for resolution in RESOLUTIONS {
            found = examine_staged(case, stages, resolution).or(found);
            if found.as_ref().is_some_and(enough) {
                break;
            }
        }
        (*case, found)
    };
    let mut found = Vec::with_capacity(cases.len());
    for together in cases.chunks(rayon::current_num_threads().max(1)) {
        if !go_on(found.len() as f64 / cases.len() as f64) {
            return Err(VerifyError::Interrupted);
        }
        found.extend(together.par_iter().map(best).collect::<Vec<_>>());
    }
    let (mut claims, counts) = judged(&Summary { found }, spec);
    let latest_s = stages
        .iter()
        .map(|stage| stage.latest_s)
        .fold(0.0, f64::max);
    for claim in &mut claims {
        claim.statement = format!(
            "{}; {} losses in stages, {:.3} GW in all, the last {latest_s} s after the event at the \
             latest",
            claim.statement,
            stages.len(),
            all.last.high
        );
    }
    claims.insert(0, meter::claim(spec));
    Ok(Proof {
        claims,
        method: Method::FleetBounds,
        counts,
    })
}
