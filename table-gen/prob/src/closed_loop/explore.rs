//! All nodes that are reached, and the chain that they make.

use rayon::prelude::*;

use super::known::Known;
use super::{
    ClosedLoop, ClosedLoopError, Ends, Expanded, Failures, Loop, Settings, Start, Unfollowed,
};
use crate::chain::{Branch, SAFE};
use crate::reward::{Reward, seconds_of};

/// Nodes that are expanded between two looks at the clock.
const TOGETHER: usize = 4096;

impl Loop<'_> {
    /// Expands all nodes that are reached, and makes the chain.
    pub(super) fn explore(
        &self,
        start: &Start,
        horizon_ticks: u32,
        settings: &Settings,
        go_on: &dyn Fn(usize, usize) -> bool,
    ) -> Result<ClosedLoop, ClosedLoopError> {
        let pace = self.pace();
        let steps = pace.steps_in(horizon_ticks);
        let mut known = Known::default();
        let mut initial = Vec::new();
        for ends in &start.ends {
            initial.push(known.set(ends));
        }
        let mut failures = Failures::default();
        // Branches of all decided states, and where those of a node begin.
        let (mut rows, mut branches, mut first) = (vec![0usize; 3], Vec::new(), Vec::new());
        let mut seconds = vec![0.0; 2];
        let (mut expanded, mut depth, mut layer_end) = (0, 0, known.keys.len());
        let mut cut = None;
        while expanded < known.keys.len() {
            if expanded == layer_end {
                depth += 1;
                layer_end = known.keys.len();
                // With no step to go every node is worth 1: nobody asks what comes after it.
                if depth >= steps {
                    break;
                }
            }
            let end = layer_end.min(expanded + TOGETHER);
            let part: Vec<Expanded> = known.keys[expanded..end]
                .par_iter()
                .map(|key| self.expand(key))
                .collect();
            for node in part {
                first.push(rows.len() - 1);
                failures.containment += node.failures.containment;
                failures.uncovered += node.failures.uncovered;
                failures.late += node.failures.late;
                failures.left += node.failures.left;
                failures.not_fitting += node.failures.not_fitting;
                for decided in node.decided {
                    seconds.push(seconds_of(decided.ticks_below, self.tick_s));
                    for (probability, ends) in decided.branches {
                        let set = known.set(&ends);
                        branches.push(Branch { probability, set });
                    }
                    rows.push(branches.len());
                }
            }
            expanded = end;
            // Layers before this one are followed in full, and this one may be.
            let followed = depth + u32::from(expanded == layer_end);
            let left = known.keys.len() - expanded;
            if known.keys.len() > settings.nodes_max && left > 0 && followed < steps {
                cut = Some(Unfollowed {
                    steps: followed,
                    nodes: left,
                });
                break;
            }
            if !go_on(expanded, known.keys.len()) {
                return Err(ClosedLoopError::Interrupted);
            }
        }
        first.push(rows.len() - 1);
        // What stands for a node that is not followed: past the last step nothing can fail any
        // more; before it, the state that fails.
        let beyond = if cut.is_some() {
            let set = known.set(&Ends::Failed);
            let probability = 1.0;
            branches.push(Branch { probability, set });
            rows.push(branches.len());
            seconds.push(0.0);
            (rows.len() - 2) as u32
        } else {
            SAFE
        };
        let chain = known.chain(initial, rows, branches, &first, expanded, beyond);
        Ok(ClosedLoop {
            chain,
            steps,
            pace,
            nodes: known.keys.len(),
            cut,
            failures,
            reach_hz: self.cover.radius().iter().sum(),
            below: Reward {
                seconds,
                failed_s: settings.horizon_s,
            },
            below_before_s: seconds_of(start.ticks_below, self.tick_s),
        })
    }
}
