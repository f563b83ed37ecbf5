//! How the command ends: a closed or a full standard output, a result that cannot be written, Ctrl-C.
#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]

use std::process::{Command, Output, Stdio};

const CLASSROOM: &str = "../../crates/sonarfix-map/scenarios/classroom.toml";

/// Every subcommand, with arguments for the shortest output.
const PRINTING: [&[&str]; 15] = [
    &["find-forecast", "--floor-plans", "1", "--starts", "2", "--trials", "2"],
    &["find", "--floor-plans", "1", "--walls", "30", "--seconds", "5"],
    &["find-standing", "--runs", "1", "--seconds", "2"],
    &["relocalize", "--runs", "1", "--seconds", "5"],
    &["search-motion", "--runs", "1", "--seconds", "5"],
    &["calibration", "--runs", "1", "--metres", "5"],
    &["surveys", "room", "--runs", "1"],
    // These need recordings.
    &["sonar-model", "--help"],
    &["reality", "--help"],
    &["recordings", "--help"],
    // This has two dozen runs of ten minutes.
    &["peers", "--help"],
    &["faults", "--runs", "1"],
    &["health", "--runs", "1"],
    &["rooms", "--runs", "1", "--family", "arena", "--sensor", "nxt"],
    &["floor-plans", "--plans", "1", "--runs", "1"],
];

/// The command, for a test that reads its output.
pub fn studies(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix-studies"));
    command.args(arguments).stdin(Stdio::null()).stderr(Stdio::piped());
    command
}

fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// No subcommand is missing in [`PRINTING`].
#[test]
fn every_subcommand_is_in_the_table() {
    let help = String::from_utf8(studies(&["--help"]).output().unwrap().stdout).unwrap();
    let commands = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let names: Vec<&str> = commands
        .take_while(|line| !line.is_empty())
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .collect();
    assert_eq!(names.len(), PRINTING.len(), "{names:?}");
    for name in names {
        assert!(PRINTING.iter().any(|arguments| arguments[0] == name), "{name}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_or_closed_standard_output_ends_it() {
    for arguments in PRINTING {
        let (reader, closed) = std::io::pipe().unwrap();
        drop(reader);
        let output = studies(arguments).stdout(closed).output().unwrap();
        assert!(output.status.success(), "{arguments:?}: {}", errors(&output));
        assert_eq!(errors(&output), "", "{arguments:?}");

        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let output = studies(arguments).stdout(full).output().unwrap();
        // clap, which prints the help, has messages of its own.
        if !arguments.contains(&"--help") {
            assert_eq!(output.status.code(), Some(1), "{arguments:?}");
            assert!(errors(&output).contains("error: standard output"), "{arguments:?}");
        }
    }
}

/// A result that cannot be written is refused before the work.
#[test]
fn a_result_that_cannot_be_written_is_an_early_error() {
    for (arguments, option) in [
        (["health", "--runs", "4000000"], "--figure"),
        (["floor-plans", "--plans", "4000000"], "--images"),
        (["floor-plans", "--draw", "1"], "--out"),
        (["floor-plans", "--draw", "1"], "--toml"),
    ] {
        let output = studies(&arguments).args([option, "Cargo.toml/result"]).output().unwrap();
        assert!(errors(&output).contains(option), "{arguments:?}: {}", errors(&output));
        assert_eq!(output.status.code(), Some(1), "{arguments:?}");
    }
}

/// An office whose corridor and rooms are as wide as the whole.
#[test]
fn a_narrow_office_is_drawn() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("plan.svg");
    let output = studies(&["floor-plans", "--draw", "10078", "--out"]).arg(&file).output().unwrap();
    assert!(output.status.success(), "{}", errors(&output));
    assert!(std::fs::read_to_string(file).unwrap().contains("<svg"));
}

/// Commands with more runs than anyone waits for, and what their output must begin with.
#[cfg(unix)]
const LONG: [(&[&str], &str); 10] = [
    (&["floor-plans", "--plans", "1000000", "--runs", "1"], "# "),
    (&["faults", "--runs", "4000000"], "# Effects"),
    (&["find", CLASSROOM, "--runs", "1000000", "--seconds", "5"], ""),
    (&["relocalize", "--runs", "1000000", "--seconds", "5"], ""),
    (&["health", "--runs", "1000000"], "# Reliability"),
    (&["calibration", "--runs", "1000000", "--metres", "5"], ""),
    (&["calibration", "--wheel-noise", "2", "--runs", "1000000", "--metres", "5"], ""),
    (&["calibration", "--unknown-start", "--runs", "1000000", "--metres", "5"], ""),
    (&["calibration", "--echoes", "--runs", "1000000", "--metres", "5"], ""),
    (&["surveys", "room", "--runs", "1000000"], ""),
];

/// Interrupts a command after this time.
#[cfg(unix)]
fn interrupted_after(seconds: u64, arguments: &[&str]) -> Output {
    let child = studies(arguments).stdout(Stdio::piped()).spawn().unwrap();
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
        // On a slow computer a run takes longer than is waited for.
        if errors.contains("a run takes longer than a second") {
            continue;
        }
        assert!(errors.contains("interrupted: the results are those of "), "{errors}");
        assert!(text.trim_start().starts_with(begins), "{arguments:?}: {text}");
        assert!(!text.trim().is_empty() && !text.contains("| NaN"), "{arguments:?}: {text}");
    }
}
