//! Rows of runs and traces as tables.

use std::sync::Arc;

use arrow_array::{ArrayRef, Float64Array, Int64Array, StringArray, UInt64Array};
use pyo3::prelude::*;
use sonarfix_exchange::row::{
    Kind, Row as TraceRow, Sink, Value, columns, fix_columns, pass, state_columns,
};
use sonarfix_sim::row::{COUNTS, REALS, Row};
use sonarfix_sim::statistics::Totals;
use sonarfix_sim::trace::Trace;

use crate::table::Table;
use crate::{errors, values};

/// The rows of runs, in the order of the columns of `run --rows`. With `names` a first column tells whose row it is.
pub fn of_rows(rows: &[Row], names: Option<&[String]>) -> PyResult<Table> {
    let mut columns: Vec<(String, ArrayRef)> = Vec::new();
    if let Some(names) = names {
        columns.push(("estimator".to_owned(), Arc::new(StringArray::from_iter_values(names))));
    }
    let seeds = rows.iter().map(|row| row.seed);
    columns.push(("seed".to_owned(), Arc::new(UInt64Array::from_iter_values(seeds))));
    for (at, name) in COUNTS.into_iter().enumerate() {
        let counts = rows.iter().filter_map(|row| row.counts.get(at).copied());
        columns.push((name.to_owned(), Arc::new(UInt64Array::from_iter_values(counts))));
    }
    for (at, name) in REALS.into_iter().enumerate() {
        let reals = rows.iter().filter_map(|row| row.reals.get(at).copied());
        columns.push((name.to_owned(), Arc::new(Float64Array::from_iter_values(reals))));
    }
    Table::of(columns)
}

/// The rows of a table of runs.
fn rows_of(table: &Table) -> PyResult<Vec<Row>> {
    let whole = |name: &str| table.column::<UInt64Array>(name);
    let real = |name: &str| table.column::<Float64Array>(name);
    let seeds = whole("seed")?;
    let counts = COUNTS.into_iter().map(whole).collect::<PyResult<Vec<_>>>()?;
    let reals = REALS.into_iter().map(real).collect::<PyResult<Vec<_>>>()?;
    let mut rows = Vec::new();
    for (at, seed) in seeds.values().iter().enumerate() {
        let mut row = Row { seed: *seed, reals: [0.0; REALS.len()], counts: [0; COUNTS.len()] };
        row.counts.iter_mut().zip(&counts).for_each(|(to, of)| *to = of.value(at));
        row.reals.iter_mut().zip(&reals).for_each(|(to, of)| *to = of.value(at));
        rows.push(row);
    }
    Ok(rows)
}

/// The statistics of the rows of ``monte_carlo``, a dict with the numbers of ``sonarfix run --json``: mean, deviation, RMS and
/// bound of each state, NEES, NIS, outcomes, RMS along the path; SI units.
///
/// A table with several estimators is summed up for one of them, by default the localizer.
#[pyfunction]
#[pyo3(signature = (rows, estimator=None))]
pub fn summary<'py>(
    py: Python<'py>,
    rows: &Table,
    estimator: Option<&str>,
) -> PyResult<Bound<'py, PyAny>> {
    let mut of = rows_of(rows)?;
    let name = estimator.unwrap_or("sonarfix");
    if let Ok(names) = rows.column::<StringArray>("estimator") {
        let mut is_theirs = names.iter().map(|held| held == Some(name));
        of.retain(|_| is_theirs.next().unwrap_or(false));
    } else if estimator.is_some() {
        return Err(errors::input("the table has no column estimator"));
    }
    if of.is_empty() {
        return Err(errors::input("there are no rows"));
    }
    let mut totals = Totals::default();
    for row in &of {
        totals.add(row);
    }
    let mut deviations = totals.deviations();
    for row in &of {
        deviations.add(row);
    }
    values::of_json(py, &deviations.summary())
}

/// A column that grows.
enum Column {
    Real(Vec<Option<f64>>),
    Whole(Vec<Option<i64>>),
    Text(Vec<Option<String>>),
}

impl Column {
    fn new(kind: Kind) -> Self {
        match kind {
            Kind::Real => Self::Real(Vec::new()),
            Kind::Whole => Self::Whole(Vec::new()),
            Kind::Text => Self::Text(Vec::new()),
        }
    }

    fn push(&mut self, value: &Value) {
        match (self, value) {
            (Self::Real(of), Value::Real(value)) => of.push(Some(*value)),
            (Self::Real(of), _) => of.push(None),
            (Self::Whole(of), Value::Whole(value)) => of.push(Some(*value)),
            (Self::Whole(of), _) => of.push(None),
            (Self::Text(of), Value::Text(text)) => of.push(Some(text.clone())),
            (Self::Text(of), _) => of.push(None),
        }
    }

    fn end(self) -> ArrayRef {
        match self {
            Self::Real(of) => Arc::new(Float64Array::from(of)),
            Self::Whole(of) => Arc::new(Int64Array::from(of)),
            Self::Text(of) => Arc::new(StringArray::from(of)),
        }
    }
}

/// A table that grows by rows.
struct Growing(Vec<(&'static str, Column)>);

impl Growing {
    fn new(columns: impl Iterator<Item = (&'static str, Kind)>) -> Self {
        Self(columns.map(|(name, kind)| (name, Column::new(kind))).collect())
    }

    fn push<'v>(&mut self, values: impl Iterator<Item = &'v Value>) {
        for ((_, column), value) in self.0.iter_mut().zip(values) {
            column.push(value);
        }
    }

    fn end(self) -> PyResult<Table> {
        let columns = self.0.into_iter();
        Table::of(columns.map(|(name, column)| (name.to_owned(), column.end())).collect())
    }
}

impl Sink for Growing {
    fn take(&mut self, row: &TraceRow) -> anyhow::Result<()> {
        self.push(row.values().iter());
        Ok(())
    }
}

/// The trace with the rows and columns of `run --trace`.
pub fn of_trace(trace: &Trace) -> PyResult<Table> {
    let mut table = Growing::new(columns());
    pass(trace, &mut table).map_err(|error| errors::any(&error))?;
    table.end()
}

/// The state at every encoder tick, the start first.
pub fn of_ticks(trace: &Trace) -> PyResult<Table> {
    let mut table = Growing::new(state_columns());
    for tick in trace.start.iter().chain(&trace.ticks) {
        let row = TraceRow::new(tick, None, None, &trace.walls);
        table.push(row.state().map(|(_, value)| value));
    }
    table.end()
}

/// The measurement cycles.
pub fn of_fixes(trace: &Trace) -> PyResult<Table> {
    let mut table = Growing::new(fix_columns());
    let Some(tick) = trace.start.as_ref().or(trace.ticks.first()) else { return table.end() };
    for fix in &trace.fixes {
        let row = TraceRow::new(tick, Some(fix), None, &trace.walls);
        table.push(row.fix().map(|(_, value)| value));
    }
    table.end()
}

/// Numbers that are known everywhere as a table.
pub fn of_reals(columns: Vec<(&str, Vec<f64>)>) -> PyResult<Table> {
    let column = |(name, values): (&str, Vec<f64>)| {
        (name.to_owned(), Arc::new(Float64Array::from(values)) as ArrayRef)
    };
    Table::of(columns.into_iter().map(column).collect())
}
