//! How the command ends: endless input, a closed or a full standard output, a directory that cannot be
//! made.

#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]

use std::process::{Command, Output, Stdio};

use crate::common::{MAP, ROBOT};

fn sonarfix(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
    command.args(arguments).stdin(Stdio::null()).stderr(Stdio::piped());
    command
}

fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

const CLASSROOM: &str = "../../crates/sonarfix-map/scenarios/classroom.toml";
const PAPER: &str = "../../crates/sonarfix-map/scenarios/paper.toml";

/// Every subcommand, with arguments for the shortest output. In `FILES` are a short log with its map and robot, a recorded
/// stream of a robot's bytes, and room for results.
const PRINTING: [&[&str]; 28] = [
    &["--help"],
    &["init", "FILES/robot"],
    &["paper", "--runs", "1"],
    &["run", CLASSROOM, "--runs", "1", "--json"],
    &["pil", CLASSROOM, "--seconds", "1", "--machine", "host"],
    &["replay", "FILES/log.csv"],
    &["find", "FILES/log.csv", "--json"],
    &["find", "--floor-plans", "1", "--seconds", "5"],
    &["relocalize", "--runs", "1", "--seconds", "5"],
    &["calibrate", "--help"],
    &["calibration", "--runs", "1", "--metres", "5"],
    &["export", "FILES/log.csv", "--mcap", "FILES/log.mcap"],
    &["map", "export", PAPER, "--out", "FILES/map.svg"],
    &["convert", "carmen", "FILES/carmen.log", "--out", "FILES/converted"],
    &["monitor", "--port", "FILES/bytes"],
    &["command", "--help"],
    &["config", "bake", "tests/robot.toml", "--out", "FILES/config.bin"],
    &["config", "check", "FILES/config.bin"],
    &["map", "check", PAPER],
    &["map", "simplify", "FILES/map.toml", "--out", "FILES/simple.csv"],
    &["bound", CLASSROOM],
    &["merge", "--help"],
    &["plan", CLASSROOM, "--runs", "1"],
    &["reality", "FILES"],
    &["sonar-model", "--help"],
    &["faults", "--runs", "1"],
    &["health", "--runs", "1"],
    &["floor-plans", "--plans", "1", "--runs", "1"],
];

/// The files of [`PRINTING`].
fn files() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
    write("map.toml", MAP);
    write("robot.toml", ROBOT);
    let wheels = (0..40).map(|tick| format!("wheels,{}.{},0,0\n", tick / 10, tick % 10));
    write(
        "log.csv",
        &format!("sonarfix-log,1\nstart,0,2,1.5,0,0.02,0.01\n{}", wheels.collect::<String>()),
    );
    let flaser = "FLASER 3 2.0 9.0 2.0 5.0 6.0 0.5 0.5 0 0 10.5 host 0.6\n";
    let odom = |x, time| format!("ODOM {x} 0 0 0.5 0 0 {time} host 0\n");
    write("carmen.log", &[&odom(0, 10), flaser, &odom(1, 11), flaser, &odom(2, 12)].concat());
    write("bytes", "");
    dir
}

fn printing(arguments: &[&str], files: &std::path::Path) -> Command {
    let files = files.display().to_string();
    let arguments: Vec<String> =
        arguments.iter().map(|argument| argument.replace("FILES", &files)).collect();
    sonarfix(&arguments.iter().map(String::as_str).collect::<Vec<_>>())
}

/// No subcommand is missing in [`PRINTING`].
#[test]
fn every_subcommand_is_in_the_table() {
    let output = sonarfix(&["--help"]).stdout(Stdio::piped()).output().unwrap();
    let help = String::from_utf8(output.stdout).unwrap();
    let commands = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let commands = commands.take_while(|line| !line.is_empty());
    let names: Vec<&str> = commands.filter_map(|line| line.split_whitespace().next()).collect();
    assert!(names.len() > 15, "{names:?}");
    for name in names.into_iter().filter(|name| *name != "help") {
        let is_listed = PRINTING.iter().any(|arguments| arguments.first() == Some(&name));
        assert!(is_listed, "{name}");
    }
}

