//! `pamtools`: recordings, fits, predictions and diagnoses of pneumatic artificial muscles, with numpy arrays.
//!
//! Everything is in SI units inside arrays (s, Pa, m, N, K), regardless of the units in the files.

use std::collections::BTreeMap;
use std::ffi::CString;
use std::path::PathBuf;

use model_core::inverse::Reach;
use model_core::muscle::Muscle as Model;
use model_core::units::{Force, Length, Pressure};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArrayDyn};
use pam_data::date;
use pam_data::error::{DataCode, Error};
use pam_data::muscle_description::{Kind, MuscleDescription};
use pam_data::physical_limits::{self, Contractions};
use pam_data::pluralise::pluralise;
use pam_data::recording::{Campaign as HostCampaign, Import, Reader, Recording as HostRecording};
use pam_diagnose as diagnosis;
use pam_evaluate::cross_validation::{Split, cross_validate};
use pam_fit::Fit as HostFit;
use pam_fit::Options;
use pam_fit::confidence_band::{ConfidenceBand, HALF_95};
use pam_fit::predict::{Predicted, beyond, predict as host_predict, predict_with_bands};
use pam_fit::table_faults::table_faults;
use pam_fit::table_file::{self, About, TableFile};
use pam_report::{Page, diagnose_page, fit_page};
use pyo3::create_exception;
use pyo3::exceptions::{PyIndexError, PyUserWarning, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyModule, PyTuple};

create_exception!(
    pamtools,
    PamError,
    PyValueError,
    "What is wrong: the text names cause, place and remedy; code, cause, file, line, column and help give them one by one."
);

/// The error as an exception: its text names cause, place and remedy, its attributes give them one by one.
fn raised(error: Error) -> PyErr {
    let help = error.advice().map_or(String::new(), |a| format!("; {a}"));
    let exception = PamError::new_err(format!("{error}{help}"));
    let place = error.place();
    let file = place.file.as_ref().map(|f| f.display().to_string());
    let told = Python::attach(|py| {
        let value = exception.value(py);
        value.setattr("code", error.code().name())?;
        value.setattr("cause", error.cause())?;
        value.setattr("file", file)?;
        value.setattr("line", place.line)?;
        value.setattr("column", place.column.as_deref())?;
        value.setattr("help", error.advice())
    });
    told.err().unwrap_or(exception)
}

fn wrong(text: impl Into<String>) -> PyErr {
    raised(Error::new(DataCode::CallInvalid, text).help("help() of the function shows what it takes"))
}

/// Anything that numpy takes for a column of numbers.
fn column(name: &str, values: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let array = numbers(name, values)?;
    let shape: Vec<usize> = array.getattr("shape")?.extract()?;
    if shape.len() != 1 {
        return Err(raised(
            Error::new(DataCode::CallInvalid, format!("`{name}` has {} dimensions", shape.len()))
                .help("give a one-dimensional array, one number a row"),
        ));
    }
    let array: PyReadonlyArrayDyn<'_, f64> = array.extract()?;
    Ok(array.as_array().iter().copied().collect())
}

/// Anything that numpy can turn into an array of numbers.
fn numbers<'py>(name: &str, values: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let py = values.py();
    let numpy = PyModule::import(py, "numpy")?;
    // numpy would drop the imaginary parts with no more than a warning.
    if numpy.call_method1("iscomplexobj", (values,))?.is_truthy()? {
        return Err(raised(
            Error::new(DataCode::CallInvalid, format!("`{name}` holds complex numbers"))
                .help("give its real part"),
        ));
    }
    numpy.call_method1("asarray", (values, "float64")).map_err(|e| {
        raised(
            Error::new(DataCode::CallInvalid, format!("`{name}` is no array of numbers: {}", e.value(py))).help(
                "give a numpy array, a list or a column of a data frame; missing values are not filled in",
            ),
        )
    })
}

/// JSON text as Python values.
fn loads<'py>(py: Python<'py>, text: &str) -> PyResult<Bound<'py, PyAny>> {
    PyModule::import(py, "json")?.call_method1("loads", (text,))
}

