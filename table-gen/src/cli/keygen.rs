//! `keygen`: a key pair for signing tables.

use std::fs::OpenOptions;
use std::io::{ErrorKind, Write as _};
use std::path::{Path, PathBuf};

use ::ocpp::container::{SigningKey, private_text, public_text};
use serde::Serialize;

use super::{Failure, OutputArgs, output};

/// Arguments of `keygen`.
#[derive(Debug, clap::Args)]
pub(super) struct KeygenArgs {
    /// Where the private key goes; the public key goes beside it, with .pub behind the name. A file
    /// that exists is never written over
    #[arg(value_name = "KEY")]
    key: PathBuf,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Debug, Serialize)]
struct KeygenReport {
    private_key: PathBuf,
    public_key: PathBuf,
    public: String,
}

/// Runs the command.
pub(super) fn run(args: &KeygenArgs) -> Result<(), Failure> {
    let public_path = with_pub(&args.key);
    // Asked for both before either is written, so that no half of a pair is left behind.
    for path in [&args.key, &public_path] {
        if path.symlink_metadata().is_ok() {
            return Err(exists(path));
        }
    }
    let mut seed = [0; 32];
    getrandom::fill(&mut seed)
        .map_err(|error| Failure::BadInput(format!("no random numbers: {error}")))?;
    let key = SigningKey::from_bytes(&seed);
    write_new(&args.key, &private_text(&key), true)?;
    write_new(&public_path, &public_text(&key), false)?;
    let report = KeygenReport {
        private_key: args.key.clone(),
        public_key: public_path,
        public: public_text(&key),
    };
    if args.output.json {
        return output::json(&report);
    }
    output::line(format_args!(
        "wrote the private key to {} (keep it, and keep it secret)",
        report.private_key.display()
    ));
    output::line(format_args!(
        "wrote the public key to {}: {}",
        report.public_key.display(),
        report.public
    ));
    Ok(())
}

/// The public key's file beside the private one's.
fn with_pub(key: &Path) -> PathBuf {
    let mut name = key.as_os_str().to_owned();
    name.push(".pub");
    name.into()
}

fn exists(path: &Path) -> Failure {
    let path = path.display();
    Failure::BadInput(format!(
        "{path} exists; keys are never written over: name another file, or remove it yourself"
    ))
}

/// Writes a line into a file that must not exist; one for the owner's eyes alone if it is private.
fn write_new(path: &Path, line: &str, private: bool) -> Result<(), Failure> {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    if private {
        use std::os::unix::fs::OpenOptionsExt as _;
        options.mode(0o600);
    }
    let failed = |error: std::io::Error| match error.kind() {
        ErrorKind::AlreadyExists => exists(path),
        _ => Failure::BadInput(format!("{}: {error}", path.display())),
    };
    let mut file = options.open(path).map_err(failed)?;
    writeln!(file, "{line}")
        .and_then(|()| file.sync_all())
        .map_err(failed)
}
