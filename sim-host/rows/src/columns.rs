//! Rows as Parquet: a column per number, not compressed, the plan in the metadata.

use std::fs::File;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, ensure};
use parquet::basic::{Repetition, Type as Physical};
use parquet::data_type::{DoubleType, Int64Type};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, RowGroupReader, SerializedFileReader};
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::{Type, TypePtr};
use sonarfix_files::Output;
use sonarfix_sim::row::{COUNTS, REALS, Row};

use crate::plan::{Plan, Rows};

/// Rows that are in memory at once.
const GROUP: usize = 8_192;
/// The key of the plan in the metadata.
const KEY: &str = "sonarfix";

fn schema() -> anyhow::Result<TypePtr> {
    let column = |name: &str, physical| {
        let column = Type::primitive_type_builder(name, physical);
        Ok(Arc::new(column.with_repetition(Repetition::REQUIRED).build()?))
    };
    let whole = std::iter::once("seed").chain(COUNTS).map(|name| column(name, Physical::INT64));
    let real = REALS.into_iter().map(|name| column(name, Physical::DOUBLE));
    let fields = whole.chain(real).collect::<anyhow::Result<_>>()?;
    Ok(Arc::new(Type::group_type_builder("runs").with_fields(fields).build()?))
}

/// Writes a file.
///
/// # Errors
/// If the file cannot be written, or a row cannot be read.
pub fn write(
    file: &Path,
    plan: &Plan,
    rows: impl Iterator<Item = anyhow::Result<Row>>,
) -> anyhow::Result<()> {
    let metadata = KeyValue::new(KEY.to_owned(), plan.line());
    let properties =
        WriterProperties::builder().set_key_value_metadata(Some(vec![metadata])).build();
    let out = Output::create(file)?;
    let mut writer = SerializedFileWriter::new(out, schema()?, Arc::new(properties))?;
    let mut rows = rows.peekable();
    while rows.peek().is_some() {
        let group: Vec<Row> = rows.by_ref().take(GROUP).collect::<anyhow::Result<_>>()?;
        let mut columns = writer.next_row_group()?;
        write_group(&mut columns, &group)?;
        columns.close()?;
    }
    Ok(writer.into_inner()?.finish()?)
}

fn write_group(
    columns: &mut SerializedRowGroupWriter<'_, Output>,
    rows: &[Row],
) -> anyhow::Result<()> {
    let counts = (0..COUNTS.len()).map(|of| column(rows, |row| row.counts.get(of).copied()));
    let seeds = column(rows, |row| Some(row.seed));
    for values in std::iter::once(seeds).chain(counts) {
        // As the bits of a signed number.
        let values: Vec<i64> = values.into_iter().map(u64::cast_signed).collect();
        let mut column = columns.next_column()?.context("a column is missing")?;
        column.typed::<Int64Type>().write_batch(&values, None, None)?;
        column.close()?;
    }
    for of in 0..REALS.len() {
        let values = column(rows, |row| row.reals.get(of).copied());
        let mut column = columns.next_column()?.context("a column is missing")?;
        column.typed::<DoubleType>().write_batch(&values, None, None)?;
        column.close()?;
    }
    Ok(())
}

fn column<T>(rows: &[Row], of: impl Fn(&Row) -> Option<T>) -> Vec<T> {
    rows.iter().filter_map(of).collect()
}

/// Opens a file: its plan, and its rows.
///
/// # Errors
/// If the file cannot be read or is no file of rows.
pub fn open(file: &Path) -> anyhow::Result<(Plan, Rows)> {
    let reader = SerializedFileReader::new(File::open(file)?)?;
    let metadata = reader.metadata().file_metadata();
    let pairs = metadata.key_value_metadata().map(Vec::as_slice).unwrap_or_default();
    let line = pairs.iter().find(|pair| pair.key == KEY).and_then(|pair| pair.value.as_deref());
    let plan = Plan::parse(line.context("the file has no plan of runs")?)?;
    ensure!(metadata.schema() == schema()?.as_ref(), "the columns are those of another version");
    let groups =
        (0..reader.num_row_groups()).map(move |group| read_group(&*reader.get_row_group(group)?));
    let rows = groups.flat_map(|group| match group {
        Ok(rows) => rows.into_iter().map(Ok).collect(),
        Err(error) => vec![Err(error)],
    });
    let rows = rows.enumerate().map(move |(run, row)| {
        let row: Row = row?;
        ensure!(row.seed == plan.seed_of(u32::try_from(run)?), "row {} has another seed", run + 1);
        Ok(row)
    });
    Ok((plan, Box::new(rows)))
}

fn read_group(group: &dyn RowGroupReader) -> anyhow::Result<Vec<Row>> {
    let length = usize::try_from(group.metadata().num_rows())?;
    let whole = |column: usize| -> anyhow::Result<Vec<i64>> {
        let mut values = Vec::with_capacity(length);
        let mut reader = parquet::column::reader::get_typed_column_reader::<Int64Type>(
            group.get_column_reader(column)?,
        );
        reader.read_records(length, None, None, &mut values)?;
        ensure!(values.len() == length, "a column is too short");
        Ok(values)
    };
    let real = |column: usize| -> anyhow::Result<Vec<f64>> {
        let mut values = Vec::with_capacity(length);
        let mut reader = parquet::column::reader::get_typed_column_reader::<DoubleType>(
            group.get_column_reader(column)?,
        );
        reader.read_records(length, None, None, &mut values)?;
        ensure!(values.len() == length, "a column is too short");
        Ok(values)
    };
    let empty = Row { seed: 0, reals: [0.0; REALS.len()], counts: [0; COUNTS.len()] };
    let mut rows = vec![empty; length];
    for (row, seed) in rows.iter_mut().zip(whole(0)?) {
        row.seed = seed.cast_unsigned();
    }
    for of in 0..COUNTS.len() {
        for (row, value) in rows.iter_mut().zip(whole(1 + of)?) {
            row.counts
                .get_mut(of)
                .map(|count| *count = value.cast_unsigned())
                .context("a column")?;
        }
    }
    for of in 0..REALS.len() {
        for (row, value) in rows.iter_mut().zip(real(1 + COUNTS.len() + of)?) {
            row.reals.get_mut(of).map(|real| *real = value).context("a column")?;
        }
    }
    Ok(rows)
}