/// A muscle as its maker or a calliper describes it: lengths in mm, the braid angle in degrees from the radial plane.
#[pyclass(frozen)]
#[derive(Clone)]
struct Muscle(MuscleDescription);

#[pymethods]
impl Muscle {
    #[new]
    #[pyo3(signature = (name, rest_length_mm, braid_angle_deg, bladder_outer_diameter_mm, bladder_wall_mm, kind = "contractile",
        max_pressure_kpa = None, young_modulus_mpa = None))]
    #[allow(clippy::too_many_arguments)] // They are the lines of the description's file.
    fn new(
        name: &str,
        rest_length_mm: f64,
        braid_angle_deg: f64,
        bladder_outer_diameter_mm: f64,
        bladder_wall_mm: f64,
        kind: &str,
        max_pressure_kpa: Option<f64>,
        young_modulus_mpa: Option<f64>,
    ) -> PyResult<Self> {
        // Through the text form, so that every check of a file holds here, too.
        let mut text = format!(
            "name = {}\nkind = {}\nrest_length_mm = {rest_length_mm:?}\nbraid_angle_deg = {braid_angle_deg:?}\n\
             bladder_outer_diameter_mm = {bladder_outer_diameter_mm:?}\nbladder_wall_mm = {bladder_wall_mm:?}\n",
            serde_json::Value::from(name),
            serde_json::Value::from(kind)
        );
        if let Some(p) = max_pressure_kpa {
            text += &format!("max_pressure_kPa = {p:?}\n");
        }
        if let Some(e) = young_modulus_mpa {
            text += &format!("young_modulus_MPa = {e:?}\n");
        }
        MuscleDescription::parse(&text).map(Self).map_err(raised)
    }

    /// Reads a description (TOML).
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        MuscleDescription::read(path).map(Self).map_err(raised)
    }

    /// What it is called.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// L0, m.
    #[getter]
    fn rest_length(&self) -> f64 {
        self.0.rest_length()
    }

    /// `contractile` or `push`.
    #[getter]
    fn kind(&self) -> &'static str {
        match self.0.kind {
            Kind::Contractile => "contractile",
            Kind::Push => "push",
        }
    }

    fn __repr__(&self) -> String {
        format!("Muscle({:?}, rest_length_mm={})", self.0.name, self.0.rest_length_mm)
    }
}

/// One recording, columns in SI units.
#[pyclass(frozen)]
#[derive(Clone)]
struct Recording(HostRecording);

#[pymethods]
impl Recording {
    #[new]
    #[pyo3(signature = (name, time, pressure, stroke, force = None, temperature = None))]
    fn new(
        name: String,
        time: &Bound<'_, PyAny>,
        pressure: &Bound<'_, PyAny>,
        stroke: &Bound<'_, PyAny>,
        force: Option<&Bound<'_, PyAny>>,
        temperature: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let recording = HostRecording {
            name,
            time: column("time", time)?,
            pressure: column("pressure", pressure)?,
            stroke: column("stroke", stroke)?,
            force: force.map(|f| column("force", f)).transpose()?,
            temperature: temperature.map(|t| column("temperature", t)).transpose()?,
            ..HostRecording::default()
        };
        recording.check().map_err(|e| raised(e.file(format!("recording `{}`", recording.name))))?;
        Ok(Self(recording))
    }

    /// What it is called: its file's name, where it was read from one.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// Time, s.
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.time.clone().into_pyarray(py)
    }

    /// Gauge pressure, Pa.
    #[getter]
    fn pressure<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.pressure.clone().into_pyarray(py)
    }

    /// Contraction stroke, m.
    #[getter]
    fn stroke<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.stroke.clone().into_pyarray(py)
    }

    /// N, or None.
    #[getter]
    fn force<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.0.force.clone().map(|f| f.into_pyarray(py))
    }

    /// K, or None.
    #[getter]
    fn temperature<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.0.temperature.clone().map(|t| t.into_pyarray(py))
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }

    fn __repr__(&self) -> String {
        format!(
            "Recording({:?}, {}, {:.1} s)",
            self.0.name,
            pluralise(self.0.len(), "row"),
            self.0.duration()
        )
    }
}

