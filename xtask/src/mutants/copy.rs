//! A copy of the repository in which every mutant can be chosen when a test runs.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use serde::Deserialize;

use super::edits::{self, Changed, Numbered};
use super::mutant::Mutant;
use crate::cargo;

/// The crates that are mutated.
const CRATES: [&str; 2] = ["sonarfix", "sonarfix-app"];
/// Asks for the active mutant; appended to each of them.
const ACTIVE: &str = include_str!("active.rs");
/// Constants that a mutant makes visible to the compiler.
const ALLOWED: &str = "#![allow(warnings, arithmetic_overflow, unconditional_panic)]\n";

/// Where the copy is.
pub fn folder() -> PathBuf {
    cargo::target_folder().join("mutated")
}

/// Makes the copy; returns the numbers of the mutants in it. The others do not compile, or cannot be chosen when a test
/// runs.
pub fn make(mutants: &[(u32, Mutant)]) -> anyhow::Result<BTreeSet<u32>> {
    copy_repository()?;
    let mut excluded = BTreeSet::new();
    loop {
        let changed = write(mutants, &excluded)?;
        let errors = errors()?;
        if errors.is_empty() {
            return Ok(changed.values().flat_map(|it| it.numbers.iter().copied()).collect());
        }
        let before = excluded.len();
        for (file, at, message) in &errors {
            let Some(due) = changed.get(file).and_then(|it| due_to(it, *at)) else {
                eprintln!("no mutant at {file}:{at}: {message}");
                continue;
            };
            excluded.extend(due);
        }
        eprintln!("{} errors, {} mutants excluded", errors.len(), excluded.len());
        if excluded.len() == before {
            bail!("the copy does not compile");
        }
    }
}

fn copy_repository() -> anyhow::Result<()> {
    let mut command = std::process::Command::new("git");
    command.args(["ls-files", "--cached", "--others", "--exclude-standard"]);
    command.current_dir(cargo::root());
    let listed = cargo::printed(command)?;
    let files: BTreeSet<PathBuf> = listed.lines().map(|file| folder().join(file)).collect();
    remove_others(&folder(), &files)?;
    for file in listed.lines() {
        copy(&cargo::root().join(file), &folder().join(file))?;
    }
    Ok(())
}

/// Removes what has been removed from the repository since the last copy.
fn remove_others(folder: &Path, files: &BTreeSet<PathBuf>) -> anyhow::Result<()> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Ok(()) };
    for entry in entries {
        let path = entry?.path();
        if path.is_dir() {
            remove_others(&path, files)?;
        } else if !files.contains(&path) {
            std::fs::remove_file(path)?;
        }
    }
    Ok(())
}

/// An unchanged file keeps its time, so that it is not built again.
fn copy(from: &Path, to: &Path) -> anyhow::Result<()> {
    // A file that is deleted and not yet committed, or a link to a folder.
    let Ok(contents) = std::fs::read(from) else { return Ok(()) };
    update(to, &contents)
}

fn update(file: &Path, contents: &[u8]) -> anyhow::Result<()> {
    if std::fs::read(file).is_ok_and(|old| old == contents) {
        return Ok(());
    }
    if let Some(parent) = file.parent() {
        std::fs::create_dir_all(parent)?;
    }
    std::fs::write(file, contents).with_context(|| file.display().to_string())
}

fn write(
    mutants: &[(u32, Mutant)],
    excluded: &BTreeSet<u32>,
) -> anyhow::Result<BTreeMap<String, Changed>> {
    let mut of_files: BTreeMap<String, Vec<Numbered>> = BTreeMap::new();
    for name in CRATES {
        of_files.insert(format!("crates/{name}/src/lib.rs"), Vec::new());
    }
    for (number, mutant) in mutants {
        let of_file = of_files.entry(mutant.file.clone()).or_default();
        if !excluded.contains(number) {
            of_file.push((*number, mutant));
        }
    }
    let mut changed = BTreeMap::new();
    for (file, mutants) in of_files {
        let source = std::fs::read_to_string(cargo::root().join(&file))?;
        let it = edits::change(&source, &mutants).with_context(|| file.clone())?;
        let text = if file.ends_with("/src/lib.rs") {
            format!("{ALLOWED}{}{ACTIVE}", it.text)
        } else {
            it.text.clone()
        };
        update(&folder().join(&file), text.as_bytes())?;
        changed.insert(file, it);
    }
    Ok(changed)
}

/// The mutants to which an error at this byte is due.
fn due_to(changed: &Changed, at: usize) -> Option<&[u32]> {
    let around = changed.ranges.iter().filter(|(range, _)| range.contains(&at));
    let smallest = around.min_by_key(|(range, _)| range.len());
    smallest.map(|(_, numbers)| &**numbers)
}

/// A cargo command in the copy, which builds where the mutants of cargo-mutants are built.
pub fn cargo_in_copy(arguments: &str) -> std::process::Command {
    let mut command = cargo::command(arguments);
    command.args(["--profile", "mutants", "--message-format", "json"]);
    command.current_dir(folder()).env("CARGO_TARGET_DIR", cargo::target_folder());
    command
}

/// A line of cargo's output.
#[derive(Deserialize)]
struct Line {
    message: Option<Message>,
}

#[derive(Deserialize)]
struct Message {
    level: String,
    #[serde(rename = "message")]
    text: String,
    spans: Vec<Place>,
}

#[derive(Deserialize)]
struct Place {
    file_name: String,
    byte_start: usize,
    is_primary: bool,
}

/// File, byte and text of each error of the compiler.
fn errors() -> anyhow::Result<BTreeSet<(String, usize, String)>> {
    let mut command = cargo_in_copy("check --quiet --keep-going");
    for name in CRATES {
        command.args(["--package", name]);
    }
    let output = command.output()?;
    let mut errors = BTreeSet::new();
    for line in String::from_utf8_lossy(&output.stdout).lines() {
        let Line { message: Some(message) } = serde_json::from_str(line)? else { continue };
        if message.level != "error" {
            continue;
        }
        for span in message.spans.into_iter().filter(|span| span.is_primary) {
            errors.insert((span.file_name, span.byte_start, message.text.clone()));
        }
    }
    if errors.is_empty() && !output.status.success() {
        bail!("{}", String::from_utf8_lossy(&output.stderr));
    }
    Ok(errors)
}
