//! Keys, containers and slots through the command line: what is written, what is refused, and what
//! is never written over.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

const TABLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../firmware/tables/gb-bi.bin");
const OTHER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../firmware/tables/gb-uni.bin");
const PRODUCT: &str = "holdfast-bidirectional";

/// A folder in which commands are called.
struct Desk(tempfile::TempDir);

impl Desk {
    /// With a key pair, `maker` and `maker.pub`.
    fn new() -> Self {
        let desk = Self(tempfile::tempdir().unwrap());
        desk.does(&["keygen", "maker"]);
        desk
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap()
    }

    fn call(&self, arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_table-gen"))
            .args(arguments)
            .current_dir(self.0.path())
            .output()
            .unwrap()
    }

    fn does(&self, arguments: &[&str]) -> String {
        let output = self.call(arguments);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{arguments:?}: {errors}");
        String::from_utf8(output.stdout).unwrap()
    }

    /// The command ends with this code and says each of these words.
    fn refused(&self, code: i32, arguments: &[&str], words: &[&str]) {
        let output = self.call(arguments);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {errors}");
        for word in words {
            assert!(errors.contains(word), "{arguments:?}: {word}: {errors}");
        }
    }

    /// A container with a table, under a version.
    fn signed(&self, version: &str, out: &str, more: &[&str]) {
        let sign = ["sign", TABLE, "--key", "maker", "--product", PRODUCT];
        let rest = ["--version", version, "--out", out];
        self.does(&[&sign[..], &rest, more].concat());
    }
}

fn update<'a>(container: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let to = ["update", container, "--flash", "slots.bin", "--product"];
    [&to[..], &[PRODUCT, "--trust", "maker.pub"], more].concat()
}

#[test]
fn keys_are_never_written_over() {
    let desk = Desk::new();
    let pair = [desk.read("maker"), desk.read("maker.pub")];
    assert_ne!(pair[0], pair[1]);
    desk.refused(
        2,
        &["keygen", "maker"],
        &["maker exists", "never written over"],
    );
    std::fs::write(desk.path("half.pub"), "kept").unwrap();
    desk.refused(2, &["keygen", "half"], &["half.pub exists"]);
    assert!(!desk.path("half").exists());
    assert_eq!(desk.read("half.pub"), b"kept");
    // Nor by what else is written.
    for name in ["maker", "maker.pub"] {
        let sign = ["sign", TABLE, "--key", "maker", "--product", PRODUCT];
        let rest = ["--version", "1", "--out", name];
        desk.refused(2, &[&sign[..], &rest].concat(), &["is no container"]);
        let mut arguments = update("one.hfsc", &[]);
        desk.signed("1", "one.hfsc", &[]);
        arguments[3] = name;
        desk.refused(2, &arguments, &["two slots have 262144"]);
    }
    assert_eq!(pair, [desk.read("maker"), desk.read("maker.pub")]);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        let mode = desk.path("maker").metadata().unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
    }
    let other: Value = serde_json::from_str(&desk.does(&["keygen", "other", "--json"])).unwrap();
    let text = String::from_utf8(desk.read("other.pub")).unwrap();
    assert_eq!(other["public"], text.trim());
    assert_ne!(desk.read("other.pub"), pair[1]);
}

#[test]
fn a_container_goes_into_the_slots() {
    let desk = Desk::new();
    desk.signed("1", "one.hfsc", &[]);
    let container = desk.read("one.hfsc");
    let table = std::fs::read(TABLE).unwrap();
    assert_eq!(container.len(), 32 + table.len() + 64);
    assert_eq!(container[32..][..table.len()], table);
    let told = desk.does(&update("one.hfsc", &["--dry-run"]));
    assert!(
        told.contains("in force before: the built-in table"),
        "{told}"
    );
    assert!(told.contains("version 1 in slot A, on trial"), "{told}");
    assert!(!desk.path("slots.bin").exists());
    let told: Value = serde_json::from_str(&desk.does(&update("one.hfsc", &["--json"]))).unwrap();
    assert_eq!(told["before"], Value::Null);
    assert_eq!(told["after"]["version"], 1);
    assert_eq!(told["after"]["confirmed"], false);
    let flash = desk.read("slots.bin");
    assert_eq!(flash.len(), 2 * 128 * 1024);
    // Behind the marks of slot A, and nowhere else.
    assert_eq!(flash[256..][..container.len()], container);
    assert!(flash[128 * 1024..].iter().all(|byte| *byte == 0xFF));
    // The first table is on trial, as the charger would have it at its next start.
    desk.signed("2", "two.hfsc", &[]);
    desk.refused(
        1,
        &update("two.hfsc", &[]),
        &["on trial", "nothing was written"],
    );
    assert_eq!(desk.read("slots.bin"), flash);
}

