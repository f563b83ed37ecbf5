//! `cargo xtask words`: lines with words that the glossary avoids.

use std::collections::BTreeMap;

use anyhow::{Context, ensure};

use crate::cargo;

/// The glossary, which lists the words in the last column of its tables.
const GLOSSARY: &str = "docs/glossary.md";
/// The files that are searched for names, and for words. The glossary itself and this file contain them all.
const CODE: [&str; 4] = ["*.rs", "*.js", ":!docs/glossary.md", ":!xtask/src/words.rs"];
const TEXT: [&str; 4] = ["*.md", "*.toml", "*.html", ".ci/run"];

/// Prints the lines with each word.
pub fn print() -> anyhow::Result<()> {
    let text = std::fs::read_to_string(cargo::root().join(GLOSSARY)).context(GLOSSARY)?;
    let words = avoided(&text);
    ensure!(!words.is_empty(), "no words to avoid in {GLOSSARY}");
    for (word, is_name) in &words {
        let mut search = std::process::Command::new("git");
        search.current_dir(cargo::root()).args([
            "--no-pager",
            "grep",
            "-n",
            "-w",
            "-I",
            "-F",
            "-e",
        ]);
        search.arg(word).arg("--").args(CODE).args(TEXT.iter().filter(|_| !is_name));
        // Fails if there is none.
        search.status().context("cannot start `git`")?;
    }
    Ok(())
}

/// The words in the last column of the tables, and whether each is in backticks: a name, which is searched in code
/// only.
fn avoided(text: &str) -> BTreeMap<String, bool> {
    let mut words = BTreeMap::new();
    for row in text.lines().filter(|line| line.starts_with("| ")) {
        let Some(cell) = row.trim_end_matches('|').rsplit('|').next() else { continue };
        for word in cell.split(',').map(str::trim) {
            let name = word.trim_matches('`');
            if !name.is_empty() && name != "avoid" {
                // A word that is listed as both is searched everywhere.
                let is_name = words.entry(name.to_owned()).or_insert(true);
                *is_name &= name != word;
            }
        }
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_column_lists_the_words() {
        let text = "| term | meaning | source | avoid |\n|---|---|---|---|\n\
                    | gate | a test | BS | `Trust`, is told |\n| pose | | | |\n";
        let words = [("Trust", true), ("is told", false)];
        assert_eq!(avoided(text), words.map(|(word, name)| (word.to_owned(), name)).into());
    }
}
