//! The two names of the program: `host`, and `pam` where a system has another `host`. Help, completions, manual pages, messages, results
//! and pages use the name that was called.

use std::ffi::OsStr;
use std::path::Path;
use std::sync::OnceLock;

/// The name in the sources of all texts.
const WRITTEN: &str = "host";
/// The second name.
const SECOND: &str = "pam";

/// The name by which the program was called: `pam` or `host`.
#[must_use]
pub(crate) fn called() -> &'static str {
    static NAME: OnceLock<&str> = OnceLock::new();
    NAME.get_or_init(|| of(std::env::args_os().next().as_deref()))
}

fn of(argument: Option<&OsStr>) -> &'static str {
    let stem = argument.and_then(|a| Path::new(a).file_stem());
    if stem == Some(OsStr::new(SECOND)) { SECOND } else { WRITTEN }
}

/// The command line with the called name in its examples.
#[must_use]
pub(crate) fn renamed(command: clap::Command) -> clap::Command {
    let name = called();
    // The parser would show the file's name, on Windows with its `.exe`.
    let command = command.bin_name(name);
    if name == WRITTEN { command } else { with_name(command.name(name), name) }
}

fn with_name(command: clap::Command, name: &str) -> clap::Command {
    let help = command.get_after_help().map(|help| in_text(&help.to_string(), name));
    let command = match help {
        Some(help) => command.after_help(help),
        None => command,
    };
    let command = command.mut_args(|argument| {
        let (short, long) = (argument.get_help().cloned(), argument.get_long_help().cloned());
        let argument = match short {
            Some(help) => argument.help(in_text(&help.to_string(), name)),
            None => argument,
        };
        match long {
            Some(help) => argument.long_help(in_text(&help.to_string(), name)),
            None => argument,
        }
    });
    command.mut_subcommands(|sub| with_name(sub, name))
}

/// A text about commands, with the called name in them: a system whose `host` is another program would start that one.
#[must_use]
pub(crate) fn in_called_name(text: String) -> String {
    let name = called();
    if name == WRITTEN { text } else { in_text(&text, name) }
}

/// A page in HTML, with the called name in its commands.
#[must_use]
pub(crate) fn in_page(html: String) -> String {
    let name = called();
    if name == WRITTEN { html } else { in_code(&html, name) }
}

/// `html` with the program called `name` where its name begins a piece of code.
fn in_code(html: &str, name: &str) -> String {
    html.replace(&format!("<code>{WRITTEN} "), &format!("<code>{name} "))
}

/// `text` with the program called `name` where it stands as a command: at the start of a line or of a shell command, or in backquotes.
fn in_text(text: &str, name: &str) -> String {
    let mut renamed = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find(WRITTEN) {
        let (before, from) = rest.split_at(at);
        let after = &from[WRITTEN.len()..];
        let line = before.rsplit('\n').next().unwrap_or(before).trim_end();
        let begins = line.is_empty() && (before.is_empty() || before.ends_with([' ', '\n']));
        let command =
            (begins || line.ends_with(['`', '|', '&', ':', ';', '('])) && after.starts_with([' ', '-', '`']);
        renamed += before;
        renamed += if command { name } else { WRITTEN };
        rest = after;
    }
    renamed + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_is_that_of_the_file_that_was_called() {
        let of = |path: &str| of(Some(OsStr::new(path)));
        assert_eq!(
            [of("/usr/bin/pam"), of("pam.exe"), of("host"), of("./renamed")],
            ["pam", "pam", "host", "host"]
        );
    }

    #[test]
    fn the_usage_shows_the_name_without_the_ending_of_the_file() {
        let shown =
            renamed(clap::Command::new(WRITTEN)).try_get_matches_from(["C:/tools/host.exe", "--help"]);
        let usage = shown.expect_err("help is an early end").to_string();
        assert!(usage.contains("Usage: host\n"), "{usage}");
    }

    #[test]
    fn only_commands_take_the_called_name() {
        let text = "Examples:\n  host fit a.csv && host flash b\n  host man | man -l -   # then: host-fit\nthe host program, `host vent`";
        let said = "Examples:\n  pam fit a.csv && pam flash b\n  pam man | man -l -   # then: pam-fit\nthe host program, `pam vent`";
        assert_eq!(in_text(text, "pam"), said);
    }

    #[test]
    fn the_help_of_an_option_takes_the_called_name() {
        let option = clap::Arg::new("with").long("with").help("`host effects` lists the names");
        let command = clap::Command::new("host").subcommand(clap::Command::new("diagnose").arg(option));
        let mut command = with_name(command, "pam");
        let help = command.find_subcommand_mut("diagnose").map(|c| c.render_help().to_string());
        assert!(help.is_some_and(|help| help.contains("`pam effects` lists")));
    }

    #[test]
    fn only_commands_of_a_page_take_the_called_name() {
        let page = "<td>host 7</td><p>the host, <code>host fit a.csv</code></p>";
        assert_eq!(in_code(page, "pam"), "<td>host 7</td><p>the host, <code>pam fit a.csv</code></p>");
    }
}
