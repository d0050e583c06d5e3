//! The table file `*.pam`: the controller's image, and what a user wants to know about it later.
//!
//! ```text
//! "PAMF"  version u16 LE  0 u16  length u32 LE  body (postcard of [`TableFile`]'s parts)  CRC-32 u32 LE over all before
//! ```
//! The controller's part lies inside as its own image ([`model_core::image`]), with its own version and checksum: what a
//! controller is sent is byte for byte what the file holds. The rest stays with the host.

use std::fs;
use std::path::{Path, PathBuf};

use model_core::check;
use model_core::image;
use model_core::table::MuscleTable;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::beginning::Beginning;
use crate::fit::dimensions::Mounting;
use crate::fit::problem::Problem;
use crate::vented_rest::EarlierLoad;
use pam_data::bounds;
use pam_data::error::{DataCode, Error, Result};
use pam_data::file_kind::FileKind;
use pam_data::output::write_whole;
use pam_data::recording::Campaign;

const MAGIC: [u8; 4] = *b"PAMF";
/// The version that is written.
pub const VERSION: u16 = 4;
/// Versions before, which are read too, and what postcard writes for the last fields that they lack: [`About::beginning`], and
/// [`About::earlier_load`] before it.
const EARLIER: [(u16, &[u8]); 2] = [(3, &[0, 0]), (2, &[0, 0, 0])];
const HEADER: usize = 12;
const CHECKSUM: usize = 4;
/// A file that announces more is not read: no table comes near it.
const MAX_BODY: usize = 16 << 20;

/// A table with its history.
#[derive(Debug, Clone, PartialEq)]
pub struct TableFile {
    /// The table as the controller gets it.
    pub table: MuscleTable,
    /// What stays with the host.
    pub about: About,
}

/// Where a table comes from and how good it is.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// The name of the muscle description.
    pub muscle: String,
    /// When the table was made, ISO 8601 in UTC.
    pub date: String,
    /// The program that made it, with its version.
    pub tool: String,
    /// The recordings of the fit.
    pub sources: Vec<Source>,
    /// How well it fits them.
    pub fit: FitQuality,
    /// How uncertain its numbers are; `None` where nothing was estimated.
    pub uncertainty: Option<Uncertainty>,
    /// Corrections of the bench that the recordings were made on. `predict` applies them; a controller never sees them.
    pub corrections: Vec<Correction>,
    /// Mountings whose recordings were held at one length. `predict` adds the correction to recordings of the same mounting.
    pub mountings: Vec<StoredMounting>,
    /// What the muscle had carried before the recordings of the fit. `predict` counts it before recordings at held lengths.
    pub earlier_load: Option<EarlierLoad>,
    /// How recordings begin, for effects with a memory. `predict` counts it before each; a controller follows the muscle from one to the next.
    pub beginning: Beginning,
}

/// A mounting whose recordings were held at one length.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct StoredMounting {
    /// What the recordings' file calls it; empty where it has no label.
    pub label: String,
    /// The stroke as recorded, m.
    pub stroke: f64,
    /// What is to be added to it, m.
    pub offset: f64,
}

/// One file that a table was fitted to.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Source {
    /// The path as given on the command line.
    pub path: String,
    /// SHA-256 of its bytes, in hexadecimal.
    pub sha256: String,
    /// Rows used of it.
    pub samples: u64,
}

/// The figures of merit of a fit.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct FitQuality {
    /// Samples fitted.
    pub samples: u64,
    /// Root mean square of force residuals, N.
    pub rms_newtons: f64,
    /// Mean error by the thesis's eq. 24, percent of blocked force.
    pub mean_error_percent: f64,
    /// Largest error by eq. 24, percent of blocked force.
    pub max_error_percent: f64,
    /// Mean error when each pressure is predicted from the others; `None` where there is but one.
    pub left_out_percent: Option<f64>,
    /// What the fit warned of.
    pub warnings: Vec<String>,
}

