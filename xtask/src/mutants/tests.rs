//! The tests of the copy, and which mutants each reaches.

use std::collections::BTreeSet;
use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use anyhow::Context;
use serde::Deserialize;

use super::copy;
use crate::cargo;

/// What the tests of the mutated package do not catch, those of the others may. The last has the golden traces.
const PACKAGES: [&str; 6] = [
    "sonarfix",
    "sonarfix-hal",
    "sonarfix-app",
    "sonarfix-link",
    "sonarfix-map",
    "sonarfix-pil-host",
];

/// A built program of tests.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Program {
    file: PathBuf,
    folder: PathBuf,
}

/// One test.
#[derive(Debug, Clone)]
pub struct Test {
    pub program: usize,
    pub name: String,
    pub time: Duration,
    /// The mutants that it reaches.
    pub reached: BTreeSet<u32>,
}

/// How a run of tests with a mutant ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum End {
    Passed,
    Failed(String),
    TimedOut,
}

/// How much the tests try.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Cases of each property.
    pub cases: u32,
    /// Random sequences of the application.
    pub sequences: u32,
    /// Tests that take longer are left out.
    pub longest: Duration,
}

/// A line of cargo's output.
#[derive(Deserialize)]
struct Built {
    executable: Option<PathBuf>,
    profile: Option<Profile>,
    manifest_path: Option<PathBuf>,
}

#[derive(Deserialize)]
struct Profile {
    test: bool,
}

/// Builds the programs.
pub fn build() -> anyhow::Result<Vec<Program>> {
    let mut command = copy::cargo_in_copy("test --quiet --no-run --lib --tests");
    for package in PACKAGES {
        command.args(["--package", package]);
    }
    let mut programs = Vec::new();
    for line in cargo::printed(command)?.lines() {
        let Built { executable: Some(file), profile, manifest_path: Some(manifest) } =
            serde_json::from_str(line)?
        else {
            continue;
        };
        if !profile.is_some_and(|profile| profile.test) {
            continue;
        }
        let folder = manifest.parent().context("a package has a folder")?.to_owned();
        programs.push(Program { file, folder });
    }
    Ok(programs)
}

impl Program {
    fn command(&self, effort: Effort) -> Command {
        let mut command = Command::new(&self.file);
        command.current_dir(&self.folder).env("CARGO_MANIFEST_DIR", &self.folder);
        command.env("PROPTEST_CASES", effort.cases.to_string());
        // A failure needs no smallest example.
        command.env("PROPTEST_MAX_SHRINK_ITERS", "0");
        command.env("SONARFIX_SEQUENCES", effort.sequences.to_string());
        // Without recordings, whose tests take longer.
        command.env_remove("SONARFIX_DATA");
        command
    }

    /// Its tests with one of these parts in their names, or all, each run alone without a mutant.
    pub fn tests(
        &self,
        program: usize,
        parts: &[String],
        effort: Effort,
    ) -> anyhow::Result<Vec<Test>> {
        let mut list = self.command(effort);
        list.args(["--list", "--format", "terse"]);
        let ignored = {
            let mut list = self.command(effort);
            list.args(["--list", "--format", "terse", "--ignored"]);
            cargo::printed(list)?
        };
        let ignored: BTreeSet<&str> = ignored.lines().collect();
        let list = cargo::printed(list)?;
        let names = list.lines().filter(|line| !ignored.contains(line));
        let names = names.filter_map(|line| line.strip_suffix(": test"));
        let names =
            names.filter(|name| parts.is_empty() || parts.iter().any(|it| name.contains(&**it)));
        let mut tests = Vec::new();
        for name in names {
            if let Some(test) = self.test(program, name, effort)? {
                tests.push(test);
            }
        }
        Ok(tests)
    }

    fn test(&self, program: usize, name: &str, effort: Effort) -> anyhow::Result<Option<Test>> {
        let file = copy::folder().join("reached.txt");
        let _ = std::fs::remove_file(&file);
        let mut command = self.command(effort);
        command.env("SONARFIX_REACHED", &file).args(["--exact", name, "--test-threads", "1"]);
        let begin = Instant::now();
        // Recording what is reached takes several times as long.
        let end = run(command, effort.longest * 3)?;
        let time = begin.elapsed();
        if end != End::Passed {
            eprintln!("left out, {end:?} without a mutant: {name}");
            return Ok(None);
        }
        let reached = std::fs::read_to_string(&file).unwrap_or_default();
        let reached = reached.lines().filter_map(|line| line.parse().ok()).collect();
        Ok(Some(Test { program, name: name.to_owned(), time, reached }))
    }

    /// Runs tests with a mutant until one fails.
    pub fn with_mutant(&self, number: u32, tests: &[&Test], effort: Effort) -> anyhow::Result<End> {
        let mut command = self.command(effort);
        command.env("SONARFIX_MUTANT", number.to_string()).args(["--exact", "--test-threads", "1"]);
        command.args(tests.iter().map(|test| &test.name));
        let usual: Duration = tests.iter().map(|test| test.time).sum();
        run(command, Duration::from_secs(10) + 10 * usual)
    }
}

/// Runs a program of tests until one fails.
fn run(mut command: Command, limit: Duration) -> anyhow::Result<End> {
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null());
    let mut child = command.spawn()?;
    let (sender, receiver) = mpsc::channel();
    let lines = BufReader::new(child.stdout.take().context("a pipe")?).lines();
    std::thread::spawn(move || {
        for line in lines.map_while(Result::ok) {
            if sender.send(line).is_err() {
                return;
            }
        }
    });
    let deadline = Instant::now() + limit;
    let mut running = String::new();
    let end = loop {
        match receiver.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
            Ok(line) => {
                let Some(line) = line.strip_prefix("test ") else { continue };
                let (name, result) = line.split_once(" ... ").unwrap_or((line, ""));
                if result.ends_with("FAILED") {
                    break End::Failed(name.to_owned());
                }
                name.clone_into(&mut running);
            }
            Err(mpsc::RecvTimeoutError::Timeout) => break End::TimedOut,
            Err(mpsc::RecvTimeoutError::Disconnected) => {
                if child.wait()?.success() {
                    return Ok(End::Passed);
                }
                // It aborted: no line of the test was finished.
                break End::Failed(format!("the one after {running}"));
            }
        }
    };
    let _ = child.kill();
    child.wait()?;
    Ok(end)
}
