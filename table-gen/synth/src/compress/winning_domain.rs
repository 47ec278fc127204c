//! `table.domain = "winning"`: laws that cover every winning cell, or all but what the options
//! allow to give up.
//!
//! The phase machine asks C2 only where f lies in I1; outside it C1 decides, also on the way to I2.
//! So where both laws exist and nothing is to be held, C2's part needs entries in I1 alone: its
//! game is played with C1's answers fixed everywhere else. Cells that I1 cuts belong to both: they
//! are ranked by C1's answer, and C2 may give any input that lowers that rank as well. Where this
//! does not win, and with `stay`, every law covers its own winning cells.

use firmware::grid::Cell;
use firmware::table::Law;
use firmware::units::AXIS_F;
use rayon::prelude::*;

use super::domain::{DEPTH_MAX, GIVE_UP_ONE_IN, Play};
use super::inputs::{CompressedInputs, InputsTask};
use super::membership::{Predicates, describe};
use super::{
    CompressError, CompressedLaw, CompressedLaws, Context, INPUTS_DEPTH_MAX, VISITS_GOAL,
    candidate_pieces, finish, target,
};
use crate::abstraction::Abstraction;
use crate::game::Solution;
use crate::game::bitset::BitSet;
use crate::game::restricted::{LastResort, Restricted};
use crate::synthesis::{SolvedLaw, Synthesis};
use model::plant::STATES;

/// Times that C1 and C2 are fitted to each other.
const ROUNDS: u32 = 4;

/// A law and what it was made from.
struct Made {
    law: CompressedLaw,
    cells: BitSet,
    inputs: CompressedInputs,
}

impl Made {
    /// The law's input at a cell, as a bit.
    fn choice(&self, cell: [u32; STATES]) -> u32 {
        let cell = cell.map(|i| i as u16);
        1 << self
            .inputs
            .laws
            .level(self.inputs.tree.leaf(Cell(cell)), cell)
    }
}

impl Context<'_, '_> {
    /// Laws that cover the winning cells.
    ///
    /// # Errors
    /// A game without a result, or a tree that the format cannot hold.
    pub(super) fn winning(&self, synthesis: &Synthesis) -> Result<CompressedLaws, CompressError> {
        if !self.spec.requirements.stay
            && let Some(c2) = &synthesis.c2
            && let Some(laws) = self.side_by_side(synthesis, c2)?
        {
            return Ok(laws);
        }
        self.one_by_one(synthesis)
    }

    /// Every law covers its own winning cells.
    fn one_by_one(&self, synthesis: &Synthesis) -> Result<CompressedLaws, CompressError> {
        let stay = self.spec.requirements.stay;
        let mut done = Vec::new();
        // Cells at which a law later in the chain, or Fixed, answers.
        let mut covered = BitSet::new(self.abstraction.shape().cells());
        // Backwards from where the event ends: a law that gives cells up shrinks the target of the
        // one before it.
        for (law, solved) in [
            (Law::Hold, synthesis.hold.as_ref()),
            (Law::C2, synthesis.c2.as_ref()),
            (Law::C1, Some(&synthesis.c1)),
        ] {
            let Some(solved) = solved else { continue };
            if law == Law::C2 && !stay {
                covered.add(&target(&solved.solution.ranks));
            }
            let made = self.law(law, solved, &covered, stay)?;
            covered.add(&made.cells);
            done.push(made.law);
        }
        done.reverse();
        Ok(CompressedLaws { laws: done })
    }

    /// C1 outside I1, C2 inside; `None` if that gives up more cells than allowed.
    fn side_by_side(
        &self,
        synthesis: &Synthesis,
        c2: &SolvedLaw,
    ) -> Result<Option<CompressedLaws>, CompressError> {
        let outer = target(&synthesis.c1.solution.ranks);
        let inner = target(&c2.solution.ranks);
        let guard = self.guard(Law::C2);
        let watch = self.watch(Law::C2);
        let all = u32::MAX >> (u32::BITS - self.abstraction.inputs() as u32);
        let mut asked = c2.solution.winning_set(false);
        asked.keep(&outer);
        // What C2 cannot win beside this C1 is given up; C1 then has fewer cells to lead to.
        for _ in 0..ROUNDS {
            let mut covered = asked.clone();
            covered.add(&inner);
            let c1 = self.law(Law::C1, &synthesis.c1, &covered, true)?;
            let mut everywhere = asked.clone();
            everywhere.add(&c1.cells);
            let given_up = c2.solution.winning.saturating_sub(everywhere.count());
            let allowed = if self.options.exact_domain {
                0
            } else {
                c2.solution.winning / GIVE_UP_ONE_IN
            };
            if given_up > allowed {
                break;
            }
            let game = Restricted {
                abstraction: self.abstraction,
                target: &inner,
                domain: &everywhere,
                settled: Some(&c1.cells),
                guard: &guard,
                watch: watch.as_ref(),
            };
            let decided = |index: usize, cell: [u32; STATES]| {
                if c1.cells.contains(index) {
                    c1.choice(cell)
                } else {
                    all
                }
            };
            let solution = game.reach(&decided, LastResort::None)?;
            if solution.winning == everywhere.count() {
                return self.beside(c1, c2, inner, asked, &solution).map(Some);
            }
            asked.keep(&solution.winning_set(false));
        }
        Ok(None)
    }

