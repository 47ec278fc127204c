//! The supply fails: within every step of an update, of a start and of a confirmation, and within
//! what follows such a failure.
//!
//! What must hold at every start that the supply lets come to its end:
//!
//! - the table in force is one that was signed, whole;
//! - it is not older than the newest that was confirmed, or that is older than one that was;
//! - once there was a table in force that was confirmed, there is one.
//!
//! And an update that is tried again ends with the new table in force.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on fails"
)]

mod common;

use std::collections::BTreeMap;

use common::flash::{Flash, Tear};
use common::{FLASH_LEN, GB_BI, SLOT_LEN, container, device, layout, trusted};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use update::container::SIGNATURE_LEN;
use update::key::{PublicKey, Verify};
use update::mapped::Mapped as _;
use update::marks::TRIALS;
use update::refusal::Refusal;
use update::slots::Slots;

/// Versions that a life goes through.
const VERSIONS: u32 = 4;
/// Random cuts in the ordinary run; `HOLDFAST_CUTS` names another number.
const CUTS: u64 = 20_000;

/// The trusted key. The containers of these tests are known to be signed by it (a test says so);
/// whatever else is asked for is verified.
#[derive(Debug, Clone, Copy)]
struct Known<'c>(&'c [Vec<u8>], PublicKey);

impl Verify for Known<'_> {
    fn verifies(&self, message: &[u8], signature: &[u8; SIGNATURE_LEN]) -> bool {
        let is_whole = |whole: &Vec<u8>| {
            let split = whole.split_last_chunk();
            split == Some((message, signature))
        };
        self.0.iter().any(is_whole) || self.1.verifies(message, signature)
    }
}

fn containers() -> Vec<Vec<u8>> {
    (1..=VERSIONS + 1).map(container).collect()
}

/// What was in force at a start, against what the charger had come to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Found {
    NothingYet,
    TheConfirmed,
    TheNewOnTrial,
    TheNewConfirmed,
}

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ran {
    /// The supply failed in the start.
    CutInStart,
    /// The supply failed later.
    Cut,
    /// The new table is in force and confirmed.
    Arrived,
    /// The new table was tried in vain, and the charger will not take it again.
    RolledBack,
    /// On the way: installed, or not confirmed in this run.
    OnTheWay,
}

/// A charger's flash, and what must hold of it.
#[derive(Clone)]
struct World<'c> {
    containers: &'c [Vec<u8>],
    flash: Flash,
    /// Newest version that is known to be confirmed for good.
    confirmed: u32,
    found: BTreeMap<Found, u64>,
    cuts: u64,
    /// Of them, within a start.
    cuts_in_start: u64,
    rolled_back: u64,
}

impl<'c> World<'c> {
    fn new(containers: &'c [Vec<u8>], seed: u64) -> Self {
        Self {
            containers,
            flash: Flash::new(FLASH_LEN, seed),
            confirmed: 0,
            found: BTreeMap::new(),
            cuts: 0,
            cuts_in_start: 0,
            rolled_back: 0,
        }
    }

    /// The same charger, of which nothing was counted yet.
    fn uncounted(&self) -> Self {
        Self {
            found: BTreeMap::new(),
            cuts: 0,
            cuts_in_start: 0,
            rolled_back: 0,
            ..self.clone()
        }
    }

