//! How the command ends: endless input, a closed or a full standard output, a directory that cannot be
//! made.

#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]

use std::process::{Command, Output, Stdio};

use sonarfix_boards::made;
use sonarfix_link::CommandResult;
use sonarfix_studies::surveys::{self, Place};

use crate::common::{MAP, ROBOT};

fn sonarfix(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
    command.args(arguments).stdin(Stdio::null()).stderr(Stdio::piped());
    command
}

pub fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

pub const CLASSROOM: &str = "../../crates/sonarfix-map/scenarios/classroom.toml";
const PAPER: &str = "../../crates/sonarfix-map/scenarios/paper.toml";

/// Every subcommand, with arguments for the shortest output. In `FILES` are a short log with its map and robot, a drive for
/// the calibration, a recorded stream of a robot's bytes, rows, and room for results; `ROBOT` is the port of a robot.
const PRINTING: [&[&str]; 51] = [
    &["--help"],
    &["doctor", "--json"],
    &["init", "FILES/robot"],
    &["paper", "--runs", "1"],
    &["run", CLASSROOM, "--runs", "1", "--json"],
    &["pil", CLASSROOM, "--seconds", "1", "--machine", "host"],
    &["replay", "FILES/log.csv"],
    &["compare", "FILES/log.csv", "FILES/log.csv"],
    &["find", "FILES/log.csv", "--json"],
    &["calibrate", "FILES/drive.csv"],
    &["survey", "FILES/survey/log.csv"],
    &["export", "FILES/log.csv", "--mcap", "FILES/log.mcap"],
    &["export", "FILES/log.csv", "--rosbag", "FILES/bag"],
    &["convert", "carmen", "FILES/carmen.log", "--out", "FILES/converted"],
    &["convert", "rosbag", "FILES/recorded", "--out", "FILES/of_bag"],
    // These need a recording.
    &["convert", "lego", "--help"],
    &["convert", "nxt", "--help"],
    // This needs a person.
    &["measure", "--help"],
    &["monitor", "--port", "FILES/bytes"],
    &["command", "--port", "ROBOT", "set-pose", "1", "2", "90"],
    &["command", "--port", "ROBOT", "heading", "90"],
    &["command", "--port", "ROBOT", "position", "1", "2"],
    &["command", "--port", "ROBOT", "pose", "1", "2", "90"],
    &["command", "--port", "ROBOT", "set-configuration", "tests/robot.toml"],
    &["command", "--port", "ROBOT", "start"],
    &["command", "--port", "ROBOT", "stop"],
    &["command", "--port", "ROBOT", "reset-calibration"],
    &["command", "--port", "ROBOT", "search"],
    &["command", "--port", "ROBOT", "map-checksum"],
    &["command", "--port", "ROBOT", "point", "-30"],
    &["command", "--port", "ROBOT", "drive", "--speed", "0.1", "--seconds", "0"],
    &["command", "--port", "ROBOT", "goto", "1", "-2", "--seconds", "0"],
    // This takes seconds.
    &["command", "--port", "ROBOT", "self-test", "--help"],
    &["command", "--port", "ROBOT", "patrol", "1", "-2", "--seconds", "0"],
    &["virtual-robot", CLASSROOM, "--running", "--speed", "50", "--seconds", "1"],
    &["config", "bake", "tests/robot.toml", "--out", "FILES/config.bin"],
    &["config", "check", "FILES/config.bin"],
    &["config", "show", "FILES/config.bin"],
    &[
        "flash",
        "FILES/board",
        "--board",
        "stm32f405",
        "--program",
        "FILES/board/program.elf",
        "--dry-run",
    ],
    &["map", "check", PAPER],
    &["map", "bake", "FILES/map.toml", "--out", "FILES/map.bin"],
    &["map", "draw", "FILES/map.toml", "--out", "FILES/map.svg"],
    &["map", "simplify", "FILES/map.toml", "--out", "FILES/simple.csv"],
    &["map", "export", "FILES/map.toml", "--out", "FILES/map.geojson"],
    &["map", "import", "FILES/room.geojson", "--unit", "m", "--out", "FILES/imported.toml"],
    &["bound", CLASSROOM],
    &["merge", "FILES/rows.csv"],
    &["plan", CLASSROOM, "--runs", "1"],
    &["plan", CLASSROOM, "--runs", "1", "--starts", "1"],
    &["completions", "bash"],
    &["man", "--out", "FILES/man"],
];

