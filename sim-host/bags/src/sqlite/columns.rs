//! The names of a table's columns, from the text that made the table.

use super::error::SqlError;
use super::record::{Row, SqlValue};

/// Words that begin a rule of a table in place of a column.
const RULES: [&str; 5] = ["CONSTRAINT", "PRIMARY", "UNIQUE", "CHECK", "FOREIGN"];

/// The columns of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Columns {
    table: String,
    names: Vec<String>,
    /// The column that is the number of the row: its value in a row is null.
    number: Option<usize>,
}

/// A column of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Column {
    place: usize,
    is_number: bool,
}

impl Columns {
    /// Those of the table that `text` (`CREATE TABLE …`) has made.
    pub(super) fn of(table: &str, text: &str) -> Self {
        let inner = text.split_once('(').map_or("", |(_, inner)| inner);
        let inner = inner.rsplit_once(')').map_or(inner, |(inner, _)| inner);
        let (mut names, mut number) = (Vec::new(), None);
        for part in parts(inner) {
            let mut words = part.split_ascii_whitespace();
            let name = words.next().unwrap_or_default();
            if RULES.iter().any(|rule| name.eq_ignore_ascii_case(rule)) {
                continue;
            }
            let rest: Vec<_> = words.map(str::to_ascii_uppercase).collect();
            if rest.starts_with(&["INTEGER", "PRIMARY", "KEY"].map(str::to_owned)) {
                number = Some(names.len());
            }
            let quotes: &[char] = &['"', '`', '[', ']', '\''];
            names.push(name.trim_matches(quotes).to_owned());
        }
        Self { table: table.to_owned(), names, number }
    }

    /// A column by its name.
    ///
    /// # Errors
    /// [`SqlError::NoColumn`].
    pub fn find(&self, name: &str) -> Result<Column, SqlError> {
        let place = self.names.iter().position(|own| own.eq_ignore_ascii_case(name));
        let place = place.ok_or_else(|| SqlError::NoColumn(self.table.clone(), name.to_owned()))?;
        Ok(Column { place, is_number: self.number == Some(place) })
    }
}

impl Column {
    /// Takes its value out of a row.
    pub fn take(self, row: &mut Row) -> SqlValue {
        let value = row.values.get_mut(self.place);
        match value.map(|value| std::mem::replace(value, SqlValue::Null)) {
            None | Some(SqlValue::Null) if self.is_number => SqlValue::Integer(row.number),
            value => value.unwrap_or(SqlValue::Null),
        }
    }
}

/// The parts between commas, except for those in parentheses.
fn parts(text: &str) -> Vec<&str> {
    let mut depth = 0_u32;
    text.split(|letter| {
        match letter {
            '(' => depth += 1,
            ')' => depth = depth.saturating_sub(1),
            _ => {}
        }
        letter == ',' && depth == 0
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_have_their_names() {
        let text = "CREATE TABLE messages(id INTEGER PRIMARY KEY, \"topic_id\" INTEGER NOT NULL, \
                    size DECIMAL(10, 5), data BLOB, FOREIGN KEY(topic_id) REFERENCES topics(id))";
        let columns = Columns::of("messages", text);
        assert_eq!(columns.names, ["id", "topic_id", "size", "data"]);
        let mut row = Row { number: 7, values: vec![SqlValue::Null, SqlValue::Integer(3)] };
        let mut value = |name: &str| columns.find(name).map(|column| column.take(&mut row));
        assert_eq!(value("id").unwrap(), SqlValue::Integer(7));
        assert_eq!(value("topic_id").unwrap(), SqlValue::Integer(3));
        assert_eq!(value("data").unwrap(), SqlValue::Null);
        let missing = value("stamp").unwrap_err().to_string();
        assert_eq!(missing, "the table `messages` has no column `stamp`");
        assert_eq!(Columns::of("odd", "nonsense").names, [""]);
    }
}