/// Recordings of one muscle in chronological order.
#[pyclass(frozen)]
#[derive(Clone)]
struct Campaign(HostCampaign);

#[pymethods]
impl Campaign {
    #[new]
    fn new(recordings: Vec<PyRef<'_, Recording>>) -> Self {
        Self(HostCampaign::new(recordings.iter().map(|r| r.0.clone()).collect()))
    }

    /// The recordings, in order.
    #[getter]
    fn recordings(&self) -> Vec<Recording> {
        self.0.recordings.iter().cloned().map(Recording).collect()
    }

    /// What was noticed while reading.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.0.warnings.clone()
    }

    fn __len__(&self) -> usize {
        self.0.recordings.len()
    }

    /// One recording, from the end where the number is negative; for iteration over a campaign.
    fn __getitem__(&self, index: isize) -> PyResult<Recording> {
        let count = self.0.recordings.len();
        let from_start = if index < 0 { index.checked_add_unsigned(count) } else { Some(index) };
        from_start
            .and_then(|i| usize::try_from(i).ok())
            .and_then(|i| self.0.recordings.get(i).cloned())
            .map(Recording)
            .ok_or_else(|| PyIndexError::new_err(format!("recording {index} of {count}")))
    }

    fn __repr__(&self) -> String {
        format!(
            "Campaign({}, {})",
            pluralise(self.0.recordings.len(), "recording"),
            pluralise(self.0.samples(), "row")
        )
    }
}

/// One file, or several.
#[derive(FromPyObject)]
enum Paths {
    One(PathBuf),
    Several(Vec<PathBuf>),
}

/// Reads a file, or several in chronological order; `import_description` is the TOML file for other formats.
///
/// `filters` maps columns to the text that rows must have, as `--where` of `host fit`: `{"run": "1,2", "condition!": "Kinked69mm"}`.
#[pyfunction]
#[pyo3(signature = (paths, muscle = None, import_description = None, filters = None))]
fn read(
    py: Python<'_>,
    paths: Paths,
    muscle: Option<PyRef<'_, Muscle>>,
    import_description: Option<PathBuf>,
    filters: Option<BTreeMap<String, String>>,
) -> PyResult<Campaign> {
    let muscle = muscle.map(|m| m.0.clone());
    let paths = match paths {
        Paths::One(path) => vec![path],
        Paths::Several(paths) => paths,
    };
    py.detach(|| {
        let import = import_description.as_ref().map(Import::read).transpose()?;
        let mut reader = muscle.as_ref().map_or_else(Reader::new, Reader::of).import(import.as_ref());
        reader.filters.extend(filters.unwrap_or_default());
        reader.campaign(&paths)
    })
    .map(Campaign)
    .map_err(raised)
}

fn write_report(page: &Page, path: &PathBuf) -> PyResult<()> {
    pam_data::output::write_whole(path, page.html().as_bytes()).map_err(raised)
}

/// What a table says of one recording.
#[pyclass(frozen)]
struct Prediction(Predicted);

#[pymethods]
impl Prediction {
    /// The force that the load cell would read, N.
    #[getter]
    fn force<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.force.clone().into_pyarray(py)
    }

    /// Half the width of the 95 % interval of the table's own force, N, per row; None where the table holds no uncertainty.
    #[getter]
    fn band<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.0.bands.as_ref().map(|b| b.half.clone().into_pyarray(py))
    }

    /// Root mean square of measured minus predicted force, N; None without a force column.
    #[getter]
    fn rms(&self) -> Option<f64> {
        self.0.rms
    }

    /// The share of readings within the 95 % interval of single readings, 0 to 1; None where either is not known.
    #[getter]
    fn inside(&self) -> Option<f64> {
        self.0.bands.as_ref().and_then(|b| b.inside)
    }

    fn __len__(&self) -> usize {
        self.0.force.len()
    }

    fn __repr__(&self) -> String {
        let rms = self.0.rms.map_or(String::new(), |r| format!(", rms {r:.3} N"));
        let band = self.0.bands.as_ref().map_or(String::new(), |b| format!(", ± {:.3} N", b.mean));
        format!("Prediction({}{rms}{band})", pluralise(self.0.force.len(), "row"))
    }
}

