//! No byte of a header is free: each, changed and with the CRC made right again, is refused by the
//! reader or by the claim `header`, for every shipped table.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use firmware::prediction::prediction_len;
use firmware::table::field::{self, Field};
use firmware::table::{CRC_LEN, HEADER_LEN, RESPONSE_LEN, TableView, checksum};
use model::spec::Spec;
use tests::root;

/// Fields of which every value will do, with the reason.
const HARMLESS: [(&str, Field); 1] = [
    // Neither device nor proof depends on which version of the generator wrote the bytes.
    ("generator", field::GENERATOR),
];

/// The table with a byte changed and the CRC made right.
fn mutant(table: &[u8], at: usize, change: u8) -> Vec<u8> {
    let mut image = table.to_vec();
    image[at] ^= change;
    let body = image.len() - CRC_LEN;
    let crc = checksum(&image[..body]);
    image[body..].copy_from_slice(&crc.to_le_bytes());
    image
}

#[derive(Debug, Default)]
struct Tally {
    by_reader: u32,
    by_claim: u32,
    accepted: Vec<usize>,
}

#[test]
fn every_changed_byte_of_a_header_is_refused() {
    let folder = root().join("firmware/tables");
    let mut tables = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|ending| ending != "bin") {
            continue;
        }
        let name = path.file_stem().unwrap().to_str().unwrap();
        let table = std::fs::read(&path).unwrap();
        let spec = Spec::load(name, &[]).unwrap();
        let holds =
            |bytes: &[u8]| verify::header_claim(bytes, &spec).is_ok_and(|claim| claim.holds);
        assert!(
            holds(&table),
            "{name}: {:?}",
            verify::header_claim(&table, &spec)
        );
        let view = TableView::parse(&table).unwrap();
        // The laws' blocks are another matter: there the exploration decides.
        let end = match (view.response(), view.header().delay_ticks) {
            (Some(_), _) => HEADER_LEN + RESPONSE_LEN,
            (None, 0) => HEADER_LEN,
            (None, ticks) => HEADER_LEN + prediction_len(ticks),
        };
        let mut tally = Tally::default();
        for at in 0..end {
            // The prediction's coefficients are compared one by one: the ends of a byte will do.
            let all = at < HEADER_LEN || view.response().is_some();
            let bits = if all { 0..8 } else { 0..1 };
            for change in bits.map(|bit| 1 << bit).chain([0xFF]) {
                let image = mutant(&table, at, change);
                if TableView::parse(&image).is_err() {
                    tally.by_reader += 1;
                } else if !holds(&image) {
                    tally.by_claim += 1;
                } else {
                    let named = HARMLESS.iter().any(|(_, field)| field.contains(&at));
                    assert!(named, "{name}: byte {at} ^ {change:#04x} passes");
                    tally.accepted.push(at);
                }
            }
        }
        tally.accepted.dedup();
        println!(
            "{name}: {end} bytes, 9 changes each (2 after the header): {} refused by the reader, {} by the claim; any value \
             of bytes {:?} ({}) is accepted",
            tally.by_reader,
            tally.by_claim,
            tally.accepted,
            HARMLESS.map(|(name, _)| name).join(", ")
        );
        // A field that is listed and refused would be listed for nothing.
        let listed: Vec<usize> = HARMLESS
            .iter()
            .flat_map(|(_, field)| field.clone())
            .collect();
        assert_eq!(tally.accepted, listed, "{name}");
        tables += 1;
    }
    assert!(tables >= 5, "{tables}");
}

/// The four mutants that the first version took for proven.
#[test]
fn the_mutants_that_the_first_version_took_for_proven_are_refused() {
    let read =
        |name: &str| std::fs::read(root().join(format!("firmware/tables/{name}.bin"))).unwrap();
    let put = |mut image: Vec<u8>, changes: &[(Field, [u8; 4])]| {
        for (at, bytes) in changes {
            image[at.clone()].copy_from_slice(bytes);
        }
        mutant(&image, 0, 0)
    };
    let refused = |image: &[u8], name: &str, set: &[&str], word: &str| {
        let set: Vec<String> = set.iter().map(|s| (*s).to_owned()).collect();
        let spec = Spec::load(name, &set).unwrap();
        let claim = verify::header_claim(image, &spec).unwrap();
        assert!(!claim.holds);
        let reason = claim.reason.unwrap();
        assert!(reason.contains(word), "{reason}");
    };
    let weak = (-1_000_000i32).to_le_bytes();
    let no_droop = [
        (field::GOVERNOR_GAIN, weak),
        (field::DROOP_DEADBAND, 100u32.to_le_bytes()),
        (field::DROOP_FULL, 4_000_000_000u32.to_le_bytes()),
    ];
    for name in ["gb-bi-band", "gb-bi"] {
        refused(&put(read(name), &no_droop), name, &[], "the plant is");
    }
    let slow = [
        (field::GOVERNOR_TIME, 25_000_000u32.to_le_bytes()),
        (field::GOVERNOR_GAIN, (-500_000i32).to_le_bytes()),
        (field::DROOP_DEADBAND, 4_000_000u32.to_le_bytes()),
    ];
    refused(
        &put(read("paper-uni"), &slow),
        "paper-uni",
        &[],
        "the droop is",
    );
    // The device would refuse a chain that is too fast for its tick, whatever the spec says.
    let fast = [(field::TURBINE_TIME, 10_000u32.to_le_bytes())];
    let image = put(read("paper-bi"), &fast);
    let set = ["plant.turbine_time_s=0.01"];
    refused(&image, "paper-bi", &set, "the device refuses the plant");
    // A table against another spec.
    let set = ["plant.inertia_gw_s_per_hz=2"];
    refused(&read("paper-bi"), "paper-bi", &set, "the plant is");
}