/// A square root of the covariance of the table's numbers: `C = S Sᵀ`.
///
/// Rows are the numbers in the order `P0`, then `E_1` at every node, `E_2` …, then `k_F` at every node; SI units.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Uncertainty {
    /// Numbers in the table, the rows of `S`.
    pub rows: u32,
    /// Columns of `S`.
    pub columns: u32,
    /// `S`, row after row.
    pub root: Vec<f64>,
    /// Standard deviation of what the table does not describe, as seen in its own residuals, N.
    pub residual_newtons: f64,
}

/// A correction of the bench, by its catalogue name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Correction {
    /// The effect's name, as `host diagnose` prints it.
    pub effect: String,
    /// Its parameters in SI units, in the order of the effect's list.
    pub parameters: Vec<f64>,
}

#[derive(Serialize, Deserialize)]
struct Body {
    image: Vec<u8>,
    about: About,
}

impl TableFile {
    /// The bytes of the file.
    ///
    /// # Errors
    /// [`DataCode::TableInvalid`] where a number of the table cannot be used.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let mut buffer = [0; image::MAX_LEN];
        let image = image::write(&self.table, &mut buffer)
            .map_err(|e| Error::new(DataCode::TableInvalid, e.to_string()))?
            .to_vec();
        let body = postcard::to_stdvec(&Body { image, about: self.about.clone() })
            .map_err(|e| Error::new(DataCode::TableInvalid, format!("the table cannot be encoded: {e}")))?;
        let length = u32::try_from(body.len()).ok().filter(|_| body.len() <= MAX_BODY).ok_or_else(|| {
            Error::new(DataCode::TableInvalid, "the table's history is too long for a file")
        })?;
        let mut bytes = Vec::with_capacity(HEADER + body.len() + CHECKSUM);
        bytes.extend_from_slice(&MAGIC);
        bytes.extend_from_slice(&VERSION.to_le_bytes());
        bytes.extend_from_slice(&[0, 0]);
        bytes.extend_from_slice(&length.to_le_bytes());
        bytes.extend_from_slice(&body);
        let crc = check::crc32(&bytes);
        bytes.extend_from_slice(&crc.to_le_bytes());
        Ok(bytes)
    }

    /// Reads a file's bytes and looks at every number.
    ///
    /// # Errors
    /// [`DataCode::TableInvalid`], saying what is wrong with the bytes.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let wrong = |cause: String| Error::new(DataCode::TableInvalid, cause);
        let damaged = "the file was damaged or cut short; copy it again or fit the muscle again";
        if bytes.len() < HEADER || bytes[..4] != MAGIC {
            return Err(wrong("this is not a table file".into())
                .help("tables end in .pam and are written by `host fit` or `host diagnose`"));
        }
        let found = u16::from_le_bytes([bytes[4], bytes[5]]);
        let earlier = EARLIER.iter().find(|(version, _)| *version == found);
        if found != VERSION && earlier.is_none() {
            return Err(wrong(format!(
                "the file has table format {found}, this program reads table formats {} to {VERSION}",
                EARLIER[EARLIER.len() - 1].0
            ))
            .help("use the version of the program that wrote it, or fit the muscle again"));
        }
        let length = u32::from_le_bytes([bytes[8], bytes[9], bytes[10], bytes[11]]) as usize;
        if length > MAX_BODY || bytes.len() != HEADER + length + CHECKSUM {
            return Err(wrong(format!(
                "the file is {} bytes long, but announces {}",
                bytes.len(),
                HEADER + length + CHECKSUM
            ))
            .help(damaged));
        }
        let (content, tail) = bytes.split_at(HEADER + length);
        let stored = u32::from_le_bytes([tail[0], tail[1], tail[2], tail[3]]);
        if check::crc32(content) != stored {
            return Err(wrong("the file's checksum does not fit".into()).help(damaged));
        }
        let mut content = content[HEADER..].to_vec();
        content.extend(earlier.map_or(&[][..], |(_, lacking)| lacking));
        let (body, rest): (Body, &[u8]) = postcard::take_from_bytes(&content)
            .map_err(|e| wrong(format!("the file's content cannot be decoded: {e}")).help(damaged))?;
        if !rest.is_empty() {
            return Err(wrong("the file's content ends before its announced length".into()).help(damaged));
        }
        let table = image::read(&body.image).map_err(|e| wrong(e.to_string()).help(damaged))?;
        body.about.check()?;
        Ok(Self { table, about: body.about })
    }

    /// Reads a file.
    ///
    /// # Errors
    /// [`DataCode::FileUnreadable`], also for a file that is longer than any table, or [`DataCode::TableInvalid`] with what is wrong.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let bytes = bounds::read(path, (MAX_BODY + HEADER + CHECKSUM) as u64)
            .map_err(|e| e.help("tables end in .pam and are written by `host fit` or `host diagnose`"))?;
        Self::from_bytes(&bytes).map_err(|e| FileKind::Table.wanted(path, e))
    }

    /// Writes the file, whole or not at all.
    ///
    /// # Errors
    /// [`DataCode::TableInvalid`] or [`DataCode::FileUnwritable`].
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        let path = path.as_ref();
        write_whole(path, &self.to_bytes().map_err(|e| e.file(path))?)
    }
}

