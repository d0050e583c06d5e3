//! A file that grows piece by piece and is at every moment a whole number of pieces: `NAME.part` until it is finished.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::recover::{Recovered, recover};
use pam_data::error::{DataCode, Error, Result};

/// A file on its way to its name.
#[derive(Debug)]
pub(super) struct Part {
    path: PathBuf,
    part: PathBuf,
    file: File,
    /// Where the pieces end that are whole, and where the last of them begins.
    whole: u64,
    last: u64,
}

impl Part {
    /// Begins `path`. What an earlier program left unfinished there is given a name of its own first.
    pub fn create(path: &Path) -> Result<(Self, Option<Recovered>)> {
        let part = part_of(path);
        let recovered = if part.exists() { Some(recover(&part)?) } else { None };
        // Never one that is there: it would be that of another program which began in the meantime.
        let file =
            OpenOptions::new().write(true).create_new(true).open(&part).map_err(|e| match e.kind() {
                std::io::ErrorKind::AlreadyExists => in_use(&part),
                _ => Error::unwritable(&part, &e).help("check that the folder exists and may be written to"),
            })?;
        // The lock shows other programs that this file still grows. Before it, another one may have removed the file as an empty one.
        if matches!(file.try_lock(), Err(TryLockError::WouldBlock)) || !is_at(&file, &part) {
            return Err(in_use(&part));
        }
        Ok((Self { path: path.to_owned(), part, file, whole: 0, last: 0 }, recovered))
    }

    /// Adds a piece. One that does not fit is taken back, so that the file ends with the piece before.
    pub fn append(&mut self, piece: &[u8]) -> std::io::Result<()> {
        match self.file.write_all(piece) {
            Ok(()) => {
                self.last = self.whole;
                self.whole += piece.len() as u64;
                Ok(())
            }
            Err(reason) => {
                self.truncate(self.whole);
                Err(reason)
            }
        }
    }

    /// Writes `end` although the disk is full: where there is no room for it, the last piece makes room.
    pub fn append_end(&mut self, end: &[u8]) -> std::io::Result<()> {
        let first = self.append(end);
        if first.is_ok() {
            return Ok(());
        }
        self.whole = self.last;
        self.truncate(self.whole);
        self.append(end)
    }

    fn truncate(&mut self, length: u64) {
        // A file that can neither be written nor shortened is left as it is; its reader ends at the last whole piece.
        let _ = self.file.set_len(length);
        let _ = self.file.seek(SeekFrom::Start(length));
    }

    /// Gives the file its name.
    pub fn finish(self) -> Result<PathBuf> {
        self.file.sync_all().map_err(|e| Error::unwritable(&self.part, &e))?;
        std::fs::rename(&self.part, &self.path).map_err(|e| Error::unwritable(&self.path, &e))?;
        Ok(self.path)
    }

    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// The error where another program records to the same file.
pub(super) fn in_use(part: &Path) -> Error {
    Error::new(DataCode::FileUnwritable, "another program is recording to this file")
        .file(part)
        .help("end that one first, or give this recording another name with -o")
}

/// Whether an open file is the one that has this name.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let identity = |metadata: std::io::Result<std::fs::Metadata>| metadata.ok().map(|m| (m.dev(), m.ino()));
    identity(file.metadata()).is_some_and(|open| identity(std::fs::symlink_metadata(path)) == Some(open))
}

/// Elsewhere an open file cannot be removed.
#[cfg(not(unix))]
fn is_at(_: &File, _: &Path) -> bool {
    true
}

/// The name of a file while it grows.
pub(super) fn part_of(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".part");
    PathBuf::from(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_programs_that_begin_the_same_file_at_the_same_time_one_gets_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.csv");
        for round in 0..200 {
            let barrier = std::sync::Barrier::new(4);
            let got: Vec<String> = std::thread::scope(|scope| {
                let begin = |program: usize| {
                    let (barrier, path) = (&barrier, &path);
                    scope.spawn(move || {
                        barrier.wait();
                        let part = Part::create(path);
                        // All have tried before one ends.
                        barrier.wait();
                        let (mut part, _) = part.ok()?;
                        let text = format!("{round} {program}\n");
                        part.append(text.as_bytes()).unwrap();
                        part.finish().unwrap();
                        Some(text)
                    })
                };
                let programs: Vec<_> = (0..4).map(begin).collect();
                programs.into_iter().filter_map(|program| program.join().unwrap()).collect()
            });
            assert!(got.len() <= 1, "round {round}: {got:?}");
            // Where all were in each other's way, none got it, and the next round restarts.
            if let Some(text) = got.first() {
                assert_eq!(&std::fs::read_to_string(&path).unwrap(), text);
            }
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_prepared_link_is_not_written_through() {
        let folder = tempfile::tempdir().unwrap();
        let (path, other) = (folder.path().join("run.csv"), folder.path().join("other"));
        std::os::unix::fs::symlink(&other, part_of(&path)).unwrap();
        assert!(Part::create(&path).is_err());
        assert!(!other.exists());
    }

    #[test]
    fn a_cut_recording_is_completed_and_replaces_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.csv");
        std::fs::write(&path, "an earlier recording\n").unwrap();
        std::fs::write(part_of(&path), "time_s,b\n1,2\n3,").unwrap();
        let (mut part, recovered) = Part::create(&path).unwrap();
        let recovered = recovered.unwrap();
        let recording = recovered.recording.clone().unwrap();
        assert_eq!(recording.file_name().unwrap(), "run.rescued-1.csv");
        assert_eq!(std::fs::read_to_string(&recording).unwrap(), "time_s,b\n1,2\n");
        assert_eq!(std::fs::read_to_string(recovered.original.unwrap()).unwrap(), "time_s,b\n1,2\n3,");
        assert_eq!((recovered.tally.bytes_lost, recovered.tally.samples_lost), (2, 1));
        part.append(b"new\n").unwrap();
        assert!(recover(&part_of(&path)).unwrap_err().cause().contains("another program"));
        part.finish().unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "new\n");
        std::fs::write(part_of(&path), "").unwrap();
        assert_eq!(recover(&part_of(&path)).unwrap().recording, None);
    }
}
