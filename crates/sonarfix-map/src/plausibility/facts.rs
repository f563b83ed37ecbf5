//! The values of a scenario and of the files that it names, as flat lists with their lines.

use std::cell::Cell;
use std::collections::BTreeMap;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::error::Mistake;
use crate::quantity::Dimension;
use crate::text_lines::Lines;

/// A comment with this word accepts the values of its line.
const ACCEPTED: &str = "# plausible";

/// The key at which a wall is reported.
const WALL: &str = "map.wall.name";

/// A number in a file.
#[derive(Debug, Clone)]
pub(super) struct Fact {
    file: String,
    line: usize,
    /// The whole key, as in `robot.sonar.mount[0]`.
    key: String,
    /// The key by which rules find it, as in `sonar.mount[0]`.
    pub id: String,
    /// The index of its table in an array of tables.
    pub table: usize,
    /// The value as written, without quotes.
    pub text: String,
    is_number: bool,
    is_accepted: bool,
    /// Whether a warning is about this value: another one about the same value has the same cause.
    is_reported: Cell<bool>,
}

impl Fact {
    /// A value that its reader has refused.
    pub fn refused(key: &str, text: &str, is_number: bool) -> Self {
        Self {
            file: String::new(),
            line: 0,
            key: key.to_owned(),
            id: id(key),
            table: 0,
            text: text.to_owned(),
            is_number,
            is_accepted: false,
            is_reported: Cell::new(false),
        }
    }

    /// The value in the SI unit; `None` if it is not of this dimension.
    pub fn value(&self, dimension: &Dimension) -> Option<f64> {
        let is_possible = if self.is_number { dimension.is_bare } else { dimension.has_units() };
        if !is_possible {
            return None;
        }
        Some(dimension.number(&self.text)).filter(|value| value.is_finite())
    }

    /// The value as it is quoted in messages.
    pub fn quoted(&self) -> String {
        if self.is_number { self.text.clone() } else { format!("\"{}\"", self.text) }
    }

    /// Another value, written as this one is.
    pub fn quoted_as(&self, text: &str) -> String {
        if self.is_number && text.parse::<f64>().is_ok() {
            text.to_owned()
        } else {
            format!("\"{text}\"")
        }
    }

    /// Marks the value as reported; whether a warning about it is to be shown.
    pub fn report(&self) -> bool {
        !self.is_reported.replace(true) && !self.is_accepted
    }

    /// A warning at this value.
    pub fn warn(&self, message: String) -> Mistake {
        Mistake::new(&self.file, self.line, &self.key, message)
    }
}

/// All numbers and words of a scenario, a robot file or a map file.
#[derive(Debug, Default)]
pub(super) struct Facts {
    /// By the key by which rules find them.
    all: BTreeMap<String, Vec<Fact>>,
    /// The duration of the path in seconds, if the file is a scenario without mistakes.
    pub duration: Option<f64>,
}

impl Facts {
    /// The values of a file without those of the files that it names.
    pub fn of_one(text: &str, name: &str) -> Self {
        let mut facts = Self::default();
        facts.add_values(text, name);
        facts
    }

    /// The walls of a map without keys, by their lines.
    pub fn of_walls(name: &str, lines: impl IntoIterator<Item = usize>) -> Self {
        let wall = |(table, line): (usize, usize)| Fact {
            file: name.to_owned(),
            line,
            id: WALL.to_owned(),
            table,
            ..Fact::refused(&format!("map.wall[{table}]"), "", false)
        };
        let walls = lines.into_iter().enumerate().map(wall).collect();
        Self { all: BTreeMap::from([(WALL.to_owned(), walls)]), ..Self::default() }
    }

