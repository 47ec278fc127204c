//! `service` against a charger on a pseudo-terminal that runs the device's own code.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;
use service_client::stand_in::StandIn;

fn service(port: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_table-gen"))
        .arg("service")
        .arg(port)
        .args(arguments)
        .output()
        .unwrap()
}

fn read(port: &Path, what: &str) -> Value {
    let output = service(port, &[what, "--json"]);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{what}: {errors}");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// The command ends with this code and says each of these words.
fn refused(port: &Path, arguments: &[&str], code: i32, words: &[&str]) {
    let output = service(port, arguments);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {errors}");
    for word in words {
        assert!(errors.contains(word), "{arguments:?}: {errors}");
    }
    assert!(output.stdout.is_empty(), "{arguments:?}");
}

fn done(port: &Path, arguments: &[&str]) {
    let output = service(port, arguments);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {errors}");
}

/// Files with the Base64 of 32 bytes: 0, 1, 2 .. and 32, 31, 30 ..
fn keys(folder: &Path) -> [PathBuf; 2] {
    let texts = [
        "AAECAwQFBgcICQoLDA0ODxAREhMUFRYXGBkaGxwdHh8=\n",
        "IB8eHRwbGhkYFxYVFBMSERAPDg0MCwoJCAcGBQQDAgE=\n",
    ];
    let paths = ["first.key", "second.key"].map(|name| folder.join(name));
    for (path, text) in paths.iter().zip(texts) {
        std::fs::write(path, text).unwrap();
    }
    paths
}

#[test]
fn a_charger_is_read_set_and_kept() {
    let charger = StandIn::start().unwrap();
    let port = charger.path();
    let folder = tempfile::tempdir().unwrap();
    let keys = keys(folder.path());
    let [first, second] = keys.each_ref().map(|path| path.to_str().unwrap());

    let identity = read(port, "identity");
    assert_eq!(identity["serial"], "000511e7");
    assert_eq!(identity["settings"], "defaults");
    assert_eq!(identity["has_key"], false);
    assert_eq!(read(port, "settings")["rated_current_ma"], 32_000);

    let limit = ["limit", "site", "10000", "--for-s", "600", "--key"];
    refused(
        port,
        &[&limit[..], &[first]].concat(),
        1,
        &["no device key", "provision"],
    );
    done(port, &["provision", "--key", first]);
    refused(
        port,
        &["provision", "--key", second],
        1,
        &["has a device key"],
    );
    refused(
        port,
        &[&limit[..], &[second]].concat(),
        1,
        &["not this charger's", "nothing was sent"],
    );
    done(port, &[&limit[..], &[first]].concat());
    let status = read(port, "status");
    assert_eq!(status["limits_ma"]["site"], 10_000);
    assert!(status["tick"].as_u64().unwrap() > 0);

    done(
        port,
        &[
            "set",
            "rated_current_ma=16000",
            "pilot_gap_s=5",
            "--key",
            first,
        ],
    );
    assert_eq!(read(port, "status")["waiting"], true);
    let wrong = [
        "set",
        "user_limit_ma=9000",
        "start_fixed_s=30",
        "--key",
        first,
    ];
    refused(port, &wrong, 1, &["start_fixed_s", "at least", "60"]);
    done(
        port,
        &["override", "charge", "--for-s", "60", "--key", first],
    );
    assert_eq!(read(port, "status")["override"], "charge");

    done(port, &["restart", "--key", first]);
    let status = read(port, "status");
    // What was set is in force, orders are over, and half an order was never done.
    assert_eq!(
        (&status["waiting"], &status["override"]),
        (&false.into(), &"none".into())
    );
    assert_eq!(status["limits_ma"]["cable"], 16_000);
    assert_eq!(status["limits_ma"]["site"], 80_000);
    assert_eq!(read(port, "settings")["user_limit_ma"], 80_000);
    assert_eq!(read(port, "identity")["settings"], "stored");

    done(port, &["new-key", "--key", first, "--new", second]);
    refused(
        port,
        &["defaults", "--key", first],
        1,
        &["not this charger's"],
    );
    done(port, &["defaults", "--key", second]);
    done(port, &["restart", "--key", second]);
    assert_eq!(read(port, "settings")["pilot_gap_s"], 0);
    let people = service(port, &["settings"]);
    let people = String::from_utf8_lossy(&people.stdout).into_owned();
    assert!(
        people.contains("rated_current_ma") && people.contains("80000"),
        "{people}"
    );
}

#[test]
fn what_is_wrong_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let keys = keys(folder.path());
    let first = keys[0].to_str().unwrap();
    let nowhere = folder.path().join("nowhere");
    refused(&nowhere, &["identity"], 2, &["nowhere"]);
    let file = folder.path().join("file");
    std::fs::write(&file, "x").unwrap();
    refused(&file, &["identity"], 2, &["not a serial port"]);
    let set = |setting| ["set", setting, "--key", first];
    refused(&nowhere, &set("phases"), 2, &["KEY=VALUE"]);
    refused(
        &nowhere,
        &set("phase=1"),
        2,
        &["no such setting", "rated_current_ma"],
    );
    refused(&nowhere, &set("phases=4"), 2, &["phases=4", "1 to 3"]);
    refused(
        &nowhere,
        &["restart", "--key", "absent.key"],
        2,
        &["absent.key"],
    );
    let file = file.to_str().unwrap();
    refused(
        &nowhere,
        &["restart", "--key", file],
        2,
        &["32 bytes in Base64"],
    );
    let limit = ["limit", "site", "80001", "--key", first];
    refused(&nowhere, &limit, 2, &["0 to 80000", "none"]);
}

#[test]
fn a_signed_table_is_sent_and_a_forged_one_is_refused() {
    let charger = StandIn::start().unwrap();
    let port = charger.path();
    let folder = tempfile::tempdir().unwrap();
    // The key of experiments: 32 bytes of 0x48.
    let key = folder.path().join("dev.key");
    std::fs::write(&key, "SEhISEhISEhISEhISEhISEhISEhISEhISEhISEhISEg=\n").unwrap();
    let container = folder.path().join("table.hfsc");
    let table = concat!(env!("CARGO_MANIFEST_DIR"), "/../firmware/tables/gb-uni.bin");
    let signed = Command::new(env!("CARGO_BIN_EXE_table-gen"))
        .args(["sign", table, "--product", "holdfast", "--version", "3"])
        .arg("--key")
        .arg(&key)
        .arg("--out")
        .arg(&container)
        .output()
        .unwrap();
    let errors = String::from_utf8_lossy(&signed.stderr);
    assert!(signed.status.success(), "{errors}");
    let name = container.to_str().unwrap();
    let mut bytes = std::fs::read(&container).unwrap();
    bytes[40] ^= 1;
    let forged = folder.path().join("forged.hfsc");
    std::fs::write(&forged, &bytes).unwrap();
    let forged = forged.to_str().unwrap();
    refused(port, &["install", forged], 1, &["not signed by the key"]);
    assert_eq!(read(port, "tables")["from_next_start"], Value::Null);
    done(port, &["install", name]);
    let tables = read(port, "tables");
    assert_eq!(tables["from_next_start"], 3);
    assert_eq!(tables["in_force"], Value::Null);
    refused(port, &["install", "missing.hfsc"], 2, &["missing.hfsc"]);
}
