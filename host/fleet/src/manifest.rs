//! The manifest: one row per muscle, as CSV or Parquet, read row by row so that its length costs no memory.
//!
//! | column | content |
//! | --- | --- |
//! | `muscle` | name, unique; required |
//! | `files` | recordings in chronological order, separated by `;`; patterns such as `loops/*.csv`; required |
//! | `description` | the muscle's description (TOML); required unless there is a reference |
//! | `reference` | earlier recordings, separated by `;`, or one `.pam`: the diagnosis reports what changed since then |
//! | `import` | an import description for files of another form |
//! | `where` | `column=value` filters, separated by `;` |
//! | `tags` | `key=value` pairs, separated by `;` |
//! | any other | a tag with the column's name |
//!
//! Paths are relative to the folder of the manifest; the manifest and each file may be an object in a bucket. In a Parquet manifest `files` and `reference` may be lists of texts.

mod parquet;
mod text;

use std::collections::{BTreeMap, HashSet};
use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use pam_data::error::{Error, Result, nearest};
use sha2::{Digest, Sha256};

use crate::error::FleetCode;
use crate::storage::{self, is_remote};
use crate::work_item::WorkItem;

/// The separator of several values in one cell.
const SEPARATOR: char = ';';
/// The columns with a meaning of their own.
const COLUMNS: [&str; 7] = ["muscle", "description", "files", "reference", "import", "where", "tags"];
/// A longer name would not fit into a folder's name on common file systems (255 bytes) once it is encoded.
const LONGEST_NAME: usize = 120;

/// One row as it stands: the names of its columns with one or several texts each.
pub(crate) type Row = Vec<(String, Vec<String>)>;

/// A row that is a muscle's, or an error with a name for it.
#[derive(Debug)]
pub(crate) enum Entry {
    /// A muscle to compute.
    Muscle(Box<WorkItem>),
    /// A row that names no computable muscle; listed as a failure under `label`.
    Invalid {
        /// The muscle's name, or `row 12` where it has none of its own.
        label: String,
        /// What is wrong with the row.
        error: Error,
    },
}

impl Entry {
    /// The name under which the row's results are stored.
    #[must_use]
    pub fn label(&self) -> &str {
        match self {
            Self::Muscle(item) => &item.muscle,
            Self::Invalid { label, .. } => label,
        }
    }
}

/// The rows of a manifest file.
pub(crate) struct Manifest {
    path: PathBuf,
    folder: PathBuf,
    rows: Box<dyn Iterator<Item = (u64, Result<Row>)> + Send>,
    /// Hashes of the names that were seen: 16 bytes per muscle.
    seen: HashSet<[u8; 16]>,
    /// A copy of a manifest from a bucket.
    _copy: Option<tempfile::TempPath>,
}

impl std::fmt::Debug for Manifest {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Manifest").field("path", &self.path).finish_non_exhaustive()
    }
}

impl Manifest {
    /// Opens a manifest and checks its columns.
    ///
    /// # Errors
    /// A file that cannot be read, or lacks a required column.
    pub fn open(path: &Path) -> Result<Self> {
        let address = path.to_string_lossy();
        if !is_remote(&address) {
            let path = Path::new(address.strip_prefix("file://").unwrap_or(&address));
            return Self::open_copy(path, path, None);
        }
        let bytes = storage::read_existing(&address)?;
        let copy = |bytes: &[u8]| {
            let mut file = tempfile::NamedTempFile::new()?;
            file.write_all(bytes)?;
            Ok(file.into_temp_path())
        };
        let copy = copy(&bytes).map_err(|e: std::io::Error| Error::unwritable(path, &e))?;
        let local = copy.to_path_buf();
        Self::open_copy(path, &local, Some(copy))
    }

