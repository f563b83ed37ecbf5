//! What is wrong with a file, and where.

use std::fmt;

/// Something wrong with a file: `paper.toml:45: robot.sonar.cone: must be …`.
///
/// One type for every kind of fault, because every reader does the same with it: shows it to the
/// person who wrote the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileError {
    file: String,
    line: Option<usize>,
    key: String,
    message: String,
}

impl FileError {
    /// A fault of the value of `key` in `line`.
    pub(crate) fn new(file: &str, line: usize, key: &str, message: impl Into<String>) -> Self {
        Self { file: file.into(), line: Some(line), key: key.into(), message: message.into() }
    }

    /// A fault of the file as a whole.
    pub(crate) fn of_file(file: &str, message: impl Into<String>) -> Self {
        Self { file: file.into(), line: None, key: String::new(), message: message.into() }
    }

    /// The file, as it was named by who asked for it.
    #[must_use]
    pub fn file(&self) -> &str {
        &self.file
    }

    /// The line, from 1. `None` if the file could not be read at all.
    #[must_use]
    pub fn line(&self) -> Option<usize> {
        self.line
    }

    /// The whole key, as in `map.wall[3].to`; empty where the text is not TOML.
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
