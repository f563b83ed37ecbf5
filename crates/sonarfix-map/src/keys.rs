//! The table of keys. A row has the name of a key, its unit and limits, its place in a structure and its explanation; reader,
//! writer, error messages, comments of new files and the tables of `docs/formats.md` come from the rows. The rows are beside
//! the part that they describe.

use crate::document::{Node, Table};
use crate::quantity::{Dimension, Limits, Number};

/// A table of a file, which describes a `T`.
pub(crate) struct Section<T: 'static> {
    /// Its place in the file: `motors`.
    pub name: &'static str,
    /// What optional keys are without a value in the file.
    pub usual: fn() -> T,
    pub keys: &'static [Key<T>],
}

/// A row of the table.
#[derive(Clone, Copy)]
pub(crate) struct Key<T: 'static> {
    name: &'static str,
    need: Need,
    value: Value<T>,
    /// The first sentence explains the key in one line.
    doc: &'static str,
}

/// Whether a file must have a key.
#[derive(Clone, Copy, PartialEq)]
enum Need {
    Required,
    Optional,
    /// The reader of the table decides by its other keys.
    Depends,
}

/// What a key holds, and where it goes.
#[derive(Clone, Copy)]
pub(crate) enum Value<T: 'static> {
    Number(&'static Dimension, Limits, fn(&mut T) -> &mut dyn Number),
    Pair(&'static Dimension, Limits, fn(&mut T) -> [&mut dyn Number; 2]),
    Flag(fn(&mut T) -> &mut bool),
    /// One of several words, by its index.
    Word(&'static [&'static str], fn(&T) -> usize, fn(&mut T, usize)),
    /// A table of keys of the same structure.
    Table(&'static Section<T>),
    /// A value with a reader and a writer of its own, and what it must be.
    Own(&'static str, fn(Node<'_>, &mut T), fn(&T) -> Option<String>),
    /// Tables with a reader and a writer of their own.
    Tables(fn(Node<'_>, &mut T), fn(&T) -> String),
}

/// A key that a file need not have.
pub(crate) const fn optional<T: Copy>(key: Key<T>) -> Key<T> {
    Key { need: Need::Optional, ..key }
}

/// A key for which the reader of the table decides.
pub(crate) const fn depends<T: Copy>(key: Key<T>) -> Key<T> {
    Key { need: Need::Depends, ..key }
}

/// A key with a number.
pub(crate) const fn number<T: Copy>(
    name: &'static str,
    dimension: &'static Dimension,
    limits: Limits,
    field: fn(&mut T) -> &mut dyn Number,
    doc: &'static str,
) -> Key<T> {
    Key::new(name, Value::Number(dimension, limits, field), doc)
}

/// A key whose table reads it together with others.
pub(crate) const fn other<T: Copy>(
    name: &'static str,
    must: &'static str,
    doc: &'static str,
) -> Key<T> {
    depends(Key::new(name, Value::Own(must, |_, _| {}, |_| None), doc))
}

impl<T: Copy> Key<T> {
    pub const fn new(name: &'static str, value: Value<T>, doc: &'static str) -> Self {
        Self { name, need: Need::Required, value, doc }
    }

    fn read(&self, table: &Table<'_>, into: &mut T) {
        let node = match (table.get(self.name), self.need) {
            (Some(node), _) => node,
            (None, Need::Required) => table.require(self.name),
            (None, _) => return,
        };
        match self.value {
            Value::Number(dimension, limits, field) => {
                field(into).set(node.within(dimension, limits, self.note()));
            }
            Value::Pair(dimension, limits, fields) => {
                for (field, node) in fields(into).into_iter().zip(node.pair()) {
                    field.set(node.within(dimension, limits, self.note()));
                }
            }
            Value::Flag(field) => *field(into) = node.boolean(),
            Value::Word(words, _, set) => set(into, node.word(words)),
            Value::Table(section) => *into = section.read(node, *into),
            Value::Own(_, read, _) | Value::Tables(read, _) => read(node, into),
        }
    }

    /// Its explanation in one line.
    fn note(&self) -> &'static str {
        self.doc.split(". ").next().unwrap_or(self.doc)
    }

    /// Its value as in a file, if it has one.
    fn text(&self, of: &T) -> Option<String> {
        let mut of = *of;
        match self.value {
            Value::Number(dimension, _, field) => dimension.text(field(&mut of)),
            Value::Pair(dimension, _, fields) => {
                let [one, other] = fields(&mut of).map(|field| dimension.text(field));
                Some(format!("[{}, {}]", one?, other?))
            }
            Value::Flag(field) => Some(field(&mut of).to_string()),
            Value::Word(words, get, _) => words.get(get(&of)).map(|word| format!("\"{word}\"")),
            Value::Own(_, _, write) => write(&of),
            Value::Table(_) | Value::Tables(..) => None,
        }
    }

    /// The tables that follow the values.
    fn tables(&self, of: &T) -> String {
        match self.value {
            Value::Table(section) => format!("\n[{}]\n{}", self.name, section.lines(of)),
            Value::Tables(_, write) => write(of),
            _ => String::new(),
        }
    }

    /// What the value must be.
    fn rule(&self) -> String {
        match self.value {
            Value::Number(_, (least, most), _) => format!("{least} to {most}"),
            Value::Pair(_, (least, most), _) => format!("two values, {least} to {most}"),
            Value::Flag(_) => "`true` or `false`".to_owned(),
            Value::Word(words, ..) => {
                let words = words.iter().map(|word| format!("`\"{word}\"`"));
                words.collect::<Vec<_>>().join(", ")
            }
            Value::Own(must, ..) => must.to_owned(),
            Value::Table(_) | Value::Tables(..) => String::new(),
        }
    }

    /// Its row in `docs/formats.md`.
    fn row(&self, usual: &T) -> String {
        let default = match (self.need, self.text(usual)) {
            (Need::Optional, Some(text)) => format!("*optional, default {text}*: "),
            (Need::Optional, None) => "*optional*: ".to_owned(),
            _ => String::new(),
        };
        format!("| `{}` | {default}{} | {} |\n", self.name, self.doc, self.rule())
    }
}

impl<T: Copy> Section<T> {
    /// Reads a table: `usual` with what the file has.
    pub fn read(&self, node: Node<'_>, usual: T) -> T {
        self.read_from(&node.table(&self.names()), usual)
    }

    /// Reads a table whose keys are known to be of this section.
    pub fn read_from(&self, table: &Table<'_>, mut usual: T) -> T {
        for key in self.keys {
            key.read(table, &mut usual);
        }
        usual
    }

    pub fn names(&self) -> Vec<&'static str> {
        self.keys.iter().map(|key| key.name).collect()
    }

    fn values(&self, of: &T) -> Vec<String> {
        let value = |key: &Key<T>| Some(format!("{} = {}", key.name, key.text(of)?));
        self.keys.iter().filter_map(value).collect()
    }

    /// The text of a table: a line for each value, then the tables in it.
    pub fn lines(&self, of: &T) -> String {
        let values = self.values(of).into_iter().map(|value| value + "\n");
        values.chain(self.keys.iter().map(|key| key.tables(of))).collect()
    }

    /// The text of a table in one line.
    pub fn inline(&self, of: &T) -> String {
        format!("{{ {} }}", self.values(of).join(", "))
    }

    /// Its rows in `docs/formats.md`; tables in it have their own.
    pub fn rows(&self) -> (&'static str, String) {
        let usual = (self.usual)();
        let is_value = |key: &&Key<T>| !matches!(key.value, Value::Table(_) | Value::Tables(..));
        let rows = self.keys.iter().filter(is_value).map(|key| key.row(&usual));
        (
            self.name,
            format!("| key | meaning | must be |\n|---|---|---|\n{}", rows.collect::<String>()),
        )
    }

    /// The explanation of each key in one line.
    pub fn notes(&self) -> impl Iterator<Item = (String, &'static str)> {
        self.keys.iter().map(|key| (format!("{}.{}", self.name, key.name), key.note()))
    }
}
