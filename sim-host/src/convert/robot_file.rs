//! `robot.toml`, with a comment that says where each value comes from.

use std::path::Path;

use crate::convert::{ConvertError, Out};

/// A value as the file has it, and where it comes from.
pub struct Value(pub String, pub &'static str);

impl Value {
    pub fn text(value: &str, source: &'static str) -> Self {
        Self(format!("\"{value}\""), source)
    }
}

/// A robot file: tables of keys.
pub type Tables = Vec<(&'static str, Vec<(&'static str, Value)>)>;

/// Writes a robot file.
pub fn write(dir: &Path, name: &str, comment: &str, tables: Tables) -> Result<(), ConvertError> {
    let mut out = Out::create(dir.join(name))?;
    out.line(format_args!("# {comment}\nformat = 1"))?;
    for (table, values) in tables {
        out.line(format_args!("\n[{table}]"))?;
        for (key, Value(value, source)) in values {
            out.line(format_args!("{key} = {value}  # {source}"))?;
        }
    }
    out.close()
}