impl About {
    fn check(&self) -> Result<()> {
        let wrong =
            |what: &str| Err(Error::new(DataCode::TableInvalid, format!("{what} in the file's history")));
        let quality = &self.fit;
        let figures = [quality.rms_newtons, quality.mean_error_percent, quality.max_error_percent];
        if figures.iter().chain(&quality.left_out_percent).any(|x| !x.is_finite()) {
            return wrong("an error figure is not finite");
        }
        if self.corrections.iter().flat_map(|c| &c.parameters).any(|p| !p.is_finite()) {
            return wrong("a correction's parameter is not finite");
        }
        if self.mountings.iter().any(|m| !m.stroke.is_finite() || !m.offset.is_finite()) {
            return wrong("a mounting's length is not finite");
        }
        if self
            .earlier_load
            .is_some_and(|l| [l.pressure, l.seconds].iter().any(|x| !(*x >= 0.0 && x.is_finite())))
        {
            return wrong("an earlier load that is not a pressure and a time");
        }
        if let Some(u) = &self.uncertainty {
            let expected = (u.rows as usize).checked_mul(u.columns as usize);
            if expected != Some(u.root.len()) {
                return wrong("a covariance of the wrong size");
            }
            if u.root.iter().any(|x| !x.is_finite()) || !u.residual_newtons.is_finite() {
                return wrong("an uncertainty that is not finite");
            }
        }
        Ok(())
    }
}

/// The mountings of a fit, as a table file keeps them.
#[must_use]
pub fn stored_mountings(problem: &Problem) -> Vec<StoredMounting> {
    let stored = |m: &Mounting| StoredMounting { label: m.label.clone(), stroke: m.stroke, offset: m.offset };
    problem.mountings.iter().map(stored).collect()
}

/// SHA-256 of a file's bytes, in hexadecimal.
///
/// # Errors
/// [`DataCode::FileUnreadable`].
pub fn sha256(path: impl AsRef<Path>) -> Result<String> {
    let path = path.as_ref();
    let mut file = fs::File::open(path).map_err(|e| Error::unreadable(path, &e))?;
    let mut hash = Sha256::new();
    std::io::copy(&mut file, &mut hash).map_err(|e| Error::unreadable(path, &e))?;
    Ok(hash.finalize().iter().map(|b| format!("{b:02x}")).collect())
}

