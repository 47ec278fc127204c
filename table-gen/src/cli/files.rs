//! Output files that come together or not at all.

use std::path::Path;

use super::{Failure, progress};

/// Writes all files into a folder, or none: they are made in a temporary folder beside their places
/// and moved when all of them are complete.
pub(super) fn write_all(dir: &Path, files: &[(&str, &[u8])]) -> Result<(), Failure> {
    let fail = |path: &Path, error: std::io::Error| {
        Failure::BadInput(format!("{}: {error}", path.display()))
    };
    if progress::interrupted() {
        return Err(interruption());
    }
    let new = !dir.exists();
    std::fs::create_dir_all(dir).map_err(|error| fail(dir, error))?;
    // In the target's own folder, so that the moves stay on one file system.
    let staging = tempfile::Builder::new()
        .prefix(".partial-")
        .tempdir_in(dir)
        .map_err(|error| fail(dir, error))?;
    for (name, bytes) in files {
        let path = staging.path().join(name);
        std::fs::write(&path, bytes).map_err(|error| fail(&path, error))?;
    }
    if progress::interrupted() {
        drop(staging);
        if new {
            // Fails only if someone else put something there: then it is not ours to remove.
            let _ = std::fs::remove_dir(dir);
        }
        return Err(interruption());
    }
    for (name, _) in files {
        let to = dir.join(name);
        std::fs::rename(staging.path().join(name), &to).map_err(|error| fail(&to, error))?;
    }
    Ok(())
}

/// Writes one file, or nothing: it is made beside its place and moved when it is complete.
pub(super) fn write_one(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let fail = |error: std::io::Error| Failure::BadInput(format!("{}: {error}", path.display()));
    let dir = path.parent().filter(|dir| !dir.as_os_str().is_empty());
    let staged = tempfile::NamedTempFile::new_in(dir.unwrap_or(Path::new("."))).map_err(fail)?;
    std::fs::write(staged.path(), bytes).map_err(fail)?;
    staged.persist(path).map_err(|error| fail(error.error))?;
    Ok(())
}

fn interruption() -> Failure {
    Failure::No("interrupted; nothing was written".to_owned())
}