    /// A run on the way to a version: a start, then the installation or, if `healthy`, the
    /// confirmation. The supply fails after so many steps, or goes when all is done.
    fn run(&mut self, version: u32, healthy: bool, cut: Option<(u64, Tear)>) -> Ran {
        if let Some((steps, tear)) = cut {
            self.flash.cut_after(steps, tear);
        }
        let known = device(Known(self.containers, trusted()));
        let mut charger = Slots::start(&mut self.flash, layout(), known);
        if charger.flash().is_dead() {
            self.cuts += 1;
            self.cuts_in_start += 1;
            self.flash.power_up();
            return Ran::CutInStart;
        }
        let running = charger.running().cloned();
        let found = match &running {
            None => {
                assert_eq!(self.confirmed, 0, "nothing is in force");
                Found::NothingYet
            }
            Some(running) => {
                assert_eq!(charger.table(), Some(GB_BI));
                let found = running.version;
                assert!(found >= self.confirmed, "{found} < {}", self.confirmed);
                assert!(found <= version, "{found} was not sent");
                match (found == self.confirmed, running.confirmed) {
                    (true, true) => Found::TheConfirmed,
                    (true, false) => panic!("{found} was confirmed, and is on trial"),
                    (false, false) => Found::TheNewOnTrial,
                    (false, true) => Found::TheNewConfirmed,
                }
            }
        };
        *self.found.entry(found).or_default() += 1;
        let arrives = running
            .as_ref()
            .is_some_and(|running| running.version == version);
        if let Some(running) = running.filter(|running| running.confirmed) {
            // A start that reads it writes it again: from now on it stands.
            self.confirmed = running.version;
        }
        let (done, ran) = if arrives && healthy {
            (charger.confirm(), Ran::Arrived)
        } else if arrives {
            (Ok(()), Ran::OnTheWay)
        } else {
            let container = &self.containers[version as usize - 1];
            (charger.install(container, None), Ran::OnTheWay)
        };
        if let Some(table) = charger.table() {
            assert_eq!(table, GB_BI, "the table in force has changed");
        }
        let dead = charger.flash().is_dead();
        self.flash.power_up();
        match done {
            Err(Refusal::Flash) if dead => {
                self.cuts += 1;
                Ran::Cut
            }
            Err(Refusal::RolledBack { .. }) => {
                self.rolled_back += 1;
                Ran::RolledBack
            }
            // An earlier one whose trial was torn and has come back.
            Err(Refusal::TrialRuns) => Ran::OnTheWay,
            Err(other) => panic!("{other:?}"),
            Ok(()) => {
                if ran == Ran::Arrived {
                    self.confirmed = version;
                }
                ran
            }
        }
    }

    /// Goes on to a version without further cuts, in the starts that a new table has at most.
    fn arrive(&mut self, version: u32) {
        for _ in 0..3 {
            if self.run(version, true, None) == Ran::Arrived {
                assert_eq!(self.run(version, true, None), Ran::Arrived);
                return;
            }
        }
        panic!("version {version} is not in force");
    }
}

