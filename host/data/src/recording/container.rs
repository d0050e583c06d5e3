//! Files that hold named columns of numbers instead of text: MATLAB and Parquet.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use super::column_table::{Column, ColumnTable, damaged};
use super::{matlab, mcap};
use crate::error::{DataCode, Error, Result};

/// The kinds of containers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Container {
    Matlab5,
    Hdf5,
    Parquet,
    Mcap,
}

impl Container {
    /// Recognises a container by its first bytes. An HDF5 file may begin with 512 bytes of the user's own; MATLAB's says so.
    pub(super) fn of(magic: &[u8]) -> Option<Self> {
        if magic.starts_with(b"MATLAB 5.0 MAT-file") {
            Some(Self::Matlab5)
        } else if magic.starts_with(b"MATLAB 7.3 MAT-file") || magic.starts_with(b"\x89HDF\r\n\x1a\n") {
            Some(Self::Hdf5)
        } else if magic.starts_with(b"PAR1") {
            Some(Self::Parquet)
        } else if magic.starts_with(mcap::MAGIC) {
            Some(Self::Mcap)
        } else {
            None
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Matlab5 => "MATLAB",
            Self::Hdf5 => "MATLAB 7.3 or HDF5",
            Self::Parquet => "Parquet",
            Self::Mcap => "MCAP",
        }
    }

    fn columns(self, path: &Path) -> Result<ColumnTable> {
        let mut file = File::open(path).map_err(|e| Error::unreadable(path, &e))?;
        match self {
            Self::Matlab5 | Self::Mcap => {
                let mut bytes = Vec::new();
                file.seek(SeekFrom::Start(0)).map_err(|e| Error::unreadable(path, &e))?;
                file.read_to_end(&mut bytes).map_err(|e| Error::unreadable(path, &e))?;
                if self == Self::Mcap { mcap::columns(&bytes) } else { matlab::columns(&bytes) }
            }
            #[cfg(feature = "hdf5")]
            Self::Hdf5 => super::hdf5::columns(path),
            #[cfg(feature = "parquet")]
            Self::Parquet => super::parquet::columns(file),
            #[cfg(not(all(feature = "hdf5", feature = "parquet")))]
            _ => Err(Error::new(
                DataCode::RecordingContainer,
                format!("this build does not read {} files", self.name()),
            )
            .help("it was built without the features `hdf5` and `parquet`: build it with them, or export the data as CSV")),
        }
    }
}

/// The columns of a container.
pub(super) fn columns(path: &Path, container: Container) -> Result<ColumnTable> {
    // A damaged file must end in an error, also where the reader of a foreign format would rather panic.
    let table = catch_unwind(AssertUnwindSafe(|| container.columns(path)))
        .unwrap_or_else(|_| Err(damaged("the file is damaged beyond what its reader expects")))
        .map_err(|e| {
            if e.code() == DataCode::RecordingContainer && !e.advised() {
                let cause = format!("no usable {} file: {}", container.name(), e.cause());
                Error::new(DataCode::RecordingContainer, cause)
                    .help("save it again, or export the data as CSV")
            } else {
                e
            }
        })?;
    let useless = |column: &Column| matches!(column, Column::Other(_));
    if table.iter().all(|(_, c)| useless(c)) {
        let mut cause = "there is no column of numbers in the file".to_owned();
        if let Some((name, Column::Other(what))) = table.first() {
            cause += &format!(": `{name}` holds {what}");
        }
        return Err(damaged(cause).help(
            "columns are vectors of numbers with names and units, such as `pressure_kPa`; a MATLAB table becomes a struct \
             of vectors by `table2struct(T, 'ToScalar', true)`",
        ));
    }
    Ok(table)
}

#[cfg(test)]
mod tests;
