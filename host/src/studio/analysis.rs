//! Recordings on the page: loaded, fitted, diagnosed, compared. Files lie in one folder, under names that this program makes.

use std::collections::{HashSet, VecDeque};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use model_core::muscle::Muscle;
use model_core::units::{Length, Pressure};

use super::access::{same, token};
use super::answers::{Compared, Curves, Diagnosed, Fitted, LoadLine, Recordings};
use crate::change_watch::Reference;
use crate::console::Console;
use crate::demo::campaign::record;
use crate::documents::bench::Compare;
use crate::program_name::in_page;
use pam_data::compare::compare;
use pam_data::date;
use pam_data::error::{DataCode, Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::{Campaign, Hashes, Reader, Recording};
use pam_fit::table_file;
use pam_fit::{Options, fit};
use pam_report::{diagnose_page, fit_page};

/// Points of a curve that are sent to the page.
const POINTS: usize = 1_500;

/// Reports that can still be opened; older ones are forgotten.
const REPORTS: usize = 8;

/// The folder, and what is known of the files in it. Nothing is computed, read or written while `Known` is locked: who waits for
/// it waits for microseconds.
#[derive(Debug)]
pub struct Analysis {
    folder: PathBuf,
    known: Mutex<Known>,
}

/// The name of a recording on the page, and its file.
type NamedFile = (String, PathBuf);

#[derive(Debug, Default)]
struct Known {
    recordings: Vec<NamedFile>,
    /// The table of the last fit that ended.
    table: Option<PathBuf>,
    reports: VecDeque<(String, Arc<str>)>,
    /// Paths that were given away, whether or not a file lies there yet.
    given: HashSet<PathBuf>,
}

impl Analysis {
    /// Nothing yet, in a folder that is made where it is missing.
    ///
    /// # Errors
    /// [`DataCode::FileUnwritable`].
    pub fn new(folder: PathBuf) -> Result<Self> {
        std::fs::create_dir_all(&folder).map_err(|e| Error::unwritable(&folder, &e))?;
        Ok(Self { folder, known: Mutex::default() })
    }

    fn state(&self) -> MutexGuard<'_, Known> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The table of the last fit, if there is one.
    ///
    /// # Errors
    /// [`DataCode::CallInvalid`] when nothing was fitted yet.
    pub fn table(&self) -> Result<PathBuf> {
        self.state().table.clone().ok_or_else(|| {
            Error::new(DataCode::CallInvalid, "no table exists yet").help("fit recordings first")
        })
    }

    /// The table of the last fit, when it is the one of this name: what is sent is what was shown.
    ///
    /// # Errors
    /// [`DataCode::CallInvalid`] when another fit ended since.
    pub fn table_named(&self, name: &str) -> Result<PathBuf> {
        let table = self.table()?;
        if table.as_os_str() != name {
            return Err(Error::new(
                DataCode::CallInvalid,
                "there is a newer table than the one that was compared",
            )
            .help("show the difference to the device again"));
        }
        Ok(table)
    }

    /// What a running controller is compared with: all recordings, or the table of the last fit.
    ///
    /// # Errors
    /// [`DataCode::CallInvalid`] where there is none, or as it is read.
    pub fn reference(&self, table: bool) -> Result<Reference> {
        let files = if table {
            vec![self.table()?]
        } else {
            self.state().recordings.iter().map(|r| r.1.clone()).collect()
        };
        if files.is_empty() {
            return Err(Error::new(DataCode::CallInvalid, "no recordings to compare with")
                .help("record a minute of ordinary motion, or load an earlier recording"));
        }
        Reference::read(&files, None, &Console::silent())
    }

    /// A report by its name, which only its creator knows.
    #[must_use]
    pub fn report(&self, name: &str) -> Option<Arc<str>> {
        self.state().reports.iter().find(|r| same(&r.0, name)).map(|r| Arc::clone(&r.1))
    }

    /// Keeps a report; gives its address, in which its name is a random one.
    fn keep_report(known: &mut Known, name: String, html: String) -> String {
        let address = format!("/report/{name}");
        known.reports.push_back((name, html.into()));
        while known.reports.len() > REPORTS {
            known.reports.pop_front();
        }
        address
    }

    /// A path in the folder that neither a file nor another caller has.
    fn free(&self, stem: &str, extension: &str) -> PathBuf {
        let mut number = 1;
        loop {
            let path = self.folder.join(format!("{stem}-{number}.{extension}"));
            if !path.exists() && self.state().given.insert(path.clone()) {
                return path;
            }
            number += 1;
        }
    }

    /// A path for the next recording of the controller.
    #[must_use]
    pub fn next_run(&self) -> PathBuf {
        self.free("run", "csv")
    }

    /// Adds a recording that lies in a file.
    pub fn add(&self, path: PathBuf) {
        self.state().recordings.push((name_of(&path), path));
    }

    /// Keeps a file that the page sent piece by piece, after it was read without complaint.
    ///
    /// # Errors
    /// What is wrong with the file, by line and column; what broke the pieces off.
    pub fn upload<B: AsRef<[u8]>>(
        &self,
        name: &str,
        pieces: impl IntoIterator<Item = Result<B>>,
    ) -> Result<Recordings> {
        // Only letters, digits, dots, dashes: a name can never lead out of the folder.
        let plain: String = name
            .chars()
            .map(|c| if c.is_ascii_alphanumeric() || "._-".contains(c) { c } else { '_' })
            .take(100)
            .collect();
        let plain = plain.trim_start_matches('.');
        let unwritable = |e: &std::io::Error| Error::unwritable(&self.folder, e);
        // The ending says what is in a file that has no mark of its own.
        let mut file = tempfile::Builder::new()
            .prefix(".upload-")
            .suffix(&format!("-{plain}"))
            .tempfile_in(&self.folder)
            .map_err(|e| unwritable(&e))?;
        for piece in pieces {
            file.write_all(piece?.as_ref()).map_err(|e| unwritable(&e))?;
        }
        file.as_file().sync_all().map_err(|e| unwritable(&e))?;
        Reader::new().file(file.path()).map_err(|e| e.file(plain))?;
        let mut number = 0;
        let path = loop {
            number += 1;
            let path = self.folder.join(format!("{number}-{plain}"));
            match file.persist_noclobber(&path) {
                Ok(_) => break path,
                Err(e) if e.error.kind() == std::io::ErrorKind::AlreadyExists => file = e.file,
                Err(e) => return Err(Error::unwritable(&path, &e.error)),
            }
        };
        self.add(path);
        Ok(self.list())
    }

    /// A campaign of the virtual bench, for trying.
    ///
    /// # Errors
    /// As [`record`].
    pub fn example(&self, muscle: &str) -> Result<Recordings> {
        let made = record(muscle, 1, &self.folder.join("example"))?;
        let text = std::fs::read_to_string(&made.muscle).map_err(|e| Error::unreadable(&made.muscle, &e))?;
        self.state().recordings = made.recordings.into_iter().map(|p| (name_of(&p), p)).collect();
        Ok(Recordings { muscle: Some(text), ..self.list() })
    }

    /// What there is.
    #[must_use]
    pub fn list(&self) -> Recordings {
        let known = self.state();
        Recordings {
            recordings: known.recordings.iter().map(|r| r.0.clone()).collect(),
            table: known.table.as_ref().map(|t| t.display().to_string()),
            muscle: None,
        }
    }

    fn one(&self, number: usize) -> Result<(String, Recording)> {
        let (name, path) = self
            .state()
            .recordings
            .get(number)
            .cloned()
            .ok_or_else(|| Error::new(DataCode::CallInvalid, "this recording does not exist"))?;
        let mut all = Reader::new().file(&path)?;
        if all.is_empty() {
            return Err(Error::new(DataCode::RecordingEmpty, "the recording is empty").file(path));
        }
        Ok((name, all.remove(0)))
    }

    /// The curves of a recording, downsampled for drawing.
    ///
    /// # Errors
    /// A recording that is not there or cannot be read.
    pub fn curves(&self, number: usize) -> Result<Curves> {
        let (name, r) = self.one(number)?;
        let every = r.len().div_ceil(POINTS).max(1);
        let downsampled =
            |v: &[f64], scale: f64| v.iter().step_by(every).map(|x| x * scale).collect::<Vec<_>>();
        let start = r.time.first().copied().unwrap_or(0.0);
        Ok(Curves {
            name,
            t: r.time.iter().step_by(every).map(|t| t - start).collect(),
            F: r.force.as_ref().map(|f| downsampled(f, 1.0)),
            P: downsampled(&r.pressure, 1e-3),
            x: downsampled(&r.stroke, 1e3),
            rows: r.len(),
        })
    }

    /// Two recordings, in numbers.
    ///
    /// # Errors
    /// As [`compare`].
    pub fn compare(&self, a: usize, b: usize) -> Result<Compared> {
        let found = compare(&self.one(a)?.1, &self.one(b)?.1)?;
        Ok(Compared { found: Compare::of(&found), text: found.to_text() })
    }

    fn read(&self, muscle: &str) -> Result<(MuscleDescription, Campaign, Vec<PathBuf>, Vec<String>)> {
        let muscle = MuscleDescription::parse(muscle)?;
        let files: Vec<PathBuf> = self.state().recordings.iter().map(|r| r.1.clone()).collect();
        let hashes = Arc::new(Hashes::default());
        let campaign =
            Reader { hashes: Some(Arc::clone(&hashes)), ..Reader::of(&muscle) }.campaign(&files)?;
        let hashes = hashes.of(&files)?;
        Ok((muscle, campaign, files, hashes))
    }

    /// Fits all recordings; the table is then what `flash` sends. Each fit has a table file and a report of its own, and both become
    /// known immediately.
    ///
    /// # Errors
    /// As [`fit`], and for a muscle description that is not right.
    pub fn fit(&self, muscle: &str) -> Result<Fitted> {
        let (muscle, campaign, files, hashes) = self.read(muscle)?;
        let options = Options::default();
        let fitted = fit(&campaign, &muscle, &options)?;
        let mut table = fitted.table_file(format!("host {} studio", env!("CARGO_PKG_VERSION")));
        table.about.date = date::now_utc();
        table.about.sources = table_file::sources(&campaign, &files, hashes);
        let path = self.free("fitted", "pam");
        table.write(&path)?;
        let lines = lines(&campaign, &fitted.table)?;
        let html = in_page(fit_page::page(&fitted, &campaign, &options).html());
        let name = report_name()?;
        let mut known = self.state();
        known.table = Some(path.clone());
        let report = Self::keep_report(&mut known, name, html);
        drop(known);
        let text = fitted.summary.to_string();
        Ok(Fitted { summary: fitted.summary, text, lines, table: path.display().to_string(), report })
    }

    /// What the model leaves out of all recordings.
    ///
    /// # Errors
    /// As [`pam_diagnose::diagnose_described`].
    pub fn diagnose(&self, muscle: &str) -> Result<Diagnosed> {
        let (muscle, campaign, ..) = self.read(muscle)?;
        let geometry = muscle.geometry();
        let options = pam_diagnose::Options { muscle: muscle.name.clone(), ..Default::default() };
        let plain = pam_fit::fit(&campaign, &muscle, &pam_fit::Options::default());
        let answer = pam_diagnose::diagnose_described(&campaign, &muscle, &options, plain.as_ref())?;
        let html = in_page(diagnose_page::page(&answer, &geometry, &campaign).html());
        let report = Self::keep_report(&mut self.state(), report_name()?, html);
        Ok(Diagnosed { text: pam_report::wording::summary(&answer), report })
    }
}

fn report_name() -> Result<String> {
    token().map_err(|e| Error::new(DataCode::CallInvalid, format!("the system gives no random numbers: {e}")))
}

fn name_of(path: &Path) -> String {
    path.file_stem().map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

/// Measured and fitted load lines: contraction in percent, force in N.
fn lines(campaign: &Campaign, table: &model_core::table::MuscleTable) -> Result<Vec<LoadLine>> {
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
        out.push(LoadLine {
            kPa: pressure / 1e3,
            x: recording.stroke.iter().step_by(every).map(|x| 100.0 * x / l0).collect(),
            F: force.iter().step_by(every).copied().collect(),
            mx: model.0,
            mF: model.1,
        });
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pieces(bytes: &[u8]) -> impl Iterator<Item = Result<&[u8]>> {
        bytes.chunks(7).map(Ok)
    }

    #[test]
    fn files_from_the_page_stay_in_the_folder_and_bad_ones_leave_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let analysis = Analysis::new(folder.path().to_owned()).unwrap();
        let error = analysis.upload("../../etc/x.csv", pieces(b"not a recording")).unwrap_err();
        assert_eq!(error.exit_status(), 1);
        let broken = [Ok(b"time_s".as_slice()), Err(Error::new(DataCode::CallInvalid, "broken off"))];
        assert_eq!(analysis.upload("x.csv", broken).unwrap_err().cause(), "broken off");
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0);
        let mut text = String::from("time_s,pressure_kPa,displacement_mm,force_N\n");
        for i in 0..20 {
            text += &format!("{i},200,{},{}\n", i, 50 - i);
        }
        analysis.upload("../../etc/x.csv", pieces(text.as_bytes())).unwrap();
        let names: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().file_name()).collect();
        assert_eq!(names, ["1-_.._etc_x.csv"]);
        assert_eq!(analysis.curves(0).unwrap().rows, 20);
        assert!(analysis.curves(1).is_err());
        assert!(analysis.fit("name = 1").is_err());
    }

    #[test]
    fn the_table_and_the_report_of_one_fit_belong_together() {
        let folder = tempfile::tempdir().unwrap();
        let analysis = Analysis::new(folder.path().to_owned()).unwrap();
        let muscle = analysis.example("mini").unwrap().muscle.unwrap();
        let (one, other) = std::thread::scope(|scope| {
            let one = scope.spawn(|| analysis.fit(&muscle).unwrap());
            let other = scope.spawn(|| analysis.fit(&muscle).unwrap());
            (one.join().unwrap(), other.join().unwrap())
        });
        assert_ne!(one.table, other.table);
        assert_ne!(one.report, other.report);
        let last = analysis.table().unwrap();
        for fit in [&one, &other] {
            let table = fit.table.as_str();
            assert!(table_file::TableFile::read(table).is_ok());
            // Only what was fitted last can be sent, and only under its own name.
            assert_eq!(analysis.table_named(table).is_ok(), last.as_os_str() == table);
            let name = fit.report.strip_prefix("/report/").unwrap();
            assert_eq!(name.len(), 32);
            assert!(analysis.report(name).unwrap().contains("<html"));
        }
        assert!(analysis.report("fit").is_none());
    }
}
