//! The build's name, for `--version`.

#[path = "src/build_id.rs"]
mod build_id;

use std::path::Path;

/// What the program is built from, seen from the workspace's root.
const SOURCE: [&str; 4] = ["Cargo.lock", "Cargo.toml", "firmware/src", "table-gen"];

fn main() {
    let package = std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default();
    let root = Path::new(&package).join("..");
    let build = build_id::of("git", &root, &SOURCE);
    println!("cargo::rustc-env=HOLDFAST_BUILD={build}");
    // A commit is written to HEAD's log, which a worktree keeps elsewhere.
    let head = std::process::Command::new("git")
        .current_dir(&root)
        .args([
            "rev-parse",
            "--path-format=absolute",
            "--git-path",
            "logs/HEAD",
        ])
        .output();
    if let Some(head) = head.ok().filter(|output| output.status.success()) {
        println!(
            "cargo::rerun-if-changed={}",
            String::from_utf8_lossy(&head.stdout).trim()
        );
    }
    for source in SOURCE {
        println!("cargo::rerun-if-changed=../{source}");
    }
}