/// The recordings' files with their hashes, and how many rows each gave.
#[must_use]
pub fn sources(campaign: &Campaign, files: &[PathBuf], hashes: Vec<String>) -> Vec<Source> {
    let rows = |file: &PathBuf| {
        campaign.recordings.iter().filter(|r| r.source == *file).map(|r| r.len() as u64).sum()
    };
    let source = |(file, sha256): (&PathBuf, String)| Source {
        path: file.display().to_string(),
        sha256,
        samples: rows(file),
    };
    files.iter().zip(hashes).map(source).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn example() -> TableFile {
        let source = Source { path: "a.csv".into(), sha256: "00".repeat(32), samples: 3 };
        let about = About {
            muscle: "mini".into(),
            sources: vec![source],
            uncertainty: Some(Uncertainty {
                rows: 2,
                columns: 1,
                root: vec![1.0, 2.0],
                residual_newtons: 0.1,
            }),
            ..About::default()
        };
        TableFile { table: model_core::table::example(), about }
    }

    #[test]
    fn a_written_table_is_read_back() {
        let bytes = example().to_bytes().expect("valid");
        assert_eq!(TableFile::from_bytes(&bytes).expect("valid"), example());
    }

    #[test]
    fn every_flipped_bit_and_every_cut_is_noticed() {
        let bytes = example().to_bytes().expect("valid");
        for bit in 0..bytes.len() * 8 {
            let mut damaged = bytes.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            // The two reserved bytes are under the checksum too.
            assert!(TableFile::from_bytes(&damaged).is_err(), "bit {bit}");
        }
        for end in 0..bytes.len() {
            assert!(TableFile::from_bytes(&bytes[..end]).is_err(), "{end} bytes");
        }
    }

    #[test]
    fn a_device_that_never_ends_is_no_table() {
        let error = TableFile::read("/dev/zero").expect_err("it never ends");
        assert_eq!(error.code(), DataCode::FileUnreadable);
    }

    #[test]
    fn files_of_earlier_versions_are_read() {
        for (version, lacking) in EARLIER {
            let mut bytes = example().to_bytes().expect("valid");
            bytes.truncate(bytes.len() - CHECKSUM);
            assert!(bytes.ends_with(lacking), "the last fields");
            bytes.truncate(bytes.len() - lacking.len());
            bytes[4..6].copy_from_slice(&version.to_le_bytes());
            let length = (bytes.len() - HEADER) as u32;
            bytes[8..12].copy_from_slice(&length.to_le_bytes());
            let crc = check::crc32(&bytes);
            bytes.extend_from_slice(&crc.to_le_bytes());
            assert_eq!(TableFile::from_bytes(&bytes).expect("readable"), example(), "version {version}");
        }
    }

    #[test]
    fn the_beginning_of_recordings_is_kept() {
        let mut file = example();
        file.about.beginning = Beginning { within_stroke: true, just_filled: false };
        assert_eq!(TableFile::from_bytes(&file.to_bytes().expect("valid")).expect("valid"), file);
    }

    #[test]
    fn an_earlier_load_is_kept_and_checked() {
        let mut file = example();
        file.about.earlier_load = Some(EarlierLoad { pressure: 6e5, seconds: 100.0 });
        assert_eq!(TableFile::from_bytes(&file.to_bytes().expect("valid")).expect("valid"), file);
        file.about.earlier_load = Some(EarlierLoad { pressure: 6e5, seconds: f64::NAN });
        assert!(TableFile::from_bytes(&file.to_bytes().expect("encoded")).is_err());
    }

    #[test]
    fn another_version_names_both() {
        let mut bytes = example().to_bytes().expect("valid");
        bytes[4] = 7;
        let text = TableFile::from_bytes(&bytes).expect_err("another version").to_string();
        assert!(text.contains("format 7") && text.contains(&format!("to {VERSION}")), "{text}");
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic(bytes in proptest::collection::vec(any::<u8>(), 0..300), headed in any::<bool>()) {
            let mut bytes = bytes;
            if headed && bytes.len() >= HEADER + CHECKSUM {
                bytes[..4].copy_from_slice(&MAGIC);
                bytes[4..6].copy_from_slice(&VERSION.to_le_bytes());
                let length = (bytes.len() - HEADER - CHECKSUM) as u32;
                bytes[8..12].copy_from_slice(&length.to_le_bytes());
                let end = bytes.len() - CHECKSUM;
                let crc = check::crc32(&bytes[..end]);
                bytes[end..].copy_from_slice(&crc.to_le_bytes());
            }
            prop_assert!(TableFile::from_bytes(&bytes).is_err());
        }
    }
}
