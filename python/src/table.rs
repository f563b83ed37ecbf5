//! Tables of named columns: numpy arrays, and Arrow without a copy.

use std::sync::Arc;

use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::types::{Float64Type, Int64Type, UInt64Type};
use arrow_array::{
    Array, ArrayRef, BooleanArray, PrimitiveArray, RecordBatch, RecordBatchIterator, StringArray,
};
use arrow_schema::ffi::FFI_ArrowSchema;
use arrow_schema::{DataType, Field, Schema};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::{PyKeyError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyCapsule, PyDict, PyTuple};

/// A table: columns of one length, with names.
///
/// ``table["x_m"]`` is a column as a numpy array of shape (n,): numbers as float64, int64 or uint64, texts as strings. What is
/// unknown is NaN (whole numbers with unknown values are float64) or an empty text. ``table.to_numpy()`` is a structured
/// array. pandas, polars, pyarrow and DuckDB read a table through the Arrow PyCapsule interface, for example
/// ``polars.DataFrame(table)`` or ``pandas.DataFrame.from_arrow(table)``; there what is unknown is null.
#[pyclass(frozen, module = "sonarfix")]
pub struct Table {
    batch: RecordBatch,
}

impl Table {
    /// A table of these columns, which are of one length.
    pub fn of(columns: Vec<(String, ArrayRef)>) -> PyResult<Self> {
        let field = |(name, values): &(String, ArrayRef)| {
            Field::new(name, values.data_type().clone(), values.null_count() > 0)
        };
        let schema = Arc::new(Schema::new(columns.iter().map(field).collect::<Vec<_>>()));
        let columns = columns.into_iter().map(|(_, values)| values).collect();
        let batch = RecordBatch::try_new(schema, columns);
        batch.map(|batch| Self { batch }).map_err(|error| PyValueError::new_err(error.to_string()))
    }

    /// The column of this name, if there is one of this type.
    pub fn column<A: Array + Clone + 'static>(&self, name: &str) -> PyResult<&A> {
        let values = self.batch.column(self.place(name)?).as_any().downcast_ref::<A>();
        values.ok_or_else(|| PyTypeError::new_err(format!("the column {name} has another type")))
    }

    fn array<'py>(&self, py: Python<'py>, column: usize) -> PyResult<Bound<'py, PyAny>> {
        let values = self.batch.column(column);
        if let Some(reals) = values.as_any().downcast_ref::<PrimitiveArray<Float64Type>>() {
            let unknown = reals.iter().map(|value| value.unwrap_or(f64::NAN));
            return Ok(match reals.null_count() {
                0 => PyArray1::from_slice(py, reals.values()).into_any(),
                _ => PyArray1::from_iter(py, unknown).into_any(),
            });
        }
        if let Some(whole) = values.as_any().downcast_ref::<PrimitiveArray<Int64Type>>() {
            #[expect(clippy::cast_precision_loss, reason = "counts are far below 2^53")]
            let real = |value: Option<i64>| value.map_or(f64::NAN, |value| value as f64);
            return Ok(match whole.null_count() {
                0 => PyArray1::from_slice(py, whole.values()).into_any(),
                _ => PyArray1::from_iter(py, whole.iter().map(real)).into_any(),
            });
        }
        if let Some(whole) = values.as_any().downcast_ref::<PrimitiveArray<UInt64Type>>() {
            return Ok(PyArray1::from_slice(py, whole.values()).into_any());
        }
        if let Some(texts) = values.as_any().downcast_ref::<StringArray>() {
            let texts: Vec<&str> = texts.iter().map(Option::unwrap_or_default).collect();
            return numpy(py)?.call_method1("array", (texts, "U"));
        }
        Err(PyTypeError::new_err("a column of an unknown type"))
    }

    fn place(&self, name: &str) -> PyResult<usize> {
        let schema = self.batch.schema_ref();
        schema.index_of(name).map_err(|_| PyKeyError::new_err(name.to_owned()))
    }
}

