//! A fitted table.

use std::path::PathBuf;

use model_core::inverse::Attainability;
use model_core::muscle::Muscle as Model;
use model_core::units::{Force, Length, Pressure};
use numpy::{IntoPyArray, PyArray1};
use pam_data::physical_limits::{self, Contractions};
use pam_fit::confidence_band::ConfidenceBand;
use pam_data::statistics::NORMAL_95;
use pam_fit::predict::{beyond, predict as host_predict, predict_with_bands};
use pam_fit::table_faults::table_faults;
use pam_fit::table_file::TableFile;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::arrays::broadcast;
use crate::campaign::Campaign;
use crate::error::{raised, wrong};
use crate::frames;
use crate::prediction::Prediction;
use crate::warnings::warn;

/// A fitted table.
#[pyclass(frozen, module = "pamtools")]
#[derive(Clone)]
pub(crate) struct Table(pub(crate) TableFile);

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

    /// Least and greatest stroke of the recordings that were fitted, m.
    #[getter]
    fn tested_stroke(&self) -> (f64, f64) {
        let tested = &self.0.table.tested;
        let length = f64::from(self.0.table.geometry.rest_length.metres());
        (f64::from(tested.contraction_low) * length, f64::from(tested.contraction_high) * length)
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
            if found.attainability == Attainability::Attainable { found.pressure.pascals() } else { f64::NAN }
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
        over(&self.0, &model, pressure, stroke, direction, |p, x, s| NORMAL_95 * band.std(p, x, s)).map(Some)
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

    /// Draws force against stroke at each node with matplotlib, shortening and lengthening; returns the axes.
    #[pyo3(signature = (axes = None))]
    fn plot<'py>(slf: &Bound<'py, Self>, axes: Option<Bound<'py, PyAny>>) -> PyResult<Bound<'py, PyAny>> {
        frames::plot(slf, "table", axes)
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

/// A function of pressure, stroke and direction over arrays, as numpy broadcasts them. Values outside the physical limits are
/// refused; extrapolation gives a warning.
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
