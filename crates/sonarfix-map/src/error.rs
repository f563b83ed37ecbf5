//! Errors in files, with their positions.

use std::fmt;

/// So many mistakes, or warnings, of one file are reported.
pub(crate) const MOST_MISTAKES: usize = 100;

/// One mistake in a file: `paper.toml:45: robot.sonar.cone: must be …`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mistake {
    file: String,
    line: Option<usize>,
    key: String,
    message: String,
}

impl Mistake {
    /// A mistake in the value of `key` in `line`.
    pub(crate) fn new(file: &str, line: usize, key: &str, message: impl Into<String>) -> Self {
        Self { file: file.into(), line: Some(line), key: key.into(), message: message.into() }
    }

    /// The same as a probable cause of other mistakes.
    pub(crate) fn suspected(self) -> Self {
        Self { message: format!("perhaps this is the cause: {}", self.message), ..self }
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

impl fmt::Display for Mistake {
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

/// All mistakes in a file and in the files that it names; displayed one a line.
///
/// One type for every kind of error, because every caller only prints it for the author of the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileError {
    first: Mistake,
    others: Vec<Mistake>,
}

impl FileError {
    /// An error of the whole file.
    pub(crate) fn of_file(file: &str, message: impl Into<String>) -> Self {
        let (file, message) = (file.into(), message.into());
        Mistake { file, line: None, key: String::new(), message }.into()
    }

    /// These mistakes: file by file, in the order of the lines. `None` if there are none.
    pub(crate) fn of(mut mistakes: Vec<Mistake>) -> Option<Self> {
        mistakes.sort_by(|a, b| (&a.file, a.line).cmp(&(&b.file, b.line)));
        let mut mistakes = mistakes.into_iter();
        let first = mistakes.next()?;
        Some(Self { first, others: mistakes.collect() })
    }

    /// The same with probable causes at the end.
    pub(crate) fn followed_by(mut self, causes: Vec<Mistake>) -> Self {
        self.others.extend(causes);
        self
    }

    /// All mistakes: file by file, in the order of the lines.
    pub fn mistakes(&self) -> impl Iterator<Item = &Mistake> {
        std::iter::once(&self.first).chain(&self.others)
    }

    /// The first mistake.
    #[must_use]
    pub fn first(&self) -> &Mistake {
        &self.first
    }
}

impl From<Mistake> for FileError {
    fn from(first: Mistake) -> Self {
        Self { first, others: Vec::new() }
    }
}

impl IntoIterator for FileError {
    type Item = Mistake;
    type IntoIter = std::iter::Chain<std::iter::Once<Mistake>, std::vec::IntoIter<Mistake>>;

    fn into_iter(self) -> Self::IntoIter {
        std::iter::once(self.first).chain(self.others)
    }
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.first)?;
        self.others.iter().try_for_each(|mistake| write!(f, "\n{mistake}"))
    }
}

impl std::error::Error for FileError {}
