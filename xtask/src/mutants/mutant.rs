//! The mutants that cargo-mutants finds.

use std::collections::HashMap;

use serde::Deserialize;

use crate::cargo;

/// One change of the code.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
pub struct Mutant {
    /// The path of the file in the repository.
    pub file: String,
    /// Where and what, for people.
    pub name: String,
    /// The same without the line, so that it is found again after a change above it.
    #[serde(skip)]
    pub key: String,
    pub genre: Genre,
    /// The new text.
    pub replacement: String,
    /// The text that it replaces.
    pub span: Span,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Deserialize)]
pub enum Genre {
    FnValue,
    BinaryOperator,
    UnaryOperator,
    MatchArm,
    MatchArmGuard,
    StructField,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub struct Span {
    pub start: Position,
    pub end: Position,
}

/// Of a character, both from one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Deserialize)]
pub struct Position {
    pub line: usize,
    pub column: usize,
}

/// The mutants of these files, or of all.
pub fn list(files: Option<&str>) -> anyhow::Result<Vec<Mutant>> {
    let mut command =
        cargo::command("mutants --list --json --package sonarfix --package sonarfix-app");
    command.args(files.iter().flat_map(|files| ["--file", files]));
    let mut mutants: Vec<Mutant> = serde_json::from_str(&cargo::printed(command)?)?;
    let mut seen: HashMap<String, u32> = HashMap::new();
    for mutant in &mut mutants {
        let change = mutant.name.splitn(4, ':').nth(3).unwrap_or_default().trim();
        let of_file = format!("{}: {change}", mutant.file);
        let count = seen.entry(of_file.clone()).or_default();
        *count += 1;
        mutant.key = format!("{of_file} ({count})");
    }
    Ok(mutants)
}
