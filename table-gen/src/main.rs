//! The command-line interface; see [`table_gen::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    table_gen::cli::run()
}
