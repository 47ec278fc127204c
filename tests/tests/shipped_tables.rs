//! The tables in firmware/tables: made again from their specs byte for byte, and proven, each with
//! the verdict beside it.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use model::hex::hex;
use model::spec::Spec;
use model::verdict::Verdict;
use sha2::{Digest, Sha256};
use tests::testing::{built, shipped};

/// Variants of `gb-bi`. Their proofs are those of the same verifier with other
/// numbers, and take a minute and a half of processor time each: here the verdict beside the table
/// must be about its bytes and this spec. `build NAME` proves them anew.
const VARIANTS: [&str; 6] = [
    "gb-bi-ade7953",
    "gb-bi-slow",
    "gb-low-inertia",
    "gb-uni",
    "gb-uni-ade7953",
    "gb-uni-cars",
];

/// The verdict beside a shipped table.
fn verdict(name: &str) -> Verdict {
    let file = tests::root().join(format!("firmware/tables/{name}.verdict.json"));
    serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap()
}

/// Every table of the folder.
fn names() -> Vec<String> {
    let folder = tests::root().join("firmware/tables");
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "bin"))
        .map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned())
        .collect();
    names.sort();
    names
}

fn is_about(verdict: &Verdict, bytes: &[u8], spec: &Spec) -> bool {
    verdict.verified
        && verdict.claims.iter().all(|claim| claim.holds)
        && verdict.table_sha256 == hex(&Sha256::digest(bytes))
        && verdict.spec_hash == hex(&spec.hash())
}

#[test]
fn every_shipped_table_regenerates_and_is_proven() {
    let names = names();
    let needed = [
        "paper-bi",
        "paper-uni",
        "gb-bi",
        "gb-bi-band",
        "gb-bi-delay",
    ];
    for needed in needed.iter().chain(&VARIANTS) {
        assert!(
            names.iter().any(|name| name == needed),
            "{needed} is not shipped"
        );
    }
    for name in names {
        let (spec, made) = built(&name, &[]);
        let shipped = shipped(&name);
        assert!(
            made == shipped,
            "firmware/tables/{name}.bin ({} bytes) is not what its spec gives ({} bytes): \
             cargo run --release -- build {name}, then copy out/table.bin and out/verdict.json there",
            shipped.len(),
            made.len()
        );
        let written = verdict(&name);
        assert!(is_about(&written, &shipped, &spec), "{name}: {written:?}");
        if VARIANTS.contains(&name.as_str()) {
            continue;
        }
        let found = verify::verify(&shipped, &spec, &|_| true).unwrap();
        assert!(found.verified, "{name}: {:?}", found.claims);
        assert_eq!(found.claims.len(), written.claims.len(), "{name}");
        for (found, written) in found.claims.iter().zip(&written.claims) {
            assert_eq!(found.name, written.name, "{name}");
            // Another processor's exponentials may differ in their last bits.
            let near = |a: f64, b: f64| (a - b).abs() <= 1e-9 * b.abs().max(1.0);
            let same = match (found.bound, written.bound) {
                (Some(found), Some(written)) => near(found, written),
                (found, written) => found == written,
            };
            assert!(same, "{name}: {found:?} and {written:?}");
        }
    }
}
