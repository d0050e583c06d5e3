//! One muscle of a manifest with its input files, and the key of what is computed from them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use pam_data::error::{Error, Result};
use pam_fit::table_file::sha256;
use serde::Serialize;
use sha2::{Digest, Sha256};

use crate::error::FleetCode;
use crate::failures::Failure;
use crate::storage::{self, is_remote};

/// Files of one pattern; more are an error of the pattern.
const MOST_FILES: usize = 10_000;

/// One muscle as its row in the manifest describes it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct WorkItem {
    /// The name under which its results are stored.
    pub muscle: String,
    /// The folder that paths are relative to.
    pub folder: PathBuf,
    /// The muscle's description; absent where only changes are reported.
    pub description: Option<String>,
    /// Recordings: paths and patterns.
    pub files: Vec<String>,
    /// Earlier recordings, or one table.
    pub reference: Vec<String>,
    /// An import description.
    pub import: Option<String>,
    /// Column and value that rows must have.
    pub filters: Vec<(String, String)>,
    /// What is known about the muscle beside its recordings: batch, rig, date.
    pub tags: BTreeMap<String, String>,
}

/// What a file is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Role {
    /// The muscle's description.
    Description,
    /// An import description.
    Import,
    /// A recording.
    Recording,
    /// An earlier recording, or a table.
    Reference,
}

/// A file with its content's hash.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Input {
    /// What it is for.
    pub role: Role,
    /// The path as results name it: relative to the manifest's folder.
    pub name: String,
    /// The path to open.
    pub path: PathBuf,
    /// SHA-256 of its bytes; absent where it could not be read.
    pub sha256: Option<String>,
}

/// An input as the column `inputs` of the results shows it.
#[derive(Serialize)]
struct InputRecord<'a> {
    role: Role,
    path: &'a str,
    sha256: Option<&'a str>,
}

/// The input files of one muscle, hashed, and the first that cannot be read.
#[derive(Debug)]
pub(crate) struct Inputs {
    /// All files, in the order of the manifest.
    pub list: Vec<Input>,
    /// Why a file cannot be used.
    pub error: Option<Error>,
    /// Copies of objects in buckets, for as long as this lives.
    copies: Option<tempfile::TempDir>,
    copied: usize,
}

impl Inputs {
    /// Finds and hashes the files of a muscle.
    #[must_use]
    pub fn of(item: &WorkItem) -> Self {
        let mut inputs = Self { list: Vec::new(), error: None, copies: None, copied: 0 };
        inputs.add(item, Role::Description, item.description.as_slice());
        inputs.add(item, Role::Import, item.import.as_slice());
        inputs.add(item, Role::Recording, &item.files);
        inputs.add(item, Role::Reference, &item.reference);
        inputs
    }

    fn add(&mut self, item: &WorkItem, role: Role, names: &[String]) {
        for name in names {
            let found = expand(&item.folder, name).and_then(|found| self.local(found)).unwrap_or_else(|e| {
                self.error.get_or_insert(e);
                vec![(name.clone(), item.folder.join(name))]
            });
            for (name, path) in found {
                let hash = match path.is_dir() {
                    true => Err(Error::new(pam_data::error::DataCode::FileUnreadable, "is a folder")
                        .file(&path)
                        .help("name the files in it")),
                    false => sha256(&path),
                };
                let sha256 = hash.map_err(|e| self.error.get_or_insert(e.file(&path))).ok();
                self.list.push(Input { role, name, path, sha256 });
            }
        }
    }

    /// Copies of those files that are in buckets, with their names; others as they are.
    fn local(&mut self, found: Vec<(String, PathBuf)>) -> Result<Vec<(String, PathBuf)>> {
        found
            .into_iter()
            .map(|(name, path)| {
                let address = path.to_string_lossy().into_owned();
                if !is_remote(&address) {
                    return Ok((name, path));
                }
                let bytes = storage::read_existing(&address)?;
                let unwritable = |e: std::io::Error| Error::unwritable(&path, &e);
                if self.copies.is_none() {
                    self.copies = Some(tempfile::tempdir().map_err(unwritable)?);
                }
                let folder = self.copies.as_ref().map_or(Path::new(""), tempfile::TempDir::path);
                // Each in a folder of its own: two objects may have the same last name.
                let own = folder.join(self.copied.to_string());
                self.copied += 1;
                std::fs::create_dir(&own).map_err(unwritable)?;
                let copy = own.join(path.file_name().unwrap_or("object".as_ref()));
                std::fs::write(&copy, bytes).map_err(unwritable)?;
                Ok((name, copy))
            })
            .collect()
    }

