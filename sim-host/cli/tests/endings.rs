//! How the command ends: endless input, a closed or a full standard output, a directory that cannot be
//! made.

#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]

use std::process::{Command, Output, Stdio};

fn sonarfix(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
    command.args(arguments).stdin(Stdio::null()).stderr(Stdio::piped());
    command
}

fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Commands that print much, or little, and soon.
const PRINTING: [&[&str]; 4] = [
    &["map", "check", "../../crates/sonarfix-map/scenarios/paper.toml"],
    &["bound", "../../crates/sonarfix-map/scenarios/classroom.toml"],
    &["plan", "../../crates/sonarfix-map/scenarios/classroom.toml"],
    &["floor-plans", "--plans", "1", "--runs", "1"],
];

#[test]
fn a_closed_standard_output_ends_it_quietly() {
    for arguments in PRINTING {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = sonarfix(arguments).stdout(writer).output().unwrap();
        let errors = errors(&output);
        assert!(output.status.success(), "{arguments:?}: {errors}");
        assert!(
            !errors.contains("panicked") && !errors.contains("error"),
            "{arguments:?}: {errors}"
        );
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_standard_output_is_an_error() {
    for arguments in PRINTING {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let output = sonarfix(arguments).stdout(full).output().unwrap();
        let errors = errors(&output);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {errors}");
        assert!(errors.contains("error: standard output"), "{arguments:?}: {errors}");
        assert!(!errors.contains("panicked"), "{arguments:?}: {errors}");
    }
}

/// Messages are short, whatever they quote.
#[cfg(target_os = "linux")]
#[test]
fn endless_input_is_an_error_of_a_few_lines() {
    for arguments in [
        ["map", "check", "/dev/zero"].as_slice(),
        &["map", "bake", "/dev/zero", "--out", "/dev/null"],
        &["run", "/dev/zero"],
        &["plan", "/dev/zero"],
        &["config", "check", "/dev/zero"],
    ] {
        let output = sonarfix(arguments).stdout(Stdio::null()).output().unwrap();
        let errors = errors(&output);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {errors}");
        assert!(errors.contains("256 MiB"), "{arguments:?}: {errors}");
        assert!(errors.lines().all(|line| line.chars().count() < 200), "{arguments:?}: {errors}");
    }
}

/// A line without an end is quoted in part.
#[test]
fn a_long_line_is_not_echoed() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("long.toml");
    std::fs::write(&file, "x".repeat(1_000_000)).unwrap();
    let output = sonarfix(&["map", "check"]).arg(&file).output().unwrap();
    let errors = errors(&output);
    assert_eq!(output.status.code(), Some(1), "{errors}");
    assert!(errors.len() < 2_000, "{} bytes of error message", errors.len());
}

#[test]
fn a_directory_that_cannot_be_created_is_an_early_error() {
    let begun = std::time::Instant::now();
    let arguments = ["paper", "--runs", "100000", "--out", "tests/robot.toml/report"];
    let output = sonarfix(&arguments).output().unwrap();
    assert!(errors(&output).contains("--out"), "{}", errors(&output));
    assert_eq!(output.status.code(), Some(1));
    assert!(begun.elapsed().as_secs() < 20);
}

/// An office whose corridor and rooms are as wide as the whole.
#[test]
fn a_narrow_office_is_drawn() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("plan.svg");
    let output =
        sonarfix(&["floor-plans", "--draw", "10078", "--out"]).arg(&file).output().unwrap();
    assert!(output.status.success(), "{}", errors(&output));
    assert!(std::fs::read_to_string(file).unwrap().contains("<svg"));
}

/// Commands with more runs than anyone waits for, and what their output must begin with.
#[cfg(unix)]
const LONG: [(&[&str], &str); 5] = [
    (&["paper", "--runs", "4000000"], "Estimates"),
    (
        &["run", "../../crates/sonarfix-map/scenarios/classroom.toml", "--runs", "4000000"],
        "Estimates",
    ),
    (&["floor-plans", "--plans", "1000000", "--runs", "1"], "# "),
    (&["faults", "--runs", "4000000"], "# Effects"),
    (&["health", "--runs", "1000000"], "# Reliability"),
];

/// Interrupts a command after this time.
#[cfg(unix)]
fn interrupted_after(seconds: u64, arguments: &[&str]) -> Output {
    let child = sonarfix(arguments).stdout(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(std::time::Duration::from_secs(seconds));
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-s", "INT", &id]).status().unwrap().success());
    child.wait_with_output().unwrap()
}

/// Ctrl-C keeps the runs that are finished, and reports their number.
#[cfg(unix)]
#[test]
fn an_interrupted_command_reports_its_finished_runs() {
    for (arguments, begins) in LONG {
        // On a busy computer the first run may take longer.
        let mut outputs =
            [2, 8, 32].into_iter().map(|seconds| interrupted_after(seconds, arguments));
        let output = outputs.find(|output| !errors(output).contains("before the first run"));
        let output = output.unwrap();
        let (text, errors) = (String::from_utf8_lossy(&output.stdout), errors(&output));
        assert_eq!(output.status.code(), Some(130), "{arguments:?}: {errors}");
        assert!(errors.contains("interrupted: the results are those of "), "{errors}");
        assert!(text.trim_start().starts_with(begins), "{arguments:?}: {text}");
        assert!(!text.contains("| NaN"), "{text}");
    }
}
