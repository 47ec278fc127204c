//! Runs on plants that lie in bands: each draws from its bands, can be run again by its seed, and
//! tells its plant; the scorecard has every corner.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use firmware::table::TableView;
use lab::compare::chargers::ChargersConfig;
use lab::compare::grids::Grids;
use lab::compare::{CompareConfig, Controller, compare};
use lab::simulation::closed_loop::{ClosedLoop, Estimator};
use lab::simulation::monte_carlo::draws::Draws;
use lab::simulation::monte_carlo::{self, Statistics};
use model::plant::Plant;
use model::spec::Spec;

const TABLE: &[u8] = include_bytes!("../../firmware/tables/gb-bi.bin");
const BANDS: [&str; 3] = [
    "uncertainty.inertia_gw_s_per_hz=[2.8,5]",
    "uncertainty.governor_gain_gw_per_hz=[-6,-4]",
    "uncertainty.governor_time_s=[2,3]",
];

fn spec(set: &[&str]) -> Spec {
    let set: Vec<String> = set.iter().map(|&pair| pair.to_owned()).collect();
    Spec::load("gb-bi", &set).unwrap()
}

#[test]
fn many_runs_draw_their_plants_and_one_can_be_run_again() {
    let spec = spec(&BANDS);
    let draws = Draws {
        loss_gw: [2.0, 2.0],
        duration_s: 30.0,
        ..Draws::of(&spec)
    };
    let own = Plant::new(&spec);
    let (mut lightest, mut heaviest) = (f64::INFINITY, 0.0f64);
    for seed in 0..1000 {
        let plant = draws.plant(seed).unwrap();
        assert!((2.8..=5.0).contains(&plant.inertia), "{plant:?}");
        assert!((-6.0..=-4.0).contains(&plant.governor_gain));
        assert!((2.0..=3.0).contains(&plant.governor_time));
        let back = Plant {
            inertia: own.inertia,
            governor_gain: own.governor_gain,
            governor_time: own.governor_time,
            ..plant
        };
        assert_eq!(back, own);
        lightest = lightest.min(plant.inertia);
        heaviest = heaviest.max(plant.inertia);
    }
    assert!(lightest < 2.85 && heaviest > 4.95);

    let table = TableView::parse(TABLE).unwrap();
    let closed_loop = ClosedLoop::new(&spec, &table, Estimator::Observer).unwrap();
    let found = monte_carlo::run(&closed_loop, &draws, 300, 7, &|| true).unwrap();
    let worst = &found.worst;
    let plant = draws.plant(worst.seed).unwrap();
    assert_eq!(worst.plant, draws.plant.told(plant));
    assert!(worst.plant.starts_with("H = "), "{}", worst.plant);
    let mut again = closed_loop.clone();
    again.set_plant(plant);
    let summary = again.run(&draws.scenario(worst.seed), &mut ());
    assert_eq!(summary, worst.summary);
    // The lowest nadir of plants that differ is another than the lowest of one.
    let plain = Draws {
        plant: Draws::of(&self::spec(&[])).plant,
        ..draws.clone()
    };
    let known = monte_carlo::run(&closed_loop, &plain, 300, 7, &|| true).unwrap();
    assert_eq!(known.worst.plant, "");
    let lowest = |found: &Statistics| found.nadir_hz.at.unwrap().min;
    assert!(lowest(&found) < lowest(&known) - 0.02);
    // Scenarios are the same with bands and without.
    assert_eq!(draws.scenario(3), plain.scenario(3));
}

#[test]
fn the_scorecard_has_every_corner_and_each_is_that_plants_own_scorecard() {
    let spec = spec(&BANDS[..2]);
    let table = TableView::parse(TABLE).unwrap();
    let of = |spec: &Spec| CompareConfig {
        losses_gw: vec![2.0],
        duration_s: 40.0,
        chargers: ChargersConfig::of(spec, 20),
        ..CompareConfig::of(spec)
    };
    let found = compare(&spec, &table, &of(&spec), &|| true).unwrap();
    assert_eq!(found.rows.len(), 5 * Controller::ALL.len());
    let views = found.views(&of(&spec).grids);
    assert_eq!(views.len(), 2);
    // The lightest grid with the weakest governors, asked for as a plant of its own.
    let corner = self::spec(&[
        "plant.inertia_gw_s_per_hz=2.8",
        "plant.governor_gain_gw_per_hz=-4",
    ]);
    let alone = CompareConfig {
        grids: Grids::of(&corner),
        ..of(&spec)
    };
    let alone = compare(&spec, &table, &alone, &|| true).unwrap();
    let name = "H = 2.8, 1/R_eq = -4";
    for controller in Controller::ALL {
        let (a, b) = (found.of(controller, name), alone.of(controller, "H = 2.8"));
        let pairs: Vec<_> = a.zip(b).collect();
        assert_eq!(pairs.len(), 1);
        assert_eq!(pairs[0].0.outcome, pairs[0].1.outcome, "{controller:?}");
        // The worst of all is this one: nothing falls deeper.
        let worst = &views[1].rows[controller as usize][0];
        assert_eq!(worst.plant, name);
        assert_eq!(worst.outcome.nadir_hz, pairs[0].0.outcome.nadir_hz);
    }
}