    /// An error whose place names the object in the place of its copy.
    pub(crate) fn with_original_name(&self, error: Error) -> Error {
        let Some(file) = error.place().file.clone() else { return error };
        match self.list.iter().find(|i| i.path == file && self.copies.is_some()) {
            Some(input) => error.file(Path::new(&input.name)),
            None => error,
        }
    }

    /// The paths of one role.
    #[must_use]
    pub fn paths(&self, role: Role) -> Vec<PathBuf> {
        self.list.iter().filter(|i| i.role == role).map(|i| i.path.clone()).collect()
    }

    /// The hashes of one role, in the order of [`Inputs::paths`].
    #[must_use]
    pub fn hashes(&self, role: Role) -> Vec<String> {
        let of = |i: &Input| i.sha256.clone().unwrap_or_default();
        self.list.iter().filter(|i| i.role == role).map(of).collect()
    }

    /// All files as JSON, for the column `inputs`.
    #[must_use]
    pub fn json(&self) -> String {
        let record = |i: &'_ Input| -> serde_json::Value {
            serde_json::to_value(InputRecord { role: i.role, path: &i.name, sha256: i.sha256.as_deref() })
                .unwrap_or_default()
        };
        serde_json::Value::Array(self.list.iter().map(record).collect()).to_string()
    }

    /// The key of a row of the manifest that names no computable muscle.
    pub(crate) fn key_of_failure(label: &str, failure: &Failure, settings: &str) -> String {
        digest([settings, label, &failure.code, &failure.cause, &failure.place, &failure.remedy])
    }

    /// The key of everything that is computed from these inputs: equal keys mean equal results, byte for byte.
    ///
    /// `settings` are the version of the program and the options of the batch.
    #[must_use]
    pub fn key(&self, item: &WorkItem, settings: &str) -> String {
        let json = self.json();
        // Not the error's place: that depends on where the manifest lies.
        let error = self.error.as_ref().map_or("", Error::cause);
        let pairs =
            item.filters.iter().map(|(k, v)| (k, v)).chain(&item.tags).flat_map(|(k, v)| [k.as_str(), v]);
        digest([settings, &item.muscle, &json, error].into_iter().chain(pairs))
    }
}

/// SHA-256 of several texts. Each is preceded by its length, so that no two lists read the same.
fn digest<'a>(parts: impl IntoIterator<Item = &'a str>) -> String {
    let mut hash = Sha256::new();
    for part in parts {
        hash.update((part.len() as u64).to_le_bytes());
        hash.update(part.as_bytes());
    }
    hash.finalize().iter().map(|b| format!("{b:02x}")).collect()
}

/// The files of a path or a pattern, sorted by name, each with its name in results.
fn expand(folder: &Path, name: &str) -> Result<Vec<(String, PathBuf)>> {
    let local = name.strip_prefix("file://").unwrap_or(name);
    let address =
        if is_remote(local) { local.to_owned() } else { folder.join(local).to_string_lossy().into_owned() };
    if is_remote(&address) {
        return remote(folder, name, &address);
    }
    if let Some((scheme, _)) = local.split_once("://") {
        return Err(Error::new(
            FleetCode::ManifestInvalid,
            format!("{scheme}:// addresses are not supported"),
        )
        .value(name)
        .help("use s3://, gs:// or az://, copy the files to this machine, or mount the storage"));
    }
    let path = folder.join(local);
    if !local.contains(['*', '?', '[']) || path.exists() {
        return Ok(vec![(name.to_owned(), path)]);
    }
    // The folder of the manifest may itself hold characters that a pattern would interpret.
    let pattern = match Path::new(local).is_absolute() {
        true => local.to_owned(),
        false => format!("{}/{local}", glob::Pattern::escape(&folder.to_string_lossy())),
    };
    let pattern = if folder.as_os_str().is_empty() { local.to_owned() } else { pattern };
    let paths = glob::glob(&pattern).map_err(|e| {
        Error::new(FleetCode::ManifestInvalid, format!("the pattern is not valid: {}", e.msg)).value(name)
    })?;
    let mut found = Vec::new();
    for path in paths.take(MOST_FILES + 1) {
        let path = path.map_err(|e| Error::unreadable(e.path(), e.error()))?;
        let shown = path.strip_prefix(folder).unwrap_or(&path).to_string_lossy().into_owned();
        found.push((shown, path));
    }
    if found.len() > MOST_FILES {
        return Err(too_many(name));
    }
    if found.is_empty() {
        return Err(no_match(name));
    }
    Ok(found)
}

