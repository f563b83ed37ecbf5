//! Warnings of improbable values, on standard error and in JSON.

use std::path::Path;

use serde::Serialize;
use sonarfix_map::{Mistake, plausibility};

/// A warning as JSON.
#[derive(Debug, Clone, Serialize)]
pub struct Warning {
    file: String,
    line: Option<usize>,
    key: String,
    message: String,
}

impl From<&Mistake> for Warning {
    fn from(mistake: &Mistake) -> Self {
        Self {
            file: mistake.file().to_owned(),
            line: mistake.line(),
            key: mistake.key().to_owned(),
            message: mistake.message().to_owned(),
        }
    }
}

/// A result with the warnings about the files that it comes from.
#[derive(Debug, Serialize)]
pub struct Warned<'a, T> {
    #[serde(flatten)]
    pub result: &'a T,
    pub warnings: &'a [Warning],
}

/// Prints the warnings about some files on standard error, and returns them.
pub fn show(files: &[&Path]) -> Vec<Warning> {
    let mistakes = files.iter().flat_map(|file| plausibility::of_file(file));
    let shown = mistakes.inspect(|mistake| eprintln!("warning: {mistake}"));
    shown.map(|mistake| Warning::from(&mistake)).collect()
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.file)?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        let separator = if self.key.is_empty() { "" } else { ": " };
        write!(f, "{separator}{}: {}", self.key, self.message)
    }
}
