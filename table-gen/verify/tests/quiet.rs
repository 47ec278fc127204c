//! The claim `quiet`: its bound, and that the phase machine keeps the distance it rests on.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use firmware::phase::{Decision, PhaseState};
use firmware::table::TableView;
use firmware::units::State;
use model::spec::Spec;
use model::verdict::{Claim, ClaimName};
use proptest::prelude::*;

const PAPER_BI: &[u8] = include_bytes!("../../../firmware/tables/paper-bi.bin");
const GB_BI: &[u8] = include_bytes!("../../../firmware/tables/gb-bi.bin");

/// The claim on a table by the spec paper-bi with this limit. For a response that spec is another
/// one, and the bound is that of its ticks all the same.
fn claimed(bytes: &[u8], limit: Option<u32>) -> Option<Claim> {
    let set = limit.map(|n| format!("requirements.changes_per_300_s={n}"));
    let spec = Spec::load("paper-bi", &Vec::from_iter(set)).unwrap();
    let verdict = verify::verify(bytes, &spec, &|_| true).unwrap();
    verdict.claim(ClaimName::Quiet).cloned()
}

#[test]
fn the_bound_is_a_change_a_tick_or_a_period() {
    assert_eq!(claimed(PAPER_BI, None), None);
    // Ticks of 0.1 s; periods of 1.5 s.
    let found = claimed(GB_BI, Some(3001)).unwrap();
    assert_eq!((found.holds, found.bound), (true, Some(3001.0)));
    assert!(!claimed(GB_BI, Some(3000)).unwrap().holds);
    let found = claimed(PAPER_BI, Some(201)).unwrap();
    assert_eq!((found.holds, found.bound), (true, Some(201.0)));
    let found = claimed(PAPER_BI, Some(200)).unwrap();
    assert!(!found.holds && found.reason.is_some());
}

proptest! {
    #[test]
    fn laws_by_games_change_their_command_a_period_apart(
        states in proptest::collection::vec(
            (-800_000i32..100_000, 0i32..2_000_000, 0i32..2_000_000, 0i32..3_000_000),
            1..400,
        ),
    ) {
        let table = TableView::parse(PAPER_BI).unwrap();
        let apart = usize::from(table.header().period_ticks);
        let mut phase = PhaseState::INITIAL;
        let mut last: Option<usize> = None;
        for (tick, (f, g, l, p)) in states.into_iter().enumerate() {
            let (next, decision) = phase.step(&table, State([f, g, l, p]));
            if decision == Decision::Outside {
                // The droop answers: past what is proven.
                break;
            }
            if next.level != phase.level {
                if let Some(last) = last {
                    prop_assert!(tick - last >= apart, "{last} {tick}");
                }
                last = Some(tick);
            }
            phase = next;
        }
    }
}
