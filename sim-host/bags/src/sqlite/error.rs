//! Why a database cannot be read.

use std::io;

/// The largest row that is read, bytes.
pub const MOST_ROW: u64 = 64 << 20;
/// Why a database cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum SqlError {
    /// The file cannot be read.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// It does not begin as a database does.
    #[error("is no SQLite database: it does not begin with `SQLite format 3`")]
    Magic,
    /// The header has a value that `SQLite` does not write.
    #[error("the header of the database is damaged: its {0} is {1}")]
    Header(&'static str, u64),
    /// Texts are in UTF-16.
    #[error(
        "the texts of the database are UTF-16, and only UTF-8 is read: copy it with `sqlite3 OLD .dump | sqlite3 NEW`"
    )]
    Utf16,
    /// There is no such table.
    #[error("the database has no table `{0}`")]
    NoTable(String),
    /// There is no such column.
    #[error("the table `{0}` has no column `{1}`")]
    NoColumn(String, String),
    /// A page is damaged.
    #[error(
        "page {page} of the database is damaged: {what}; `sqlite3 OLD .recover | sqlite3 NEW` saves what can be read"
    )]
    Page {
        /// Its number, from 1.
        page: u32,
        /// The defect.
        what: &'static str,
    },
    /// A row is larger than [`MOST_ROW`].
    #[error("row {row} has {bytes} bytes, and at most {MOST_ROW} are read")]
    LongRow {
        /// Its number.
        row: i64,
        /// Its size.
        bytes: u64,
    },
}
