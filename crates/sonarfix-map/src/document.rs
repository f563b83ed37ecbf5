//! A TOML file as a tree in which every value has its line and its full key, for error messages.

use std::ops::RangeInclusive;

use sonarfix::units::Duration;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::error::FileError;
use crate::quantity::{Dimension, FRACTION, LENGTH, TIME, Unit};
use crate::spelling::nearest;

/// The version of the formats that this crate reads.
const FORMAT: u64 = 1;

/// The longest duration in a file, seconds.
const LONGEST_SPAN: f64 = 3600.0;

#[derive(Clone, Copy)]
struct File<'a> {
    name: &'a str,
    text: &'a str,
}

impl File<'_> {
    fn error(self, at: usize, key: &str, message: impl Into<String>) -> FileError {
        let before = self.text.bytes().take(at);
        let line = before.filter(|&byte| byte == b'\n').count() + 1;
        FileError::new(self.name, line, key, message)
    }
}

/// A parsed file.
pub(crate) struct Document<'a> {
    file: File<'a>,
    root: DeValue<'a>,
}

impl<'a> Document<'a> {
    /// Parses the text of the file `name`.
    pub fn parse(text: &'a str, name: &'a str) -> Result<Self, FileError> {
        let file = File { name, text };
        let root = DeTable::parse(text).map_err(|error| {
            let span = error.span().unwrap_or_default();
            let rest = text.get(span.start..).unwrap_or_default();
            let near = rest.lines().next().unwrap_or_default();
            let message = format!("this is not TOML at `{near}`: {}", error.message());
            file.error(span.start, "", message)
        })?;
        Ok(Self { file, root: DeValue::Table(root.into_inner()) })
    }

    /// Whether the file has a value at this key.
    pub fn has(&self, key: &str) -> bool {
        self.root.as_table().is_some_and(|table| table.contains_key(key))
    }

    /// The file as a table with the keys `format` and `keys`. The version is checked first, because another version may
    /// have other keys.
    pub fn root(&self, keys: &[&str]) -> Result<Table<'_>, FileError> {
        let root =
            Node { file: self.file, key: String::new(), at: 0, value: &self.root }.any_table()?;
        let format = root.require("format")?;
        let version = format.integer(0..=u64::MAX)?;
        if version != FORMAT {
            let message = format!("version {version} cannot be read, only version {FORMAT}");
            return Err(format.error(message));
        }
        root.only(&[&["format"], keys].concat())
    }
}

/// The line of each position in a text, both in ascending order; lines count from 1.
pub(crate) fn lines(text: &str, places: &[usize]) -> Vec<usize> {
    let mut line = 1;
    let mut from = 0;
    let mut line_at = |&place: &usize| {
        line += text.get(from..place).unwrap_or_default().matches('\n').count();
        from = place.max(from);
        line
    };
    places.iter().map(&mut line_at).collect()
}

/// A value, with its place in the file.
pub(crate) struct Node<'a> {
    file: File<'a>,
    key: String,
    /// Position of the value in the text; of a table, of its header.
    at: usize,
    value: &'a DeValue<'a>,
}

impl<'a> Node<'a> {
    /// An error at this value.
    pub fn error(&self, message: impl Into<String>) -> FileError {
        self.file.error(self.at, &self.key, message)
    }

    /// Position of the value in the text; of a table, of its header.
    pub fn place(&self) -> usize {
        self.at
    }

    /// Returns the value if the rule holds, otherwise an error with the rule.
    pub fn check<T>(&self, value: T, holds: bool, rule: &str) -> Result<T, FileError> {
        if holds { Ok(value) } else { Err(self.error(format!("must be {rule}"))) }
    }

    fn wrong_type(&self, expected: &str) -> FileError {
        let found = self.value.type_str();
        self.error(format!("must be {expected}, but this is of type {found}"))
    }

    fn child(&self, key: String, value: &'a Spanned<DeValue<'a>>) -> Self {
        Self { file: self.file, key, at: value.span().start, value: value.get_ref() }
    }

