//! Files that hold named columns of numbers instead of text.

#[cfg(feature = "parquet")]
use std::fs::File;
use std::io::BufReader;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use super::column_table::{Column, ColumnTable, damaged};
use super::mcap::Needed;
use super::source::Source;
use super::{matlab, mcap, tdms};
use crate::bounds::{self, Budget};
use crate::error::{DataCode, Error, Result};

/// The kinds of containers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Container {
    Matlab5,
    Hdf5,
    Parquet,
    Mcap,
    Tdms,
    /// Not read, but named with what helps.
    RosBag,
    /// As a bag of ROS 1.
    Sqlite,
}

/// Columns, and remarks for the user.
pub(super) type Contents = (ColumnTable, Vec<String>);

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
        } else if magic.starts_with(tdms::MAGIC) {
            Some(Self::Tdms)
        } else if magic.starts_with(b"#ROSBAG V2.0") {
            Some(Self::RosBag)
        } else if magic.starts_with(b"SQLite format 3\0") {
            Some(Self::Sqlite)
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
            Self::Tdms => "TDMS",
            Self::RosBag => "bag",
            Self::Sqlite => "SQLite",
        }
    }

    fn columns(self, path: &Path, source: &mut Source, needed: Needed<'_>) -> Result<Contents> {
        let whole = |source: &mut Source| bounds::whole(path, &mut source.reader, bounds::WHOLE);
        let table = match self {
            Self::Mcap => {
                let reader = BufReader::with_capacity(1 << 18, &mut source.reader);
                return mcap::columns(reader, Budget::default(), needed);
            }
            Self::Tdms => return tdms::columns(&whole(source)?, Budget::whole()),
            Self::Matlab5 => matlab::columns(&whole(source)?, Budget::whole()),
            Self::RosBag => Err(Error::new(DataCode::RecordingContainer, "the file is a bag of ROS 1")
                .help("`mcap convert FILE.bag FILE.mcap` writes it as MCAP, which is read")),
            Self::Sqlite => Err(Error::new(DataCode::RecordingContainer, "the file is a database of SQLite")
                .help("if it is a bag of ROS 2, `mcap convert FILE.db3 FILE.mcap` or `ros2 bag convert` writes it as MCAP, which is read")),
            Self::Hdf5 | Self::Parquet if !source.rereadable => Err(Error::new(
                DataCode::FileUnreadable,
                format!("a {} file cannot be read from a pipe", self.name()),
            )
            .help("save it as a file first")),
            #[cfg(feature = "hdf5")]
            Self::Hdf5 => super::hdf5::columns(path),
            #[cfg(feature = "parquet")]
            Self::Parquet => super::parquet::columns(File::open(path).map_err(|e| Error::unreadable(path, &e))?),
            #[cfg(not(all(feature = "hdf5", feature = "parquet")))]
            _ => Err(Error::new(
                DataCode::RecordingContainer,
                format!("this build does not read {} files", self.name()),
            )
            .help("it was built without the features `hdf5` and `parquet`: build it with them, or export the data as CSV")),
        };
        Ok((table?, Vec::new()))
    }
}

/// The columns of a container, and what the user has to know of how they were made.
pub(super) fn columns(
    path: &Path,
    container: Container,
    source: &mut Source,
    needed: Needed<'_>,
) -> Result<Contents> {
    // A damaged file must end in an error, also where the reader of another library would rather panic.
    let (table, notes) = catch_unwind(AssertUnwindSafe(|| container.columns(path, source, needed)))
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
    Ok((table, notes))
}

#[cfg(test)]
mod tests;
