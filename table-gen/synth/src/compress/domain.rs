//! The domain of a law: which winning cells its table part covers, so that the game is still won
//! inside.
//!
//! Giving a cell up takes away a place for its predecessors to go. So after each description the
//! game is played again inside what was kept, and what it loses there is no longer winning; until
//! the description covers exactly the cells that the game wins inside it.

use firmware::table::LookAhead;

use super::CompressError;
use rayon::prelude::*;

use super::half_spaces::{Point, hull, normals, tightened};
use super::look_aheads;
use super::membership::{DomainPart, Predicates, describe};
use crate::abstraction::Abstraction;
use crate::abstraction::affine::AffineAbstraction;
use crate::game::bitset::BitSet;
use crate::game::reach::reach;
use crate::game::safety::safety;
use crate::game::{Solution, Watch};
use crate::synthesis::OptionalGuard;
use model::plant::STATES;
use model::spec::Spec;

/// Share of the winning cells that may be given up: one in this many.
pub const GIVE_UP_ONE_IN: usize = 100;
/// Descriptions tried with cells given up, before the rest is described exactly.
const ROUNDS: u32 = 5;
/// Positions of each half-space of the hull that a leaf may name.
const TIGHTENINGS: u32 = 4;
/// Most nodes on a path of a membership tree: below the bits of the four axes boxes could only be
/// halved.
pub const DEPTH_MAX: u32 = 32;

/// A law's game and where it is asked.
pub struct Play<'p> {
    /// The spec.
    pub spec: &'p Spec,
    /// The abstraction.
    pub abstraction: &'p AffineAbstraction<STATES>,
    /// Forbids inputs.
    pub guard: &'p OptionalGuard,
    /// Told of every sweep.
    pub watch: &'p dyn Watch,
    /// Where the game ends; none for Hold.
    pub target: Option<&'p BitSet>,
    /// Target cells at which the law is never asked, so that the domain may hold them or not.
    pub unasked: &'p BitSet,
}

/// A law's domain.
#[derive(Debug)]
pub struct Domain {
    /// The cells, without unasked ones.
    pub cells: BitSet,
    /// The game inside it.
    pub solution: Solution,
    /// The bytes.
    pub part: DomainPart,
}