#[test]
fn each_wrong_container_is_refused_with_its_reason() {
    let desk = Desk::new();
    confirmed_version_5(&desk);
    let flash = desk.read("slots.bin");
    let refused = |name: &str, more: &[&str], words: &[&str]| {
        desk.refused(1, &update(name, more), words);
        assert_eq!(desk.read("slots.bin"), flash, "{name}");
    };
    desk.signed("4", "older.hfsc", &[]);
    refused("older.hfsc", &[], &["version 4 is older than version 5"]);
    desk.signed("5", "same.hfsc", &[]);
    refused("same.hfsc", &[], &["has version 5 already"]);
    desk.signed("6", "good.hfsc", &[]);
    let good = desk.read("good.hfsc");
    let write = |name: &str, bytes: &[u8]| std::fs::write(desk.path(name), bytes).unwrap();
    write("short.hfsc", &good[..good.len() - 1]);
    refused(
        "short.hfsc",
        &[],
        &["truncated: 387 bytes, and 388 are needed"],
    );
    let mut forged = good.clone();
    forged[100] ^= 1;
    write("forged.hfsc", &forged);
    refused("forged.hfsc", &[], &["not that of the trusted key"]);
    write("table.hfsc", &std::fs::read(TABLE).unwrap());
    refused("table.hfsc", &[], &["begins with \"HFDT\""]);
    let sign = ["sign", OTHER, "--key", "maker", "--product", "holdfast"];
    let rest = ["--version", "6", "--out", "other.hfsc"];
    desk.does(&[&sign[..], &rest].concat());
    refused("other.hfsc", &[], &["for chargers of class", "(holdfast)"]);
    let timed = [
        "--from",
        "2027-01-01T00:00:00Z",
        "--until",
        "2027-02-01T00:00:00Z",
    ];
    desk.signed("6", "timed.hfsc", &timed);
    refused("timed.hfsc", &[], &["not told the time"]);
    refused(
        "timed.hfsc",
        &["--now", "2026-12-31T23:59:59Z"],
        &["valid from 2027-01-01"],
    );
    refused(
        "timed.hfsc",
        &["--now", "2027-02-01T00:00:01Z"],
        &["valid until 2027-02-01"],
    );
    let told = desk.does(&update("timed.hfsc", &["--now", "2027-01-15T00:00:00Z"]));
    assert!(
        told.contains("in force before: version 5 in slot A, confirmed"),
        "{told}"
    );
    assert!(told.contains("version 6 in slot B, on trial"), "{told}");
}

/// Slots as a charger leaves them that has confirmed version 5.
fn confirmed_version_5(desk: &Desk) {
    desk.signed("5", "five.hfsc", &[]);
    desk.does(&update("five.hfsc", &[]));
    // What `update::marks` writes: confirmed and settled, behind complete and a trial.
    let mut flash = desk.read("slots.bin");
    flash[32..64].copy_from_slice(b"holdfast: has run, is confirmed\0");
    flash[64..96].copy_from_slice(b"holdfast: confirmed is settled\0\0");
    flash[128..160].fill(0);
    std::fs::write(desk.path("slots.bin"), flash).unwrap();
}

#[test]
fn bad_input_is_named() {
    let desk = Desk::new();
    let sign = |table: &str, more: &[&str], words: &[&str], code: i32| {
        let call = ["sign", table, "--key", "maker", "--out", "x.hfsc"];
        desk.refused(code, &[&call[..], more].concat(), words);
        assert!(!Path::new(&desk.path("x.hfsc")).exists());
    };
    let for_bi = ["--product", PRODUCT, "--version", "1"];
    sign("maker", &for_bi, &["maker: not a table"], 2);
    sign("nowhere", &for_bi, &["nowhere:"], 2);
    // A table that the product would refuse is refused here.
    sign(OTHER, &for_bi, &["direction", "power"], 1);
    sign(
        TABLE,
        &["--product", "toaster", "--version", "1"],
        &["toaster", "allowed: holdfast"],
        2,
    );
    sign(
        TABLE,
        &["--product", PRODUCT, "--version", "0"],
        &["--version"],
        2,
    );
    sign(TABLE, &["--version", "1"], &["--product"], 2);
    let upside_down = [
        "--from",
        "2027-02-01T00:00:00Z",
        "--until",
        "2027-01-01T00:00:00Z",
    ];
    sign(
        TABLE,
        &[&for_bi[..], &upside_down].concat(),
        &["--until is before --from"],
        2,
    );
    sign(
        TABLE,
        &[&for_bi[..], &["--from", "tomorrow"]].concat(),
        &["2027-01-31T00:00:00Z"],
        2,
    );
    // Any table for chargers of another maker.
    let call = [
        "sign",
        OTHER,
        "--key",
        "maker",
        "--class",
        "7",
        "--version",
        "1",
    ];
    desk.does(&[&call[..], &["--out", "y.hfsc"]].concat());
    // The private key is no public key's file, and a short one is none.
    std::fs::write(desk.path("short"), "AAAA\n").unwrap();
    let call = ["sign", TABLE, "--key", "short", "--out", "x.hfsc"];
    desk.refused(
        2,
        &[&call[..], &for_bi].concat(),
        &["short:", "32 bytes in Base64"],
    );
    let mut arguments = update("y.hfsc", &["--slot-bytes", "100"]);
    desk.refused(2, &arguments, &["--slot-bytes 100"]);
    arguments = update("y.hfsc", &[]);
    desk.refused(1, &arguments, &["0x00000007"]);
}

#[test]
fn the_key_of_experiments_is_told() {
    let desk = Desk::new();
    // 32 bytes of 0x48, as docs/signed-tables.md has it.
    let key = "SEhISEhISEhISEhISEhISEhISEhISEhISEhISEhISEg=\n";
    std::fs::write(desk.path("development"), key).unwrap();
    let call = ["sign", TABLE, "--key", "development", "--product", PRODUCT];
    let output = desk.call(&[&call[..], &["--version", "1", "--out", "x.hfsc"]].concat());
    assert!(output.status.success());
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(told.contains("key of experiments"), "{told}");
}
