//! A file that grows piece by piece and is at every moment a whole number of pieces: `NAME.part` until it is finished.

use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::recover::{Recovered, recover};
use pam_data::error::{Error, Result};

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
        let file = File::create(&part).map_err(|e| {
            Error::unwritable(&part, &e).help("check that the folder exists and may be written to")
        })?;
        // The lock shows other programs that this file still grows.
        let _ = file.try_lock();
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
                self.cut(self.whole);
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
        self.cut(self.whole);
        self.append(end)
    }

    fn cut(&mut self, length: u64) {
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
    fn what_was_cut_off_is_whole_again_and_replaces_nothing() {
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
