//! The tables in firmware/tables: made again from their specs byte for byte, and proven.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use tests::testing::{built, shipped};

#[test]
fn every_shipped_table_regenerates_and_is_proven() {
    let folder = tests::root().join("firmware/tables");
    let mut names: Vec<String> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "bin"))
        .map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned())
        .collect();
    names.sort();
    for needed in ["paper-bi", "paper-uni", "gb-bi", "gb-bi-delay", "gb-uni"] {
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
             cargo run --release -- build {name}, then copy out/table.bin there",
            shipped.len(),
            made.len()
        );
        let verdict = verify::verify(&shipped, &spec, &|_| true).unwrap();
        assert!(verdict.verified, "{name}: {:?}", verdict.claims);
    }
}