    /// Opens a file that is read in the place of the manifest `named`.
    fn open_copy(named: &Path, path: &Path, copy: Option<tempfile::TempPath>) -> Result<Self> {
        let mut file = File::open(path).map_err(|e| Error::unreadable(path, &e))?;
        if file.metadata().is_ok_and(|m| m.is_dir()) {
            return Err(Error::new(FleetCode::ManifestInvalid, "the manifest is a folder").file(path));
        }
        let mut magic = Vec::new();
        Read::by_ref(&mut file).take(4).read_to_end(&mut magic).map_err(|e| Error::unreadable(path, &e))?;
        let opened = if magic == b"PAR1" { parquet::open(path) } else { text::open(path) };
        let (columns, rows) = opened.map_err(|e| e.file(named))?;
        check_columns(&columns).map_err(|e| e.file(named))?;
        let folder = named.parent().unwrap_or(Path::new("")).to_path_buf();
        Ok(Self { path: named.to_path_buf(), folder, rows, seen: HashSet::new(), _copy: copy })
    }

    fn entry(&mut self, number: u64, row: Result<Row>) -> Entry {
        let unnamed = format!("row {number}");
        let mut row = match row {
            Ok(row) => row,
            Err(error) => {
                return Entry::Invalid { label: unnamed, error: error.file(&self.path).line(number) };
            }
        };
        let invalid =
            |cause: &str| Error::new(FleetCode::ManifestInvalid, cause).file(&self.path).line(number);
        let name = take(&mut row, "muscle").join(" ").trim().to_owned();
        if name.is_empty() {
            return Entry::Invalid {
                label: unnamed,
                error: invalid("the row names no muscle").column("muscle"),
            };
        }
        if name.len() > LONGEST_NAME {
            let error = invalid(&format!("the muscle's name is longer than {LONGEST_NAME} bytes"));
            return Entry::Invalid { label: unnamed, error: error.column("muscle").value(&name) };
        }
        if !self.seen.insert(short_hash(&name)) {
            let error = invalid("the muscle is listed twice; only its first row counts")
                .column("muscle")
                .value(&name)
                .help("give each muscle one row; list several recordings in `files`, separated by `;`");
            return Entry::Invalid { label: format!("{name} (row {number})"), error };
        }
        match item(&name, row, &self.folder) {
            Ok(item) => Entry::Muscle(Box::new(item)),
            Err(error) => Entry::Invalid { label: name, error: error.file(&self.path).line(number) },
        }
    }
}

impl Iterator for Manifest {
    type Item = Entry;

    fn next(&mut self) -> Option<Entry> {
        let (number, row) = self.rows.next()?;
        Some(self.entry(number, row))
    }
}

fn check_columns(columns: &[String]) -> Result<()> {
    for required in ["muscle", "files"] {
        if !columns.iter().any(|c| c == required) {
            let error =
                Error::new(FleetCode::ManifestInvalid, format!("there is no column `{required}`")).line(1);
            return Err(match nearest(required, columns.iter().map(String::as_str)) {
                Some(close) => error.help(format!("rename the column `{close}` to `{required}`")),
                None => error,
            });
        }
    }
    let mut names = HashSet::new();
    match columns.iter().find(|c| !names.insert(c.as_str())) {
        Some(twice) => Err(Error::new(FleetCode::ManifestInvalid, "a column is given twice").column(twice)),
        None => Ok(()),
    }
}

/// The texts of a column, which leaves the row.
fn take(row: &mut Row, column: &str) -> Vec<String> {
    match row.iter().position(|(name, _)| name == column) {
        Some(at) => row.swap_remove(at).1,
        None => Vec::new(),
    }
}

/// Several values of one cell, or of the texts of a list.
fn several(texts: &[String]) -> Vec<String> {
    let parts = texts.iter().flat_map(|t| t.split(SEPARATOR)).map(str::trim);
    parts.filter(|t| !t.is_empty()).map(str::to_owned).collect()
}

fn one(texts: &[String], column: &str) -> Result<Option<String>> {
    match several(texts).as_slice() {
        [] => Ok(None),
        [one] => Ok(Some(one.clone())),
        _ => {
            Err(Error::new(FleetCode::ManifestInvalid, "several values where one is expected").column(column))
        }
    }
}

