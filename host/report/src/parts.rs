//! A report's pictures, their numbers and its summary as files of their own.

use std::path::{Path, PathBuf};

use super::page::Page;
use pam_data::error::{Error, Result};

impl Page {
    /// Writes every picture as `ID.svg` with its numbers as `ID.csv`, and the summary as `summary.md`, into a directory,
    /// which is made where it is missing. Returns the files written.
    ///
    /// # Errors
    /// [`pam_data::error::DataCode::FileUnwritable`].
    pub fn write_parts(&self, directory: impl AsRef<Path>) -> Result<Vec<PathBuf>> {
        let directory = directory.as_ref();
        std::fs::create_dir_all(directory).map_err(|e| Error::unwritable(directory, &e))?;
        let mut written = Vec::new();
        let mut write = |name: String, text: String| {
            let path = directory.join(name);
            pam_data::output::write_whole(&path, text.as_bytes())?;
            written.push(path);
            Ok(())
        };
        for figure in self.figures() {
            write(format!("{}.svg", figure.id), figure.svg())?;
            write(format!("{}.csv", figure.id), figure.csv())?;
        }
        write("summary.md".into(), self.markdown())?;
        Ok(written)
    }
}