/// The files of [`PRINTING`].
pub fn files() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
    write("map.toml", MAP);
    write("robot.toml", ROBOT);
    let wheels = (0..40).map(|tick| format!("wheels,{}.{},0,0\n", tick / 10, tick % 10));
    write(
        "log.csv",
        &format!("sonarfix-log,1\nstart,0,2,1.5,0,0.02,0.01\n{}", wheels.collect::<String>()),
    );
    let pings = "start,0,2,1.5,0,0.02,0.01\nwheels,0,0,0\nrange,0.05,0,1.5\nwheels,0.1,0,0\n";
    write("pings.csv", &format!("sonarfix-log,1\n{pings}"));
    write("drive.csv", &crate::calibrate::log());
    let flaser = "FLASER 3 2.0 9.0 2.0 5.0 6.0 0.5 0.5 0 0 10.5 host 0.6\n";
    let odom = |x, time| format!("ODOM {x} 0 0 0.5 0 0 {time} host 0\n");
    write("carmen.log", &[&odom(0, 10), flaser, &odom(1, 11), flaser, &odom(2, 12)].concat());
    write("bytes", "");
    std::fs::create_dir(dir.path().join("board")).unwrap();
    write("board/map.toml", MAP);
    write("board/robot.toml", ROBOT);
    let program = made::elf(0, &[made::segment(0x0800_0000, &[0; 8])]);
    std::fs::write(dir.path().join("board/program.elf"), program).unwrap();
    let geojson = r#"{"type": "LineString", "coordinates": [[0, 0], [4, 0], [4, 3]]}"#;
    write("room.geojson", geojson);
    for arguments in [
        ["run", CLASSROOM, "--runs", "1", "--rows", "FILES/rows.csv"].as_slice(),
        &["export", "FILES/pings.csv", "--rosbag", "FILES/recorded"],
        &["config", "bake", "tests/robot.toml", "--out", "FILES/config.bin"],
    ] {
        assert!(printing(arguments, dir.path()).stdout(Stdio::null()).status().unwrap().success());
    }
    surveys::record(Place::Room, 20_000, &dir.path().join("survey")).unwrap();
    dir
}

pub fn printing(arguments: &[&str], files: &std::path::Path) -> Command {
    let files = files.display().to_string();
    let argument = |argument: &&str| match *argument {
        "ROBOT" => crate::link_command::robot(0, CommandResult::Done).0,
        argument => argument.replace("FILES", &files),
    };
    let arguments: Vec<String> = arguments.iter().map(argument).collect();
    sonarfix(&arguments.iter().map(String::as_str).collect::<Vec<_>>())
}

/// The help of a subcommand, in short: each option in one line.
fn help(subcommand: &[String]) -> String {
    let subcommand = subcommand.iter().map(String::as_str);
    let arguments: Vec<&str> = subcommand.chain(["-h"]).collect();
    let output = sonarfix(&arguments).stdout(Stdio::piped()).output().unwrap();
    String::from_utf8(output.stdout).unwrap()
}

/// Every subcommand without further ones, as clap lists it.
fn subcommands(of: &[String]) -> Vec<Vec<String>> {
    let help = help(of);
    let commands = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let commands = commands.take_while(|line| !line.is_empty());
    let names = commands.filter_map(|line| line.split_whitespace().next());
    let all: Vec<Vec<String>> = names
        .filter(|name| *name != "help")
        .flat_map(|name| subcommands(&[of, &[name.to_owned()]].concat()))
        .collect();
    if all.is_empty() { vec![of.to_vec()] } else { all }
}

