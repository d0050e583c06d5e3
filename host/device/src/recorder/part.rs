//! A file that grows piece by piece and is at every moment a whole number of pieces: `NAME.part` until it is finished.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::mcap;
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
    pub fn create(path: &Path) -> Result<(Self, Option<PathBuf>)> {
        let part = part_of(path);
        let rescued = if part.exists() { rescue(&part)? } else { None };
        let file = File::create(&part).map_err(|e| {
            Error::unwritable(&part, &e).help("check that the folder exists and may be written to")
        })?;
        // Whoever finds this file must be able to tell that it still grows.
        let _ = file.try_lock();
        Ok((Self { path: path.to_owned(), part, file, whole: 0, last: 0 }, rescued))
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

/// Makes a whole recording of one that was cut off: takes away the piece that was begun, gives the file its end, and a name
/// that no other file has. Gives that name, or `None` when nothing was recorded yet (then the file is removed).
///
/// # Errors
/// [`DataCode::CallInvalid`] when it is no `.part`, [`DataCode::FileUnreadable`], [`DataCode::FileUnwritable`] also when it still grows.
pub fn rescue(part: &Path) -> Result<Option<PathBuf>> {
    let text = part.to_string_lossy();
    let Some(path) = text.strip_suffix(".part").map(PathBuf::from) else {
        return Err(Error::new(DataCode::CallInvalid, "this is no recording that was cut off")
            .file(part)
            .help("such a file is named RECORDING.part; any other can be used as it is"));
    };
    let unreadable = |e| Error::unreadable(part, &e);
    let unwritable = |e| Error::unwritable(part, &e);
    let mut file = OpenOptions::new().read(true).write(true).open(part).map_err(unreadable)?;
    if matches!(file.try_lock(), Err(TryLockError::WouldBlock)) {
        return Err(Error::new(DataCode::FileUnwritable, "another program is recording to this file")
            .file(part)
            .help("end that one first, or give this recording another name with -o"));
    }
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(unreadable)?;
    let (whole, end): (usize, &[u8]) = if bytes.starts_with(mcap::MAGIC) {
        (mcap::whole(&bytes), &mcap::END)
    } else {
        (bytes.iter().rposition(|b| *b == b'\n').map_or(0, |at| at + 1), &[])
    };
    if whole == 0 {
        std::fs::remove_file(part).map_err(unwritable)?;
        return Ok(None);
    }
    file.set_len(whole as u64).map_err(unwritable)?;
    file.seek(SeekFrom::Start(whole as u64)).map_err(unwritable)?;
    file.write_all(end).and_then(|()| file.sync_all()).map_err(unwritable)?;
    drop(file);
    let name = free_name(&path);
    std::fs::rename(part, &name).map_err(unwritable)?;
    // What was known when the recording began stands beside it.
    let side = super::side_file(part);
    if side.exists() {
        std::fs::rename(&side, super::side_file(&name)).map_err(|e| Error::unwritable(&side, &e))?;
    }
    Ok(Some(name))
}

/// `path`, or where that is taken `NAME.rescued-N.EXTENSION`.
fn free_name(path: &Path) -> PathBuf {
    let extension = path.extension().map(|e| format!(".{}", e.to_string_lossy())).unwrap_or_default();
    let mut name = path.to_owned();
    let mut number = 0;
    while name.exists() {
        number += 1;
        name = path.with_extension("");
        let stem = name.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        name.set_file_name(format!("{stem}.rescued-{number}{extension}"));
    }
    name
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_cut_off_is_whole_again_and_replaces_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.csv");
        std::fs::write(&path, "an earlier recording\n").unwrap();
        std::fs::write(part_of(&path), "a,b\n1,2\n3,").unwrap();
        let (mut part, rescued) = Part::create(&path).unwrap();
        let rescued = rescued.unwrap();
        assert_eq!(rescued.file_name().unwrap(), "run.rescued-1.csv");
        assert_eq!(std::fs::read_to_string(&rescued).unwrap(), "a,b\n1,2\n");
        part.append(b"new\n").unwrap();
        assert!(rescue(&part_of(&path)).unwrap_err().cause().contains("another program"));
        part.finish().unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "new\n");
        assert_eq!(rescue(&path).unwrap_err().exit_status(), 2);
        std::fs::write(part_of(&path), "a,").unwrap();
        assert_eq!(rescue(&part_of(&path)).unwrap(), None);
    }
}
