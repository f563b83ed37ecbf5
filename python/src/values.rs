//! Values from Python and for it.

use std::path::Path;

use numpy::{PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Serialize;

use crate::errors;

/// The JSON text of a value, by Python's own encoder.
fn json(value: &Bound<'_, PyAny>) -> PyResult<String> {
    value.py().import("json")?.call_method1("dumps", (value,))?.extract()
}

fn toml_value(value: &Bound<'_, PyAny>) -> PyResult<toml::Value> {
    let text = json(value)?;
    serde_json::from_str(&text).map_err(|error| errors::input(format!("no value of TOML: {error}")))
}

/// A text that is no TOML.
pub fn no_toml(error: toml::de::Error) -> PyErr {
    errors::input(error.to_string())
}

/// A dict as the text of a file.
pub fn toml_text(table: &Bound<'_, PyDict>) -> PyResult<String> {
    toml::to_string(&toml_value(table)?).map_err(|error| errors::input(error.to_string()))
}

/// The keys of a dict with their values.
pub fn toml_keys(keys: &Bound<'_, PyDict>) -> PyResult<Vec<(String, toml::Value)>> {
    keys.iter().map(|(key, value)| Ok((key.extract()?, toml_value(&value)?))).collect()
}

/// The text of a file.
pub fn text_of(path: &Path) -> PyResult<String> {
    sonarfix_map::read_text(path).map_err(|error| {
        let text = format!("{}: cannot be read: {error}", path.display());
        errors::unreadable(&path.display().to_string(), text, format!("cannot be read: {error}"))
    })
}

/// A result as Python's own types.
pub fn of_json<'py>(py: Python<'py>, value: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(value);
    let text = text.map_err(|error| errors::internal(error.to_string()))?;
    py.import("json")?.call_method1("loads", (text,))
}

/// A matrix of these rows.
pub fn matrix<const N: usize>(
    py: Python<'_>,
    rows: impl IntoIterator<Item = [f64; N]>,
) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let values: Vec<f64> = rows.into_iter().flatten().collect();
    let count = values.len() / N.max(1);
    numpy::PyArray1::from_vec(py, values).reshape([count, N])
}

/// The elements of a numpy array, or of what becomes one, of numbers, with its shape.
pub fn reals(values: &Bound<'_, PyAny>, name: &str) -> PyResult<(Vec<f64>, Vec<usize>)> {
    let py = values.py();
    let array = py.import("numpy")?.call_method1("asarray", (values,))?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    if !matches!(kind.as_str(), "f" | "i" | "u" | "b") {
        return Err(errors::input(format!("{name} must be an array of numbers")));
    }
    let shape: Vec<usize> = array.getattr("shape")?.extract()?;
    let flat = array.call_method1("astype", ("float64",))?.call_method0("ravel")?;
    let flat = flat.cast_into::<numpy::PyArray1<f64>>().map_err(PyErr::from)?;
    Ok((flat.readonly().as_array().to_vec(), shape))
}

/// A finite number that the robot can compute with.
pub fn single(value: f64, name: &str) -> PyResult<f32> {
    #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
    let single = value as f32;
    if single.is_finite() {
        Ok(single)
    } else {
        Err(errors::input(format!("{name} must be a finite number")))
    }
}

/// A time in seconds as that of the robot, microseconds.
pub fn instant(seconds: f64) -> PyResult<sonarfix::geometry::units::Instant> {
    if !(0.0..=1e10).contains(&seconds) {
        return Err(errors::input("the time must be from 0 to 1e10 s"));
    }
    Ok(sonarfix::geometry::units::Instant::from_ticks(sonarfix_sim::time::micros(seconds)))
}
