//! Description of a muscle.

use std::path::PathBuf;

use pam_data::muscle_description::{Kind, MuscleDescription};
use pyo3::prelude::*;

use crate::error::{raised, wrong};

/// A muscle as its maker or a calliper describes it: lengths in mm, the braid angle in degrees from the radial plane.
#[pyclass(frozen, module = "pamtools")]
#[derive(Clone)]
pub(crate) struct Muscle(pub(crate) MuscleDescription);

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

    /// A description from the text of its file (TOML).
    #[staticmethod]
    fn from_toml(text: &str) -> PyResult<Self> {
        MuscleDescription::parse(text).map(Self).map_err(raised)
    }

    /// The text of its file (TOML). Descriptions can be pickled, copied and compared.
    fn to_toml(&self) -> PyResult<String> {
        toml::to_string(&self.0).map_err(|e| wrong(e.to_string()))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        Ok((py.get_type::<Self>().getattr("from_toml")?, (self.to_toml()?,)))
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.extract::<PyRef<'_, Self>>().is_ok_and(|other| other.0 == self.0)
    }

    fn __hash__(&self) -> u64 {
        use std::hash::{DefaultHasher, Hash, Hasher};
        let mut hasher = DefaultHasher::new();
        self.0.name.hash(&mut hasher);
        hasher.finish()
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
