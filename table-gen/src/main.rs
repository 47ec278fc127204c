//! The command line of Holdfast; see [`cli`].
#![forbid(unsafe_code)]

#[cfg(test)]
mod build_id;
mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::run()
}
