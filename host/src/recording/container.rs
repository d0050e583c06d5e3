//! Files that hold named columns of numbers instead of text: MATLAB and Parquet.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use super::blocks::Rows;
use super::cells::{Want, Words};
use super::read::Reader;
use super::{Recording, matlab, mcap};
use crate::error::{Code, Error, Result};

/// Named columns as they stand in a file, not yet in SI.
pub(super) type Columns = Vec<(String, Cells)>;

/// One column of a container.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Cells {
    Numbers(Vec<f64>),
    /// Only Parquet columns hold text.
    #[cfg_attr(not(feature = "parquet"), allow(dead_code))]
    Texts(Vec<String>),
}

impl Cells {
    fn len(&self) -> usize {
        match self {
            Self::Numbers(n) => n.len(),
            Self::Texts(t) => t.len(),
        }
    }
}

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
    pub fn of(magic: &[u8]) -> Option<Self> {
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

    fn columns(self, path: &Path) -> Result<Columns> {
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
                Code::RecordingContainer,
                format!("this build does not read {} files", self.name()),
            )
            .help("build the host with the features `hdf5` and `parquet`, or export the data as CSV")),
        }
    }
}

/// A failure inside a container, in the words of whoever read it.
pub(super) fn damaged(what: impl std::fmt::Display) -> Error {
    Error::new(Code::RecordingContainer, what.to_string())
}

/// Reads a container and makes recordings of it by the same rules as of text. Where text errors name a line, these name the
/// row, counted from 1.
pub(super) fn read(reader: &Reader<'_>, path: &Path, container: Container) -> Result<Vec<Recording>> {
    let description = reader.description();
    // A damaged file must end in an error, also where the reader of a foreign format would rather panic.
    let columns = catch_unwind(AssertUnwindSafe(|| container.columns(path)))
        .unwrap_or_else(|_| Err(damaged("the file is damaged beyond what its reader expects")))
        .map_err(|e| {
            if e.code() == Code::RecordingContainer && !e.advised() {
                let cause = format!("no usable {} file: {}", container.name(), e.cause());
                Error::new(Code::RecordingContainer, cause).help("save it again, or export the data as CSV")
            } else {
                e
            }
        })?;
    if columns.is_empty() {
        return Err(damaged("there is no column of numbers in the file")
            .help("columns are vectors with names and units"));
    }
    let names: Vec<String> = columns.iter().map(|(n, _)| n.clone()).collect();
    let layout = reader.layout(path, &names, &description, "")?;
    let rows = select(columns, &layout.plan.wanted)?;
    reader.finish(path, &description, &names, &layout, 1, rows)
}

fn select(columns: Columns, wanted: &[super::cells::Wanted]) -> Result<Rows> {
    let mut rows = Rows::default();
    let mut length: Option<(usize, &str)> = None;
    for wanted in wanted {
        let Some((name, cells)) = columns.get(wanted.index) else { continue };
        match length {
            Some((n, first)) if n != cells.len() => {
                return Err(Error::new(
                    Code::RecordingWrongWidth,
                    format!("`{name}` has {} rows and `{first}` has {n}", cells.len()),
                )
                .help("all columns of a recording are equally long"));
            }
            _ => length = Some((cells.len(), name)),
        }
        let (mut numbers, mut words) = (Vec::new(), Words::default());
        match (wanted.want, cells) {
            (Want::Number { scale, offset }, Cells::Numbers(values)) => {
                if let Some(row) = values.iter().position(|v| !v.is_finite()) {
                    return Err(Error::new(Code::RecordingNotFinite, "not a finite number")
                        .line(row as u64 + 1)
                        .column(name)
                        .value(values[row].to_string())
                        .help("leave such rows out; missing values are not filled in silently"));
                }
                numbers = values.iter().map(|v| v * scale + offset).collect();
            }
            (Want::Number { .. }, Cells::Texts(texts)) => {
                return Err(Error::new(
                    Code::RecordingNotANumber,
                    "a column of text where numbers are needed",
                )
                .column(name)
                .value(texts.first().map_or("", String::as_str))
                .help("save the column as numbers"));
            }
            (Want::Text, Cells::Numbers(values)) => values.iter().for_each(|v| words.push(&v.to_string())),
            (Want::Text, Cells::Texts(texts)) => texts.iter().for_each(|t| words.push(t)),
        }
        rows.numbers.push(numbers);
        rows.texts.push(words);
    }
    rows.rows = length.map_or(0, |(n, _)| n);
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The fixtures are made by `fixtures/make.py` with SciPy, h5py and polars; all hold the same 40 rows.
    fn fixture(name: &str) -> std::path::PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)
    }

    #[test]
    fn every_container_gives_the_rows_of_the_text() {
        let text = Reader::new().file(&fixture("recording.csv")).unwrap();
        let mut names = vec![
            "recording_v5.mat",
            "recording_v5_packed.mat",
            "recording_struct.mat",
            "recording.csv.gz",
            "recording.csv.zst",
            "recording.tsv",
        ];
        if cfg!(feature = "hdf5") {
            names.push("recording_v73.mat");
        }
        if cfg!(feature = "parquet") {
            names.extend(["recording_zstd.parquet", "recording_snappy.parquet"]);
        }
        for name in names {
            let read = Reader::new().file(&fixture(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_eq!(read.len(), 1, "{name}");
            let close = |a: &[f64], b: &[f64]| {
                a.len() == b.len() && a.iter().zip(b).all(|(x, y)| (x - y).abs() <= 1e-12 * x.abs().max(1e-6))
            };
            assert!(close(&read[0].time, &text[0].time), "{name}");
            assert!(close(&read[0].pressure, &text[0].pressure), "{name}");
            assert!(close(&read[0].stroke, &text[0].stroke), "{name}");
            assert!(close(read[0].require_force().unwrap(), text[0].require_force().unwrap()), "{name}");
        }
    }

    #[test]
    fn damaged_containers_are_errors() {
        let folder = tempfile::tempdir().unwrap();
        let mut names = vec!["recording_v5.mat", "recording_v5_packed.mat"];
        if cfg!(feature = "hdf5") {
            names.push("recording_v73.mat");
        }
        if cfg!(feature = "parquet") {
            names.push("recording_zstd.parquet");
        }
        for name in names {
            let whole = std::fs::read(fixture(name)).unwrap();
            for cut in [130, 300, whole.len() / 4, whole.len() / 2] {
                let path = folder.path().join(name);
                std::fs::write(&path, &whole[..cut.min(whole.len())]).unwrap();
                // A cut may leave whole columns; then a required one is missing.
                let error = Reader::new().file(&path).expect_err(name);
                assert_eq!(error.exit_status(), 1, "{name} cut at {cut}: {error}");
            }
        }
    }
}
