//! Recordings beside each other in one table: the file is read once for each.

use std::path::Path;

use super::super::columns::Recording;
use super::super::import::Import;
use super::Reader;
use crate::error::{DataCode, Error, Result};

impl Reader<'_> {
    /// Reads each of the recordings by the description of its own columns.
    pub(super) fn side_by_side(
        &self,
        path: &Path,
        import: &Import,
        recordings: usize,
    ) -> Result<Vec<Recording>> {
        if std::fs::metadata(path).is_ok_and(|m| !m.is_file()) {
            return Err(Error::new(
                DataCode::CallInvalid,
                "recordings side by side are read one after the other, which needs a file",
            )
            .help("write the table into a file first"));
        }
        let mut all = Vec::new();
        for n in 0..recordings {
            let import = import.beside(n);
            let mut reader = Reader { import: Some(&import), ..self.clone() };
            if n > 0 {
                (reader.progress, reader.hashes) = (None, None);
            }
            let number = (n + 1).to_string();
            for mut recording in reader.open(path)? {
                recording.name += &format!(" [recording={number}]");
                recording.labels.push(("recording".to_owned(), number.clone()));
                all.push(recording);
            }
        }
        Ok(all)
    }
}
