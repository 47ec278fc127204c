//! The falsifier against tables that stand and tables that fall.

use firmware::table::{Law, TableView};
use lab::falsify::falsify;

use super::{SMALL_TABLE, small};

#[test]
fn a_proven_table_stands_a_broken_one_and_a_wider_spec_fall() {
    let spec = small(&[]);
    let bytes = &SMALL_TABLE;
    let stands = falsify(bytes, &spec, 200_000, 1).unwrap();
    assert_eq!(stands.violation, None);
    assert!(stands.smallest_margin_hz > 0.0 && stands.steps >= 200_000);
    // Far more uncertainty than the kernel was made for.
    let wider = small(&[
        "uncertainty.loss_gw=[1.7,2.3]",
        "uncertainty.participation=0.2",
    ]);
    let falls = falsify(bytes, &wider, 1_000_000, 1).unwrap();
    assert!(falls.violation.is_some(), "{falls:?}");
    // C1's block emptied: the first decision has no entry.
    let entry = TableView::parse(bytes).unwrap().header().laws[Law::C1 as usize].unwrap();
    let mut broken = bytes.to_vec();
    let from = firmware::table::HEADER_LEN + firmware::table::DENSE_HEADER_LEN;
    let to = firmware::table::HEADER_LEN + (entry.domain_len + entry.inputs_len) as usize;
    broken[from..to].fill(0);
    firmware::table::seal(&mut broken).unwrap();
    let falls = falsify(&broken, &spec, 1_000_000, 1).unwrap();
    assert!(falls.violation.unwrap().what.contains("no law"));
    // The same seed gives the same search.
    assert_eq!(
        falsify(bytes, &spec, 20_000, 7).unwrap(),
        falsify(bytes, &spec, 20_000, 7).unwrap()
    );
}
