//! The event once more: the inferred disturbance on the plant, with the firmware in the loop.

use firmware::table::TableView;

use super::smoother::Disturbance;
use crate::simulation::beyond::plant::BeyondPlant;
use crate::simulation::beyond::system::BeyondSystem;
use crate::simulation::beyond::{DemandNoise, Disturbances, Governor, Loss};
use crate::simulation::closed_loop::{ClosedLoop, Estimator, LoopError};
use crate::simulation::monitor::Summary;
use crate::simulation::recorder::Recorder;
use crate::simulation::scenario::Scenario;
use model::plant::Plant;
use model::spec::Spec;

/// What a run needs besides the disturbance.
#[derive(Debug, Clone, Copy)]
pub struct Rerun<'a> {
    /// The spec, whose fleet is replaced.
    pub spec: &'a Spec,
    /// The firmware's table.
    pub table: &'a TableView<'a>,
    /// The plant; the fleet's power is replaced.
    pub plant: Plant,
    /// Limits of the governors.
    pub governor: Governor,
    /// Time from one value of the disturbance to the next \[s\].
    pub step_s: f64,
}

impl Rerun<'_> {
    /// The event with a fleet of this power \[GW\]; from the sample `relay` on `put_back_gw` more
    /// are missing.
    ///
    /// # Errors
    /// A plant that the observer cannot follow.
    pub fn run(
        &self,
        fleet_gw: f64,
        disturbance: &Disturbance,
        put_back_gw: f64,
        relay: Option<usize>,
        recorder: &mut impl Recorder,
    ) -> Result<Summary, LoopError> {
        let mut spec = self.spec.clone();
        // One charger that is as strong as the fleet: the plant sees the product alone.
        spec.fleet.chargers = 1;
        spec.fleet.power_per_charger_kw = 1e6 * fleet_gw;
        let missing = &disturbance.missing_gw;
        let mut before = 0.0;
        let losses = missing
            .iter()
            .enumerate()
            .map(|(index, missing_gw)| {
                let relieved = relay.is_some_and(|relay| index >= relay);
                let now = missing_gw + if relieved { put_back_gw } else { 0.0 };
                let power_gw = now - std::mem::replace(&mut before, now);
                Loss {
                    at_s: self.step_s * index as f64,
                    power_gw,
                    inertia_gw_s_per_hz: 0.0,
                }
            })
            .collect();
        let disturbances = Disturbances {
            losses,
            governor: self.governor,
            demand: DemandNoise::NONE,
        };
        let mut closed_loop = ClosedLoop::new(&spec, self.table, Estimator::Observer)?;
        let scenario = Scenario {
            duration_s: self.step_s * missing.len().saturating_sub(1) as f64,
            initial: disturbance.initial,
            ..Scenario::of(&spec)
        };
        let plant = Plant {
            fleet: fleet_gw,
            ..self.plant
        };
        let plant = BeyondPlant::new(plant, &disturbances, 0.0, 0);
        let (_, parts) = closed_loop.parts(&scenario);
        let mut grid = BeyondSystem::new(plant, parts, disturbance.initial);
        Ok(closed_loop.run_on(&mut grid, &scenario, recorder))
    }
}