fn pairs(texts: &[String], column: &str) -> Result<Vec<(String, String)>> {
    let pair = |text: String| match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() => Ok((key.trim().to_owned(), value.trim().to_owned())),
        _ => Err(Error::new(FleetCode::ManifestInvalid, "a pair without `=`")
            .column(column)
            .value(text)
            .help("write key=value, several separated by `;`, such as batch=B7;rig=2")),
    };
    several(texts).into_iter().map(pair).collect()
}

fn item(muscle: &str, mut row: Row, folder: &Path) -> Result<WorkItem> {
    let description = one(&take(&mut row, "description"), "description")?;
    let import = one(&take(&mut row, "import"), "import")?;
    let files = several(&take(&mut row, "files"));
    let reference = several(&take(&mut row, "reference"));
    let filters = pairs(&take(&mut row, "where"), "where")?;
    let mut tags: BTreeMap<String, String> = pairs(&take(&mut row, "tags"), "tags")?.into_iter().collect();
    for (column, texts) in row {
        debug_assert!(!COLUMNS.contains(&column.as_str()));
        let text = texts.join("; ").trim().to_owned();
        if !text.is_empty() {
            tags.insert(column, text);
        }
    }
    if files.is_empty() {
        return Err(Error::new(FleetCode::ManifestInvalid, "the row names no recording").column("files"));
    }
    if description.is_none() && reference.is_empty() {
        return Err(
            Error::new(FleetCode::ManifestInvalid, "the row names no description").column("description")
        );
    }
    Ok(WorkItem {
        muscle: muscle.to_owned(),
        folder: folder.to_path_buf(),
        description,
        files,
        reference,
        import,
        filters,
        tags,
    })
}

fn short_hash(name: &str) -> [u8; 16] {
    let hash = Sha256::digest(name.as_bytes());
    let mut short = [0; 16];
    short.copy_from_slice(&hash[..16]);
    short
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entries(text: &[u8]) -> Vec<Entry> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("fleet.csv");
        std::fs::write(&path, text).expect("written");
        Manifest::open(&path).expect("a manifest").collect()
    }

    #[test]
    fn a_row_is_a_muscle_with_files_and_tags() {
        let all = entries(
            b"muscle,description,files,tags,rig\n# a comment\na,m.toml,x/*.csv; y.csv,batch=B7;date=2026-03-01,2\n",
        );
        let [Entry::Muscle(item)] = all.as_slice() else { panic!("{all:?}") };
        assert_eq!(item.files, ["x/*.csv", "y.csv"]);
        assert_eq!(item.description.as_deref(), Some("m.toml"));
        let tags: Vec<_> = item.tags.iter().map(|(k, v)| format!("{k}={v}")).collect();
        assert_eq!(tags, ["batch=B7", "date=2026-03-01", "rig=2"]);
    }

    #[test]
    fn a_bad_row_is_named_and_the_others_stand() {
        let all = entries(
            b"muscle,description,files,tags\na,m.toml,a.csv,\n,m.toml,b.csv,\na,m.toml,c.csv,\nd,m.toml,,\ne,,e.csv,\n\
              f,m.toml\ng\xff,m.toml,g.csv,\nh,m.toml,h.csv,batch\ni,m.toml,i.csv,\n",
        );
        let messages: Vec<String> = all
            .iter()
            .map(|e| match e {
                Entry::Muscle(item) => item.muscle.clone(),
                Entry::Invalid { label, error } => format!("{label}: {}", error.cause()),
            })
            .collect();
        assert_eq!(
            messages,
            [
                "a",
                "row 3: the row names no muscle",
                "a (row 4): the muscle is listed twice; only its first row counts",
                "d: the row names no recording",
                "e: the row names no description",
                "row 7: the row has 2 cells, the header 4",
                "row 8: the row is not text in UTF-8",
                "h: a pair without `=`",
                "i",
            ]
        );
    }

    #[test]
    fn a_misspelt_column_is_offered() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("fleet.csv");
        std::fs::write(&path, "muscles,description,files\n").expect("written");
        let error = Manifest::open(&path).expect_err("no column muscle");
        assert_eq!(error.advice(), Some("rename the column `muscles` to `muscle`"));
    }
}
