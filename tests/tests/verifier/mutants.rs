//! Tables and specs that are wrong in one place: each must be rejected, and for the right claim.

use firmware::phase::{Decision, Phase, PhaseState};
use firmware::table::{HEADER_LEN, Header, Law, LawEntry, TableView, seal, write_header};

use lab::falsify::adversaries::Constant;
use lab::falsify::trajectory::Trajectories;
use model::spec::Spec;
use model::verdict::{ClaimName, Verdict};
use tests::testing::load;
use verify::{VerifyError, verify};

use super::{PAPER_BI, SMALL_TABLE, judge, small, with_entry};

fn fails(verdict: &Verdict, claim: ClaimName) {
    assert!(!verdict.verified);
    assert!(
        !verdict.claim(claim).unwrap().holds,
        "{:#?}",
        verdict.claims
    );
}

/// Cell and level of the decisions that the nominal trajectory takes, in their order.
fn decisions(bytes: &[u8], spec: &Spec, ticks: u32) -> Vec<(Phase, [u16; 4], u8)> {
    let table = TableView::parse(bytes).unwrap();
    let trajectories = Trajectories::new(&table, spec);
    let mut nominal = Constant {
        corner: [0.5; 4],
        moment: 0.5,
        share: 0.0,
        error: 0.0,
        early: 1.0,
    };
    let (mut out, mut state) = (Vec::new(), PhaseState::INITIAL);
    let mut first = true;
    trajectories.run(&mut nominal, ticks, &mut |sample| {
        // The first sample is the event, not a tick.
        if std::mem::take(&mut first) {
            return;
        }
        let measured = firmware::units::State(sample.x.map(|v| (v * 1e6).floor() as i32));
        let decides = state.ticks_left == 0;
        let (next, step) = state.step(&table, measured);
        if decides
            && next.phase != Phase::NoControl
            && let (Some(cell), Decision::Level(level)) =
                (table.header().grid.quantise(measured), step)
        {
            out.push((next.phase, cell.0, level));
        }
        state = next;
    });
    out
}

/// The table with another header; blocks and all else as they are.
fn with_header(bytes: &[u8], change: impl FnOnce(&mut Header)) -> Vec<u8> {
    let mut header = TableView::parse(bytes).unwrap().header();
    change(&mut header);
    let mut image = write_header(&header).to_vec();
    image.extend_from_slice(&bytes[HEADER_LEN..]);
    seal(&mut image).unwrap();
    image
}

#[test]
fn the_small_table_is_proven_as_it_is() {
    let verdict = judge(&SMALL_TABLE, &small(&[]));
    assert!(verdict.verified, "{:#?}", verdict.claims);
    let [low, high] = verdict.counts.held_hz.unwrap();
    assert!(low >= -0.3 && high <= 0.1);
}

#[test]
fn a_cut_in_its_reach_is_rejected() {
    let spec = small(&[]);
    // Take away the entry at which the event's nominal trajectory first decides, and the one after.
    for (phase, cell, _) in decisions(&SMALL_TABLE, &spec, 60).into_iter().take(2) {
        assert_eq!(phase, Phase::C1);
        let cut = with_entry(&SMALL_TABLE, Law::C1, cell, 0);
        let verdict = judge(&cut, &spec);
        fails(&verdict, ClaimName::Table);
        let example = verdict.counterexample.unwrap();
        assert_eq!(example.claim, ClaimName::Table);
        assert!(
            example.real.is_some(),
            "the nominal trajectory meets the hole"
        );
    }
    let spec = load("paper-bi", &[]);
    let (phase, cell, _) = decisions(&PAPER_BI, &spec, 300)[1];
    assert_eq!(phase, Phase::C1);
    let verdict = judge(&with_entry(&PAPER_BI, Law::C1, cell, 0), &spec);
    fails(&verdict, ClaimName::Table);
    assert!(verdict.counterexample.unwrap().real.is_some());
}

#[test]
fn a_leaf_changed_by_one_level_is_rejected_where_it_matters() {
    let spec = small(&[]);
    let table = TableView::parse(&SMALL_TABLE).unwrap();
    // Changing by a level matters for Hold, whose margin is a fraction of a level: of the Hold
    // decisions of the nominal trajectory and their neighbours by one level, some must break the
    // proof.
    let mut rejected = 0;
    let mut tried = 0;
    for (phase, cell, level) in decisions(&SMALL_TABLE, &spec, 600) {
        if phase != Phase::Hold {
            continue;
        }
        for changed in [level.wrapping_sub(1), level + 1] {
            if changed < table.header().levels {
                let mutant = with_entry(&SMALL_TABLE, Law::Hold, cell, changed + 1);
                let verdict = judge(&mutant, &spec);
                tried += 1;
                rejected += u32::from(!verdict.verified);
            }
        }
        if tried >= 6 {
            break;
        }
    }
    assert!(rejected > 0, "none of {tried} changes was rejected");
}