#[test]
fn a_closed_standard_output_ends_it_quietly() {
    let files = files();
    for arguments in PRINTING {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = printing(arguments, files.path()).stdout(writer).output().unwrap();
        let errors = errors(&output);
        assert!(output.status.success(), "{arguments:?}: {errors}");
        assert!(!errors.contains("panicked"), "{arguments:?}: {errors}");
        assert!(!errors.contains("error:"), "{arguments:?}: {errors}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_standard_output_is_an_error() {
    let files = files();
    for arguments in PRINTING {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let output = printing(arguments, files.path()).stdout(full).output().unwrap();
        let errors = errors(&output);
        assert!(!errors.contains("panicked"), "{arguments:?}: {errors}");
        // clap, which prints the help, has messages of its own; the conversions print to standard error only.
        let is_silent =
            arguments.starts_with(&["convert"]) || arguments.starts_with(&["map", "export"]);
        if !arguments.contains(&"--help") && !is_silent {
            assert_eq!(output.status.code(), Some(1), "{arguments:?}: {errors}");
            assert!(errors.contains("error: standard output"), "{arguments:?}: {errors}");
        }
    }
}

/// Messages are short, whatever they quote.
#[cfg(target_os = "linux")]
#[test]
fn endless_input_is_an_error_of_a_few_lines() {
    let files = files();
    for arguments in [
        ["replay", "/dev/zero", "--map", "FILES/map.toml", "--config", "FILES/robot.toml"]
            .as_slice(),
        &["replay", "FILES/log.csv", "--reference", "/dev/zero"],
        &["convert", "carmen", "/dev/zero", "--out", "FILES/endless"],
        &["convert", "carmen", "/dev/urandom", "--out", "FILES/endless"],
        &["run", CLASSROOM, "--runs", "1", "--rows", "/dev/zero"],
        &["run", "/dev/zero", "--sweep", "sonar.noise=1mm,2mm"],
        &["merge", "/dev/zero", "--rows", "FILES/merged.csv"],
        &["map", "check", "/dev/zero"],
        &["map", "bake", "/dev/zero", "--out", "/dev/null"],
        &["run", "/dev/zero"],
        &["plan", "/dev/zero"],
        &["config", "check", "/dev/zero"],
    ] {
        let output = printing(arguments, files.path()).stdout(Stdio::null()).output().unwrap();
        let errors = errors(&output);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {errors}");
        let has_size =
            errors.contains("more than 256 MiB") || errors.contains("has more than 64 KiB");
        assert!(has_size, "{arguments:?}: {errors}");
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

/// A result that cannot be written is refused before the work, by every command that writes one: each of these would otherwise
/// end with another error, or work for hours.
#[test]
fn a_result_that_cannot_be_written_is_an_early_error() {
    const NOWHERE: &str = "tests/robot.toml/result";
    let commands: [(&[&str], &str); 13] = [
        (&["paper", "--runs", "4000000"], "--out"),
        (&["run", CLASSROOM, "--runs", "4000000"], "--out"),
        (&["run", CLASSROOM, "--runs", "4000000"], "--trace"),
        (&["replay", "missing.csv"], "--out"),
        (&["replay", "missing.csv"], "--trace"),
        (&["plan", CLASSROOM, "--runs", "4000000"], "--out"),
        (&["floor-plans", "--plans", "4000000"], "--images"),
        (&["floor-plans", "--draw", "1"], "--out"),
        (&["map", "bake", "missing.toml"], "--out"),
        (&["map", "draw", "missing.toml"], "--out"),
        (&["config", "bake", "missing.toml"], "--out"),
        (&["convert", "carmen", "missing.log"], "--out"),
        (&["monitor", "--port", "missing"], "--record"),
    ];
    for (arguments, option) in commands {
        let output = sonarfix(arguments).args([option, NOWHERE]).output().unwrap();
        assert!(errors(&output).contains(option), "{arguments:?}: {}", errors(&output));
        assert_eq!(output.status.code(), Some(1), "{arguments:?}");
    }
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
const LONG: [(&[&str], &str); 8] = [
    (&["paper", "--runs", "4000000"], "Estimates"),
    (
        &["run", "../../crates/sonarfix-map/scenarios/classroom.toml", "--runs", "4000000"],
        "Estimates",
    ),
    (&["floor-plans", "--plans", "1000000", "--runs", "1"], "# "),
    (&["faults", "--runs", "4000000"], "# Effects"),
    (&["find", CLASSROOM, "--runs", "1000000", "--seconds", "5"], ""),
    (&["relocalize", "--runs", "1000000", "--seconds", "5"], ""),
    (&["plan", CLASSROOM, "--runs", "100000"], ""),
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
        assert!(!text.trim().is_empty(), "{arguments:?}");
        assert!(!text.contains("| NaN"), "{text}");
    }
}