    /// Adds the values of a file; returns the names of the other files.
    pub fn add_values(&mut self, text: &str, name: &str) -> Vec<String> {
        let Ok(root) = DeTable::parse(text) else { return Vec::new() };
        let mut reader = Reader { text, lines: Lines::new(text), name, all: &mut self.all };
        let mut others = Vec::new();
        for (key, value) in root.get_ref() {
            let key: &str = key.get_ref();
            match value.get_ref() {
                DeValue::String(other) if matches!(key, "map" | "robot") => {
                    others.push(other.as_ref().to_owned());
                }
                _ => reader.value(key.to_owned(), 0, value),
            }
        }
        others
    }

    /// Adds the values of other files.
    pub fn extend(&mut self, others: Self) {
        for (id, facts) in others.all {
            self.all.entry(id).or_default().extend(facts);
        }
    }

    /// The values with this key, of all tables of an array.
    pub fn with(&self, id: &str) -> impl Iterator<Item = &Fact> {
        self.all.get(id).into_iter().flatten().filter(|fact| !fact.is_reported.get())
    }

    /// The value with this key, of the same table of an array if it is in one.
    pub fn beside(&self, fact: &Fact, id: &str) -> Option<&Fact> {
        let in_table = self.with(id).find(|other| other.table == fact.table);
        in_table.or_else(|| self.with(id).next())
    }

    /// A number by its key.
    pub fn number(&self, id: &str, dimension: &Dimension) -> Option<f64> {
        self.with(id).next()?.value(dimension)
    }

    /// A word by its key.
    pub fn word(&self, id: &str) -> Option<&str> {
        self.with(id).next().map(|fact| fact.text.as_str())
    }

    /// The name of a wall.
    pub fn wall(&self, wall: usize) -> Option<&Fact> {
        self.with(WALL).find(|fact| fact.table == wall)
    }

    /// The value with this key in a table of an array.
    pub fn in_table(&self, id: &str, table: usize) -> Option<&Fact> {
        self.with(id).find(|fact| fact.table == table)
    }
}

struct Reader<'r> {
    text: &'r str,
    lines: Lines,
    name: &'r str,
    all: &'r mut BTreeMap<String, Vec<Fact>>,
}

impl Reader<'_> {
    fn value(&mut self, key: String, table: usize, value: &Spanned<DeValue<'_>>) {
        let (text, is_number) = match value.get_ref() {
            DeValue::Table(entries) => {
                for (name, value) in entries {
                    let name: &str = name.get_ref();
                    self.value(format!("{key}.{name}"), table, value);
                }
                return;
            }
            DeValue::Array(items) => {
                for (index, item) in items.iter().enumerate() {
                    let is_table = item.get_ref().as_table().is_some();
                    let table = if is_table { index } else { table };
                    self.value(format!("{key}[{index}]"), table, item);
                }
                return;
            }
            DeValue::String(text) => (text.trim().to_owned(), false),
            DeValue::Integer(integer) => (integer.as_str().to_owned(), true),
            DeValue::Float(float) => (float.as_str().to_owned(), true),
            _ => return,
        };
        let line = self.lines.of(value.span().start);
        let is_accepted = self.lines.text(self.text, line).contains(ACCEPTED);
        let id = id(&key);
        self.all.entry(id.clone()).or_default().push(Fact {
            file: self.name.to_owned(),
            line,
            id,
            key,
            table,
            text,
            is_number,
            is_accepted,
            is_reported: Cell::new(false),
        });
    }
}

/// A key without the indices of its tables, and without `robot`: rules concern a robot file and the robot of a scenario.
pub(super) fn id(key: &str) -> String {
    let mut id = String::new();
    for part in key.split('.') {
        let name = part.split('[').next().unwrap_or(part);
        id = if id.is_empty() { name.to_owned() } else { format!("{id}.{name}") };
    }
    let index = key.rsplit('.').next().and_then(|last| last.split_once('['));
    if let Some((_, index)) = index {
        id = format!("{id}[{index}");
    }
    id.strip_prefix("robot.").map_or(id.clone(), str::to_owned)
}
