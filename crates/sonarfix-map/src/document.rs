//! A TOML file as a tree in which every value has its line and its full key.
//!
//! A mistake in a value ends nothing: it is recorded, the reader goes on with a placeholder, and [`Document::read`] returns
//! all mistakes at once.

use std::cell::{Cell, RefCell};
use std::ops::RangeInclusive;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::error::{FileError, MOST_MISTAKES, Mistake};
use crate::example;
use crate::geometry::{TOO_FAR, is_near_enough};
use crate::plausibility::values::{meant, suspects};
use crate::quantity::{Dimension, LENGTH, Limits, METRE, Unit};
use crate::spelling::{alternatives, nearest};
use crate::text_lines::Lines;

/// The version of the formats that this crate reads.
const FORMAT: u64 = 1;

/// A number in place of one that cannot be read; every dimension permits it.
const PLACEHOLDER: f64 = 1.0;

#[derive(Clone, Copy)]
struct File<'a> {
    name: &'a str,
    lines: &'a Lines,
    mistakes: &'a RefCell<Vec<Mistake>>,
}

impl File<'_> {
    fn record(self, at: usize, key: &str, message: impl Into<String>) {
        let mut mistakes = self.mistakes.borrow_mut();
        if mistakes.len() < MOST_MISTAKES {
            mistakes.push(Mistake::new(self.name, self.lines.of(at), key, message));
        }
    }
}

/// The beginning of a line, as it is quoted in a message: a file that is no text may have control characters.
fn shown(line: &str) -> String {
    let visible = |character: char| if character.is_control() { '\u{fffd}' } else { character };
    line.chars().take(60).map(visible).collect()
}

/// The longest TOML that is parsed, which takes 60 times its length in memory.
const MAX_TOML_BYTES: usize = 4 * 1024 * 1024;

/// A parsed file.
pub(crate) struct Document<'a> {
    name: &'a str,
    text: &'a str,
    lines: Lines,
    mistakes: RefCell<Vec<Mistake>>,
    root: DeValue<'a>,
}

impl<'a> Document<'a> {
    /// Parses the text of the file `name`.
    pub fn parse(text: &'a str, name: &'a str) -> Result<Self, FileError> {
        if text.len() > MAX_TOML_BYTES {
            let limit = MAX_TOML_BYTES / (1024 * 1024);
            let message =
                format!("it has more than {limit} MiB: write a map of so many walls as CSV");
            return Err(FileError::of_file(name, message));
        }
        let lines = Lines::new(text);
        let root = DeTable::parse(text).map_err(|error| {
            let span = error.span().unwrap_or_default();
            let rest = text.get(span.start..).unwrap_or_default();
            let near = shown(rest.lines().next().unwrap_or_default());
            let message = format!("this is not TOML at `{near}`: {}", error.message());
            FileError::from(Mistake::new(name, lines.of(span.start), "", message))
        })?;
        let root = DeValue::Table(root.into_inner());
        Ok(Self { name, text, lines, mistakes: RefCell::default(), root })
    }

    /// Whether the file has a value at this key.
    pub fn has(&self, key: &str) -> bool {
        self.root.as_table().is_some_and(|table| table.contains_key(key))
    }

    /// Reads the file as a table with the keys `format` and `keys`. The version is checked first, because another version
    /// may have other keys.
    ///
    /// # Errors
    /// The mistakes that were recorded, by line: at most [`MOST_MISTAKES`].
    pub fn read<T>(
        &self,
        keys: &[&str],
        read: impl FnOnce(&Table<'_>) -> Option<T>,
    ) -> Result<T, FileError> {
        let file = File { name: self.name, lines: &self.lines, mistakes: &self.mistakes };
        let root = Node::new(file, String::new(), 0, Some(&self.root)).any_table();
        let value =
            root.has_known_format().then(|| read(&root.only(&[&["format"], keys].concat())));
        let mistakes = self.mistakes.take();
        let suspects = suspects(self.text, self.name, &mistakes);
        match (FileError::of(mistakes), value.flatten()) {
            (Some(error), _) => Err(error.followed_by(suspects)),
            (None, Some(value)) => Ok(value),
            (None, None) => Err(FileError::of_file(self.name, "cannot be read")),
        }
    }
}

/// A value, with its place in the file; or the place where a value is missing.
pub(crate) struct Node<'a> {
    file: File<'a>,
    key: String,
    /// Position of the value in the text; of a table, of its header.
    at: usize,
    /// None for a value that is missing, which is recorded where it was asked for.
    value: Option<&'a DeValue<'a>>,
    /// Whether a mistake in this value has been recorded. What follows from it is not.
    is_reported: Cell<bool>,
}

impl<'a> Node<'a> {
    fn new(file: File<'a>, key: String, at: usize, value: Option<&'a DeValue<'a>>) -> Self {
        Self { file, key, at, value, is_reported: Cell::new(value.is_none()) }
    }

