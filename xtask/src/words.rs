//! `cargo xtask words`: counts the words that the glossary avoids.

use std::collections::BTreeMap;

use anyhow::{Context, ensure};

use crate::cargo;

/// The glossary, which lists the words in the last column of its tables.
const GLOSSARY: &str = "docs/glossary.md";
/// The files that are searched. The glossary itself and the tests of this file, which contain the words, are not.
const FILES: [&str; 6] = ["*.rs", "*.md", "*.toml", "*.js", "*.html", ".ci/run"];

#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// Count in this commit. Otherwise in the files of the working tree.
    #[arg(long)]
    revision: Option<String>,
    /// Print each line with such a word.
    #[arg(long)]
    lines: bool,
}

/// Prints each word with the number of lines that contain it, in code and in documentation.
pub fn count(args: &Args) -> anyhow::Result<()> {
    let text = std::fs::read_to_string(cargo::root().join(GLOSSARY)).context(GLOSSARY)?;
    let words = avoided(&text);
    ensure!(!words.is_empty(), "no words to avoid in {GLOSSARY}");
    let mut all = Counts::default();
    println!("| word | code | documentation |\n|---|---:|---:|");
    for (word, is_name) in &words {
        let mut counts = Counts::default();
        for line in search(word, args)?.iter().filter(|line| !is_name || is_code(line)) {
            if args.lines {
                println!("{line}");
            }
            counts.add(line);
        }
        println!("| {word} | {} | {} |", counts.code, counts.documentation);
        all.code += counts.code;
        all.documentation += counts.documentation;
    }
    println!("| **all** | **{}** | **{}** |", all.code, all.documentation);
    Ok(())
}

/// Lines with a word.
#[derive(Debug, Default)]
struct Counts {
    code: u32,
    documentation: u32,
}

impl Counts {
    /// Adds a line of `git grep`.
    fn add(&mut self, line: &str) {
        if is_code(line) {
            self.code += 1;
        } else {
            self.documentation += 1;
        }
    }
}

/// Whether a line, `path<tab>content`, is code. Comments are documentation.
fn is_code(line: &str) -> bool {
    let (path, content) = line.split_once('\t').unwrap_or((line, ""));
    let is_comment = content.trim_start().starts_with("//") || content.contains(" // ");
    [".rs", ".js"].iter().any(|end| path.ends_with(end)) && !is_comment
}

/// The lines with a word, as `path<tab>content`.
fn search(word: &str, args: &Args) -> anyhow::Result<Vec<String>> {
    let mut command = std::process::Command::new("git");
    command.current_dir(cargo::root()).args(["grep", "--null", "-w", "-I", "-F", "-e", word]);
    command.args(args.revision.as_deref()).arg("--").args(FILES);
    command.args([format!(":!{GLOSSARY}").as_str(), ":!xtask/src/words.rs"]);
    let output = command.output().context("cannot start `git`")?;
    // 1 if there is none.
    ensure!(
        matches!(output.status.code(), Some(0 | 1)),
        "`git grep` failed: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    let text = String::from_utf8_lossy(&output.stdout);
    Ok(text.lines().map(|line| line.replacen('\0', "\t", 1)).collect())
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

    #[test]
    fn comments_and_pages_are_documentation() {
        let mut counts = Counts::default();
        for line in ["a.rs\t    let x;", "a.rs\t/// Says.", "a.rs\tf(); // says", "a.md\tsays"] {
            counts.add(line);
        }
        assert_eq!((counts.code, counts.documentation), (1, 3));
    }
}