/// The help of every subcommand, or of the one above it, has examples, whose arguments exist.
#[test]
fn every_subcommand_has_examples() {
    let mut tried = 0;
    for subcommand in subcommands(&[]) {
        let above = subcommand.split_last().map_or(Vec::new(), |(_, above)| above.to_vec());
        let of_above = if above.is_empty() { String::new() } else { help(&above) };
        let text = help(&subcommand) + &of_above;
        let lines = text.lines().filter_map(|line| line.strip_prefix("  sonarfix "));
        let examples: Vec<&str> = lines.collect();
        assert!(!examples.is_empty(), "{subcommand:?}");
        for example in examples.iter().filter(|example| !example.contains('>')) {
            let arguments: Vec<&str> = example.split_whitespace().chain(["--help"]).collect();
            let output = sonarfix(&arguments).output().unwrap();
            assert!(output.status.success(), "{example}: {}", errors(&output));
            tried += 1;
        }
    }
    assert!(tried > 40, "{tried}");
}

/// No subcommand is missing in [`PRINTING`].
#[test]
fn every_subcommand_is_in_the_table() {
    let all = subcommands(&[]);
    assert!(all.len() > 30, "{all:?}");
    for subcommand in all {
        let is_this = |arguments: &&&[&str]| {
            let mut words = arguments.iter();
            subcommand.iter().all(|name| words.any(|word| word == name))
        };
        assert!(PRINTING.iter().any(|arguments| is_this(&arguments)), "{subcommand:?}");
    }
}

/// The options that name a file or folder, of all subcommands: those that are written are in [`WRITING`].
#[test]
fn every_option_that_names_a_result_is_in_the_table() {
    const READ: [&str; 12] = [
        "--board",
        "--compare",
        "--config",
        "--data",
        "--firmware",
        "--map",
        "--path",
        "--reference",
        "--robot",
        "--sensor",
        "--servo",
        "--walls",
    ];
    for subcommand in subcommands(&[]) {
        for line in help(&subcommand).lines() {
            let mut words = line.split_whitespace().skip_while(|word| !word.starts_with("--"));
            let (Some(option), Some(value)) = (words.next(), words.next()) else { continue };
            let names_a_file = value.contains('.') || value.contains("FILE") || value == "<DIR>";
            if !line.trim_start().starts_with('-')
                || !value.starts_with('<')
                || !names_a_file
                || READ.contains(&option)
            {
                continue;
            }
            let is_listed = WRITING.iter().any(|(arguments, listed)| {
                let mut words = arguments.iter();
                *listed == option && subcommand.iter().all(|name| words.any(|word| word == name))
            });
            assert!(is_listed, "{subcommand:?} {option}");
        }
    }
}