/// A fitted table.
#[pyclass(frozen)]
#[derive(Clone)]
struct Table(TableFile);

#[pymethods]
impl Table {
    /// Reads a `.pam` file.
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        TableFile::read(path).map(Self).map_err(raised)
    }

    /// Writes a `.pam` file.
    fn write(&self, path: PathBuf) -> PyResult<()> {
        self.0.write(path).map_err(raised)
    }

    /// P0, Pa.
    #[getter]
    fn deadband(&self) -> f64 {
        f64::from(self.0.table.deadband.pascals())
    }

    /// Pressures of the nodes, Pa.
    #[getter]
    fn nodes<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.table.nodes.iter().map(|p| f64::from(*p)).collect::<Vec<_>>().into_pyarray(py)
    }

    /// The curves `E_1 …` at the nodes, Pa.
    #[getter]
    fn elastic<'py>(&self, py: Python<'py>) -> Vec<Bound<'py, PyArray1<f64>>> {
        let curve = |c: &[f32]| c.iter().map(|e| f64::from(*e)).collect::<Vec<_>>().into_pyarray(py);
        self.0.table.elastic.iter().map(|c| curve(c)).collect()
    }

    /// k_F at the nodes.
    #[getter]
    fn friction<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.table.friction.iter().map(|k| f64::from(*k)).collect::<Vec<_>>().into_pyarray(py)
    }

    /// Force (N) of the base model at pressures (Pa) and strokes (m); `direction` is 1 shortening, -1 lengthening, 0 the mid-line.
    /// Raises PamError for a length that the braid cannot have; warns where the table was not fitted.
    /// Numbers and arrays of any shape, as numpy broadcasts them.
    #[pyo3(signature = (pressure, stroke, direction = None))]
    fn force<'py>(
        &self,
        pressure: &Bound<'py, PyAny>,
        stroke: &Bound<'py, PyAny>,
        direction: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let model = Model::<f64>::build(&self.0.table).map_err(|e| wrong(e.to_string()))?;
        over(&self.0, &model, pressure, stroke, direction, |p, x, s| {
            model.force(Pressure::from_pascals(p), Length::from_metres(x), s).newtons()
        })
    }

    /// The pressure (Pa) at which the base model pulls with a force (N) at a stroke (m), as the controller computes it; `direction` as for
    /// `force`. NaN where no pressure up to the highest allowed one does.
    #[pyo3(signature = (force, stroke, direction = None))]
    fn pressure<'py>(
        &self,
        force: &Bound<'py, PyAny>,
        stroke: &Bound<'py, PyAny>,
        direction: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let model = Model::<f64>::build(&self.0.table).map_err(|e| wrong(e.to_string()))?;
        let search = model.search();
        let solve = |f: f64, x: f64, s: f64| {
            let held = model.at_stroke(Length::from_metres(x));
            let found = model.pressure_for(Force::from_newtons(f), &held, s, Pressure::ZERO, &search);
            if found.reach == Reach::Reached { found.pressure.pascals() } else { f64::NAN }
        };
        let check = |places: &[(f64, f64)]| {
            let contractions = Contractions::of(model.braid());
            places.iter().try_for_each(|(f, x)| {
                physical_limits::force(*f).and_then(|()| contractions.check(x / model.braid().rest_length()))
            })
        };
        broadcast(["force", "stroke", "direction"], force, stroke, direction, check, solve)
            .map(|(array, _)| array)
    }

    /// What makes the table useless for control, a sentence each; empty where nothing does.
    fn faults(&self) -> Vec<String> {
        table_faults(&self.0.table, self.0.about.uncertainty.as_ref(), &self.0.about.fit)
    }

    /// A table from the bytes of a .pam file.
    #[staticmethod]
    fn from_bytes(bytes: &[u8]) -> PyResult<Self> {
        TableFile::from_bytes(bytes).map(Self).map_err(raised)
    }

    /// The bytes of the .pam file.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &self.0.to_bytes().map_err(raised)?))
    }

    /// For pickle and copy.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        Ok((py.get_type::<Self>().getattr("from_bytes")?, (self.to_bytes(py)?,)))
    }

    /// Half the width of the 95 % interval of that force (N), at the same places: the uncertainty of the table's numbers. None where
    /// the table holds no uncertainty.
    #[pyo3(signature = (pressure, stroke, direction = None))]
    fn force_band<'py>(
        &self,
        pressure: &Bound<'py, PyAny>,
        stroke: &Bound<'py, PyAny>,
        direction: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(band) = ConfidenceBand::of(&self.0) else { return Ok(None) };
        let model = Model::<f64>::build(&self.0.table).map_err(|e| wrong(e.to_string()))?;
        over(&self.0, &model, pressure, stroke, direction, |p, x, s| HALF_95 * band.std(p, x, s)).map(Some)
    }

    /// The force that the load cell would read, N: one array a recording. Effects and their memory run through the campaign.
    fn predict<'py>(
        &self,
        py: Python<'py>,
        campaign: PyRef<'_, Campaign>,
    ) -> PyResult<Vec<Bound<'py, PyArray1<f64>>>> {
        let (table, campaign) = (self.0.clone(), campaign.0.clone());
        let prediction = py.detach(move || host_predict(&table, &campaign)).map_err(raised)?;
        warn(py, &prediction.warnings)?;
        Ok(prediction.recordings.into_iter().map(|r| r.force.into_pyarray(py)).collect())
    }

    /// The same with its uncertainty and its error: one prediction per recording, with force, band, rms and inside.
    fn predict_with_bands(&self, py: Python<'_>, campaign: PyRef<'_, Campaign>) -> PyResult<Vec<Prediction>> {
        let (table, campaign) = (self.0.clone(), campaign.0.clone());
        let prediction = py.detach(move || predict_with_bands(&table, &campaign)).map_err(raised)?;
        warn(py, &prediction.warnings)?;
        Ok(prediction.recordings.into_iter().map(Prediction).collect())
    }

    fn __repr__(&self) -> String {
        format!(
            "Table({:?}, P0={:.1} kPa, {} nodes)",
            self.0.about.muscle,
            self.deadband() / 1e3,
            self.0.table.nodes.len()
        )
    }
}

