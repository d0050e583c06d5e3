//! Data frames: pandas, polars, and everything that speaks the Arrow PyCapsule interface, in and out.

use std::collections::BTreeMap;
use std::sync::Arc;

use arrow_array::cast::AsArray;
use arrow_array::ffi_stream::{FFI_ArrowArrayStream, RecordBatchStreamReader};
use arrow_array::types::{
    Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, UInt8Type, UInt16Type, UInt32Type,
    UInt64Type,
};
use arrow_array::{
    ArrayRef, ArrowPrimitiveType, Float64Array, RecordBatch, RecordBatchIterator, StringArray,
};
use arrow_schema::{ArrowError, DataType};
use numpy::IntoPyArray;
use pam_data::error::{DataCode, Error};
use pam_data::recording::{
    Campaign as HostCampaign, Import, Missing, Reader, Recording as HostRecording, TableColumn,
};
use pyo3::exceptions::PyImportError;
use pyo3::prelude::*;
use pyo3::types::{PyCapsule, PyCapsuleMethods, PyDict, PyModule};

use crate::arrays::numbers;
use crate::campaign::Campaign;
use crate::error::{raised, wrong};
use crate::muscle::Muscle;

/// The name that the interface prescribes for its capsules.
const STREAM: &std::ffi::CStr = c"arrow_array_stream";

/// A data frame as a campaign: the column names end in the unit, as in a file.
#[pyfunction]
#[pyo3(signature = (frame, name = "frame", muscle = None, *, split_by = None, filters = None, missing = "error"))]
pub(crate) fn from_frame(
    py: Python<'_>,
    frame: &Bound<'_, PyAny>,
    name: &str,
    muscle: Option<PyRef<'_, Muscle>>,
    split_by: Option<SplitBy>,
    filters: Option<BTreeMap<String, String>>,
    missing: &str,
) -> PyResult<Campaign> {
    let missing = match missing {
        "error" => Missing::Error,
        "skip" => Missing::Skip,
        other => return Err(wrong(format!("`missing` is {other:?}; it is \"error\" or \"skip\""))),
    };
    let table = columns(frame)?;
    let split_by = split_by.map(SplitBy::names).unwrap_or_default();
    let import = (!split_by.is_empty()).then(|| Import { split_by, ..Import::default() });
    let muscle = muscle.map(|m| m.0.clone());
    py.detach(|| {
        let mut reader = muscle.as_ref().map_or_else(Reader::new, Reader::of).import(import.as_ref());
        reader.filters.extend(filters.unwrap_or_default());
        reader.missing = Some(missing);
        reader.table(name, table).map(HostCampaign::new)
    })
    .map(Campaign)
    .map_err(raised)
}

/// One column, or several.
#[derive(FromPyObject)]
pub(crate) enum SplitBy {
    One(String),
    Several(Vec<String>),
}

impl SplitBy {
    fn names(self) -> Vec<String> {
        match self {
            Self::One(name) => vec![name],
            Self::Several(names) => names,
        }
    }
}

/// The columns of a data frame: by the Arrow interface, else by name.
fn columns(frame: &Bound<'_, PyAny>) -> PyResult<Vec<(String, TableColumn)>> {
    if frame.hasattr("__arrow_c_stream__")? {
        match frame.call_method0("__arrow_c_stream__") {
            Ok(capsule) => return from_stream(&capsule),
            // pandas needs pyarrow for it, which is not always installed.
            Err(e) if e.is_instance_of::<PyImportError>(frame.py()) => {}
            Err(e) => return Err(e),
        }
    }
    let names = if frame.hasattr("columns")? {
        frame.getattr("columns")?
    } else if frame.hasattr("keys")? {
        frame.call_method0("keys")?
    } else {
        return Err(wrong(format!("a {} is not a data frame", frame.get_type().name()?)));
    };
    let mut table = Vec::new();
    for name in names.try_iter()? {
        let name = name?;
        let values = frame.get_item(&name)?;
        let name = name.str()?.to_string();
        let column = match numbers(&name, &values) {
            Ok(array) => TableColumn::Numbers(crate::arrays::column(&name, &array)?),
            Err(_) => {
                let texts = values.try_iter()?.map(|v| Ok(v?.str()?.to_string())).collect::<PyResult<_>>()?;
                TableColumn::Texts(texts)
            }
        };
        table.push((name, column));
    }
    Ok(table)
}

fn from_stream(capsule: &Bound<'_, PyAny>) -> PyResult<Vec<(String, TableColumn)>> {
    let capsule = capsule.cast::<PyCapsule>()?;
    let stream = capsule.pointer_checked(Some(STREAM))?.cast::<FFI_ArrowArrayStream>();
    // SAFETY: a capsule of this name holds a stream, by the definition of the interface; the reader takes it out of the capsule and
    // leaves a released one there.
    let reader = unsafe { RecordBatchStreamReader::from_raw(stream.as_ptr()) }.map_err(|e| arrow(&e))?;
    let mut table: Vec<(String, TableColumn)> = Vec::new();
    let fields = arrow_array::RecordBatchReader::schema(&reader);
    for field in fields.fields() {
        let empty = match field.data_type() {
            DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View => TableColumn::Texts(Vec::new()),
            t if is_number(t) => TableColumn::Numbers(Vec::new()),
            other => TableColumn::Other(format!("the Arrow type {other}")),
        };
        table.push((field.name().clone(), empty));
    }
    for batch in reader {
        let batch = batch.map_err(|e| arrow(&e))?;
        for ((_, column), array) in table.iter_mut().zip(batch.columns()) {
            match column {
                TableColumn::Numbers(values) => append(values, array),
                TableColumn::Texts(texts) => append_texts(texts, array),
                TableColumn::Other(_) => {}
            }
        }
    }
    Ok(table)
}

