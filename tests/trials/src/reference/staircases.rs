//! Pressure staircases of 10 mm fluidic muscles as runs.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};

use pam_data::recording::Recording;
use serde::Serialize;

/// Constants were chosen on one half; what is claimed is measured on the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Half {
    /// Constants were chosen here.
    Development,
    /// Set aside.
    Final,
}

/// The muscles on which constants were chosen.
const DEVELOPMENT: [&str; 6] = ["13cm", "27cm", "30cm", "cut100mm", "cut200mm", "cut300mm"];
/// Shorter runs are not runs.
const FEWEST_ROWS: usize = 50;

/// One run at a held length, SI.
#[derive(Debug, Clone)]
pub struct Run {
    /// File.
    pub source: PathBuf,
    /// Index of the mounting by ascending stroke.
    pub mounting: usize,
    /// Counted from 1.
    pub run: usize,
    /// m.
    pub stroke: f64,
    /// s.
    pub time: Vec<f64>,
    /// Pa.
    pub pressure: Vec<f64>,
    /// N.
    pub force: Vec<f64>,
}

impl Run {
    /// As a recording.
    pub fn recording(&self) -> Recording {
        Recording {
            name: format!("mounting {} run {}", self.mounting + 1, self.run),
            source: self.source.clone(),
            time: self.time.clone(),
            pressure: self.pressure.clone(),
            stroke: vec![self.stroke; self.time.len()],
            force: Some(self.force.clone()),
            ..Recording::default()
        }
    }
}

/// A muscle with all its runs.
pub struct Muscle {
    /// Year and file.
    pub name: String,
    /// Which half.
    pub half: Half,
    /// Runs of a mounting.
    pub runs: usize,
    /// mm.
    pub rest_length_mm: f64,
    all: Vec<Run>,
}

impl Muscle {
    /// Runs from one number to another, both included.
    pub fn between(&self, from: usize, to: usize) -> Vec<Run> {
        self.all.iter().filter(|r| r.run >= from && r.run <= to).cloned().collect()
    }

    /// Runs that either side has: two, where there are enough.
    pub fn least_runs(&self) -> usize {
        if self.runs > 3 { 2 } else { 1 }
    }
}

struct Sheet {
    names: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Sheet {
    fn read(path: &Path) -> Result<Self, Box<dyn Error>> {
        let text = std::fs::read_to_string(path)?;
        let mut lines = text.lines().map(|l| l.split(',').map(str::to_owned).collect::<Vec<_>>());
        let names = lines.next().ok_or("an empty file")?;
        Ok(Self { names, rows: lines.collect() })
    }

    fn column(&self, name: &str) -> Result<usize, Box<dyn Error>> {
        self.names.iter().position(|n| n == name).ok_or_else(|| format!("no column {name}").into())
    }
}

/// All muscles that are there.
///
/// # Errors
/// Files that are there and cannot be read.
pub fn read(data: &Path) -> Result<Vec<Muscle>, Box<dyn Error>> {
    let mut muscles = Vec::new();
    for year in ["2021", "2022"] {
        let folder = data.join(format!("aarl-festo-10mm-{year}"));
        if !folder.join("runs.csv").exists() {
            println!("no {}: left out", folder.display());
            continue;
        }
        let list = Sheet::read(&folder.join("runs.csv"))?;
        let file = list.column("file")?;
        let mut by_file: BTreeMap<&str, Vec<&Vec<String>>> = BTreeMap::new();
        for row in &list.rows {
            by_file.entry(&row[file]).or_default().push(row);
        }
        for (name, rows) in by_file {
            muscles.push(muscle(&folder.join(name), year, &list, &rows)?);
        }
    }
    Ok(muscles)
}

fn muscle(path: &Path, year: &str, list: &Sheet, rows: &[&Vec<String>]) -> Result<Muscle, Box<dyn Error>> {
    let (key, first) =
        if year == "2021" { ("condition", 1) } else { ("nominal_relative_contraction_percent", 8) };
    let (key_here, run_here) = (list.column(key)?, list.column("run")?);
    let sheet = Sheet::read(path)?;
    let own_key = sheet.column(if year == "2021" { "condition" } else { "relative_contraction_percent" })?;
    let own_run = sheet.column("run")?;
    let columns = [sheet.column("t_s")?, sheet.column("pressure_kPa")?, sheet.column("force_N")?];
    let mut all = Vec::new();
    for row in rows {
        let number = |name: &str| -> Result<f64, Box<dyn Error>> { Ok(row[list.column(name)?].parse()?) };
        let stroke = if year == "2021" {
            number("shortening_mm")?
        } else {
            number("rest_length_mm")? - number("mounted_length_mm")?
        };
        let run = number("run")? as usize + 1 - first;
        let mut one = Run {
            source: path.to_path_buf(),
            mounting: 0,
            run,
            stroke: stroke * 1e-3,
            time: Vec::new(),
            pressure: Vec::new(),
            force: Vec::new(),
        };
        let mut before = f64::NEG_INFINITY;
        for cells in sheet.rows.iter().filter(|c| c[own_key] == row[key_here] && c[own_run] == row[run_here])
        {
            let [t, p, f] =
                [cells[columns[0]].parse::<f64>()?, cells[columns[1]].parse()?, cells[columns[2]].parse()?];
            if t > before {
                one.time.push(t);
                one.pressure.push(1e3 * p);
                one.force.push(f);
            }
            before = t;
        }
        if one.time.len() >= FEWEST_ROWS {
            all.push(one);
        }
    }
    let mut strokes: Vec<f64> = all.iter().map(|r| r.stroke).collect();
    strokes.sort_by(f64::total_cmp);
    strokes.dedup();
    for r in &mut all {
        r.mounting = strokes.iter().position(|s| *s == r.stroke).unwrap_or(0);
    }
    let stem = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let half = if DEVELOPMENT.iter().any(|d| stem.ends_with(d)) { Half::Development } else { Half::Final };
    let runs = all.iter().map(|r| r.run).max().unwrap_or(0);
    let name = format!("{year} {}", stem.trim_start_matches("festo10_"));
    let rest = list.column("rest_length_mm")?;
    let rest_length_mm = rows.first().ok_or("no runs")?[rest].parse()?;
    Ok(Muscle { name, half, runs, rest_length_mm, all })
}
