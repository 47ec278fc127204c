//! The commands by what they are for, as `--help` shows them.

use std::fmt::Write as _;

use clap::Command;

/// Headings and the commands under them, in order; every command once.
const GROUPS: [(&str, &[&str]); 5] = [
    ("A table", &["build", "verify", "budget"]),
    (
        "What it does on the grid",
        &["simulate", "compare", "fleet", "prob", "report"],
    ),
    ("Recorded frequencies", &["replay", "identify"]),
    (
        "Chargers and back offices",
        &["monitor", "service", "ocpp", "keygen", "sign", "update"],
    ),
    (
        "Research",
        &[
            "synth",
            "maximise",
            "falsify",
            "counterfactual",
            "formula",
            "inspect",
            "keys",
        ],
    ),
];

/// The help of the whole program: commands by group.
const TEMPLATE: &str = "{about}\n\n{usage-heading} {usage}\n{after-help}\n\nOptions:\n{options}\n";

/// The command line with its commands in groups.
pub(super) fn grouped(command: Command) -> Command {
    let text = text(&command);
    command.help_template(TEMPLATE).after_help(text)
}

fn text(command: &Command) -> String {
    let width = command
        .get_subcommands()
        .map(|c| c.get_name().len())
        .max()
        .unwrap_or(0);
    let mut text = String::new();
    for (heading, names) in GROUPS {
        // Writing to a String cannot fail.
        let _ = write!(text, "\n{heading}:\n");
        for name in names {
            let Some(found) = command.find_subcommand(name) else {
                continue;
            };
            let about = found
                .get_about()
                .map(ToString::to_string)
                .unwrap_or_default();
            let _ = writeln!(text, "  {name:width$}  {about}");
        }
    }
    let _ = write!(
        text,
        "\n`table-gen COMMAND --help` tells the arguments of each."
    );
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory as _;

    #[test]
    fn every_command_stands_in_one_group() {
        let command = super::super::Cli::command();
        let all = || GROUPS.iter().flat_map(|(_, names)| names.iter().copied());
        for found in command
            .get_subcommands()
            .filter(|found| found.get_name() != "help")
        {
            let name = found.get_name();
            assert_eq!(all().filter(|known| *known == name).count(), 1, "{name}");
        }
        for name in all() {
            // What another part of the program is still to bring may stand here before it comes.
            let expected = ["prob", "identify"].contains(&name);
            assert!(
                command.find_subcommand(name).is_some() || expected,
                "{name}"
            );
        }
    }
}