impl Play<'_> {
    /// Describes the cells that the law's game wins, all of them or nearly.
    ///
    /// # Errors
    /// A game without a result, or a tree that the format cannot hold.
    pub fn domain(&self, won: &Solution, exact: bool) -> Result<Domain, CompressError> {
        let safety = self.target.is_none();
        let all = won.winning_set(safety);
        let winning = all.count();
        if !exact && let Some(domain) = self.by_look_ahead(&all)? {
            return Ok(domain);
        }
        let mut solution = self.within(&all)?;
        let mut kept = solution.winning_set(safety);
        // What a shrunken target costs comes off the budget.
        let predicates = self.predicates(&kept);
        let mut round = 0;
        loop {
            let given_up = winning - kept.count();
            let budget = (winning / GIVE_UP_ONE_IN).saturating_sub(given_up);
            // Half at first: playing again loses more.
            let budget = match round {
                _ if exact => 0,
                0 => budget / 2,
                ROUNDS.. => 0,
                _ => budget / 4,
            };
            let part = self.describe(&kept, &predicates, budget)?;
            let cells = self.covered(&part);
            if cells == kept {
                return Ok(Domain {
                    cells,
                    solution,
                    part,
                });
            }
            solution = self.within(&cells)?;
            kept = solution.winning_set(safety);
            if cells == kept {
                return Ok(Domain {
                    cells,
                    solution,
                    part,
                });
            }
            round += 1;
        }
    }

    /// A domain that look-aheads alone describe, if there is one: no losing cell is inside, at most
    /// the budget is given up, and the game inside is won everywhere.
    fn by_look_ahead(&self, all: &BitSet) -> Result<Option<Domain>, CompressError> {
        let Some(target) = self.target else {
            return Ok(None);
        };
        for margins in look_aheads::MARGINS {
            let aheads = look_aheads::choose(self.spec, self.abstraction, target, all, margins);
            let Some(cells) = look_aheads::covered(self.abstraction, target, all, &aheads) else {
                continue;
            };
            if (all.count() - cells.count()) * GIVE_UP_ONE_IN > all.count() {
                break;
            }
            let solution = self.within(&cells)?;
            if solution.winning == cells.count() {
                let predicates = Predicates {
                    aheads: aheads.iter().map(LookAhead::write).collect(),
                    ..Predicates::default()
                };
                let part = self.describe(&cells, &predicates, 0)?;
                return Ok(Some(Domain {
                    cells,
                    solution,
                    part,
                }));
            }
        }
        Ok(None)
    }

    /// Plays the game with everything outside `domain` (and the target) lost.
    fn within(&self, domain: &BitSet) -> Result<Solution, CompressError> {
        match self.target {
            None => Ok(safety(self.abstraction, domain, self.guard, self.watch)?),
            Some(target) => {
                let mut avoid = domain.clone();
                avoid.add(target);
                let avoid = avoid.complement();
                Ok(reach(
                    self.abstraction,
                    target,
                    &avoid,
                    self.guard,
                    self.watch,
                )?)
            }
        }
    }

    fn describe(
        &self,
        kept: &BitSet,
        predicates: &Predicates,
        budget: usize,
    ) -> Result<DomainPart, CompressError> {
        let shape = self.abstraction.shape();
        let cells = (0..shape.cells())
            .into_par_iter()
            .filter(|index| !self.unasked.contains(*index))
            .map(|index| (shape.cell(index).map(|i| i as u16), kept.contains(index)));
        let count = shape.count.map(|n| n as u16);
        describe(cells, count, predicates, budget as u32, DEPTH_MAX)
    }

    /// Cells that a part covers, without unasked ones.
    fn covered(&self, part: &DomainPart) -> BitSet {
        let shape = self.abstraction.shape();
        let count = shape.count.map(|n| n as u16);
        let mut cells = BitSet::new(shape.cells());
        for index in 0..shape.cells() {
            let cell = shape.cell(index).map(|i| i as u16);
            if !self.unasked.contains(index) && part.covers(cell, count) {
                cells.insert(index);
            }
        }
        cells
    }

    /// The hull of a set, tighter versions of its half-spaces, and look-aheads.
    fn predicates(&self, kept: &BitSet) -> Predicates {
        let shape = self.abstraction.shape();
        let strides = shape.strides();
        let point = |index: usize| -> Point { shape.cell(index).map(|i| i as i32) };
        let winning: Vec<Point> = kept.iter().map(point).collect();
        let losing: Vec<Point> = (0..shape.cells())
            .filter(|index| !kept.contains(*index) && !self.unasked.contains(*index))
            .filter(|index| {
                let cell = shape.cell(*index);
                (0..STATES).any(|d| {
                    let below = cell[d] > 0 && kept.contains(index - strides[d]);
                    let last = cell[d] + 1 == shape.count[d];
                    below || (!last && kept.contains(index + strides[d]))
                })
            })
            .map(point)
            .collect();
        let hull = hull(&normals(self.spec, shape), &winning, &losing);
        let mut spaces = hull.clone();
        for share in 1..TIGHTENINGS {
            for space in &hull {
                spaces.extend(tightened(space, TIGHTENINGS).nth(share as usize));
            }
        }
        spaces.truncate(Predicates::SPACES_MAX);
        let aheads = match self.target {
            Some(target) => {
                let [margins, ..] = look_aheads::MARGINS;
                look_aheads::choose(self.spec, self.abstraction, target, kept, margins)
            }
            None => Vec::new(),
        };
        Predicates {
            spaces,
            hull: hull.len(),
            aheads: aheads.iter().map(LookAhead::write).collect(),
        }
    }
}
