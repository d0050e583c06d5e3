//! Recordings on the page: loaded, fitted, diagnosed, compared. Files lie in one folder, under names of our own making.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use model_core::muscle::Muscle;
use model_core::units::{Length, Pressure};
use serde_json::{Value, json};

use crate::demo::campaign::record;
use pam_data::compare::compare;
use pam_data::date;
use pam_data::error::{DataCode, Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::output::write_whole;
use pam_data::recording::{Campaign, Reader, Recording};
use pam_fit::table_file::{self, About, TableFile};
use pam_fit::{Options, fit};
use pam_report::{diagnose_page, fit_page};

/// Points of a curve that are sent to the page.
const POINTS: usize = 1_500;

/// The folder and what lies in it.
#[derive(Debug)]
pub struct Workshop {
    folder: PathBuf,
    recordings: Vec<(String, PathBuf)>,
    table: Option<PathBuf>,
    reports: BTreeMap<&'static str, String>,
}

impl Workshop {
    /// An empty one in a folder, which is made where it is missing.
    ///
    /// # Errors
    /// [`DataCode::FileUnwritable`].
    pub fn new(folder: PathBuf) -> Result<Self> {
        std::fs::create_dir_all(&folder).map_err(|e| Error::unwritable(&folder, &e))?;
        Ok(Self { folder, recordings: Vec::new(), table: None, reports: BTreeMap::new() })
    }

    /// The fitted table, if there is one.
    ///
    /// # Errors
    /// [`DataCode::CallInvalid`] when nothing was fitted yet.
    pub fn table(&self) -> Result<PathBuf> {
        self.table.clone().ok_or_else(|| {
            Error::new(DataCode::CallInvalid, "there is no table yet").help("fit recordings first")
        })
    }

    /// The page of the last fit (`fit`) or diagnosis (`diagnosis`).
    #[must_use]
    pub fn report(&self, name: &str) -> Option<String> {
        self.reports.get(name).cloned()
    }

    /// A path for the next recording of the controller.
    #[must_use]
    pub fn next_run(&self) -> PathBuf {
        let taken = |n: &u32| self.folder.join(format!("run-{n}.csv")).exists();
        let number = (1..10_000).find(|n| !taken(n)).unwrap_or(10_000);
        self.folder.join(format!("run-{number}.csv"))
    }

    /// Adds a recording that lies in a file.
    pub fn add(&mut self, path: PathBuf) {
        let name = path.file_stem().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
        self.recordings.push((name, path));
    }

    /// Keeps a file that the page sent, after it was read without complaint.
    ///
    /// # Errors
    /// What is wrong with the file, by line and column.
    pub fn upload(&mut self, name: &str, bytes: &[u8]) -> Result<Value> {
        // Only letters, digits, dots, dashes: a name can never lead out of the folder.
        let plain: String = name
            .chars()
            .map(|c| if c.is_ascii_alphanumeric() || "._-".contains(c) { c } else { '_' })
            .collect();
        let path =
            self.folder.join(format!("{}-{}", self.recordings.len() + 1, plain.trim_start_matches('.')));
        write_whole(&path, bytes)?;
        if let Err(error) = Reader::new().file(&path) {
            let _ = std::fs::remove_file(&path);
            return Err(error);
        }
        self.add(path);
        Ok(self.list())
    }

    /// A campaign of the virtual bench, for trying.
    ///
    /// # Errors
    /// As [`record`].
    pub fn example(&mut self, muscle: &str) -> Result<Value> {
        let made = record(muscle, 1, &self.folder.join("example"))?;
        self.recordings.clear();
        for path in made.recordings {
            self.add(path);
        }
        let text = std::fs::read_to_string(&made.muscle).map_err(|e| Error::unreadable(&made.muscle, &e))?;
        let mut list = self.list();
        list["muscle"] = json!(text);
        Ok(list)
    }

    /// What there is.
    #[must_use]
    pub fn list(&self) -> Value {
        json!({
            "recordings": self.recordings.iter().map(|r| r.0.clone()).collect::<Vec<_>>(),
            "table": self.table.as_ref().map(|t| t.display().to_string()),
        })
    }

    fn one(&self, number: usize) -> Result<Recording> {
        let (_, path) = self
            .recordings
            .get(number)
            .ok_or_else(|| Error::new(DataCode::CallInvalid, "there is no such recording"))?;
        let mut all = Reader::new().file(path)?;
        if all.is_empty() {
            return Err(Error::new(DataCode::RecordingEmpty, "the recording is empty").file(path));
        }
        Ok(all.remove(0))
    }

    /// The curves of a recording, thinned for the eye.
    ///
    /// # Errors
    /// A recording that is not there or cannot be read.
    pub fn curves(&self, number: usize) -> Result<Value> {
        let r = self.one(number)?;
        let every = r.len().div_ceil(POINTS).max(1);
        let thin = |v: &[f64], scale: f64| v.iter().step_by(every).map(|x| x * scale).collect::<Vec<_>>();
        let start = r.time.first().copied().unwrap_or(0.0);
        Ok(json!({
            "name": self.recordings[number].0,
            "t": r.time.iter().step_by(every).map(|t| t - start).collect::<Vec<_>>(),
            "F": r.force.as_ref().map(|f| thin(f, 1.0)),
            "P": thin(&r.pressure, 1e-3),
            "x": thin(&r.stroke, 1e3),
            "rows": r.len(),
        }))
    }

    /// Two recordings, in numbers.
    ///
    /// # Errors
    /// As [`compare`].
    pub fn compare(&self, a: usize, b: usize) -> Result<Value> {
        let found = compare(&self.one(a)?, &self.one(b)?)?;
        let mut value = found.to_json();
        value["text"] = json!(found.to_text());
        Ok(value)
    }

    fn read(&self, muscle: &str) -> Result<(MuscleDescription, Campaign)> {
        let muscle = MuscleDescription::parse(muscle)?;
        let campaign = Reader::of(&muscle).campaign(self.recordings.iter().map(|r| &r.1))?;
        Ok((muscle, campaign))
    }

    /// Fits all recordings; the table is then what `flash` sends.
    ///
    /// # Errors
    /// As [`fit`], and for a muscle description that is not right.
    pub fn fit(&mut self, muscle: &str) -> Result<Value> {
        let (muscle, campaign) = self.read(muscle)?;
        let options = Options::default();
        let fitted = fit(&campaign, &muscle, &options)?;
        let files: Vec<PathBuf> = self.recordings.iter().map(|r| r.1.clone()).collect();
        let hashes = files.iter().map(table_file::sha256).collect::<Result<Vec<_>>>()?;
        let about = About {
            muscle: muscle.name.clone(),
            date: date::now_utc(),
            tool: format!("host {} studio", env!("CARGO_PKG_VERSION")),
            sources: table_file::sources(&campaign, &files, hashes),
            fit: fitted.summary.quality(),
            uncertainty: Some(fitted.stored_uncertainty()),
            corrections: Vec::new(),
            mountings: fitted.solution.problem.mountings.iter().map(|m| (m.stroke, m.offset)).collect(),
        };
        let path = self.folder.join("fitted.pam");
        TableFile { table: fitted.table.clone(), about }.write(&path)?;
        let lines = lines(&campaign, &fitted.table)?;
        self.table = Some(path.clone());
        self.reports.insert("fit", fit_page::page(&fitted, &campaign, &options).html());
        Ok(
            json!({ "summary": fitted.summary, "text": fitted.summary.to_string(), "lines": lines, "table": path.display().to_string() }),
        )
    }

    /// What the model leaves out of all recordings.
    ///
    /// # Errors
    /// As [`pam_diagnose::diagnose`].
    pub fn diagnose(&mut self, muscle: &str) -> Result<Value> {
        let (muscle, campaign) = self.read(muscle)?;
        let geometry = muscle.geometry();
        let answer = pam_diagnose::diagnose(
            &campaign,
            &geometry,
            &pam_diagnose::Options { muscle: muscle.name.clone(), ..Default::default() },
        )?;
        self.reports.insert("diagnosis", diagnose_page::page(&answer, &geometry, &campaign).html());
        Ok(json!({ "text": pam_diagnose::summary::summary(&answer) }))
    }

    /// The folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }
}

/// Measured and fitted load lines: contraction in percent, force in N.
fn lines(campaign: &Campaign, table: &model_core::table::MuscleTable) -> Result<Vec<Value>> {
    let muscle =
        Muscle::<f64>::build(table).map_err(|e| Error::new(DataCode::TableInvalid, e.to_string()))?;
    let l0 = f64::from(table.geometry.rest_length.metres());
    let mut out = Vec::new();
    for recording in &campaign.recordings {
        let Ok(force) = recording.require_force() else { continue };
        let every = recording.len().div_ceil(400).max(1);
        let pressure = recording.pressure.iter().sum::<f64>() / recording.len().max(1) as f64;
        let longest = recording.stroke.iter().copied().fold(0.0_f64, f64::max);
        let mut model = (Vec::new(), Vec::new());
        for direction in [1.0, -1.0] {
            for j in 0..=40 {
                // Out and back along one closed line.
                let share = if direction > 0.0 { f64::from(j) } else { f64::from(40 - j) } / 40.0;
                let stroke = longest * share;
                model.0.push(100.0 * stroke / l0);
                model.1.push(
                    muscle
                        .force(Pressure::from_pascals(pressure), Length::from_metres(stroke), direction)
                        .newtons(),
                );
            }
        }
        out.push(json!({
            "kPa": pressure / 1e3,
            "x": recording.stroke.iter().step_by(every).map(|x| 100.0 * x / l0).collect::<Vec<_>>(),
            "F": force.iter().step_by(every).collect::<Vec<_>>(),
            "mx": model.0, "mF": model.1,
        }));
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_from_the_page_stay_in_the_folder_and_bad_ones_leave_nothing() {
        let folder = std::env::temp_dir().join(format!("pam-workshop-{}", std::process::id()));
        let mut workshop = Workshop::new(folder.clone()).unwrap();
        let error = workshop.upload("../../etc/x.csv", b"not a recording").unwrap_err();
        assert_eq!(error.exit_status(), 1);
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0);
        let mut text = String::from("time_s,pressure_kPa,displacement_mm,force_N\n");
        for i in 0..20 {
            text += &format!("{i},200,{},{}\n", i, 50 - i);
        }
        workshop.upload("../../etc/x.csv", text.as_bytes()).unwrap();
        let names: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().file_name()).collect();
        assert_eq!(names, ["1-_.._etc_x.csv"]);
        assert_eq!(workshop.curves(0).unwrap()["rows"], 20);
        assert!(workshop.curves(1).is_err());
        assert!(workshop.fit("name = 1").is_err());
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