/// Warnings, as Python's own: shown once per line, and silenced or raised by its filters.
fn warn(py: Python<'_>, warnings: &[String]) -> PyResult<()> {
    for text in warnings {
        let text = CString::new(text.as_str())?;
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)?;
    }
    Ok(())
}

/// A function of pressure, stroke and direction over arrays, as numpy broadcasts them. What the table's muscle cannot have is
/// refused, where the table extrapolates is said.
fn over<'py>(
    table: &TableFile,
    model: &Model<f64>,
    pressure: &Bound<'py, PyAny>,
    stroke: &Bound<'py, PyAny>,
    direction: Option<&Bound<'py, PyAny>>,
    of: impl Fn(f64, f64, f64) -> f64,
) -> PyResult<Bound<'py, PyAny>> {
    let py = pressure.py();
    let contractions = Contractions::of(model.braid());
    let check = |places: &[(f64, f64)]| {
        places.iter().try_for_each(|(p, x)| {
            physical_limits::pressure(*p).and_then(|()| contractions.check(x / model.braid().rest_length()))
        })
    };
    let names = ["pressure", "stroke", "direction"];
    let (array, places) = broadcast(names, pressure, stroke, direction, check, of)?;
    warn(py, &beyond(&table.table, &places))?;
    Ok(array)
}

