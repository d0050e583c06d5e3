//! What the program says: results on standard output, everything else on standard error.

use std::fmt::Display;
use std::io::{IsTerminal, Write};

use pam_data::error::Error;

/// When messages are coloured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Colour {
    /// On a terminal only, and not where the environment variable `NO_COLOR` is set.
    OnTerminal,
    /// Always.
    Always,
    /// Never.
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

    /// A console that says nothing but errors, for use inside programs and tests.
    #[must_use]
    pub fn silent() -> Self {
        Self::new(true, false, Colour::Never)
    }

    /// Whether progress bars and live lines are welcome: somebody watches, and did not ask for quiet.
    #[must_use]
    pub fn live(&self) -> bool {
        !self.quiet && std::io::stderr().is_terminal()
    }

    /// Whether only results and errors are wanted.
    #[must_use]
    pub fn quiet(&self) -> bool {
        self.quiet
    }

    /// Whether details were asked for.
    #[must_use]
    pub fn verbose(&self) -> bool {
        self.verbose
    }

    /// A result, on standard output. A reader that stopped reading (`| head`) is no failure.
    pub fn result(&self, text: impl Display) {
        let _ = writeln!(std::io::stdout().lock(), "{text}");
    }

    /// A step done, on standard error.
    pub fn note(&self, text: impl Display) {
        if !self.quiet {
            let _ = writeln!(std::io::stderr().lock(), "{text}");
        }
    }

    /// A detail, on standard error, where `--verbose` asks for it.
    pub fn detail(&self, text: impl Display) {
        if self.verbose {
            let _ = writeln!(std::io::stderr().lock(), "{text}");
        }
    }

    /// Something that the user should know about a result, on standard error.
    pub fn warning(&self, text: impl Display) {
        if !self.quiet {
            let _ = writeln!(std::io::stderr().lock(), "{}: {text}", self.paint("33", "warning"));
        }
    }

    /// What went wrong, where, and what to do.
    pub fn error(&self, error: &Error) {
        let head = self.paint("31", &format!("error[{}]", error.code().name()));
        let mut text = format!("{head}: {}\n", error.cause());
        let place = error.place().to_string();
        if !place.is_empty() {
            text += &format!("   at: {place}\n");
        }
        if let Some(advice) = error.advice() {
            text += &format!("{}: {advice}\n", self.paint("36", " help"));
        }
        let _ = std::io::stderr().lock().write_all(text.as_bytes());
    }

    fn paint(&self, code: &str, text: &str) -> String {
        if self.colour { format!("\u{1b}[1;{code}m{text}\u{1b}[0m") } else { text.to_owned() }
    }
}
