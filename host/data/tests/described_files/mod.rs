//! Files of a bench with the import description that `guess_among` writes for them.
#![allow(clippy::unwrap_used)] // what fails here fails the test

use std::path::PathBuf;

use pam_data::recording::Import;
use pam_data::recording::import_guess::{Guess, guess_among};
use tempfile::TempDir;

/// Files in a folder, which goes with this value.
pub struct DescribedFiles {
    pub guess: Guess,
    /// The description, as a reader takes it.
    pub import: Import,
    pub paths: Vec<PathBuf>,
    _folder: TempDir,
}

/// Writes files of these names and lets one description be found for all of them, from the first.
pub fn describe(files: &[(&str, impl AsRef<[u8]>)]) -> DescribedFiles {
    let folder = tempfile::tempdir().unwrap();
    let paths: Vec<PathBuf> = files.iter().map(|(name, _)| folder.path().join(name)).collect();
    for (path, (_, bytes)) in paths.iter().zip(files) {
        std::fs::write(path, bytes).unwrap();
    }
    let guess = guess_among(&paths[0], &paths[1..], None).unwrap();
    let import = Import::parse(&guess.description).unwrap_or_else(|e| panic!("{}: {e}", guess.description));
    DescribedFiles { guess, import, paths, _folder: folder }
}
