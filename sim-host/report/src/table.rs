//! A table of numbers.

/// A table of a report, as text.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Table {
    /// What it shows.
    pub title: String,
    /// A remark below it; empty for none.
    pub note: String,
    /// The heads of the columns.
    pub columns: Vec<String>,
    /// The rows; the first cell of each names the row.
    pub rows: Vec<Vec<String>>,
}
