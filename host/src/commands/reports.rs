//! Where a command writes its report: the same options wherever there is one.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::console::Console;
use pam_data::error::Result;
use pam_data::output::write_whole;
use pam_data::pluralise::pluralise;
use pam_report::Page;

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

    /// Writes what is requested; `page` is called only then.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, console: &Console, page: impl FnOnce() -> Page) -> Result<()> {
        if !self.wanted() {
            return Ok(());
        }
        let page = page();
        if let Some(path) = &self.report {
            write_whole(path, page.html().as_bytes())?;
            console.detail(format!("report in {}", path.display()));
        }
        if let Some(folder) = &self.figures {
            let files = page.write_parts(folder)?;
            console.detail(format!("{} in {}", pluralise(files.len(), "file"), folder.display()));
        }
        Ok(())
    }
}
