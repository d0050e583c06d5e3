//! `pamtools`: recordings, fits, predictions and diagnoses of pneumatic artificial muscles, with numpy arrays.
//!
//! Everything is in SI units inside arrays (s, Pa, m, N, K), whatever the files' units were.

use std::path::PathBuf;

use host::diagnose as diagnosis;
use host::error::Error;
use host::fit::Options;
use host::fit::result::Fit as HostFit;
use host::muscle_description::{Kind, MuscleDescription};
use host::predict::predict as host_predict;
use host::recording::{Campaign as HostCampaign, Import, Reader, Recording as HostRecording};
use host::report::{Page, diagnose_page, fit_page};
use host::table_file::{self, About, TableFile};
use model_core::braid::Geometry;
use model_core::muscle::Muscle as Model;
use model_core::units::{Angle, Length, Pressure};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::create_exception;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyModule;

create_exception!(
    pamtools,
    PamError,
    PyValueError,
    "What is wrong with the input: the text names cause, place and remedy; `args[1]` is the stable code."
);

fn raised(error: Error) -> PyErr {
    let help = error.advice().map_or(String::new(), |a| format!("; {a}"));
    PamError::new_err((format!("{error}{help}"), error.code().name()))
}

fn wrong(text: impl Into<String>) -> PyErr {
    PamError::new_err((text.into(), "call::invalid"))
}

/// JSON text as Python values.
fn loads<'py>(py: Python<'py>, text: &str) -> PyResult<Bound<'py, PyAny>> {
    PyModule::import(py, "json")?.call_method1("loads", (text,))
}

/// A muscle as its maker or a calliper describes it: lengths in mm, the braid angle in degrees from the radial plane.
#[pyclass(frozen, skip_from_py_object)]
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
#[pyclass(frozen, skip_from_py_object)]
#[derive(Clone)]
struct Recording(HostRecording);

#[pymethods]
impl Recording {
    #[new]
    #[pyo3(signature = (name, time, pressure, stroke, force = None, temperature = None))]
    fn new(
        name: String,
        time: PyReadonlyArray1<'_, f64>,
        pressure: PyReadonlyArray1<'_, f64>,
        stroke: PyReadonlyArray1<'_, f64>,
        force: Option<PyReadonlyArray1<'_, f64>>,
        temperature: Option<PyReadonlyArray1<'_, f64>>,
    ) -> PyResult<Self> {
        let column = |a: &PyReadonlyArray1<'_, f64>| a.as_array().to_vec();
        let recording = HostRecording {
            name,
            time: column(&time),
            pressure: column(&pressure),
            stroke: column(&stroke),
            force: force.as_ref().map(column),
            temperature: temperature.as_ref().map(column),
            ..HostRecording::default()
        };
        recording.check().map_err(raised)?;
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
        format!("Recording({:?}, {} rows, {:.1} s)", self.0.name, self.0.len(), self.0.duration())
    }
}

/// Recordings of one muscle in chronological order.
#[pyclass(frozen, skip_from_py_object)]
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

    fn __repr__(&self) -> String {
        format!("Campaign({} recordings, {} rows)", self.0.recordings.len(), self.0.samples())
    }
}

/// Reads files in chronological order; `import_description` is the TOML file for foreign formats.
#[pyfunction]
#[pyo3(signature = (paths, muscle = None, import_description = None))]
fn read(
    py: Python<'_>,
    paths: Vec<PathBuf>,
    muscle: Option<PyRef<'_, Muscle>>,
    import_description: Option<PathBuf>,
) -> PyResult<Campaign> {
    let muscle = muscle.map(|m| m.0.clone());
    py.detach(|| {
        let import = import_description.as_ref().map(Import::read).transpose()?;
        let reader = muscle.as_ref().map_or_else(Reader::new, Reader::of);
        reader.import(import.as_ref()).campaign(&paths)
    })
    .map(Campaign)
    .map_err(raised)
}

fn write_report(page: &Page, path: &PathBuf) -> PyResult<()> {
    host::output::write_whole(path, page.html().as_bytes()).map_err(raised)
}

