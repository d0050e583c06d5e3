//! Bounds on what a file may make this program take into memory: 1 GiB in all, regardless of the sizes that the file states.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::error::{DataCode, Error, Result};

/// Values of one campaign, 8 bytes each: 400 MB, so that the columns of a file and their conversion to SI stay under 1 GiB. Force,
/// pressure, stroke and time at 1 kHz fill them in three and a half hours.
pub(crate) const VALUES: usize = 48 << 20;
/// Bytes of a container that is taken into memory whole, packed or unpacked. Its readers hold up to four copies of a value at a time:
/// as stored, as a number, as a matrix and as a column.
pub const WHOLE: u64 = 128 << 20;
/// Bytes of a description, a table of names, settings: text written by hand.
pub const WRITTEN: u64 = 16 << 20;

/// Values that may still be taken.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Budget {
    left: usize,
    all: usize,
}

impl Default for Budget {
    fn default() -> Self {
        Self::new(VALUES)
    }
}

impl Budget {
    /// For a number of values.
    #[must_use]
    pub(crate) fn new(values: usize) -> Self {
        Self { left: values, all: values }
    }

    /// For the values of a container that is taken into memory whole.
    #[must_use]
    pub(crate) fn whole() -> Self {
        Self::new(WHOLE as usize / size_of::<f64>())
    }

    /// Takes a number of bytes.
    ///
    /// # Errors
    /// [`DataCode::FileUnreadable`] where there are not as many left.
    pub(crate) fn take(&mut self, values: usize) -> Result<()> {
        match self.left.checked_sub(values) {
            Some(left) => {
                self.left = left;
                Ok(())
            }
            None => Err(Error::new(
                DataCode::FileUnreadable,
                format!("there are more than {} million values", self.all >> 20),
            )
            .help("leave columns out, split the recording, or record fewer samples per second")),
        }
    }
}

/// The bytes of a file of at most `limit` bytes; a device or a pipe that gives more is refused, too.
///
/// # Errors
/// [`DataCode::FileUnreadable`].
pub fn read(path: &Path, limit: u64) -> Result<Vec<u8>> {
    let unreadable = |e: std::io::Error| Error::unreadable(path, &e);
    let file = File::open(path).map_err(unreadable)?;
    if file.metadata().map_err(unreadable)?.is_dir() {
        return Err(Error::new(DataCode::FileUnreadable, "is a folder").file(path).help("name a file in it"));
    }
    whole(path, file, limit)
}

/// The bytes of an open file, as [`read`].
///
/// # Errors
/// As [`read`].
pub fn whole(path: &Path, reader: impl Read, limit: u64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    reader.take(limit + 1).read_to_end(&mut bytes).map_err(|e| Error::unreadable(path, &e))?;
    if bytes.len() as u64 > limit {
        return Err(Error::new(
            DataCode::FileUnreadable,
            format!("is larger than {} MiB, which no file of this kind is", limit >> 20),
        )
        .file(path)
        .help("is it the right file?"));
    }
    Ok(bytes)
}

/// As [`read`], for text in UTF-8; `Ok(Err(()))` where it is none.
///
/// # Errors
/// As [`read`].
pub fn read_text(path: &Path, limit: u64) -> Result<std::result::Result<String, ()>> {
    Ok(String::from_utf8(read(path, limit)?).map_err(|_| ()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_never_ends_is_given_up_at_the_limit() {
        let error = read(Path::new("/dev/zero"), 1 << 20).expect_err("it never ends");
        assert_eq!(error.code(), DataCode::FileUnreadable);
        assert_eq!(read(Path::new("/dev/null"), 0).expect("empty"), Vec::<u8>::new());
    }

    #[test]
    fn a_budget_ends_at_its_limit() {
        let mut budget = Budget::new(5);
        assert!(budget.take(5).is_ok() && budget.take(0).is_ok() && budget.take(1).is_err());
        assert!(Budget::default().take(usize::MAX).is_err());
    }
}
