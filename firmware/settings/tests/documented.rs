//! docs/service.md shows every setting as it is.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use settings::key::Key;

#[test]
fn every_setting_stands_in_the_docs() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/service.md");
    let text = std::fs::read_to_string(path).unwrap();
    let shown = text
        .lines()
        .filter(|line| line.starts_with("| ") && line.contains("| `"));
    let expected = Key::ALL.map(|key| {
        let about = key.about();
        format!(
            "| {} | `{}` | {} | {} | {} | {} |",
            key.number(),
            about.name,
            about.least,
            about.most,
            about.default,
            about.says
        )
    });
    assert_eq!(shown.collect::<Vec<_>>(), expected);
}