/// A function of two quantities and the direction over arrays, as numpy broadcasts them, and the places that it was taken at.
fn broadcast<'py>(
    names: [&str; 3],
    first: &Bound<'py, PyAny>,
    second: &Bound<'py, PyAny>,
    direction: Option<&Bound<'py, PyAny>>,
    check: impl Fn(&[(f64, f64)]) -> Result<(), Error>,
    of: impl Fn(f64, f64, f64) -> f64,
) -> PyResult<(Bound<'py, PyAny>, Vec<(f64, f64)>)> {
    let py = first.py();
    let numpy = PyModule::import(py, "numpy")?;
    let first = numbers(names[0], first)?;
    let second = numbers(names[1], second)?;
    let direction = match direction {
        Some(given) => numbers(names[2], given)?,
        None => numpy.call_method1("zeros", ((),))?,
    };
    let same = numpy.call_method1("broadcast_arrays", (first, second, direction)).map_err(|e| {
        raised(
            Error::new(DataCode::CallInvalid, format!("the arrays do not fit each other: {}", e.value(py)))
                .help(format!("{} are numbers or arrays of one shape", names.join(", "))),
        )
    })?;
    let part = |i: usize| -> PyResult<PyReadonlyArrayDyn<'py, f64>> { Ok(same.get_item(i)?.extract()?) };
    let (a, x, s) = (part(0)?, part(1)?, part(2)?);
    if let Some(wrong_way) = s.as_array().iter().find(|s| !(-1.0..=1.0).contains(*s)) {
        return Err(wrong(format!(
            "`direction` is {wrong_way}; it is 1 shortening, -1 lengthening, 0 the mid-line"
        )));
    }
    let places: Vec<(f64, f64)> = a.as_array().iter().copied().zip(x.as_array().iter().copied()).collect();
    check(&places).map_err(raised)?;
    let values: Vec<f64> = places.iter().zip(s.as_array()).map(|((a, x), s)| of(*a, *x, *s)).collect();
    let shape = a.as_array().shape().to_vec();
    let array = values.into_pyarray(py).call_method1("reshape", (shape,))?;
    // One number for one place.
    let array = array.get_item(PyTuple::empty(py)).or(Ok::<_, PyErr>(array))?;
    Ok((array, places))
}

/// A finished fit.
#[pyclass(frozen)]
struct Fit {
    fit: HostFit,
    campaign: HostCampaign,
    options: Options,
}

#[pymethods]
impl Fit {
    /// The figures of the fit, as in the JSON of `host fit`.
    #[getter]
    fn summary<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let text = serde_json::to_string(&self.fit.summary).map_err(|e| wrong(e.to_string()))?;
        loads(py, &text)
    }

    /// The table.
    #[getter]
    fn table(&self) -> Table {
        let about = About {
            muscle: self.fit.summary.muscle.clone(),
            date: date::now_utc(),
            tool: format!("pamtools {}", env!("CARGO_PKG_VERSION")),
            fit: self.fit.summary.quality(),
            uncertainty: Some(self.fit.stored_uncertainty()),
            mountings: table_file::stored_mountings(&self.fit.solution.problem),
            ..About::default()
        };
        Table(TableFile { table: self.fit.table.clone(), about })
    }

    /// Writes the report, one HTML file.
    fn report(&self, path: PathBuf) -> PyResult<()> {
        write_report(&fit_page::page(&self.fit, &self.campaign, &self.options), &path)
    }

    fn __repr__(&self) -> String {
        let s = &self.fit.summary;
        format!("Fit({:?}, mean error {:.3} %, P0={:.1} kPa)", s.muscle, s.mean_error_pct, s.deadband_kPa)
    }
}

/// Fits a muscle's table to recordings.
#[pyfunction]
#[pyo3(signature = (campaign, muscle, order = 4, tip_correction = false, smoothing = None, fit_geometry = false, fit_lengths = false,
    physical = false))]
