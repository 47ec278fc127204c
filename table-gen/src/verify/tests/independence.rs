//! The verifier must not rest on what it checks.

use std::fs;
use std::path::Path;

/// Modules of this crate that the verifier may use.
const ALLOWED: [&str; 5] = ["spec", "plant", "interval", "flow", "verify"];

#[test]
fn the_verifier_uses_nothing_of_synthesis() {
    let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/verify");
    let mut files = 0;
    for entry in fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|ext| ext != "rs") {
            continue;
        }
        files += 1;
        let text = fs::read_to_string(&path).unwrap();
        for line in text
            .lines()
            .filter(|line| !line.trim_start().starts_with("//"))
        {
            // Every mention of the crate, in a `use` or in a path.
            for rest in line.split("crate::").skip(1) {
                let module: String = rest
                    .chars()
                    .take_while(|c| c.is_ascii_alphanumeric() || *c == '_')
                    .collect();
                assert!(
                    ALLOWED.contains(&module.as_str()),
                    "{}: {line}",
                    path.display()
                );
            }
            assert!(!line.contains("super::super"), "{}: {line}", path.display());
        }
    }
    assert!(files > 10, "only {files} files were looked at");
    // What the allowed modules use in turn must stay on this side too.
    for module in ["plant.rs", "interval.rs", "flow.rs"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("src")
            .join(module);
        let text = fs::read_to_string(path).unwrap();
        for forbidden in [
            "abstraction",
            "game",
            "synthesis",
            "emit",
            "compress",
            "pipeline",
        ] {
            assert!(!text.contains(&format!("crate::{forbidden}")), "{module}");
        }
    }
}
