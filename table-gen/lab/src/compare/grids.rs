//! The grids of a scorecard: the spec's own plant, others of its inertia, the corners of its bands.

use model::plant::Plant;
use model::plant_bands::PlantBands;
use model::spec::Spec;

/// A plant under its name.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// `H = 4`; at a corner everything that lies in bands: `H = 2.8, D = 0.5`.
    pub name: String,
    /// Its parameters.
    pub plant: Plant,
}

impl Grid {
    /// The spec's plant with an inertia \[GW s/Hz\].
    fn of_inertia(spec: &Spec, inertia: f64) -> Self {
        Self {
            name: format!("H = {inertia}"),
            plant: Plant {
                inertia,
                ..Plant::new(spec)
            },
        }
    }
}

/// The plants on which a scorecard is played.
#[derive(Debug, Clone, PartialEq)]
pub struct Grids {
    /// The spec's own plant, or what else was asked for; each has a table and figures.
    pub asked: Vec<Grid>,
    /// All corners of the spec's bands but its own plant, which are told together.
    pub corners: Vec<Grid>,
}

impl Grids {
    /// The spec's own plant, and the corners of its bands.
    pub fn of(spec: &Spec) -> Self {
        let bands = PlantBands::of(spec);
        let own = Plant::new(spec);
        let corner = |plant| Grid {
            name: bands.told(plant),
            plant,
        };
        let corners = bands.corners().filter(|plant| *plant != own);
        Self {
            asked: vec![Grid::of_inertia(spec, spec.plant.inertia_gw_s_per_hz)],
            corners: corners.map(corner).collect(),
        }
    }

    /// The spec's plant with each of these inertias \[GW s/Hz\], and nothing else.
    pub fn of_inertias(spec: &Spec, inertias: &[f64]) -> Self {
        let grid = |inertia: &f64| Grid::of_inertia(spec, *inertia);
        Self {
            asked: inertias.iter().map(grid).collect(),
            corners: Vec::new(),
        }
    }

    /// All of them, as the scorecard has them.
    pub fn all(&self) -> impl Iterator<Item = &Grid> {
        self.asked.iter().chain(&self.corners)
    }

    /// Their number.
    pub const fn number(&self) -> usize {
        self.asked.len() + self.corners.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A band that begins at the own number has the own plant as a corner: one row a loss, not two.
    #[test]
    fn no_plant_comes_twice() {
        let set = ["uncertainty.inertia_gw_s_per_hz=[4,5]".to_owned()];
        let grids = Grids::of(&Spec::load("gb-bi", &set).unwrap());
        let names: Vec<&str> = grids.all().map(|grid| grid.name.as_str()).collect();
        assert_eq!(names, ["H = 4", "H = 5"]);
    }

    #[test]
    fn inertias_asked_for_leave_the_bands_out() {
        let set = ["uncertainty.damping_gw_per_hz=[0.5,1.5]".to_owned()];
        let spec = Spec::load("gb-bi", &set).unwrap();
        let grids = Grids::of_inertias(&spec, &[2.0, 4.0]);
        assert_eq!((grids.number(), grids.corners.len()), (2, 0));
        assert_eq!(grids.asked[0].plant.inertia, 2.0);
    }
}
