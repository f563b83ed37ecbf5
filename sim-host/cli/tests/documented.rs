//! The commands that the pages print: each has a subcommand and options that exist, and each test that a page names exists. `documented_runs.rs`
//! runs them.

#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The name and the text of each page.
pub fn pages() -> Vec<(String, String)> {
    let docs = fs::read_dir(root().join("docs")).unwrap().map(|entry| entry.unwrap().path());
    let pages = docs.chain([root().join("README.md"), root().join("CONTRIBUTING.md")]);
    let pages = pages.filter(|path| path.extension().is_some_and(|it| it == "md"));
    let text = |path: &PathBuf| fs::read_to_string(path).unwrap().replace("\\\n", " ");
    pages.map(|path| (path.file_name().unwrap().display().to_string(), text(&path))).collect()
}

/// The commands in the blocks of code of a page, each in a line or behind `&&`.
pub fn in_blocks(page: &str) -> impl Iterator<Item = &str> {
    let blocks = page.split("```").skip(1).step_by(2).filter(|block| !block.starts_with("toml"));
    let commands = blocks.flat_map(str::lines).flat_map(|line| line.split(" && "));
    commands.map(|line| {
        let end = [" #", " |", " >", ";"].iter().filter_map(|end| line.find(end)).min();
        line.get(..end.unwrap_or(line.len())).unwrap_or_default().trim()
    })
}

/// What is code within the text of a page.
fn in_text(page: &str) -> impl Iterator<Item = &str> {
    page.split("```").step_by(2).flat_map(|text| text.split('`').skip(1).step_by(2))
}

/// The arguments of a command `sonarfix`, as a shell passes them.
pub fn arguments(command: &str) -> Option<Vec<String>> {
    let starts = ["sonarfix ", "./sonarfix ", "cargo run --release --bin sonarfix -- "];
    let rest = starts.iter().find_map(|start| command.strip_prefix(start))?;
    let mut words = vec![String::new()];
    for (number, part) in rest.split(['"', '\'']).enumerate() {
        let is_quoted = number % 2 == 1;
        for letter in part.chars() {
            match words.last_mut() {
                Some(word) if is_quoted || letter != ' ' => word.push(letter),
                _ => words.push(String::new()),
            }
        }
    }
    words.retain(|word| !word.is_empty());
    Some(words)
}

fn is_understood(arguments: &[&str]) -> bool {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
    command.args(arguments).arg("--help").stdout(Stdio::null()).stderr(Stdio::null());
    command.status().unwrap().success()
}

#[test]
fn every_command_of_a_page_has_arguments_that_exist() {
    let (mut tried, mut wrong) = (0, Vec::new());
    for (name, text) in pages() {
        for command in in_blocks(&text) {
            let Some(words) = arguments(command) else { continue };
            tried += 1;
            if !is_understood(&words.iter().map(String::as_str).collect::<Vec<_>>()) {
                wrong.push(format!("{name}: {command}"));
            }
        }
        // Within a text a command may be cut short: its subcommand counts.
        for command in in_text(&text).filter_map(|code| code.strip_prefix("sonarfix ")) {
            let subcommand = command.split_whitespace().next().unwrap_or_default();
            if !subcommand.starts_with('-') && !is_understood(&[subcommand]) {
                wrong.push(format!("{name}: sonarfix {command}"));
            }
        }
    }
    assert!(tried > 60, "{tried}");
    assert_eq!(wrong, Vec::<String>::new());
}

/// The folder of a package of the main workspace.
fn folder(package: &str) -> Option<PathBuf> {
    let root = root();
    let folders = [root.join("crates"), root.join("sim-host")];
    let folders = folders.iter().flat_map(|of| fs::read_dir(of).unwrap());
    let folders = folders.map(|entry| entry.unwrap().path()).chain([root.join("tests")]);
    let has_name = |folder: &PathBuf| {
        let manifest = fs::read_to_string(folder.join("Cargo.toml")).unwrap_or_default();
        manifest.lines().any(|line| line == format!("name = \"{package}\""))
    };
    folders.into_iter().find(has_name)
}

/// The paths and the texts of all sources below a folder.
fn sources(folder: &Path) -> String {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let text = |path: PathBuf| match path.extension() {
        _ if path.is_dir() => sources(&path),
        Some(ending) if ending == "rs" => {
            format!("{}\n{}", path.display(), fs::read_to_string(&path).unwrap())
        }
        _ => String::new(),
    };
    entries.map(text).collect()
}

/// Whether a command `cargo test` has a package of the main workspace, a file and names that occur in its sources.
fn has_tests(command: &str) -> bool {
    let mut package = None;
    let mut words = command.split_whitespace().skip(2).take_while(|word| *word != "--");
    while let Some(word) = words.next() {
        let is_right = match (word, &package) {
            ("-p" | "--package", _) => {
                package = words.next().and_then(folder);
                package.is_some()
            }
            ("--test", Some(package)) => {
                let file = package.join("tests").join(words.next().unwrap_or_default());
                file.with_extension("rs").is_file() || file.join("main.rs").is_file()
            }
            ("--features", _) => words.next().is_some(),
            ("--lib" | "--bins", _) => true,
            (name, Some(package)) => name.split("::").all(|part| sources(package).contains(part)),
            (_, None) => false,
        };
        if !is_right {
            return false;
        }
    }
    true
}

#[test]
fn every_test_of_a_page_exists() {
    let (mut tried, mut wrong) = (0, Vec::new());
    for (name, text) in pages() {
        for command in in_text(&text).chain(in_blocks(&text)) {
            // Variables of the environment may stand before it.
            let at =
                command.find("cargo test -p ").or_else(|| command.find("cargo test --package "));
            let Some(command) = at.and_then(|at| command.get(at..)) else { continue };
            tried += 1;
            if !has_tests(command) {
                wrong.push(format!("{name}: {command}"));
            }
        }
    }
    assert!(tried > 20, "{tried}");
    assert_eq!(wrong, Vec::<String>::new());
}