fn report(what: &str, worlds: &[&World<'_>]) {
    let sum = |of: &dyn Fn(&World<'_>) -> u64| worlds.iter().map(|world| of(world)).sum::<u64>();
    let found = [
        Found::NothingYet,
        Found::TheConfirmed,
        Found::TheNewOnTrial,
        Found::TheNewConfirmed,
    ]
    .map(|kind| sum(&|world| world.found.get(&kind).copied().unwrap_or(0)));
    println!(
        "{what}: {} cuts, {} of them in a start; then in force: {} the confirmed table, {} the new \
         one on trial, {} the new one confirmed, {} none before the first; {} rolled back",
        sum(&|world| world.cuts),
        sum(&|world| world.cuts_in_start),
        found[1],
        found[2],
        found[3],
        found[0],
        sum(&|world| world.rolled_back)
    );
}

/// Chargers from which an update begins, each with the version that comes next.
fn beginnings(containers: &[Vec<u8>]) -> [(World<'_>, u32); 4] {
    let empty = World::new(containers, 1);
    let mut first = empty.clone();
    first.arrive(1);
    let mut second = first.clone();
    second.arrive(2);
    // Version 2 was tried and did not run: slot B holds it.
    let mut failed = first.clone();
    assert_eq!(failed.run(2, true, None), Ran::OnTheWay);
    for _ in 0..TRIALS {
        assert_eq!(failed.run(2, false, None), Ran::OnTheWay);
    }
    assert_eq!(failed.run(2, false, None), Ran::RolledBack);
    [(empty, 1), (first, 2), (second, 3), (failed, 3)]
}

/// Steps of a run that is not cut.
fn steps(world: &World<'_>, version: u32) -> u64 {
    let mut world = world.clone();
    let before = world.flash.steps;
    world.run(version, true, None);
    world.flash.steps - before
}

#[test]
fn every_step_cut_and_every_step_of_what_follows() {
    let containers = containers();
    let mut cut_worlds = Vec::new();
    for (world, version) in beginnings(&containers) {
        // The installation, and then the trial with its confirmation.
        let mut installed = world.clone();
        assert_eq!(installed.run(version, true, None), Ran::OnTheWay);
        for world in [world, installed] {
            let steps = steps(&world, version);
            assert!(steps >= 32, "{steps}");
            for step in 0..steps {
                for tear in Tear::ALL {
                    let mut once = world.uncounted();
                    let ran = once.run(version, true, Some((step, tear)));
                    assert!(matches!(ran, Ran::Cut | Ran::CutInStart), "{ran:?}");
                    // And each step of the next start as well.
                    for (next, other) in (0..).zip(Tear::ALL.iter().cycle()) {
                        let mut twice = once.uncounted();
                        let ran = twice.run(version, false, Some((next, *other)));
                        let within = ran == Ran::CutInStart;
                        twice.flash.power_up();
                        twice.arrive(version);
                        cut_worlds.push(summary(twice));
                        if !within {
                            break;
                        }
                    }
                    once.arrive(version);
                    cut_worlds.push(summary(once));
                }
            }
        }
    }
    let all: Vec<_> = cut_worlds.iter().collect();
    report("every step", &all);
    assert!(cut_worlds.len() > 4_000, "{}", cut_worlds.len());
}

/// A world without its flash, for the sum.
fn summary(world: World<'_>) -> World<'_> {
    World {
        flash: Flash::new(0, 0),
        ..world
    }
}

/// Updates from the first version to the last, the supply failing at random in most runs.
fn life(world: &mut World<'_>, random: &mut Pcg64) {
    for version in 1..=VERSIONS {
        for run in 0.. {
            assert!(run < 1_000, "version {version} is never in force");
            let reach = if random.random_bool(0.5) { 40 } else { 160 };
            let tear = Tear::ALL[random.random_range(0..Tear::ALL.len())];
            let cut = (random.random_range(0..reach), tear);
            let cut = random.random_bool(0.9).then_some(cut);
            let healthy = random.random_bool(0.8);
            let ran = world.run(version, healthy, cut);
            if matches!(ran, Ran::Arrived | Ran::RolledBack) {
                break;
            }
        }
    }
    // Whatever has happened: a newer one can be installed and confirmed.
    for _ in 0..TRIALS {
        // What was torn in its last trial may come back, and has so many starts.
        if world.run(VERSIONS + 1, true, None) == Ran::Arrived {
            return;
        }
    }
    world.arrive(VERSIONS + 1);
}

#[test]
fn random_cuts() {
    let asked = std::env::var("HOLDFAST_CUTS").ok();
    let cuts = asked.map_or(CUTS, |text| text.parse().unwrap());
    let containers = containers();
    let mut random = Pcg64::seed_from_u64(1);
    let mut sum = summary(World::new(&containers, 0));
    let mut lives = 0;
    while sum.cuts < cuts {
        lives += 1;
        let mut world = World::new(&containers, lives);
        life(&mut world, &mut random);
        sum.cuts += world.cuts;
        sum.cuts_in_start += world.cuts_in_start;
        sum.rolled_back += world.rolled_back;
        for (kind, count) in world.found {
            *sum.found.entry(kind).or_default() += count;
        }
    }
    report(&format!("{lives} chargers"), &[&sum]);
    assert_eq!(sum.found.len(), 4, "a state was never found");
    assert!(sum.rolled_back > 0, "nothing was rolled back");
}

#[test]
fn a_slot_that_was_to_be_erased_does_not_come_back() {
    let containers = containers();
    let [_, _, (two, _), _] = beginnings(&containers);
    // Version 2 is in force in slot B, 1 lies in slot A. The voiding takes 8 steps.
    for (step, tear) in [(7, Tear::Whole), (8, Tear::Nothing)] {
        let mut world = two.clone();
        assert_eq!(world.run(3, true, Some((step, tear))), Ran::Cut);
        // Voided, and nothing is erased yet.
        let (mark, rest) = world.flash.bytes().split_at(32);
        assert!(mark.iter().all(|byte| *byte == 0));
        assert_eq!(rest[256 - 32..][..388], containers[0]);
        world.flash.decay(SLOT_LEN as usize + 400);
        let known = device(Known(&containers, trusted()));
        let charger = Slots::start(&mut world.flash, layout(), known);
        assert_eq!(charger.running(), None);
    }
    // Before that it is what is left.
    let mut world = two.clone();
    assert_eq!(world.run(3, true, Some((0, Tear::Nothing))), Ran::Cut);
    world.flash.decay(SLOT_LEN as usize + 400);
    let known = device(Known(&containers, trusted()));
    let charger = Slots::start(&mut world.flash, layout(), known);
    assert_eq!(charger.running().unwrap().version, 1);
}

#[test]
fn the_known_containers_are_signed() {
    for whole in containers() {
        let (message, signature) = whole.split_last_chunk().unwrap();
        assert!(trusted().verifies(message, signature));
    }
}