/// The objects of an address or a pattern in a bucket, sorted, each with its name in results.
fn remote(folder: &Path, name: &str, address: &str) -> Result<Vec<(String, PathBuf)>> {
    if !address.contains(['*', '?', '[']) {
        return Ok(vec![(name.to_owned(), PathBuf::from(address))]);
    }
    let found = storage::list(address, MOST_FILES)?;
    if found.len() > MOST_FILES {
        return Err(too_many(name));
    }
    if found.is_empty() {
        return Err(no_match(name));
    }
    let folder = format!("{}/", folder.to_string_lossy());
    let shown = |object: &String| object.strip_prefix(&folder).unwrap_or(object).to_owned();
    Ok(found.into_iter().map(|object| (shown(&object), PathBuf::from(object))).collect())
}

fn too_many(name: &str) -> Error {
    Error::new(FleetCode::ManifestInvalid, format!("the pattern matches more than {MOST_FILES} files"))
        .value(name)
}

fn no_match(name: &str) -> Error {
    Error::new(pam_data::error::DataCode::FileUnreadable, "no file matches the pattern")
        .file(name)
        .help("look at the folder: patterns are relative to the folder of the manifest")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn item(folder: &Path, files: &[&str]) -> WorkItem {
        WorkItem {
            muscle: "m".into(),
            folder: folder.to_path_buf(),
            description: Some("m.toml".into()),
            files: files.iter().map(|f| (*f).to_owned()).collect(),
            reference: Vec::new(),
            import: None,
            filters: Vec::new(),
            tags: BTreeMap::new(),
        }
    }

    #[test]
    fn the_key_is_that_of_the_contents_wherever_they_lie() {
        let (a, b) = (tempfile::tempdir().expect("a folder"), tempfile::tempdir().expect("a folder"));
        for folder in [a.path(), b.path()] {
            std::fs::write(folder.join("m.toml"), "x").expect("written");
            std::fs::create_dir(folder.join("loops [1]")).expect("made");
            std::fs::write(folder.join("loops [1]/2.csv"), "two").expect("written");
            std::fs::write(folder.join("loops [1]/1.csv"), "one").expect("written");
        }
        let key = |folder: &Path, settings: &str| {
            let item = item(folder, &["loops*/*.csv"]);
            let inputs = Inputs::of(&item);
            assert!(inputs.error.is_none(), "{:?}", inputs.error);
            let names: Vec<&str> = inputs.list.iter().map(|i| i.name.as_str()).collect();
            assert_eq!(names, ["m.toml", "loops [1]/1.csv", "loops [1]/2.csv"]);
            inputs.key(&item, settings)
        };
        assert_eq!(key(a.path(), "1"), key(b.path(), "1"));
        assert_ne!(key(a.path(), "1"), key(a.path(), "2"));
        let before = key(a.path(), "1");
        std::fs::write(a.path().join("loops [1]/2.csv"), "2").expect("written");
        assert_ne!(before, key(a.path(), "1"));
    }

    #[test]
    fn a_missing_file_is_an_error_with_its_place_and_part_of_the_key() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("m.toml"), "x").expect("written");
        let messages = |files: &[&str]| {
            let item = item(folder.path(), files);
            let inputs = Inputs::of(&item);
            let text = inputs.error.as_ref().map(ToString::to_string).unwrap_or_default();
            (text, inputs.key(&item, ""))
        };
        let (missing, before) = messages(&["1.csv"]);
        assert!(missing.starts_with("cannot be read") && missing.contains("1.csv"), "{missing}");
        assert!(messages(&["*.csv"]).0.contains("no file matches"));
        assert!(messages(&["ftp://x/1.csv"]).0.contains("ftp:// addresses are not supported"));
        std::fs::write(folder.path().join("1.csv"), "one").expect("written");
        let (found, after) = messages(&["1.csv"]);
        assert_eq!(found, "");
        assert_ne!(before, after);
        assert!(messages(&["."]).0.contains("is a folder"));
    }
}
