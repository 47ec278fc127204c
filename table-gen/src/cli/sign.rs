//! `sign`: a table in a container that chargers of one kind take.

use std::path::{Path, PathBuf};

use ed25519_dalek::Signer as _;
use firmware::table::TableView;
use serde::Serialize;
use update::class::DeviceClass;
use update::container::{Container, Header, MAGIC, Validity};
use update::key::{DEVELOPMENT_SEED, PublicKey};

use super::files::write_one;
use super::{Failure, OutputArgs, output, signing};

/// Arguments of `sign`.
#[derive(Debug, clap::Args)]
pub(super) struct SignArgs {
    /// The table
    #[arg(value_name = "TABLE")]
    table: PathBuf,
    /// Private key, as `keygen` writes it
    #[arg(long, value_name = "KEY")]
    key: PathBuf,
    /// The chargers that it is for, by the name of their image: the table must fit them
    #[arg(long, value_name = "NAME", required_unless_present = "class")]
    product: Option<String>,
    /// The chargers that it is for, by a number of one's own; whether the table fits them is not
    /// known here
    #[arg(long, value_name = "N", conflicts_with = "product")]
    class: Option<u32>,
    /// Version: chargers take a newer one alone
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    version: u32,
    /// First moment at which it may be installed, such as 2027-01-31T00:00:00Z
    #[arg(long, value_name = "TIME", value_parser = signing::moment)]
    from: Option<u32>,
    /// Last moment
    #[arg(long, value_name = "TIME", value_parser = signing::moment)]
    until: Option<u32>,
    /// Where the container goes; a file that is no container is never written over
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Debug, Serialize)]
struct SignReport {
    container: PathBuf,
    bytes: usize,
    class: u32,
    version: u32,
    from_s: u32,
    until_s: u32,
    table_bytes: usize,
    table_version: u32,
    development_key: bool,
}

/// Runs the command.
pub(super) fn run(args: &SignArgs) -> Result<(), Failure> {
    let key = signing::signer(&args.key)?;
    let table = signing::read(&args.table)?;
    let view = TableView::parse(&table)
        .map_err(|error| signing::in_file(&args.table, format!("not a table: {error:?}")))?;
    let table_version = view.header().hypotheses.table_version;
    let public = PublicKey(key.verifying_key().to_bytes());
    let validity = Validity {
        from_s: args.from.unwrap_or(Validity::ALWAYS.from_s),
        until_s: args.until.unwrap_or(Validity::ALWAYS.until_s),
    };
    if validity.until_s < validity.from_s {
        let reason = "--until is before --from: no charger could ever take it";
        return Err(Failure::BadInput(reason.to_owned()));
    }
    let product = args.product.as_deref().map(signing::product).transpose()?;
    let class = match (&product, args.class) {
        (Some((_, class)), _) => *class,
        (None, number) => DeviceClass(number.unwrap_or_default()),
    };
    let header = Header {
        table_len: table.len() as u32,
        class,
        version: args.version,
        validity,
    };
    let mut bytes = header.write().to_vec();
    bytes.extend(&table);
    let signature = key.sign(&bytes);
    bytes.extend(signature.to_bytes());
    if let Some((product, class)) = &product {
        let charger = signing::charger(product, *class, public);
        let container = Container::parse(&bytes);
        container
            .and_then(|container| charger.runs(&container))
            .map_err(|refusal| {
                Failure::No(format!(
                    "{}: {}",
                    args.table.display(),
                    signing::told(refusal)
                ))
            })?;
    }
    must_not_be_something_else(&args.out)?;
    write_one(&args.out, &bytes)?;
    let report = SignReport {
        container: args.out.clone(),
        bytes: bytes.len(),
        class: class.0,
        version: args.version,
        from_s: validity.from_s,
        until_s: validity.until_s,
        table_bytes: table.len(),
        table_version,
        development_key: key.to_bytes() == DEVELOPMENT_SEED,
    };
    if report.development_key {
        eprintln!("warning: signed by the key of experiments, which everybody has");
    }
    if args.output.json {
        return output::json(&report);
    }
    output::line(format_args!(
        "wrote {} bytes to {}: version {} for class {}",
        report.bytes,
        report.container.display(),
        report.version,
        signing::class_name(class)
    ));
    Ok(())
}

/// A container may be written over; a key, a table or anything else may not.
fn must_not_be_something_else(path: &Path) -> Result<(), Failure> {
    match std::fs::read(path) {
        Ok(bytes) if bytes.starts_with(&MAGIC) => Ok(()),
        Ok(_) => {
            let reason = "exists and is no container; it is not written over";
            Err(signing::in_file(path, reason))
        }
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(()),
        Err(error) => Err(signing::in_file(path, error)),
    }
}