/// A fitted table.
#[pyclass(frozen, skip_from_py_object)]
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
    #[pyo3(signature = (pressure, stroke, direction = 0.0))]
    fn force<'py>(
        &self,
        py: Python<'py>,
        pressure: PyReadonlyArray1<'py, f64>,
        stroke: PyReadonlyArray1<'py, f64>,
        direction: f64,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let model = Model::<f64>::build(&self.0.table).map_err(|e| wrong(e.to_string()))?;
        let (p, x) = (pressure.as_array(), stroke.as_array());
        if p.len() != x.len() {
            return Err(wrong(format!("{} pressures beside {} strokes", p.len(), x.len())));
        }
        let force: Vec<f64> = p
            .iter()
            .zip(x.iter())
            .map(|(p, x)| model.force(Pressure::from_pascals(*p), Length::from_metres(*x), direction).newtons())
            .collect();
        Ok(force.into_pyarray(py))
    }

    /// The force that the load cell would read, N: one array a recording. Effects and their memory run through the campaign.
    fn predict<'py>(
        &self,
        py: Python<'py>,
        campaign: PyRef<'_, Campaign>,
    ) -> PyResult<Vec<Bound<'py, PyArray1<f64>>>> {
        let (table, campaign) = (self.0.clone(), campaign.0.clone());
        let prediction = py.detach(move || host_predict(&table, &campaign)).map_err(raised)?;
        Ok(prediction.recordings.into_iter().map(|r| r.force.into_pyarray(py)).collect())
    }

    fn __repr__(&self) -> String {
        format!("Table({:?}, P0={:.1} kPa, {} nodes)", self.0.about.muscle, self.deadband() / 1e3, self.0.table.nodes.len())
    }
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
            date: table_file::now_utc(),
            tool: format!("pamtools {}", env!("CARGO_PKG_VERSION")),
            fit: self.fit.summary.quality(),
            uncertainty: Some(self.fit.stored_uncertainty()),
            mountings: self.fit.prepared.mountings.iter().map(|m| (m.stroke, m.offset)).collect(),
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
#[pyo3(signature = (campaign, muscle, order = 4, tip_correction = false, fit_geometry = false, fit_lengths = false))]
fn fit(
    py: Python<'_>,
    campaign: PyRef<'_, Campaign>,
    muscle: PyRef<'_, Muscle>,
    order: usize,
    tip_correction: bool,
    fit_geometry: bool,
    fit_lengths: bool,
) -> PyResult<Fit> {
    let options = Options { order, tip_correction, fit_geometry, fit_lengths, ..Options::default() };
    let (campaign, muscle) = (campaign.0.clone(), muscle.0.clone());
    let fit = py.detach(|| host::fit::fit(&campaign, &muscle, &options)).map_err(raised)?;
    Ok(Fit { fit, campaign, options })
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
    let geometry = Geometry {
        rest_length: Length::from_metres(muscle.rest_length()),
        braid_angle: Angle::from_radians(muscle.braid_angle()),
        outer_diameter: Length::from_metres(muscle.bladder_outer_diameter()),
        wall: Length::from_metres(muscle.bladder_wall()),
        tip_correction: false,
    };
    let options = diagnosis::Options { muscle: muscle.name.clone(), ..Default::default() };
    let answer = py.detach(|| diagnosis::diagnose(&campaign, &geometry, &options)).map_err(raised)?;
    if let Some(path) = &report {
        write_report(&diagnose_page::page(&answer, &geometry), path)?;
    }
    loads(py, &answer.to_json())
}

/// Fit, predict and diagnose pneumatic artificial muscles.
#[pymodule]
fn pamtools(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("PamError", module.py().get_type::<PamError>())?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<Muscle>()?;
    module.add_class::<Recording>()?;
    module.add_class::<Campaign>()?;
    module.add_class::<Table>()?;
    module.add_class::<Fit>()?;
    module.add_function(wrap_pyfunction!(read, module)?)?;
    module.add_function(wrap_pyfunction!(fit, module)?)?;
    module.add_function(wrap_pyfunction!(diagnose, module)?)
}
