//! Folders and files to campaigns in the order of their dates.

use std::path::{Path, PathBuf};

use super::super::diagnose::reference::read as read_campaign;
use super::super::recordings::Recordings;
use crate::console::Console;
use pam_data::date::{self, DateSource};
use pam_data::error::{DataCode, Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::Import;
use pam_diagnose::timeline::Visit;

/// Endings of files that are taken from a folder; others are notes, tables and pictures. Of files that differ in the ending only, the first
/// counts: programs save a recording in several formats.
const ENDINGS: [&str; 16] = [
    "csv", "tsv", "txt", "dat", "gz", "zst", "mat", "h5", "hdf5", "parquet", "mcap", "log", "tdms", "lvm",
    "xlsx", "ods",
];
/// s of a day: recordings of one day are one campaign where the names say no more.
const DAY: f64 = 86_400.0;

/// What is to be read, and how.
pub(super) struct Request<'a> {
    pub paths: &'a [PathBuf],
    pub muscle: Option<&'a MuscleDescription>,
    pub import: Option<&'a PathBuf>,
    pub filters: &'a [String],
}

/// A campaign and the paths of the call that make it.
pub(super) struct Found {
    pub visit: Visit,
    paths: Vec<PathBuf>,
}

/// Index of the campaign that a path of the call belongs to.
pub(super) fn position(all: &[Found], path: &Path) -> Option<usize> {
    let same = |a: &Path| a == path || std::fs::canonicalize(a).ok() == std::fs::canonicalize(path).ok();
    all.iter().position(|f| f.paths.iter().any(|p| same(p)))
}

/// Files of one campaign.
struct Group {
    name: String,
    paths: Vec<PathBuf>,
    files: Vec<PathBuf>,
    /// Day of the name, by which files are joined.
    day: Option<f64>,
}

fn name_of(path: &Path) -> String {
    let whole = if path.is_dir() { path.file_name() } else { path.file_stem() };
    whole.map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}

/// `lookup` is a table beside the recordings, by which an import description reads them.
fn recordings_in(folder: &Path, lookup: Option<&Path>) -> Result<Vec<PathBuf>> {
    let is_lookup = |p: &Path| lookup.is_some_and(|table| folder.join(table) == p);
    let entries = std::fs::read_dir(folder).map_err(|e| Error::unreadable(folder, &e))?;
    let rank = |p: &PathBuf| {
        let ending = p.extension()?.to_string_lossy().to_lowercase();
        ENDINGS.iter().position(|e| *e == ending)
    };
    let taken = |p: PathBuf| {
        rank(&p).filter(|_| p.is_file() && !is_lookup(&p)).map(|rank| (p.with_extension(""), rank, p))
    };
    let mut found: Vec<(PathBuf, usize, PathBuf)> =
        entries.flatten().filter_map(|e| taken(e.path())).collect();
    found.sort();
    found.dedup_by(|a, b| a.0 == b.0);
    let mut files: Vec<PathBuf> = found.into_iter().map(|(.., file)| file).collect();
    files.sort();
    if files.is_empty() {
        return Err(Error::new(DataCode::RecordingEmpty, "the folder holds no recordings")
            .file(folder)
            .help("a campaign is a folder with recordings in it (CSV, Parquet, MATLAB, HDF5, MCAP, TDMS, LVM, workbooks); folders within it are not entered"));
    }
    Ok(files)
}

fn groups(paths: &[PathBuf], lookup: Option<&Path>) -> Result<Vec<Group>> {
    let mut all: Vec<Group> = Vec::new();
    for path in paths {
        let name = name_of(path);
        if path.is_dir() {
            all.push(Group {
                name,
                paths: vec![path.clone()],
                files: recordings_in(path, lookup)?,
                day: None,
            });
            continue;
        }
        let day = date::in_text(&name).map(|d| (d / DAY).floor());
        match all.iter_mut().find(|g| day.is_some() && g.day == day) {
            Some(group) => {
                group.paths.push(path.clone());
                group.files.push(path.clone());
            }
            None => all.push(Group { name, paths: vec![path.clone()], files: vec![path.clone()], day }),
        }
    }
    for group in &mut all {
        if let (Some(day), true) = (group.day, group.files.len() > 1) {
            group.name = date::day(day * DAY);
        }
    }
    Ok(all)
}

/// Reads all campaigns and puts them into the order of their dates.
///
/// # Errors
/// Empty folders, files that cannot be read, a single campaign.
pub(super) fn read(request: &Request<'_>, console: &Console) -> Result<Vec<Found>> {
    // A history of one campaign is refused before anything is read.
    let import = request.import.map(Import::read).transpose()?;
    let lookup = import.and_then(|i| i.lookup).map(|l| PathBuf::from(l.file));
    let groups = groups(request.paths, lookup.as_deref())?;
    if groups.len() < 2 {
        return Err(Error::new(DataCode::CallInvalid, "a history needs two campaigns or more").help(
            "give a folder or a file for each campaign; files whose names carry the same date are one campaign",
        ));
    }
    let mut all = Vec::new();
    for group in groups {
        let recordings = Recordings {
            files: group.files.clone(),
            import: request.import.cloned(),
            filters: request.filters.to_vec(),
            missing: None,
            sheet: None,
            absent_values: true,
        };
        let campaign = read_campaign(&recordings, request.muscle, console)?;
        let dated =
            |r: &pam_data::recording::Recording| date::of_recording(&r.source, r.time.first().copied());
        // The first recording's date is the campaign's; the least reliable source of all is reported.
        let dates: Vec<(f64, DateSource)> = campaign.recordings.iter().filter_map(dated).collect();
        let when = dates.iter().map(|d| d.0).fold(f64::INFINITY, f64::min);
        let dated_by = dates.iter().map(|d| d.1).max().unwrap_or(DateSource::Modified);
        let date = if when.is_finite() { when } else { 0.0 };
        all.push(Found { visit: Visit { name: group.name, date, dated_by, campaign }, paths: group.paths });
    }
    all.sort_by(|a, b| a.visit.date.total_cmp(&b.visit.date));
    Ok(all)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

    use super::*;

    #[test]
    fn a_folder_gives_its_recordings_of_every_format_once() {
        let folder = tempfile::tempdir().unwrap();
        for name in
            ["a.csv", "a.mcap", "b.tdms", "b.tdms_index", "c.XLSX", "notes.md", "d.lvm", "e.ods", "runs.csv"]
        {
            std::fs::write(folder.path().join(name), "x").unwrap();
        }
        let names: Vec<String> = recordings_in(folder.path(), Some(Path::new("runs.csv")))
            .unwrap()
            .iter()
            .map(|p| p.file_name().unwrap().to_string_lossy().into_owned())
            .collect();
        assert_eq!(names, ["a.csv", "b.tdms", "c.XLSX", "d.lvm", "e.ods"]);
    }
}
