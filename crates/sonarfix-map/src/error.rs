//! An error in a file, with its position.

use std::fmt;

/// An error in a file: `paper.toml:45: robot.sonar.cone: must be …`.
///
/// One type for every kind of error, because every caller only prints it for the author of the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileError {
    file: String,
    line: Option<usize>,
    key: String,
    message: String,
}

impl FileError {
    /// An error of the value of `key` in `line`.
    pub(crate) fn new(file: &str, line: usize, key: &str, message: impl Into<String>) -> Self {
        Self { file: file.into(), line: Some(line), key: key.into(), message: message.into() }
    }

    /// An error of the whole file.
    pub(crate) fn of_file(file: &str, message: impl Into<String>) -> Self {
        Self { file: file.into(), line: None, key: String::new(), message: message.into() }
    }

    /// The file, as named by the caller.
    #[must_use]
    pub fn file(&self) -> &str {
        &self.file
    }

    /// The line, from 1. `None` if the file could not be read at all.
    #[must_use]
    pub fn line(&self) -> Option<usize> {
        self.line
    }

    /// The full key, as in `map.wall[3].to`; empty if the text is not TOML.
    #[must_use]
    pub fn key(&self) -> &str {
        &self.key
    }

    /// What is wrong, and what to do.
    #[must_use]
    pub fn message(&self) -> &str {
        &self.message
    }
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.file)?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        if !self.key.is_empty() {
            write!(f, ": {}", self.key)?;
        }
        write!(f, ": {}", self.message)
    }
}

impl std::error::Error for FileError {}