fn arrow(error: &ArrowError) -> PyErr {
    raised(Error::new(DataCode::RecordingContainer, format!("the data frame cannot be read: {error}")))
}

macro_rules! number_types {
    ($call:ident) => {
        $call!(
            Float64Type,
            Float32Type,
            Int64Type,
            Int32Type,
            Int16Type,
            Int8Type,
            UInt64Type,
            UInt32Type,
            UInt16Type,
            UInt8Type
        )
    };
}

fn is_number(data_type: &DataType) -> bool {
    macro_rules! any {
        ($($t:ty),*) => { [$(<$t>::DATA_TYPE),*].contains(data_type) };
    }
    *data_type == DataType::Boolean || number_types!(any)
}

/// Adds the numbers of an array; a missing value is NaN.
fn append(values: &mut Vec<f64>, array: &ArrayRef) {
    if let Some(array) = array.as_boolean_opt() {
        values.extend(array.iter().map(|v| v.map_or(f64::NAN, f64::from)));
        return;
    }
    macro_rules! each {
        ($($t:ty),*) => {$(
            if let Some(array) = array.as_primitive_opt::<$t>() {
                values.extend(array.iter().map(|v| v.map_or(f64::NAN, |v| v as f64)));
            }
        )*};
    }
    number_types!(each);
}

/// Adds the texts of an array; a missing value is an empty text.
fn append_texts(texts: &mut Vec<String>, array: &ArrayRef) {
    let owned = |text: Option<&str>| text.unwrap_or_default().to_owned();
    if let Some(array) = array.as_string_opt::<i32>() {
        texts.extend(array.iter().map(owned));
    } else if let Some(array) = array.as_string_opt::<i64>() {
        texts.extend(array.iter().map(owned));
    } else if let Some(array) = array.as_string_view_opt() {
        texts.extend(array.iter().map(owned));
    }
}

/// Names and values of a recording's columns, as a file has them.
fn columns_of(recording: &HostRecording) -> Vec<(&'static str, &[f64])> {
    let mut columns = vec![
        ("time_s", recording.time.as_slice()),
        ("pressure_Pa", recording.pressure.as_slice()),
        ("displacement_m", recording.stroke.as_slice()),
    ];
    let optional = [
        ("force_N", &recording.force),
        ("temperature_K", &recording.temperature),
        ("pressure_command_Pa", &recording.pressure_command),
    ];
    columns.extend(optional.into_iter().filter_map(|(name, values)| values.as_deref().map(|v| (name, v))));
    columns
}

/// The columns of recordings one below the other, by name. A column that some of them lack is NaN there.
fn stacked(recordings: &[HostRecording]) -> Vec<(&'static str, Vec<f64>)> {
    let mut names = vec!["time_s", "pressure_Pa", "displacement_m"];
    for optional in ["force_N", "temperature_K", "pressure_command_Pa"] {
        if recordings.iter().any(|r| columns_of(r).iter().any(|(name, _)| *name == optional)) {
            names.push(optional);
        }
    }
    let column = |name: &str| {
        let mut values = Vec::new();
        for recording in recordings {
            match columns_of(recording).iter().find(|(n, _)| *n == name) {
                Some((_, column)) => values.extend_from_slice(column),
                None => values.resize(values.len() + recording.len(), f64::NAN),
            }
        }
        values
    };
    names.into_iter().map(|name| (name, column(name))).collect()
}

/// The name of its recording for each row.
fn names_of_rows(recordings: &[HostRecording]) -> Vec<&str> {
    recordings.iter().flat_map(|r| std::iter::repeat_n(r.name.as_str(), r.len())).collect()
}

/// Recordings as the stream that `__arrow_c_stream__` gives; where there may be several, with their names as the first column.
pub(crate) fn stream<'py>(
    py: Python<'py>,
    recordings: &[HostRecording],
    with_names: bool,
) -> PyResult<Bound<'py, PyCapsule>> {
    let mut arrays: Vec<(&str, ArrayRef)> = Vec::new();
    if with_names {
        arrays.push(("recording", Arc::new(StringArray::from(names_of_rows(recordings)))));
    }
    for (name, values) in stacked(recordings) {
        arrays.push((name, Arc::new(Float64Array::from(values))));
    }
    let batch = RecordBatch::try_from_iter(arrays).map_err(|e| arrow(&e))?;
    let schema = batch.schema();
    let reader = RecordBatchIterator::new([Ok(batch)], schema);
    PyCapsule::new_with_value(py, FFI_ArrowArrayStream::new(Box::new(reader)), STREAM)
}

/// Recordings as a data frame of pandas, which may be there without Arrow.
pub(crate) fn pandas<'py>(
    py: Python<'py>,
    recordings: &[HostRecording],
    with_names: bool,
) -> PyResult<Bound<'py, PyAny>> {
    let columns = PyDict::new(py);
    if with_names {
        columns.set_item("recording", names_of_rows(recordings))?;
    }
    for (name, values) in stacked(recordings) {
        columns.set_item(name, values.into_pyarray(py))?;
    }
    PyModule::import(py, "pandas")?.getattr("DataFrame")?.call1((columns,))
}

/// What has the Arrow interface as a data frame of polars.
pub(crate) fn polars<'py>(object: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    PyModule::import(object.py(), "polars")?.getattr("DataFrame")?.call1((object,))
}

/// Draws with the function of this name in `pamtools.plots`.
pub(crate) fn plot<'py>(
    object: &Bound<'py, PyAny>,
    how: &str,
    axes: Option<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    PyModule::import(object.py(), "pamtools.plots")?.getattr(how)?.call1((object, axes))
}
