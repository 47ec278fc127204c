//! From what an exploration found to the claims of the spec.

use super::closed_loop::Model;
use super::outcome::{Outcome, Violation};
use super::{delayed_loop, dispatch, header, image, quiet};
use firmware::table::{Law, TableView};
use model::spec::Spec;
use model::verdict::{Claim, ClaimName};

/// What the claims are read off.
pub(super) struct Findings<'a> {
    pub(super) table: &'a TableView<'a>,
    /// The spec that the table is of.
    pub(super) made_for: &'a Spec,
    /// What is assumed and asked.
    pub(super) spec: &'a Spec,
    pub(super) model: &'a Model,
    pub(super) tally: &'a Outcome,
    /// Over which time the claims are made.
    pub(super) scope: String,
}

/// That the table is the one that the spec asks for, and that the device can use it.
pub(super) fn header(table: &TableView<'_>, spec: &Spec) -> Claim {
    let mut differences = header::differences(table, spec);
    differences.extend(delayed_loop::misrounded(table, spec));
    Claim {
        name: ClaimName::Header,
        holds: differences.is_empty(),
        bound: None,
        limit: None,
        unit: "".into(),
        statement: "every field of the header is the spec's, and the device can use it".to_owned(),
        reason: (!differences.is_empty()).then(|| differences.join("; ")),
    }
}

impl Findings<'_> {
    /// All claims, in the order in which a reader asks.
    pub(super) fn claims(&self) -> Vec<Claim> {
        let mut claims = vec![
            header(self.table, self.made_for),
            dispatch::claim(self.spec),
        ];
        claims.extend(image::claim(self.table, self.spec));
        claims.extend([
            self.containment(),
            self.reach(
                ClaimName::ReachOuter,
                self.tally.periods_c1,
                "outside I1, f is back in I1",
            ),
            self.reach(
                ClaimName::ReachInner,
                self.tally.periods_c2,
                "in I1 and outside I2, f is in I2",
            ),
            self.settle(),
        ]);
        if self.table.law(Law::C2).is_some() {
            claims.push(self.hand_over());
        }
        if self.spec.requirements.stay {
            claims.push(self.stay());
        }
        claims.push(self.table_claim());
        claims.extend(quiet::claim(self.table, self.spec).map(|claim| self.in_table(claim)));
        claims
    }

    /// A claim that rests on every decision having an entry: without one the droop answers.
    fn in_table(&self, claim: Claim) -> Claim {
        let uncovered = self.reason(&[Violation::Uncovered]);
        Claim {
            holds: claim.holds && uncovered.is_none(),
            reason: claim.reason.or(uncovered),
            ..claim
        }
    }

    /// Why a claim that rests on these violations does not hold.
    fn reason(&self, kinds: &[Violation]) -> Option<String> {
        let found = kinds
            .iter()
            .find_map(|kind| self.tally.violations.get(kind));
        found
            .map(|found| found.what.clone())
            .or_else(|| self.tally.limit.clone())
    }

    fn containment(&self) -> Claim {
        let reason = self.reason(&[Violation::Containment, Violation::Uncovered]);
        let limit = self.spec.requirements.containment_hz;
        let bound = self.tally.lowest.map(|f| f / 1e6);
        let statement = match limit {
            Some(limit) => format!(
                "f >= {limit} Hz at all times{}, between samples too",
                self.scope
            ),
            None => format!("f has a lower bound{}, between samples too", self.scope),
        };
        Claim {
            name: ClaimName::Containment,
            holds: reason.is_none(),
            bound,
            limit,
            unit: "Hz".into(),
            statement,
            reason,
        }
    }

    fn reach(&self, name: ClaimName, periods: u32, what: &str) -> Claim {
        let reason = self.reason(&[Violation::Late, Violation::Uncovered]);
        Claim {
            name,
            holds: reason.is_none(),
            bound: reason.is_none().then_some(f64::from(periods)),
            limit: None,
            unit: "periods".into(),
            statement: format!("{what} within so many periods{}", self.scope),
            reason,
        }
    }

    fn hand_over(&self) -> Claim {
        let reason = self.reason(&[Violation::Handover, Violation::Uncovered]);
        Claim {
            name: ClaimName::HandOver,
            holds: reason.is_none(),
            bound: None,
            limit: None,
            unit: "".into(),
            statement: format!(
                "C1 hands over where C2 has an entry: C1 never decides with f in I1{}",
                self.scope
            ),
            reason,
        }
    }

    fn settle(&self) -> Claim {
        let limit = self.spec.requirements.settle_within_s;
        let bound = f64::from(self.tally.settle_ticks) * self.model.tick_s;
        // With Hold, f that leaves I2 again has not settled.
        let mut kinds = vec![Violation::Late, Violation::Uncovered];
        if self.spec.requirements.stay {
            kinds.push(Violation::Left);
        }
        let reason = self
            .reason(&kinds)
            .or_else(|| (bound > limit).then(|| format!("it may take {bound:.1} s")));
        let target = if self.spec.requirements.stay {
            "I2 for good"
        } else {
            "I2"
        };
        Claim {
            name: ClaimName::Settle,
            holds: reason.is_none(),
            bound: Some(bound),
            limit: Some(limit),
            unit: "s".into(),
            statement: format!(
                "after leaving I1, f is in {target} within {limit} s{}",
                self.scope
            ),
            reason,
        }
    }

    fn stay(&self) -> Claim {
        let reason = self.reason(&[Violation::Left, Violation::Uncovered, Violation::Late]);
        let [low, high] = self.spec.requirements.inner_hz;
        Claim {
            name: ClaimName::Stay,
            holds: reason.is_none(),
            bound: self.tally.held.map(|range| range.low / 1e6),
            limit: Some(low),
            unit: "Hz".into(),
            statement: format!(
                "once Hold is in force, {low} <= f <= {high} Hz for ever, between samples too"
            ),
            reason,
        }
    }

    fn table_claim(&self) -> Claim {
        let reason = self.reason(&[Violation::Uncovered, Violation::Visits]);
        let limit = self
            .table
            .header()
            .laws
            .iter()
            .flatten()
            .map(|law| law.worst_visits)
            .max();
        Claim {
            name: ClaimName::Table,
            holds: reason.is_none(),
            bound: Some(f64::from(self.tally.worst_visits)),
            limit: limit.map(f64::from),
            unit: "visits".into(),
            statement: "every reachable state has an entry, and no lookup visits more than the header states"
                .to_owned(),
            reason,
        }
    }
}
