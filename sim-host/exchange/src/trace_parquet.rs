//! Rows as Parquet: a column for each of a trace, not compressed; what is unknown is null.

use std::io::Write;
use std::sync::Arc;

use anyhow::Context;
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::{Type, TypePtr};

use crate::row::{Kind, Row, Sink, Value, columns};

/// The version of the columns, in the metadata `sonarfix` of a file.
pub const VERSION: u32 = 2;
/// Rows that are in memory at once.
const GROUP: usize = 8_192;

/// A file that is being written.
pub struct File<W: Write + Send> {
    out: SerializedFileWriter<W>,
    rows: Vec<Row>,
}

fn schema() -> anyhow::Result<TypePtr> {
    let column = |(name, kind): (&str, Kind)| {
        let column = match kind {
            Kind::Real => Type::primitive_type_builder(name, Physical::DOUBLE),
            Kind::Whole => Type::primitive_type_builder(name, Physical::INT64),
            Kind::Text => Type::primitive_type_builder(name, Physical::BYTE_ARRAY)
                .with_logical_type(Some(LogicalType::String)),
        };
        Ok(Arc::new(column.with_repetition(Repetition::OPTIONAL).build()?))
    };
    let fields = columns().map(column).collect::<anyhow::Result<_>>()?;
    Ok(Arc::new(Type::group_type_builder("trace").with_fields(fields).build()?))
}

impl<W: Write + Send> File<W> {
    /// Starts a file.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn new(out: W) -> anyhow::Result<Self> {
        let version = KeyValue::new("sonarfix".to_owned(), VERSION.to_string());
        let properties =
            WriterProperties::builder().set_key_value_metadata(Some(vec![version])).build();
        let out = SerializedFileWriter::new(out, schema()?, Arc::new(properties))?;
        Ok(Self { out, rows: Vec::new() })
    }

    /// Ends the file.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn end(mut self) -> anyhow::Result<W> {
        self.write_group()?;
        Ok(self.out.into_inner()?)
    }

    fn write_group(&mut self) -> anyhow::Result<()> {
        if self.rows.is_empty() {
            return Ok(());
        }
        let mut group = self.out.next_row_group()?;
        for (at, (_, kind)) in columns().enumerate() {
            let rows = self.rows.iter().filter_map(|row| row.values().get(at));
            match kind {
                Kind::Real => {
                    write_column::<DoubleType, _>(&mut group, rows, |value| match value {
                        Value::Real(value) => Some(*value),
                        _ => None,
                    })
                }
                Kind::Whole => {
                    write_column::<Int64Type, _>(&mut group, rows, |value| match value {
                        Value::Whole(value) => Some(*value),
                        _ => None,
                    })
                }
                Kind::Text => {
                    write_column::<ByteArrayType, _>(&mut group, rows, |value| match value {
                        Value::Text(text) => Some(ByteArray::from(text.as_str())),
                        _ => None,
                    })
                }
            }?;
        }
        group.close()?;
        self.rows.clear();
        Ok(())
    }
}

fn write_column<'v, T: DataType, W: Write + Send>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    rows: impl Iterator<Item = &'v Value>,
    of: impl Fn(&Value) -> Option<T::T>,
) -> anyhow::Result<()> {
    let (mut values, mut levels) = (Vec::new(), Vec::new());
    for value in rows.map(of) {
        levels.push(i16::from(value.is_some()));
        values.extend(value);
    }
    let mut column = group.next_column()?.context("a column is missing")?;
    column.typed::<T>().write_batch(&values, Some(&levels), None)?;
    Ok(column.close()?)
}

impl<W: Write + Send> Sink for File<W> {
    fn take(&mut self, row: &Row) -> anyhow::Result<()> {
        self.rows.push(row.clone());
        if self.rows.len() >= GROUP { self.write_group() } else { Ok(()) }
    }
}
