//! `synth` on the ranks of an MPI job. Every rank plays its slab; the first one tells.

use super::synth_report::{RanksReport, SynthReport, digest_of};
use super::{Failure, progress};
use model::spec::Spec;
use mpi_ranks::World;
use synth::game::Unwatched;
use synth::game::exchange::Lost;
use synth::ranks::{Transport, gather};
use synth::synthesis;
use synth::usage;

/// Plays the games of a spec; the report is the first rank's.
pub(super) fn run(
    spec: &Spec,
    world: &World,
    digest: bool,
) -> Result<Option<SynthReport>, Failure> {
    let first = world.rank() == 0;
    if spec.preference.always_on {
        // There is no game to share out.
        return Ok(first.then(|| SynthReport::of_response(spec)));
    }
    let shared = synthesis::synthesise_shared(spec, world, &|name| {
        if first {
            progress::watch(name)
        } else {
            Box::new(Unwatched)
        }
    })?;
    let gone = |lost: Lost| Failure::No(lost.to_string());
    let mut report = SynthReport::new(spec, &shared.laws);
    if digest {
        let mut sums = Vec::new();
        for (_, law) in shared.laws.all() {
            let own = synthesis::layer_sums(&law.solution, shared.own.clone(), shared.layer);
            sums.push(gather(world, &own).map_err(gone)?);
        }
        report.set_digest(
            sums.into_iter()
                .flatten()
                .map(|sums| digest_of(&sums))
                .collect(),
        );
    }
    let kilobytes = (usage::peak_rss_mb().unwrap_or(0.0) * 1e3) as u64;
    let all = gather(world, &[shared.sent_bytes, kilobytes]).map_err(gone)?;
    Ok(all.map(|words| {
        report.set_ranks(RanksReport {
            ranks: world.ranks(),
            sent_bytes: words.iter().step_by(2).sum(),
            peak_rss_mb: words
                .iter()
                .skip(1)
                .step_by(2)
                .max()
                .map_or(0.0, |kb| *kb as f64 / 1e3),
        });
        report
    }))
}