    /// A table with these keys only.
    pub fn table(self, keys: &[&str]) -> Result<Table<'a>, FileError> {
        self.any_table()?.only(keys)
    }

    fn any_table(self) -> Result<Table<'a>, FileError> {
        match self.value {
            DeValue::Table(entries) => Ok(Table { node: self, entries }),
            _ => Err(self.wrong_type("a table")),
        }
    }

    /// The values of an array.
    pub fn items(&self) -> Result<Vec<Self>, FileError> {
        let array = self.value.as_array().ok_or_else(|| self.wrong_type("an array"))?;
        let item = |(index, value)| self.child(format!("{}[{index}]", self.key), value);
        Ok(array.iter().enumerate().map(item).collect())
    }

    /// The two values of an array of two.
    pub fn pair(&self) -> Result<[Self; 2], FileError> {
        let items = self.items()?;
        let count = items.len();
        items
            .try_into()
            .map_err(|_| self.error(format!("must be two values, but there are {count}")))
    }

    /// A string; `None` for another type.
    pub fn as_text(&self) -> Option<&'a str> {
        self.value.as_str()
    }

    /// A string.
    pub fn text(&self) -> Result<&'a str, FileError> {
        self.as_text().ok_or_else(|| self.wrong_type("a string"))
    }

    /// `true` or `false`.
    pub fn boolean(&self) -> Result<bool, FileError> {
        let boolean = self.value.as_bool();
        boolean.ok_or_else(|| self.wrong_type("true or false"))
    }

    /// A whole number within these limits.
    pub fn integer(&self, limits: RangeInclusive<u64>) -> Result<u64, FileError> {
        let expected = format!("a whole number from {} to {}", limits.start(), limits.end());
        let Some(integer) = self.value.as_integer() else {
            return Err(self.wrong_type(&expected));
        };
        let number = u64::from_str_radix(integer.as_str(), integer.radix()).ok();
        number
            .filter(|number| limits.contains(number))
            .ok_or_else(|| self.error(format!("must be {expected}")))
    }

    /// The text of a number; `None` for another type.
    fn number_text(&self) -> Option<&'a str> {
        match self.value {
            DeValue::Integer(integer) if integer.radix() == 10 => Some(integer.as_str()),
            DeValue::Float(float) => Some(float.as_str()),
            _ => None,
        }
    }

    /// A finite number without a unit.
    pub fn number(&self) -> Result<f64, FileError> {
        let number = self.number_text().and_then(|text| text.parse().ok());
        let number: f64 = number.ok_or_else(|| self.wrong_type("a number"))?;
        self.check(number, number.is_finite(), "finite")
    }

    /// A number with a unit, converted to the SI unit.
    pub fn quantity(&self, dimension: &Dimension) -> Result<f64, FileError> {
        if let Some(number) = self.number_text() {
            return Err(self.error(dimension.missing_unit(number)));
        }
        let parsed = dimension.parse(self.text()?);
        parsed.map_err(|message| self.error(message))
    }

    /// A quantity that is not negative.
    pub fn deviation(&self, dimension: &Dimension) -> Result<f64, FileError> {
        let value = self.quantity(dimension)?;
        self.check(value, value >= 0.0, "zero or positive")
    }

    /// A fraction, as a number or in per cent.
    pub fn fraction(&self) -> Result<f64, FileError> {
        if self.number_text().is_some() {
            return self.number();
        }
        self.quantity(&FRACTION)
    }

    /// A duration in whole microseconds, the resolution of the localizer's time.
    pub fn span(&self) -> Result<Duration, FileError> {
        let seconds = self.quantity(&TIME)?;
        let fits = (0.0..=LONGEST_SPAN).contains(&seconds);
        let seconds = self.check(seconds, fits, "from 0 s to 1 hour")?;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "rounded, and between 0 and 3.6e9"
        )]
        let microseconds = (seconds * 1e6).round() as u64;
        Ok(Duration::micros(microseconds))
    }

    /// A duration longer than zero.
    pub fn period(&self) -> Result<Duration, FileError> {
        const SHORTEST: f64 = 1e-6;
        let seconds = self.quantity(&TIME)?;
        self.check(seconds, (SHORTEST..=LONGEST_SPAN).contains(&seconds), "from 1 us to 1 hour")?;
        self.span()
    }

    /// The unit of a table's coordinates.
    pub fn unit_of_length(&self) -> Result<&'static Unit, FileError> {
        let unit = LENGTH.unit(self.text()?);
        unit.ok_or_else(|| self.error(format!("must be one of {}", LENGTH.unit_names())))
    }

    /// A point of two bare coordinates, in metres.
    pub fn point(&self, unit: &Unit) -> Result<[f64; 2], FileError> {
        let [x, y] = self.pair()?;
        Ok([unit.in_si(x.number()?), unit.in_si(y.number()?)])
    }
}

/// A table, with its place in the file.
pub(crate) struct Table<'a> {
    node: Node<'a>,
    entries: &'a DeTable<'a>,
}

impl<'a> Table<'a> {
    fn only(self, keys: &[&str]) -> Result<Self, FileError> {
        let unknown = self.entries.keys().filter(|key| !keys.contains(&key.get_ref().as_ref()));
        match unknown.min_by_key(|key| key.span().start) {
            None => Ok(self),
            Some(key) => {
                let known = keys.join(", ");
                let message = match nearest(key.get_ref(), keys) {
                    Some(meant) => {
                        format!("unknown key: did you mean `{meant}`? possible here: {known}")
                    }
                    None => format!("unknown key; possible here: {known}"),
                };
                let whole_key = self.key_of(key.get_ref());
                Err(self.node.file.error(key.span().start, &whole_key, message))
            }
        }
    }

    fn key_of(&self, key: &str) -> String {
        if self.node.key.is_empty() { key.into() } else { format!("{}.{key}", self.node.key) }
    }

    /// The value of an optional key.
    pub fn get(&self, key: &str) -> Option<Node<'a>> {
        let value = self.entries.get(key)?;
        Some(self.node.child(self.key_of(key), value))
    }

    /// The value of a required key.
    pub fn require(&self, key: &str) -> Result<Node<'a>, FileError> {
        self.get(key).ok_or_else(|| {
            let node = &self.node;
            node.file.error(node.at, &self.key_of(key), "is missing")
        })
    }

    /// A required table with these keys only.
    pub fn table(&self, key: &str, keys: &[&str]) -> Result<Table<'a>, FileError> {
        self.require(key)?.table(keys)
    }

    /// An error at a dotted key of this table; at the innermost existing table if there is no such value.
    pub fn error_at(&self, dotted: &str, message: impl Into<String>) -> FileError {
        let (first, rest) = dotted.split_once('.').unwrap_or((dotted, ""));
        match self.get(first) {
            None => self.node.error(message),
            Some(node) if rest.is_empty() => node.error(message),
            Some(node) => match node.any_table() {
                Ok(table) => table.error_at(rest, message),
                Err(error) => error,
            },
        }
    }
}
