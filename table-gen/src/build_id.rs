//! What a build is called: the commit that it was built on, and whether its source was changed
//! since. The build script asks once; the tests ask here.

use std::path::Path;
use std::process::Command;

/// The name of a build without a repository: from an archive, or where there is no git.
pub(crate) const NO_COMMIT: &str = "no commit";

/// The commit of the repository whose root is `root`, and `changed` if files in `folders` differ
/// from it. A repository around `root` that is not its own is none.
pub(crate) fn of(git: &str, root: &Path, folders: &[&str]) -> String {
    let ask = |arguments: &[&str]| {
        let command = Command::new(git).current_dir(root).args(arguments).output();
        let output = command.ok().filter(|output| output.status.success())?;
        Some(String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let own = || {
        let top = ask(&["rev-parse", "--show-toplevel"])?;
        let same = Path::new(&top).canonicalize().ok()? == root.canonicalize().ok()?;
        same.then(|| ask(&["rev-parse", "--short=12", "HEAD"]))?
    };
    let Some(commit) = own() else {
        return NO_COMMIT.to_owned();
    };
    let status = [&["status", "--porcelain", "--"], folders].concat();
    match ask(&status) {
        Some(text) if text.is_empty() => commit,
        _ => format!("{commit}, changed"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn git(root: &Path, arguments: &[&str]) {
        let name = ["-c", "user.name=test", "-c", "user.email=test@localhost"];
        let command = Command::new("git")
            .current_dir(root)
            .args(name)
            .args(arguments)
            .output();
        let output = command.unwrap();
        assert!(output.status.success(), "{arguments:?}: {output:?}");
    }

    #[test]
    fn a_commit_is_named_and_a_change_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        assert_eq!(of("git", root, &["source"]), NO_COMMIT);
        assert_eq!(of("no-such-program", root, &["source"]), NO_COMMIT);
        std::fs::create_dir(root.join("source")).unwrap();
        std::fs::write(root.join("source/a"), "a").unwrap();
        git(root, &["init", "--quiet"]);
        git(root, &["add", "--all"]);
        git(root, &["commit", "--quiet", "--message", "a"]);
        let commit = of("git", root, &["source"]);
        assert!(commit.len() == 12 && commit.bytes().all(|b| b.is_ascii_hexdigit()));
        // A note beside the source changes nothing that is built.
        std::fs::write(root.join("note"), "b").unwrap();
        assert_eq!(of("git", root, &["source"]), commit);
        std::fs::write(root.join("source/a"), "b").unwrap();
        assert_eq!(of("git", root, &["source"]), format!("{commit}, changed"));
        // A folder inside of someone else's repository has no commit of its own.
        assert_eq!(of("git", &root.join("source"), &["."]), NO_COMMIT);
    }

    #[test]
    fn this_build_is_named_after_its_package_and_commit() {
        let text = super::super::cli::version();
        let rest = text.strip_prefix(env!("CARGO_PKG_VERSION")).unwrap();
        let build = rest.strip_prefix(" (").unwrap().strip_suffix(')').unwrap();
        let commit = build.split(',').next().unwrap();
        let digits = commit.len() == 12 && commit.bytes().all(|b| b.is_ascii_hexdigit());
        assert!(build == NO_COMMIT || digits, "{build}");
    }
}
