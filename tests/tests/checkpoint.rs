//! Games that are interrupted after any sweep and go on: the same solution, and refusals of what is
//! damaged or foreign.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::path::Path;
use std::time::Duration;

use model::spec::Spec;
use synth::abstraction::guard::Unguarded;
use synth::checkpoint::{CheckpointError, Checkpoints};
use synth::game::reach::{reach, reach_lean};
use synth::game::safety::{safety, safety_lean};
use synth::game::{GameError, Sweep, Unwatched, Watch};
use synth::yardsticks::{boost_converter, unicycle};

/// Ends a game after a number of sweeps of this run.
struct After(std::sync::atomic::AtomicU16);

impl Watch for After {
    fn sweep(&self, _sweep: &Sweep) -> bool {
        self.0.fetch_sub(1, std::sync::atomic::Ordering::Relaxed) > 1
    }
}

fn spec() -> Spec {
    Spec::load("paper-bi", &[]).unwrap()
}

fn open(folder: &Path) -> Result<Checkpoints, CheckpointError> {
    Checkpoints::open(folder, &spec(), Duration::MAX)
}

/// Plays on, `sweeps` at a time, until the game is finished; every part with the folder opened
/// anew.
fn in_parts<S>(sweeps: u16, game: impl Fn(&dyn Watch) -> Result<S, GameError>) -> (S, usize) {
    let folder = tempfile::tempdir().unwrap();
    for part in 1.. {
        let checkpoints = open(folder.path()).unwrap();
        let watch = checkpoints.watch("game", Box::new(After(sweeps.into())));
        match game(watch.as_ref()) {
            Ok(solution) => return (solution, part),
            Err(error) => assert_eq!(error, GameError::Interrupted),
        }
        drop(watch);
        assert!(checkpoints.failure().is_none());
    }
    unreachable!()
}

#[test]
fn a_game_that_goes_on_has_the_same_solution() {
    let abstraction = boost_converter::abstraction(60).unwrap();
    let all = synth::game::bitset::BitSet::full(3600);
    let whole = safety(&abstraction, &all, &Unguarded, &Unwatched).unwrap();
    let lean = safety_lean(&abstraction, &all, &Unguarded, &Unwatched).unwrap();
    for sweeps in [1, 2, 5] {
        let (solution, parts) = in_parts(sweeps, |watch| {
            safety(&abstraction, &all, &Unguarded, watch)
        });
        assert!(solution == whole && parts > 1, "{sweeps}");
        let (solution, _) = in_parts(sweeps, |watch| {
            safety_lean(&abstraction, &all, &Unguarded, watch)
        });
        assert_eq!(
            (&solution.kernel, solution.sweeps),
            (&lean.kernel, lean.sweeps)
        );
        assert!((0..3600).all(|cell| solution.witnesses.get(cell) == lean.witnesses.get(cell)));
    }
    // Past 254 sweeps, where the ranks of the lean game widen.
    let vehicle = unicycle::abstraction().unwrap();
    let (target, avoid) = (unicycle::target(), unicycle::avoid());
    let whole = reach(&vehicle, &target, &avoid, &Unguarded, &Unwatched).unwrap();
    let (solution, parts) = in_parts(90, |watch| {
        reach(&vehicle, &target, &avoid, &Unguarded, watch)
    });
    assert!(solution == whole && parts > 4, "{parts}");
    let (solution, _) = in_parts(90, |watch| {
        reach_lean(&vehicle, &target, &avoid, &Unguarded, watch)
    });
    assert!((0..whole.ranks.len()).all(|cell| solution.ranks.get(cell) == whole.ranks[cell]));
}

/// The lean games keep less and answer alike.
#[test]
fn lean_games_have_the_same_cells_ranks_and_inputs() {
    use synth::abstraction::Abstraction;
    let abstraction = boost_converter::abstraction(60).unwrap();
    let all = synth::game::bitset::BitSet::full(3600);
    let full = safety(&abstraction, &all, &Unguarded, &Unwatched).unwrap();
    let lean = safety_lean(&abstraction, &all, &Unguarded, &Unwatched).unwrap();
    assert_eq!((full.winning, full.sweeps), (lean.winning, lean.sweeps));
    for (cell, mask) in full.masks.iter().enumerate() {
        assert_eq!(lean.kernel.contains(cell), *mask != 0);
        let lowest = (*mask != 0).then(|| mask.trailing_zeros() as usize);
        assert_eq!(lean.witnesses.get(cell), lowest);
    }
    let vehicle = unicycle::abstraction().unwrap();
    let (target, avoid) = (unicycle::target(), unicycle::avoid());
    let full = reach(&vehicle, &target, &avoid, &Unguarded, &Unwatched).unwrap();
    let lean = reach_lean(&vehicle, &target, &avoid, &Unguarded, &Unwatched).unwrap();
    assert_eq!((full.winning, full.sweeps), (lean.winning, lean.sweeps));
    for (index, rank) in full.ranks.iter().enumerate() {
        assert_eq!(lean.ranks.get(index), *rank);
        if index % 11 == 0 {
            let cell = vehicle.shape().cell(index);
            assert_eq!(lean.inputs(&vehicle, &Unguarded, cell), full.masks[index]);
        }
    }
}

#[test]
fn what_is_damaged_or_foreign_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let abstraction = boost_converter::abstraction(60).unwrap();
    let all = synth::game::bitset::BitSet::full(3600);
    let checkpoints = open(folder.path()).unwrap();
    let watch = checkpoints.watch("game", Box::new(After(2.into())));
    let error = safety(&abstraction, &all, &Unguarded, watch.as_ref()).unwrap_err();
    assert_eq!(error, GameError::Interrupted);
    let path = folder.path().join("game.game");
    let bytes = std::fs::read(&path).unwrap();
    assert!(open(folder.path()).is_ok());
    for position in [0, 9, 20, 40, bytes.len() / 2, bytes.len() - 1] {
        let mut bad = bytes.clone();
        bad[position] ^= 4;
        std::fs::write(&path, &bad).unwrap();
        assert!(
            matches!(open(folder.path()), Err(CheckpointError::Damaged { .. })),
            "{position}"
        );
    }
    for len in [0, 7, 39, 40, bytes.len() - 1] {
        std::fs::write(&path, &bytes[..len]).unwrap();
        assert!(
            matches!(open(folder.path()), Err(CheckpointError::Damaged { .. })),
            "{len}"
        );
    }
    std::fs::write(&path, &bytes).unwrap();
    let other = Spec::load("paper-uni", &[]).unwrap();
    let foreign = Checkpoints::open(folder.path(), &other, Duration::MAX).unwrap_err();
    assert!(foreign.to_string().contains("another spec"), "{foreign}");
    checkpoints.done().unwrap();
    assert!(!folder.path().exists());
}
