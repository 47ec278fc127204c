//! `cargo fw check`: which table goes into which image, and what is refused.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::path::Path;
use std::process::{Command, Output};

use firmware::table::{CRC_LEN, checksum, field};
use fw::root;
use model::hex::hex;
use model::verdict::{Claim, ClaimName, Counts, Method, Verdict};
use sha2::{Digest, Sha256};

fn check(folder: &Path, arguments: &[&str], variable: Option<&str>) -> (i32, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_fw"));
    command.arg("check").args(arguments).current_dir(folder);
    match variable {
        Some(value) => command.env("HOLDFAST_TABLE", value),
        None => command.env_remove("HOLDFAST_TABLE"),
    };
    let Output {
        status,
        stdout,
        stderr,
    } = command.output().unwrap();
    let text = [stdout, stderr].concat();
    (status.code().unwrap(), String::from_utf8(text).unwrap())
}

fn tables() -> std::path::PathBuf {
    root().join("firmware/tables")
}

/// A table with some bytes replaced and sealed again.
fn sealed(mut image: Vec<u8>, at: field::Field, bytes: &[u8]) -> Vec<u8> {
    image[at].copy_from_slice(bytes);
    let body = image.len() - CRC_LEN;
    let crc = checksum(&image[..body]);
    image[body..].copy_from_slice(&crc.to_le_bytes());
    image
}

#[test]
fn each_product_has_the_shipped_table_for_its_direction_and_power() {
    let (code, text) = check(&root(), &[], None);
    assert_eq!(code, 0, "{text}");
    for line in [
        "holdfast: the table fits",
        "holdfast-bidirectional: the table fits",
        "spec gb-uni (",
        "spec gb-bi (",
        "holdfast-ade7953: the table fits",
        "holdfast-ade7953-bidirectional: the table fits",
    ] {
        assert!(text.contains(line), "{line}: {text}");
    }
}

#[test]
fn a_named_table_goes_where_it_fits() {
    // Relative to where the command was started.
    for (arguments, variable) in [
        (vec!["--table", "gb-bi.bin"], None),
        (vec![], Some("gb-bi.bin")),
    ] {
        let (code, text) = check(&tables(), &arguments, variable);
        assert_eq!(code, 0, "{text}");
        assert!(text.contains("holdfast-bidirectional: the table fits"));
        assert!(
            text.contains("holdfast: direction, power: not built"),
            "{text}"
        );
    }
}

#[test]
fn a_table_of_the_other_direction_is_refused_and_can_be_forced() {
    // The paper's tables assume an exact meter besides.
    let unidirectional = ["--table", "paper-bi.bin", "--product", "holdfast"];
    let (code, text) = check(&tables(), &unidirectional, None);
    assert_eq!(code, 2, "{text}");
    for word in [
        "does not fit",
        "direction",
        "power",
        "meter-error",
        "--force",
    ] {
        assert!(text.contains(word), "{word}: {text}");
    }
    let forced = [&unidirectional[..], &["--force"]].concat();
    let (code, text) = check(&tables(), &forced, None);
    assert_eq!(code, 0, "{text}");
    assert!(text.contains("FORCED") && text.contains("runs on the droop"));
}

#[test]
fn what_is_no_table_is_refused_with_its_reason() {
    let folder = tempfile::tempdir().unwrap();
    let shipped = std::fs::read(tables().join("gb-bi.bin")).unwrap();
    let noise: Vec<u8> = (0..3000u32)
        .map(|n| (n.wrapping_mul(2_654_435_761) >> 24) as u8)
        .collect();
    let mut version_2 = shipped.clone();
    version_2[field::VERSION].copy_from_slice(&[2, 0]);
    let slow = sealed(shipped.clone(), field::TICK, &500u16.to_le_bytes());
    let mut flipped = shipped.clone();
    flipped[100] ^= 1;
    let files: [(&str, &[u8], &str); 6] = [
        ("noise.bin", &noise, "it is no table"),
        ("empty.bin", &[], "0 bytes, at least 260 are needed"),
        (
            "old.bin",
            &version_2,
            "format 2, this firmware reads format 3",
        ),
        (
            "slow.bin",
            &slow,
            "the field at offset 74 is out of its range",
        ),
        ("flipped.bin", &flipped, "BadCrc"),
        ("short.bin", &shipped[..280], "WrongLength"),
    ];
    for (name, bytes, reason) in files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
        // A broken file is refused with --force too: there is nothing to put into the image.
        for force in [&[][..], &["--force"]] {
            let arguments = [&["--table", name], force].concat();
            let (code, text) = check(folder.path(), &arguments, None);
            assert_eq!(code, 2, "{name}: {text}");
            assert!(text.contains(reason), "{name}: {text}");
        }
    }
    for (path, reason) in [
        ("", "the empty path"),
        (".", "Is a directory"),
        ("none.bin", "No such file"),
    ] {
        let (code, text) = check(folder.path(), &[], Some(path));
        assert_eq!(code, 2, "{path}: {text}");
        assert!(text.contains(reason), "{path}: {text}");
    }
    let (code, text) = check(folder.path(), &["--product", "toaster"], None);
    assert_eq!(code, 2, "{text}");
    assert!(
        text.contains("allowed: holdfast, holdfast-ade7953"),
        "{text}"
    );
}

#[test]
fn what_is_proven_is_read_from_the_verdict_on_these_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("gb-bi.bin");
    std::fs::copy(tables().join("gb-bi.bin"), &table).unwrap();
    let said = || check(folder.path(), &["--table", "gb-bi.bin"], None).1;
    assert!(said().contains("NOTHING is known to be proven"));
    let bytes = std::fs::read(&table).unwrap();
    let claim = Claim {
        name: ClaimName::Header,
        holds: false,
        bound: None,
        limit: None,
        unit: "".into(),
        statement: "every field of the header is the spec's".to_owned(),
        reason: None,
    };
    let mut verdict = Verdict {
        verified: false,
        spec: "gb-bi".to_owned(),
        claims: vec![claim],
        reachable_cells: 0,
        counterexample: None,
        hostile_share: None,
        plant: Vec::new(),
        spec_hash: String::new(),
        table_spec_hash: String::new(),
        table_sha256: hex(&Sha256::digest(&bytes)),
        table_bytes: bytes.len(),
        method: Method::NotExplored,
        counts: Counts::default(),
        tool_version: String::new(),
        failures: Vec::new(),
    };
    let write = |verdict: &Verdict| {
        let text = serde_json::to_string(verdict).unwrap();
        std::fs::write(folder.path().join("verdict.json"), text).unwrap();
    };
    write(&verdict);
    assert!(said().contains("NOT verified for gb-bi"), "{}", said());
    verdict.verified = true;
    for claim in &mut verdict.claims {
        claim.holds = true;
    }
    write(&verdict);
    assert!(
        said().contains("; spec gb-bi") && said().contains("verified for gb-bi: header"),
        "{}",
        said()
    );
    // Of other bytes it says nothing.
    verdict.table_sha256 = "00".repeat(32);
    write(&verdict);
    assert!(said().contains("NOTHING is known to be proven"));
}
