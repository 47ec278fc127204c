//! `keys`: every key of a spec, with unit, default and what is allowed.

use serde::Serialize;

use super::{Failure, OutputArgs, output};
use model::spec::reference;

/// Arguments of `keys`.
#[derive(Debug, clap::Args)]
pub(super) struct KeysArgs {
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Debug, Serialize)]
struct KeyRow {
    key: &'static str,
    unit: &'static str,
    default: String,
    allowed: String,
    description: &'static str,
}

#[derive(Debug, Serialize)]
struct KeysReport {
    keys: Vec<KeyRow>,
}

/// Runs the command.
pub(super) fn run(args: &KeysArgs) -> Result<(), Failure> {
    let keys = reference().into_iter().map(|doc| KeyRow {
        key: doc.key,
        unit: doc.unit,
        default: doc.default,
        allowed: doc.allowed.to_string(),
        description: doc.description,
    });
    let report = KeysReport {
        keys: keys.collect(),
    };
    if args.output.json {
        return output::json(&report);
    }
    for row in &report.keys {
        output::line(format_args!(
            "{} = {}  [{}]",
            row.key, row.default, row.unit
        ));
        output::line(format_args!("    {}; {}", row.description, row.allowed));
    }
    Ok(())
}
