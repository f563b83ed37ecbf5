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

impl Table {
    /// The table as text with aligned columns.
    #[must_use]
    pub fn text(&self) -> String {
        let lines: Vec<&Vec<String>> = std::iter::once(&self.columns).chain(&self.rows).collect();
        let width = |column: usize| {
            lines.iter().filter_map(|line| line.get(column)).map(|cell| cell.chars().count()).max()
        };
        let mut text = format!("{}\n", self.title);
        for line in &lines {
            for (column, cell) in line.iter().enumerate() {
                let width = width(column).unwrap_or(0);
                // Names are left-aligned, numbers right-aligned.
                let cell = if column == 0 {
                    format!("{cell:<width$}")
                } else {
                    format!("  {cell:>width$}")
                };
                text.push_str(&cell);
            }
            text.push('\n');
        }
        text.push_str(&self.note);
        text
    }
}