    /// Records a mistake in this value, unless one has been recorded.
    pub fn report(&self, message: impl Into<String>) {
        if !self.is_reported.replace(true) {
            let text = self.as_text().or_else(|| self.number_text()).unwrap_or_default();
            let message = match meant(&self.key, text, self.as_text().is_none()) {
                Some(meant) => format!("{}; did you mean {meant}?", message.into()),
                None => message.into(),
            };
            self.file.record(self.at, &self.key, message);
        }
    }

    /// Records the mistakes of another file, which this value names.
    pub fn report_all(&self, error: FileError) {
        self.is_reported.set(true);
        self.file.mistakes.borrow_mut().extend(error);
    }

    /// Position of the value in the text; of a table, of its header.
    pub fn place(&self) -> usize {
        self.at
    }

    /// The value; records the rule if it does not hold.
    pub fn check<T>(&self, value: T, holds: bool, rule: &str) -> T {
        if !holds {
            self.report(format!("must be {rule}"));
        }
        value
    }

    fn wrong_type(&self, expected: &str) {
        let found = self.value.map_or("", DeValue::type_str);
        self.report(format!("must be {expected}, but this is of type {found}"));
    }

    fn child(&self, key: String, value: &'a Spanned<DeValue<'a>>) -> Self {
        Self::new(self.file, key, value.span().start, Some(value.get_ref()))
    }

    fn missing(&self, key: String) -> Self {
        Self::new(self.file, key, self.at, None)
    }

    /// A table with these keys only.
    pub fn table(self, keys: &[&str]) -> Table<'a> {
        self.any_table().only(keys)
    }

    fn any_table(self) -> Table<'a> {
        let entries = self.value.and_then(DeValue::as_table);
        if entries.is_none() {
            self.wrong_type("a table");
        }
        Table { node: self, entries, misspelt: Vec::new() }
    }

    /// Whether it is an array.
    pub fn is_array(&self) -> bool {
        self.value.is_some_and(|value| value.as_array().is_some())
    }

    /// The values of an array.
    pub fn items(&self) -> Vec<Self> {
        let Some(array) = self.value.and_then(DeValue::as_array) else {
            self.wrong_type("an array");
            return Vec::new();
        };
        let item = |(index, value)| self.child(format!("{}[{index}]", self.key), value);
        array.iter().enumerate().map(item).collect()
    }

    /// The two values of an array of two.
    pub fn pair(&self) -> [Self; 2] {
        let items = self.items();
        let count = items.len();
        items.try_into().unwrap_or_else(|_| {
            self.report(format!("must be two values, but there are {count}"));
            [0, 1].map(|index| self.missing(format!("{}[{index}]", self.key)))
        })
    }

    /// A string; `None` for another type.
    pub fn as_text(&self) -> Option<&'a str> {
        self.value?.as_str()
    }

    /// A string.
    pub fn text(&self) -> &'a str {
        self.as_text().unwrap_or_else(|| {
            self.wrong_type("a string");
            ""
        })
    }

    /// The index of one of several words; 0 for another text.
    pub fn word(&self, words: &[&str]) -> usize {
        let text = self.text();
        let found = words.iter().position(|word| *word == text);
        found.unwrap_or_else(|| {
            self.report(format!("must be {}", alternatives(text, words)));
            0
        })
    }

    /// `true` or `false`.
    pub fn boolean(&self) -> bool {
        self.value.and_then(DeValue::as_bool).unwrap_or_else(|| {
            self.wrong_type("true or false");
            false
        })
    }

    /// A whole number within these limits.
    pub fn integer(&self, limits: RangeInclusive<u64>) -> u64 {
        let expected = format!("a whole number from {} to {}", limits.start(), limits.end());
        let Some(integer) = self.value.and_then(DeValue::as_integer) else {
            self.wrong_type(&expected);
            return *limits.start();
        };
        let number = u64::from_str_radix(integer.as_str(), integer.radix()).ok();
        number.filter(|number| limits.contains(number)).unwrap_or_else(|| {
            self.report(format!("must be {expected}"));
            *limits.start()
        })
    }

    /// A whole number from 1 on.
    pub fn count(&self) -> u32 {
        u32::try_from(self.integer(1..=u32::MAX.into())).unwrap_or(u32::MAX)
    }

    /// The text of a number; `None` for another type.
    fn number_text(&self) -> Option<&'a str> {
        match self.value? {
            DeValue::Integer(integer) if integer.radix() == 10 => Some(integer.as_str()),
            DeValue::Float(float) => Some(float.as_str()),
            _ => None,
        }
    }

    /// A finite number without a unit.
    pub fn number(&self) -> f64 {
        let number: Option<f64> = self.number_text().and_then(|text| text.parse().ok());
        match number {
            Some(number) if number.is_finite() => return number,
            Some(_) => self.report("must be finite"),
            None => self.wrong_type("a number"),
        }
        PLACEHOLDER
    }

    /// A number in the SI unit: with a unit, or bare where the dimension permits it.
    pub fn quantity(&self, dimension: &Dimension) -> f64 {
        if let Some(number) = self.number_text().filter(|_| !dimension.is_bare) {
            self.report(dimension.missing_unit(number));
            return PLACEHOLDER;
        }
        if self.as_text().is_none() || !dimension.has_units() {
            return self.number();
        }
        dimension.parse(self.text()).unwrap_or_else(|message| {
            self.report(message);
            PLACEHOLDER
        })
    }

    /// A number within limits, which are texts like those of the file; `what` it is, for the message.
    pub fn within(&self, dimension: &Dimension, limits: Limits, what: &str) -> f64 {
        let value = self.quantity(dimension);
        let (least, most) = (dimension.number(limits.0), dimension.number(limits.1));
        let holds = least <= value && value <= most;
        self.check(value, holds, &format!("from {} to {} ({what})", limits.0, limits.1))
    }

    /// The unit of a table's coordinates.
    pub fn unit_of_length(&self) -> &'static Unit {
        LENGTH.unit(self.text()).unwrap_or_else(|| {
            self.report(format!("must be one of {}", LENGTH.unit_names()));
            &METRE
        })
    }

    /// A point of two bare coordinates, in metres.
    pub fn point(&self, unit: &Unit) -> [f64; 2] {
        let point = self.pair().map(|coordinate| unit.in_si(coordinate.number()));
        self.check(point, is_near_enough(point), TOO_FAR)
    }
}