fn numpy(py: Python<'_>) -> PyResult<Bound<'_, PyModule>> {
    py.import("numpy")
}

#[pymethods]
impl Table {
    /// A table of numpy arrays of one length: numbers or texts. ``unknown`` has a boolean array for each column with unknown
    /// values, True where a value is unknown.
    #[new]
    #[pyo3(signature = (columns, unknown=None))]
    fn new(columns: &Bound<'_, PyDict>, unknown: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let column = |(name, values): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
            let hidden = unknown.map(|unknown| unknown.get_item(&name)).transpose()?.flatten();
            let hidden = hidden.map(|hidden| hidden.call_method0("tolist")?.extract());
            let hidden: Option<Vec<bool>> = hidden.transpose()?;
            Ok((name.extract()?, column_of(&values, hidden.as_deref())?))
        };
        Self::of(columns.iter().map(column).collect::<PyResult<_>>()?)
    }

    /// The names of the columns, with their units.
    #[getter]
    fn columns(&self) -> Vec<String> {
        self.batch.schema_ref().fields().iter().map(|field| field.name().clone()).collect()
    }

    fn __len__(&self) -> usize {
        self.batch.num_rows()
    }

    fn __contains__(&self, name: &str) -> bool {
        self.place(name).is_ok()
    }

    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, self.place(name)?)
    }

    /// A structured array of shape (n,), with a field per column.
    fn to_numpy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let names = self.columns();
        let arrays = (0..names.len()).map(|column| self.array(py, column));
        let arrays = arrays.collect::<PyResult<Vec<_>>>()?;
        let types = names.iter().zip(&arrays).map(|(name, of)| Ok((name, of.getattr("dtype")?)));
        let types = types.collect::<PyResult<Vec<_>>>()?;
        let whole = numpy(py)?.call_method1("empty", (self.__len__(), types))?;
        for (name, values) in names.iter().zip(arrays) {
            whole.set_item(name, values)?;
        }
        Ok(whole)
    }

    /// The rows of several tables with the same columns, one table after the other.
    #[staticmethod]
    fn concat(tables: Vec<PyRef<'_, Table>>) -> PyResult<Self> {
        let Some(first) = tables.first() else {
            return Err(PyValueError::new_err("there is no table"));
        };
        let names = first.columns();
        if tables.iter().any(|table| table.columns() != names) {
            return Err(PyValueError::new_err("the tables have different columns"));
        }
        let column = |(at, name): (usize, String)| {
            let parts: Vec<ArrayRef> =
                tables.iter().map(|table| Arc::clone(table.batch.column(at))).collect();
            Ok((name, joined(&parts)?))
        };
        Self::of(names.into_iter().enumerate().map(column).collect::<PyResult<_>>()?)
    }

    /// The stream of the Arrow PyCapsule interface.
    #[pyo3(signature = (requested_schema=None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        // A producer may ignore the request.
        let _ = requested_schema;
        let reader = RecordBatchIterator::new([Ok(self.batch.clone())], self.batch.schema());
        let stream = FFI_ArrowArrayStream::new(Box::new(reader));
        PyCapsule::new_with_value(py, stream, c"arrow_array_stream")
    }

    /// The schema of the Arrow PyCapsule interface.
    fn __arrow_c_schema__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyCapsule>> {
        let schema = FFI_ArrowSchema::try_from(self.batch.schema_ref().as_ref());
        let schema = schema.map_err(|error| PyValueError::new_err(error.to_string()))?;
        PyCapsule::new_with_value(py, schema, c"arrow_schema")
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, table) = (slf.py(), slf.get());
        let (columns, unknown) = (PyDict::new(py), PyDict::new(py));
        for (at, name) in table.columns().into_iter().enumerate() {
            let values = table.batch.column(at);
            if values.null_count() > 0 {
                let hidden: Vec<bool> = (0..values.len()).map(|row| values.is_null(row)).collect();
                unknown.set_item(&name, PyArray1::from_vec(py, hidden))?;
            }
            columns.set_item(&name, table.stored(py, at)?)?;
        }
        let arguments = PyTuple::new(py, [columns, unknown])?;
        PyTuple::new(py, [slf.get_type().into_any(), arguments.into_any()])
    }

    fn __repr__(&self) -> String {
        let (rows, columns) = (self.batch.num_rows(), self.batch.num_columns());
        format!("<sonarfix.Table: {rows} rows, {columns} columns>")
    }
}

impl Table {
    /// A column in its own type, with anything in place of what is unknown.
    fn stored<'py>(&self, py: Python<'py>, column: usize) -> PyResult<Bound<'py, PyAny>> {
        let values = self.batch.column(column);
        match values.as_any().downcast_ref::<PrimitiveArray<Int64Type>>() {
            Some(whole) => Ok(PyArray1::from_slice(py, whole.values()).into_any()),
            None => self.array(py, column),
        }
    }
}

/// A numpy array of numbers or texts as a column.
fn column_of(values: &Bound<'_, PyAny>, unknown: Option<&[bool]>) -> PyResult<ArrayRef> {
    let hidden = |row: usize| unknown.and_then(|of| of.get(row)).copied().unwrap_or(false);
    if let Ok(reals) = values.cast::<PyArray1<f64>>() {
        let reals = reals.readonly();
        let reals = reals.as_array();
        let known = reals.iter().enumerate().map(|(row, v)| (!hidden(row)).then_some(*v));
        return Ok(Arc::new(known.collect::<PrimitiveArray<Float64Type>>()));
    }
    if let Ok(whole) = values.cast::<PyArray1<u64>>() {
        let whole = whole.readonly();
        let whole = whole.as_array();
        let known = whole.iter().enumerate().map(|(row, v)| (!hidden(row)).then_some(*v));
        return Ok(Arc::new(known.collect::<PrimitiveArray<UInt64Type>>()));
    }
    if let Ok(whole) = values.cast::<PyArray1<i64>>() {
        let whole = whole.readonly();
        let whole = whole.as_array();
        let known = whole.iter().enumerate().map(|(row, v)| (!hidden(row)).then_some(*v));
        return Ok(Arc::new(known.collect::<PrimitiveArray<Int64Type>>()));
    }
    let texts = values.call_method0("tolist").and_then(|list| list.extract::<Vec<String>>());
    let texts = texts.map_err(|_| {
        PyTypeError::new_err(
            "a column is an array of float64, int64, uint64 or texts, of shape (n,)",
        )
    })?;
    let known = texts.iter().enumerate().map(|(row, v)| (!hidden(row)).then_some(v));
    Ok(Arc::new(known.collect::<StringArray>()))
}

/// Columns of one type, one after the other.
fn joined(parts: &[ArrayRef]) -> PyResult<ArrayRef> {
    macro_rules! joined {
        ($($array:ty),*) => {$(
            let typed: Option<Vec<&$array>> =
                parts.iter().map(|part| part.as_any().downcast_ref()).collect();
            if let Some(typed) = typed {
                return Ok(Arc::new(typed.iter().flat_map(|part| part.iter()).collect::<$array>()));
            }
        )*};
    }
    joined!(
        PrimitiveArray<Float64Type>,
        PrimitiveArray<Int64Type>,
        PrimitiveArray<UInt64Type>,
        StringArray,
        BooleanArray
    );
    let types: Vec<&DataType> = parts.iter().map(Array::data_type).collect();
    Err(PyTypeError::new_err(format!("columns of different types: {types:?}")))
}
