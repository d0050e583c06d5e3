//! Where a command writes its report: the same options wherever there is one.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::console::Console;
use crate::program_name::{self, in_page};
use pam_data::error::Result;
use pam_data::output::write_whole;
use pam_data::pluralise::pluralise;
use pam_fit::table_file;
use pam_report::{Page, Provenance};

/// What to write of a report.
#[derive(Debug, Clone, Default, Args)]
pub struct Reports {
    /// Write a report with pictures: one HTML file that needs no other.
    #[arg(long, value_name = "F.html")]
    pub report: Option<PathBuf>,
    /// Write every picture as SVG, its numbers as CSV, and a summary in Markdown, into a folder.
    #[arg(long, value_name = "FOLDER")]
    pub figures: Option<PathBuf>,
}

impl Reports {
    /// Whether anything is requested.
    #[must_use]
    pub fn wanted(&self) -> bool {
        self.report.is_some() || self.figures.is_some()
    }

    /// Where the report goes, if it is requested.
    #[must_use]
    pub fn file(&self) -> Option<&Path> {
        self.report.as_deref()
    }

    /// Writes what is requested, with its provenance; `page` is called only then.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, console: &Console, from: &Provenance, page: impl FnOnce() -> Page) -> Result<()> {
        if !self.wanted() {
            return Ok(());
        }
        let mut page = page();
        page.provenance(from);
        if let Some(path) = &self.report {
            write_whole(path, in_page(page.html()).as_bytes())?;
            console.detail(format!("report in {}", path.display()));
        }
        if let Some(folder) = &self.figures {
            let files = page.write_parts(folder)?;
            console.detail(format!("{} in {}", pluralise(files.len(), "file"), folder.display()));
        }
        Ok(())
    }
}

/// The provenance of a report of this call: its command line and the version of the program.
#[must_use]
pub(super) fn provenance() -> Provenance {
    let arguments: Vec<String> = std::env::args().skip(1).map(|argument| quoted(&argument)).collect();
    Provenance {
        command: format!("{} {}", program_name::called(), arguments.join(" ")),
        program: format!("host {}", env!("CARGO_PKG_VERSION")),
        ..Provenance::default()
    }
}

/// The provenance of a report of this call that is made from some files. A pipe was read already, and has no hash here.
#[must_use]
pub(super) fn of_files(files: &[PathBuf]) -> Provenance {
    let hashed = |file: &PathBuf| {
        let whole = std::fs::metadata(file).is_ok_and(|m| m.is_file());
        whole.then(|| table_file::sha256(file).ok()).flatten().map(|hash| (file.clone(), hash))
    };
    Provenance { files: files.iter().filter_map(hashed).collect(), ..provenance() }
}

/// An argument of a command line as a shell reads it back.
fn quoted(argument: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./:=,+@%".contains(c);
    if !argument.is_empty() && argument.chars().all(plain) {
        argument.to_owned()
    } else {
        format!("'{}'", argument.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::quoted;

    #[test]
    fn arguments_are_quoted_where_a_shell_would_change_them() {
        assert_eq!(quoted("--where=run=1,2"), "--where=run=1,2");
        assert_eq!(quoted("my muscle.csv"), "'my muscle.csv'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
        assert_eq!(quoted(""), "''");
    }
}
