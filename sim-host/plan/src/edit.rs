//! Sets keys of a scenario or of its robot in the text of the file.

use std::fmt;
use std::path::Path;

use anyhow::{Context, bail};
use sonarfix_map::{Scenario, scenario_keys};
use toml::{Table, Value};

/// The new value of a key.
#[derive(Debug, Clone, PartialEq)]
pub enum Edit {
    /// A text, which becomes a number or a truth value where the key has no text.
    Text(String),
    /// A value as in the file.
    Value(Value),
}

impl fmt::Display for Edit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Text(text) => f.write_str(text),
            Self::Value(value) => value.fmt(f),
        }
    }
}

/// The scenario of a file with these values of its keys. A key is one of the scenario or else of its robot. `option` begins
/// the errors about a key.
///
/// # Errors
/// If the file is no scenario with these values, or has no such place.
pub fn scenario(
    file: &Path,
    text: &str,
    values: &[(String, Edit)],
    option: &str,
) -> anyhow::Result<Scenario> {
    let base = file.parent().unwrap_or(Path::new(""));
    let mut root: Table = text.parse().with_context(|| file.display().to_string())?;
    for (key, value) in values {
        let mut path: Vec<&str> = key.split('.').collect();
        // Any other key is one of the robot.
        if path.first().is_some_and(|first| !scenario_keys().contains(first)) {
            path.insert(0, "robot");
        }
        if let Some(first) = path.first() {
            read_in(&mut root, first, base)?;
        }
        let place = place(Value::Table(std::mem::take(&mut root)), &path, value);
        root = place.with_context(|| format!("{option}{key}={value}"))?;
    }
    let name = file.display().to_string();
    Ok(Scenario::parse(&root.to_string(), &name, base)?)
}

/// Replaces the name of a robot or map file by its content.
fn read_in(root: &mut Table, key: &str, base: &Path) -> anyhow::Result<()> {
    let Some(Value::String(name)) = root.get(key).filter(|_| matches!(key, "robot" | "map")) else {
        return Ok(());
    };
    let file = base.join(name);
    let text = sonarfix_map::read_text(&file).with_context(|| file.display().to_string())?;
    let mut content: Table = text.parse().with_context(|| file.display().to_string())?;
    content.remove("format");
    // A map file has its walls in a table of the same name.
    let inner = content.remove(key).unwrap_or(Value::Table(content));
    root.insert(key.to_owned(), inner);
    Ok(())
}

/// The document with the value at a path.
fn place(mut root: Value, path: &[&str], edit: &Edit) -> anyhow::Result<Table> {
    let mut here = &mut root;
    for &key in path {
        here = match here {
            Value::Table(table) => table.entry(key).or_insert_with(|| Value::Table(Table::new())),
            Value::Array(items) => {
                let index: usize = key.parse().context("a list needs a number")?;
                items.get_mut(index).context("the list is shorter")?
            }
            _ => bail!("\"{key}\" is not a key"),
        };
    }
    *here = match edit {
        Edit::Text(text) => of_the_same_type(here, text),
        Edit::Value(value) => value.clone(),
    };
    match root {
        Value::Table(table) => Ok(table),
        _ => bail!("the file is not a table"),
    }
}

/// A text stays a text; elsewhere what can be a number or a truth value is one.
fn of_the_same_type(held: &Value, text: &str) -> Value {
    if held.is_str() {
        return Value::String(text.to_owned());
    }
    let whole = || text.parse().ok().map(Value::Integer);
    let real = || text.parse().ok().map(Value::Float);
    let truth = || text.parse().ok().map(Value::Boolean);
    whole().or_else(real).or_else(truth).unwrap_or_else(|| Value::String(text.to_owned()))
}