/// A table, with its place in the file.
pub(crate) struct Table<'a> {
    node: Node<'a>,
    /// None for a table that is missing: all its values are, too.
    entries: Option<&'a DeTable<'a>>,
    /// Known keys for which an unknown one was probably meant.
    misspelt: Vec<String>,
}

impl<'a> Table<'a> {
    /// Whether the version of the format is one that can be read, or missing, which is recorded.
    fn has_known_format(&self) -> bool {
        let format = self.require("format");
        let version = if format.value.is_some() { format.integer(0..=u64::MAX) } else { FORMAT };
        if version != FORMAT {
            format.report(format!("version {version} cannot be read, only version {FORMAT}"));
        }
        version == FORMAT
    }

    /// The same table; records its keys that are not among these.
    fn only(mut self, keys: &[&str]) -> Self {
        let known = keys.join(", ");
        for key in self.entries.into_iter().flat_map(DeTable::keys) {
            let name: &str = key.get_ref();
            if keys.contains(&name) {
                continue;
            }
            let message = match nearest(name, keys) {
                Some(meant) => {
                    self.misspelt.push(meant.to_owned());
                    format!("unknown key: did you mean `{meant}`? possible here: {known}")
                }
                None => format!("unknown key; possible here: {known}"),
            };
            self.node.file.record(key.span().start, &self.key_of(name), message);
        }
        self
    }

    fn key_of(&self, key: &str) -> String {
        if self.node.key.is_empty() { key.into() } else { format!("{}.{key}", self.node.key) }
    }

    /// The value of an optional key.
    pub fn get(&self, key: &str) -> Option<Node<'a>> {
        let value = self.entries?.get(key)?;
        Some(self.node.child(self.key_of(key), value))
    }

    /// The value of a required key. A missing one is recorded, unless the key is misspelt or its whole table is missing.
    pub fn require(&self, key: &str) -> Node<'a> {
        self.get(key).unwrap_or_else(|| {
            let whole_key = self.key_of(key);
            if self.entries.is_some() && !self.misspelt.iter().any(|misspelt| misspelt == key) {
                self.node.file.record(self.node.at, &whole_key, example::missing(&whole_key));
            }
            self.node.missing(whole_key)
        })
    }

    /// A required table with these keys only.
    pub fn table(&self, key: &str, keys: &[&str]) -> Table<'a> {
        self.require(key).table(keys)
    }

    /// What a reader returns, if it records no mistake: placeholders are no input for rules about several values.
    pub fn faultless<T>(&self, read: impl FnOnce() -> Option<T>) -> Option<T> {
        let mistakes = self.mistakes();
        read().filter(|_| self.mistakes() == mistakes)
    }

    /// The number of mistakes so far. A rule about several values is checked only if their reading adds none.
    pub fn mistakes(&self) -> usize {
        self.node.file.mistakes.borrow().len()
    }

    /// Records a mistake at a dotted key of this table; at the innermost existing table if there is no such value.
    pub fn report_at(&self, dotted: &str, message: impl Into<String>) {
        let (first, rest) = dotted.split_once('.').unwrap_or((dotted, ""));
        match self.get(first) {
            None => self.node.report(message),
            Some(node) if rest.is_empty() => node.report(message),
            Some(node) => node.any_table().report_at(rest, message),
        }
    }
}
