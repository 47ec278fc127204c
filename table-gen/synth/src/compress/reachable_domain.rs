//! `table.domain = "reachable"`: laws for what the closed loop asks for.

use firmware::table::{Law, TableView};

use super::inputs::InputsTask;
use super::reachable_controller::Controller;
use super::{
    CompressError, CompressedLaws, Context, INPUTS_DEPTH_MAX, VISITS_GOAL, candidate_pieces,
    finish, reachable, target,
};
use crate::abstraction::Abstraction;
use crate::emit::{self, EmitError};
use crate::game::bitset::BitSet;
use crate::game::inclusion::Inclusion;
use crate::synthesis::{SolvedLaw, Synthesis};

/// Times that a reachable table is explored again and narrowed.
const NARROWINGS: u32 = 4;

impl Context<'_, '_> {
    /// Laws that cover what the closed loop asks for.
    ///
    /// # Errors
    /// As [`CompressError`].
    pub(super) fn reachable(&self, synthesis: &Synthesis) -> Result<CompressedLaws, CompressError> {
        let shape = self.abstraction.shape();
        let laws = [
            (Law::C1, Some(&synthesis.c1)),
            (Law::C2, synthesis.c2.as_ref()),
            (Law::Hold, synthesis.hold.as_ref()),
        ];
        let mut controllers = Vec::new();
        for (law, solved) in laws {
            let Some(solved) = solved else { continue };
            let domain = solved.solution.winning_set(law == Law::Hold);
            let target = (law != Law::Hold).then(|| target(&solved.solution.ranks));
            let guard = self.guard(law);
            let watch = self.watch(law);
            let candidates = candidate_pieces::candidates(self.spec, shape, self.band(law));
            let task = InputsTask {
                abstraction: self.abstraction,
                target: target.as_ref(),
                domain: &domain,
                others: None,
                guard: &guard,
                watch: watch.as_ref(),
                solution: &solved.solution,
                preferred: None,
                candidates: &candidates,
                depth_max: INPUTS_DEPTH_MAX,
                depth_goal: VISITS_GOAL,
                rounds: self.rounds(),
            };
            let controller = Controller::new(law, &task, &candidates)?;
            controllers.push((controller, solved, target));
        }
        let mut dense = [None, None, None];
        for (controller, ..) in &controllers {
            dense[controller.law as usize] = Some(controller.dense(self.abstraction));
        }
        let image = emit::assemble(emit::head(self.problem)?, &dense)?;
        drop(dense);
        let table = TableView::parse(&image).map_err(EmitError::Rejected)?;
        let mut asked = reachable::reachable(self.problem, self.abstraction, &table)?;
        let mut best = self.narrow(&controllers, &asked)?;
        // The small controller, which keeps within the explored cells, may ask for fewer of them.
        for _ in 0..NARROWINGS {
            if !asked.closed {
                break;
            }
            let image = emit::assemble(emit::head(self.problem)?, &best.encoded())?;
            let table = TableView::parse(&image).map_err(EmitError::Rejected)?;
            asked = reachable::reachable(self.problem, self.abstraction, &table)?;
            let next = self.narrow(&controllers, &asked)?;
            if next.part_bytes() >= best.part_bytes() {
                break;
            }
            best = next;
        }
        Ok(best)
    }

    /// The laws for what is asked for.
    fn narrow(
        &self,
        controllers: &[(Controller, &SolvedLaw, Option<BitSet>)],
        asked: &reachable::Asked,
    ) -> Result<CompressedLaws, CompressError> {
        let closed = asked.closed.then(|| {
            let mut union = asked.laws[0].clone();
            union.add(&asked.laws[1]);
            union.add(&asked.laws[2]);
            Inclusion::new(self.abstraction.shape(), &union, self.abstraction.extents())
        });
        let mut laws = Vec::new();
        for (controller, solved, target) in controllers {
            let asked = &asked.laws[controller.law as usize];
            let (inputs, part) =
                controller.narrow(self.abstraction, asked, closed.as_ref(), INPUTS_DEPTH_MAX)?;
            laws.push(finish(
                controller.law,
                solved,
                target.clone(),
                asked,
                inputs,
                part,
            ));
        }
        Ok(CompressedLaws { laws })
    }
}