    /// C2 for the cells of I1 that are asked of it, beside a finished C1; `solution` wins
    /// everywhere.
    fn beside(
        &self,
        c1: Made,
        c2: &SolvedLaw,
        inner: BitSet,
        mut asked: BitSet,
        solution: &Solution,
    ) -> Result<CompressedLaws, CompressError> {
        let guard = self.guard(Law::C2);
        let watch = self.watch(Law::C2);
        let mut everywhere = asked.clone();
        everywhere.add(&c1.cells);
        let row = self.asked_of_c2();
        for index in c1.cells.iter().filter(|index| row[index % row.len()]) {
            asked.insert(index);
        }
        let shape = self.abstraction.shape();
        let count = shape.count.map(|n| n as u16);
        // In I2 Fixed answers and C2 is never asked.
        let cells = (0..shape.cells())
            .into_par_iter()
            .filter(|index| !inner.contains(*index))
            .map(|index| (shape.cell(index).map(|i| i as u16), asked.contains(index)));
        let part = describe(cells, count, &Predicates::default(), 0, DEPTH_MAX)?;
        let candidates = candidate_pieces::candidates(self.spec, shape, self.band(Law::C2));
        let choice = |_: usize, cell: [u32; STATES]| c1.choice(cell);
        let inputs = InputsTask {
            abstraction: self.abstraction,
            target: Some(&inner),
            domain: &asked,
            others: Some((&c1.cells, &choice)),
            guard: &guard,
            watch: watch.as_ref(),
            solution,
            preferred: self.preferred(Law::C2)?.as_ref(),
            candidates: &candidates,
            depth_max: INPUTS_DEPTH_MAX,
            depth_goal: VISITS_GOAL.saturating_sub(part.worst_visits),
            rounds: self.rounds(),
        }
        .run()?;
        let c2 = finish(Law::C2, c2, Some(inner), &everywhere, inputs, part);
        Ok(CompressedLaws {
            laws: vec![c1.law, c2],
        })
    }

    /// Whether C2 may be asked, for each cell of f: some of its frequencies lie in I1 and not in
    /// I2.
    fn asked_of_c2(&self) -> Vec<bool> {
        let [outer_low, outer_high] = self.spec.requirements.outer_micro();
        let [inner_low, inner_high] = self.spec.requirements.inner_micro();
        let edge = |f: i64| {
            i64::from(self.problem.grid.lower_edge()[AXIS_F])
                + i64::from(self.problem.grid.width()[AXIS_F]) * f
        };
        let meets = |f: i64, low: i32, high: i32| {
            edge(f).max(i64::from(low)) <= (edge(f + 1) - 1).min(i64::from(high))
        };
        (0..i64::from(self.problem.grid.count()[AXIS_F]))
            .map(|f| {
                meets(f, outer_low, inner_low.saturating_sub(1))
                    || meets(f, inner_high.saturating_add(1), outer_high)
            })
            .collect()
    }

    /// A law that covers its own winning cells; `covered` are those at which a later law or Fixed
    /// answers, and `within` tells whether the law must lead to those of them.
    fn law(
        &self,
        law: Law,
        solved: &SolvedLaw,
        covered: &BitSet,
        within: bool,
    ) -> Result<Made, CompressError> {
        let guard = self.guard(law);
        let watch = self.watch(law);
        let target = (law != Law::Hold).then(|| {
            let mut target = target(&solved.solution.ranks);
            if within {
                target.keep(covered);
            }
            target
        });
        // Cells that no decision brings to this law: a later one answers there, or f is in I2 and
        // Fixed does.
        let mut unasked = covered.clone();
        if let Some(target) = &target {
            unasked.keep(target);
        }
        let play = Play {
            spec: self.spec,
            abstraction: self.abstraction,
            guard: &guard,
            watch: watch.as_ref(),
            target: target.as_ref(),
            unasked: &unasked,
        };
        let domain = play.domain(&solved.solution, self.options.exact_domain)?;
        // Beside C2, C1 had better aim at I2 as well: C2 has less to put right.
        let beside = law == Law::C1 && within && !self.spec.requirements.stay;
        let band = self.band(if beside { Law::C2 } else { law });
        let candidates = candidate_pieces::candidates(self.spec, self.abstraction.shape(), band);
        let inputs = InputsTask {
            abstraction: self.abstraction,
            target: target.as_ref(),
            domain: &domain.cells,
            others: None,
            guard: &guard,
            watch: watch.as_ref(),
            solution: &domain.solution,
            preferred: self.preferred(law)?.as_ref(),
            candidates: &candidates,
            depth_max: INPUTS_DEPTH_MAX,
            depth_goal: VISITS_GOAL.saturating_sub(domain.part.worst_visits),
            rounds: self.rounds(),
        }
        .run()?;
        let part = domain.part;
        Ok(Made {
            law: finish(law, solved, target, &domain.cells, inputs.clone(), part),
            cells: domain.cells,
            inputs,
        })
    }
}
