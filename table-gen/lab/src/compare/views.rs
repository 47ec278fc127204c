//! What is shown of a scorecard: a table and figures for each plant that was asked for, and the
//! worst of all corners.

use super::grids::Grids;
use super::{Controller, Outcome, Row, Scorecard};

/// A part of a scorecard, a row a loss for each controller.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// For the names of files.
    pub id: String,
    /// For people: which plants.
    pub caption: String,
    /// The rows, in the order of [`Controller::ALL`].
    pub rows: [Vec<Row>; Controller::ALL.len()],
}

impl Scorecard {
    /// What is shown: each plant that was asked for, then the worst of all if there are
    /// corners.
    pub fn views(&self, grids: &Grids) -> Vec<View> {
        let asked = grids.asked.iter().map(|grid| View {
            id: format!("H{}", grid.plant.inertia),
            caption: format!("{} GW s/Hz", grid.name),
            rows: Controller::ALL.map(|it| self.of(it, &grid.name).cloned().collect()),
        });
        let worst = (!grids.corners.is_empty()).then(|| View {
            id: "bands".to_owned(),
            caption: format!(
                "the worst of {} plants, the own one and the corners of its bands",
                grids.number()
            ),
            rows: Controller::ALL.map(|it| self.worst(it, grids.number())),
        });
        asked.chain(worst).collect()
    }

    /// For each loss the worst of each number over so many grids. The nadir's plant and its time
    /// are those of the lowest nadir; other numbers may be of other plants.
    fn worst(&self, controller: Controller, grids: usize) -> Vec<Row> {
        let rows = || self.rows.iter().filter(|row| row.controller == controller);
        let losses = rows().count() / grids.max(1);
        let of_loss = |at: usize| rows().skip(at).step_by(losses.max(1)).cloned();
        (0..losses)
            .filter_map(|at| of_loss(at).reduce(worse))
            .collect()
    }
}

/// The worse of each number of two rows.
fn worse(a: Row, b: Row) -> Row {
    let (lowest, other) = if b.outcome.nadir_hz < a.outcome.nadir_hz {
        (b, a)
    } else {
        (a, b)
    };
    let (of, with) = (lowest.outcome, other.outcome);
    Row {
        outcome: Outcome {
            nadir_hz: of.nadir_hz,
            nadir_time_s: of.nadir_time_s,
            final_hz: of.final_hz.min(with.final_hz),
            seconds_below_49_5: of.seconds_below_49_5.max(with.seconds_below_49_5),
            participation_gw_s: of.participation_gw_s.max(with.participation_gw_s),
            changes_per_charger: of.changes_per_charger.max(with.changes_per_charger),
            changes_most: of.changes_most.max(with.changes_most),
            ripple_hz: of.ripple_hz.max(with.ripple_hz),
        },
        ..lowest
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::spec::Spec;

    fn outcome(nadir_hz: f64, final_hz: f64, changes_most: u32) -> Outcome {
        Outcome {
            nadir_hz,
            nadir_time_s: nadir_hz - 40.0,
            final_hz,
            seconds_below_49_5: 50.0 - nadir_hz,
            participation_gw_s: 1.0,
            changes_per_charger: 2.0,
            changes_most,
            ripple_hz: 0.0,
        }
    }

    #[test]
    fn corners_are_played_beside_the_own_plant_and_told_together() {
        let set = ["uncertainty.damping_gw_per_hz=[0.5,1.5]".to_owned()];
        let spec = Spec::load("gb-bi", &set).unwrap();
        let grids = Grids::of(&spec);
        let names: Vec<&str> = grids.all().map(|grid| grid.name.as_str()).collect();
        assert_eq!(names, ["H = 4", "D = 0.5", "D = 1.5"]);
        assert_eq!(grids.corners[1].plant.damping, 1.5);

        // Two losses on three plants, the table's rows alone of interest.
        let found = [
            [outcome(49.7, 49.80, 3), outcome(49.6, 49.70, 4)],
            [outcome(49.5, 49.75, 2), outcome(49.4, 49.65, 9)],
            [outcome(49.8, 49.70, 5), outcome(49.3, 49.90, 1)],
        ];
        let mut rows = Vec::new();
        for (grid, outcomes) in names.iter().zip(&found) {
            for (loss_gw, outcome) in [1.0, 2.0].into_iter().zip(outcomes) {
                for controller in Controller::ALL {
                    rows.push(Row {
                        loss_gw,
                        inertia_gw_s_per_hz: 4.0,
                        plant: (*grid).to_owned(),
                        controller,
                        outcome: outcome.clone(),
                    });
                }
            }
        }
        let views = Scorecard { rows }.views(&grids);
        assert_eq!(views.len(), 2);
        let table = Controller::Table as usize;
        let own: Vec<f64> = views[0].rows[table]
            .iter()
            .map(|r| r.outcome.nadir_hz)
            .collect();
        assert_eq!(own, [49.7, 49.6]);
        let worst: Vec<_> = views[1].rows[table]
            .iter()
            .map(|r| {
                let o = &r.outcome;
                (
                    r.loss_gw,
                    r.plant.as_str(),
                    o.nadir_hz,
                    o.final_hz,
                    o.changes_most,
                )
            })
            .collect();
        assert_eq!(
            worst,
            [
                (1.0, "D = 0.5", 49.5, 49.70, 5),
                (2.0, "D = 1.5", 49.3, 49.65, 9)
            ]
        );
        assert_eq!(views[1].rows[table][1].outcome.nadir_time_s, 49.3 - 40.0);
    }
}