#[test]
fn swapped_phases_are_rejected() {
    let spec = load("paper-bi", &[]);
    let view = TableView::parse(&PAPER_BI).unwrap();
    let laws = view.header().laws;
    let (c1, c2): (LawEntry, LawEntry) = (laws[0].unwrap(), laws[1].unwrap());
    let (len1, len2) = (c1.inputs_len as usize, c2.inputs_len as usize);
    let blocks = &PAPER_BI[HEADER_LEN..];
    let mut swapped = with_header(&PAPER_BI, |header| {
        header.laws.swap(0, 1);
    });
    swapped[HEADER_LEN..HEADER_LEN + len2].copy_from_slice(&blocks[len1..len1 + len2]);
    swapped[HEADER_LEN + len2..HEADER_LEN + len2 + len1].copy_from_slice(&blocks[..len1]);
    seal(&mut swapped).unwrap();
    // The laws are robust enough to do each other's work here; but then C1 is in force where C2
    // should be.
    fails(&judge(&swapped, &spec), ClaimName::HandOver);
}

#[test]
fn a_grid_shifted_by_a_cell_is_rejected() {
    for axis in 0..4 {
        let shift = |header: &mut Header| {
            let grid = header.grid;
            let mut lower = grid.lower_edge();
            lower[axis] += grid.width()[axis] as i32;
            header.grid = firmware::grid::Grid::new(lower, grid.width(), grid.count()).unwrap();
        };
        let spec = small(&[]);
        let verdict = judge(&with_header(&SMALL_TABLE, shift), &spec);
        fails(&verdict, ClaimName::Header);
    }
    // On the frequency's axis it breaks the loop as well.
    let spec = small(&[]);
    let shifted = with_header(&SMALL_TABLE, |header| {
        let grid = header.grid;
        let mut lower = grid.lower_edge();
        lower[0] += grid.width()[0] as i32;
        header.grid = firmware::grid::Grid::new(lower, grid.width(), grid.count()).unwrap();
    });
    fails(&judge(&shifted, &spec), ClaimName::Stay);
}

#[test]
fn wider_uncertainty_than_proven_is_rejected() {
    for wider in [
        "uncertainty.loss_gw=[1.8,2.2]",
        "uncertainty.participation=0.1",
        "uncertainty.measurement=[0.01,0.05,0.05,0.05]",
    ] {
        let verdict = judge(&SMALL_TABLE, &small(&[wider]));
        assert!(!verdict.verified, "{wider}");
        assert!(verdict.counterexample.is_some());
    }
}

#[test]
fn a_slower_settling_than_asked_is_rejected() {
    let verdict = judge(&SMALL_TABLE, &small(&["requirements.settle_within_s=3"]));
    fails(&verdict, ClaimName::Settle);
    let spec = load("paper-bi", &["requirements.settle_within_s=5"]);
    let verdict = judge(&PAPER_BI, &spec);
    fails(&verdict, ClaimName::Settle);
    assert!(verdict.counterexample.unwrap().real.is_some());
}

#[test]
fn a_higher_containment_than_kept_is_refuted() {
    let spec = load("paper-bi", &["requirements.containment_hz=-0.4"]);
    let verdict = judge(&PAPER_BI, &spec);
    fails(&verdict, ClaimName::Containment);
    let real = verdict.counterexample.unwrap().real.unwrap();
    assert!(real.what.contains("-0.40"), "{}", real.what);
}

#[test]
fn for_ever_is_not_claimed_without_hold() {
    let spec = load("paper-bi", &["requirements.horizon_s=none"]);
    let verdict = judge(&PAPER_BI, &spec);
    assert!(!verdict.verified);
}

#[test]
fn bytes_that_the_firmware_rejects_have_no_verdict() {
    let mut broken = SMALL_TABLE.clone();
    broken[300] ^= 1;
    let error = verify(&broken, &small(&[]), &|_| true).unwrap_err();
    assert!(matches!(error, VerifyError::Table(_)));
    let stopped = verify(&SMALL_TABLE, &small(&[]), &|_| false).unwrap_err();
    assert_eq!(stopped, VerifyError::Interrupted);
}