/// Ctrl-C of every subcommand with many runs is tested.
#[cfg(unix)]
#[test]
fn every_subcommand_with_runs_is_interrupted() {
    for subcommand in subcommands(&[]) {
        let has_runs =
            help(&subcommand).lines().any(|line| line.trim_start().starts_with("--runs "));
        let is_listed = LONG.iter().any(|(arguments, _)| {
            arguments.first().copied() == subcommand.first().map(String::as_str)
        });
        assert!(!has_runs || is_listed, "{subcommand:?}");
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

/// Print to standard error only.
#[cfg(target_os = "linux")]
const SILENT: [&[&str]; 4] = [&["convert"], &["map", "bake"], &["map", "draw"], &["map", "export"]];

#[cfg(target_os = "linux")]
#[test]
fn a_full_standard_output_is_an_error() {
    let files = files();
    for arguments in PRINTING {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let output = printing(arguments, files.path()).stdout(full).output().unwrap();
        let errors = errors(&output);
        assert!(!errors.contains("panicked"), "{arguments:?}: {errors}");
        // clap, which prints the help, has messages of its own.
        let is_silent = SILENT.iter().any(|silent| arguments.starts_with(silent));
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
        let has_size = ["256 MiB", "64 MiB", "64 KiB"]
            .iter()
            .any(|size| errors.contains(&format!("more than {size}")));
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

/// The options that name a result, each in a command that would otherwise end with another error, or work for hours.
const WRITING: [(&[&str], &str); 37] = [
    (&["map", "check", CLASSROOM, "--starts", "1000"], "--out"),
    (&["man"], "--out"),
    (&["measure", "--port", "missing"], "--out"),
    (&["paper", "--runs", "4000000"], "--out"),
    (&["run", CLASSROOM, "--runs", "4000000"], "--out"),
    (&["run", CLASSROOM, "--runs", "4000000"], "--trace"),
    (&["run", CLASSROOM, "--runs", "4000000", "--rows", "/dev/null", "--worst", "1"], "--traces"),
    (&["run", CLASSROOM, "--runs", "4000000"], "--rows"),
    (&["run", CLASSROOM, "--runs", "4000000"], "--record"),
    (&["run", CLASSROOM, "--runs", "4000000", "--sweep", "sonar.noise=1mm,2mm"], "--out"),
    (&["merge", "missing.csv"], "--rows"),
    (&["pil", CLASSROOM, "--machine", "host"], "--record"),
    (&["replay", "missing.csv"], "--out"),
    (&["compare", "missing.csv", "missing.csv"], "--out"),
    (&["replay", "missing.csv"], "--trace"),
    (&["plan", CLASSROOM, "--runs", "4000000"], "--out"),
    (&["calibrate", "missing.csv"], "--out"),
    (&["calibrate", "missing.csv"], "--trajectory"),
    (&["calibrate", "missing.csv"], "--residuals"),
    (&["survey", "missing.csv"], "--out"),
    (&["survey", "missing.csv"], "--drawing"),
    (&["export", "missing.csv"], "--mcap"),
    (&["export", "missing.csv"], "--parquet"),
    (&["export", "missing.csv"], "--rosbag"),
    (&["map", "bake", "missing.toml"], "--out"),
    (&["map", "draw", "missing.toml"], "--out"),
    (&["map", "simplify", "missing.toml"], "--out"),
    (&["map", "import", "missing.svg"], "--out"),
    (&["map", "import", "missing.svg", "--plan", "--out", "map.toml"], "--picture"),
    (&["map", "export", "missing.toml"], "--out"),
    (&["config", "bake", "missing.toml"], "--out"),
    (&["flash", "missing", "--board", "pico"], "--out"),
    (&["convert", "carmen", "missing.log"], "--out"),
    (&["convert", "lego", "missing"], "--out"),
    (&["convert", "rosbag", "missing"], "--out"),
    (&["convert", "nxt", "missing"], "--out"),
    (&["monitor", "--port", "missing"], "--record"),
];

/// A result that cannot be written is refused before the work, by every command that writes one.
#[test]
fn a_result_that_cannot_be_written_is_an_early_error() {
    const NOWHERE: &str = "tests/robot.toml/result";
    let init = sonarfix(&["init", NOWHERE]).output().unwrap();
    assert!(errors(&init).contains("the folder"), "{}", errors(&init));
    for (arguments, option) in WRITING {
        let output = sonarfix(arguments).args([option, NOWHERE]).output().unwrap();
        assert!(errors(&output).contains(option), "{arguments:?}: {}", errors(&output));
        assert_eq!(output.status.code(), Some(1), "{arguments:?}");
    }
}

/// Commands with more runs than anyone waits for, and what their output must begin with.
#[cfg(unix)]
const LONG: [(&[&str], &str); 3] = [
    (&["paper", "--runs", "4000000"], "Estimates"),
    (
        &["run", "../../crates/sonarfix-map/scenarios/classroom.toml", "--runs", "4000000"],
        "Estimates",
    ),
    (&["plan", CLASSROOM, "--runs", "100000"], ""),
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
        // On a slow computer a run takes longer than is waited for.
        if errors.contains("a run takes longer than a second") {
            continue;
        }
        assert!(errors.contains("interrupted: the results are those of "), "{errors}");
        assert!(text.trim_start().starts_with(begins), "{arguments:?}: {text}");
        assert!(!text.trim().is_empty(), "{arguments:?}");
        assert!(!text.contains("| NaN"), "{text}");
    }
}