#[allow(clippy::too_many_arguments)] // They are the options of `host fit`.
fn fit(
    py: Python<'_>,
    campaign: PyRef<'_, Campaign>,
    muscle: PyRef<'_, Muscle>,
    order: i64,
    tip_correction: bool,
    smoothing: Option<f64>,
    fit_geometry: bool,
    fit_lengths: bool,
    physical: bool,
) -> PyResult<Fit> {
    let order = usize::try_from(order)
        .ok()
        .filter(|m| (1..=6).contains(m))
        .ok_or_else(|| wrong(format!("`order` is {order}; it must lie between 1 and 6")))?;
    if smoothing.is_some_and(|w| !(w.is_finite() && w >= 0.0)) {
        return Err(wrong("`smoothing` must be a number from 0 up, or None for an automatic choice"));
    }
    let options = Options {
        order,
        tip_correction,
        smoothing,
        fit_geometry,
        fit_lengths,
        physical,
        ..Options::default()
    };
    let (campaign, muscle) = (campaign.0.clone(), muscle.0.clone());
    let fit = py.detach(|| pam_fit::fit(&campaign, &muscle, &options)).map_err(raised)?;
    Ok(Fit { fit, campaign, options })
}

/// Scores a fit on held-out recordings: each run is left out in turn. Returns mean and rms error and bias in N, the percentage
/// of the largest measured force, and the errors by recording.
#[pyfunction]
#[pyo3(signature = (campaign, muscle, *, order = 4, leave_out = "runs"))]
fn evaluate<'py>(
    py: Python<'py>,
    campaign: PyRef<'py, Campaign>,
    muscle: PyRef<'py, Muscle>,
    order: usize,
    leave_out: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let split = match leave_out {
        "runs" => Split::Run,
        "contractions" => Split::Contraction,
        other => return Err(wrong(format!("`leave_out` is {other:?}; it is \"runs\" or \"contractions\""))),
    };
    let options = Options { order, ..Options::default() };
    let (campaign, muscle) = (campaign.0.clone(), muscle.0.clone());
    let held = py.detach(|| cross_validate(&campaign, &muscle, &options, split, None)).map_err(raised)?;
    let text = serde_json::json!({
        "rows": held.table.rows,
        "mean_N": held.table.mean(),
        "rms_N": held.table.rms(),
        "bias_N": held.table.bias(),
        "mean_pct": 100.0 * held.table.mean() / held.largest,
        "largest_force_N": held.largest,
        "recordings": held.recordings,
    });
    loads(py, &text.to_string())
}

/// Finds out what the model leaves out. Returns the JSON of `host diagnose` as a dict; `report` names an HTML file to write.
#[pyfunction]
#[pyo3(signature = (campaign, muscle, report = None))]
fn diagnose<'py>(
    py: Python<'py>,
    campaign: PyRef<'py, Campaign>,
    muscle: PyRef<'py, Muscle>,
    report: Option<PathBuf>,
) -> PyResult<Bound<'py, PyAny>> {
    let (campaign, muscle) = (campaign.0.clone(), muscle.0.clone());
    let geometry = muscle.geometry();
    let options = diagnosis::Options { muscle: muscle.name.clone(), ..Default::default() };
    let mut answer = py.detach(|| diagnosis::diagnose(&campaign, &geometry, &options)).map_err(raised)?;
    // One blocked force for one campaign: that of `fit`.
    if let Ok(plain) = py.detach(|| pam_fit::fit(&campaign, &muscle, &Options::default())) {
        answer.blocked_force_N = plain.summary.blocked_force_N;
    }
    if let Some(path) = &report {
        write_report(&diagnose_page::page(&answer, &geometry, &campaign), path)?;
    }
    loads(py, &pam_report::document::diagnosis_json(&answer))
}

/// Fit, predict and diagnose pneumatic artificial muscles.
#[pymodule]
fn pamtools(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("PamError", module.py().get_type::<PamError>())?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<Muscle>()?;
    module.add_class::<Recording>()?;
    module.add_class::<Campaign>()?;
    module.add_class::<Prediction>()?;
    module.add_class::<Table>()?;
    module.add_class::<Fit>()?;
    module.add_function(wrap_pyfunction!(read, module)?)?;
    module.add_function(wrap_pyfunction!(fit, module)?)?;
    module.add_function(wrap_pyfunction!(evaluate, module)?)?;
    module.add_function(wrap_pyfunction!(diagnose, module)?)
}
