//! What the program says: results on standard output, everything else on standard error.

use std::borrow::Cow;
use std::fmt::Display;
use std::io::{IsTerminal, Write};
use std::sync::{Mutex, PoisonError};

use crate::program_name::in_called_name;
use pam_data::error::Error;
use pam_data::output::print;

/// Text whose control characters cannot act on a terminal: names come from files, and a file may hold anything. Ends of lines and
/// tabs stay; characters that change the direction of writing are escaped, too, because they make a name look like another one.
#[must_use]
pub fn printable(text: &str) -> Cow<'_, str> {
    let acts = |c: char| {
        (c.is_control() && !matches!(c, '\n' | '\t'))
            || matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    if !text.contains(acts) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if acts(c) { out.extend(c.escape_unicode()) } else { out.push(c) }
    }
    Cow::Owned(out)
}

/// Messages about commands, with the name by which the program was called.
fn said(text: impl Display) -> String {
    let text = in_called_name(text.to_string());
    match printable(&text) {
        Cow::Borrowed(_) => text,
        Cow::Owned(escaped) => escaped,
    }
}

/// A name from a file on one line: as [`printable`], and ends of lines are escaped as well.
#[must_use]
pub fn name(text: &str) -> String {
    printable(text).replace('\n', "\\n")
}

/// The first result that could not be printed. Results are printed in many places, and none of them could do anything about it.
static UNPRINTED: Mutex<Option<Error>> = Mutex::new(None);

/// Why a result is missing on standard output, if one is.
#[must_use]
pub fn unprinted() -> Option<Error> {
    UNPRINTED.lock().unwrap_or_else(PoisonError::into_inner).take()
}

/// When messages are coloured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Colour {
    /// On a terminal only, and not where the environment variable `NO_COLOR` is set.
    OnTerminal,
    /// Always, on a terminal or not.
    Always,
    /// Never, even on a terminal.
    Never,
}

/// Where messages go, and how many of them.
#[derive(Debug, Clone)]
pub struct Console {
    quiet: bool,
    verbose: bool,
    colour: bool,
}

impl Console {
    /// `quiet` drops notes and warnings; `verbose` adds details.
    #[must_use]
    pub fn new(quiet: bool, verbose: bool, colour: Colour) -> Self {
        let colour = match colour {
            Colour::Always => true,
            Colour::Never => false,
            Colour::OnTerminal => std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none(),
        };
        Self { quiet, verbose, colour }
    }

    /// A console that prints only errors, for use inside programs and tests.
    #[must_use]
    pub fn silent() -> Self {
        Self::new(true, false, Colour::Never)
    }

    /// Whether progress bars and live lines are shown: the console is interactive, and `--quiet` is not set.
    #[must_use]
    pub fn live(&self) -> bool {
        !self.quiet && std::io::stderr().is_terminal()
    }

    /// Whether only results and errors are requested.
    #[must_use]
    pub fn quiet(&self) -> bool {
        self.quiet
    }

    /// Whether details were requested.
    #[must_use]
    pub fn verbose(&self) -> bool {
        self.verbose
    }

    /// A result, on standard output. A reader that stopped reading (`| head`) is not a failure; any other failure is reported by
    /// [`unprinted`] when the command has ended.
    pub fn result(&self, text: impl Display) {
        if let Err(error) = print(format!("{}\n", said(text)).as_bytes()) {
            UNPRINTED.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        }
    }

    /// A step done, on standard error.
    pub fn note(&self, text: impl Display) {
        if !self.quiet {
            let _ = writeln!(std::io::stderr().lock(), "{}", said(text));
        }
    }

    /// A detail, on standard error, where `--verbose` requires it.
    pub fn detail(&self, text: impl Display) {
        if self.verbose {
            let _ = writeln!(std::io::stderr().lock(), "{}", said(text));
        }
    }

    /// A remark about a result, on standard error.
    pub fn warning(&self, text: impl Display) {
        if !self.quiet {
            let text = said(text);
            let _ = writeln!(std::io::stderr().lock(), "{}: {text}", self.paint("33", "warning"));
        }
    }

    /// What went wrong, where, and what to do.
    pub fn error(&self, error: &Error) {
        let label = self.paint("31", &format!("error[{}]", error.code().name()));
        let mut text = format!("{label}: {}\n", said(error.cause()));
        let place = error.place().to_string();
        if !place.is_empty() {
            text += &format!("   at: {}\n", printable(&place));
        }
        if let Some(advice) = error.advice() {
            text += &format!("{}: {}\n", self.paint("36", " help"), said(advice));
        }
        let _ = std::io::stderr().lock().write_all(text.as_bytes());
    }

    fn paint(&self, code: &str, text: &str) -> String {
        if self.colour { format!("\u{1b}[1;{code}m{text}\u{1b}[0m") } else { text.to_owned() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_printed_and_do_not_act() {
        assert_eq!(printable("a\u{1b}[2Jb\u{7}\u{9b}c\r"), "a\\u{1b}[2Jb\\u{7}\\u{9b}c\\u{d}");
        assert_eq!(printable("run\u{202e}vsc.exe"), "run\\u{202e}vsc.exe");
        assert!(matches!(printable("µ, °C,\tΔL\nnext"), Cow::Borrowed(_)));
        assert_eq!(name("mini\nwarning: none"), "mini\\nwarning: none");
    }
}
