//! What `sonarfix replay` says is wrong with a log: a simulated drive, whose log or files are wrong in one way each.
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "all of this file is a test, its helpers too"
)]

use std::fs;
use std::path::Path;
use std::process::Command;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use tempfile::TempDir;

use crate::command::assert_documented;
use crate::endings::CLASSROOM;

/// Seconds of the drive that are replayed.
const SECONDS: f64 = 120.0;

/// The robot of the classroom with two fixed sonars.
const FIXED: &str = "../../tests/scenarios/classroom-left-right.toml";

/// A recorded drive of a scenario, without its checksums, which a change would make wrong.
fn recorded(scenario: &str) -> TempDir {
    let dir = TempDir::new().unwrap();
    let log = dir.path().join("log.csv");
    let arguments = ["run", scenario, "--runs", "1", "--seed", "77", "--fidelity", "pins"];
    let output = Command::new(env!("CARGO_BIN_EXE_sonarfix"))
        .args(arguments)
        .arg("--record")
        .arg(&log)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = fs::read_to_string(&log).unwrap();
    let is_early = |line: &&str| {
        let time = line.split(',').nth(1).and_then(|time| time.parse::<f64>().ok());
        !line.starts_with('#') && time.is_none_or(|time| time < SECONDS)
    };
    let lines: Vec<_> = text.lines().filter(is_early).collect();
    fs::write(log, lines.join("\n") + "\n").unwrap();
    dir
}

/// The names of what is wrong, the surest first.
fn causes(dir: &Path) -> Vec<String> {
    let log = dir.join("log.csv");
    let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
    let output = command.arg("replay").arg(log).arg("--json").output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_documented(&found["diagnosis"]);
    let findings = found["diagnosis"]["findings"].as_array().unwrap();
    let documented = fs::read_to_string("../../docs/diagnosis.md").unwrap();
    let cause = |finding: &Value| {
        let cause = finding["cause"].as_str().unwrap().to_owned();
        assert!(documented.contains(&format!("`{cause}`")), "docs/diagnosis.md has no {cause}");
        cause
    };
    findings.iter().map(cause).collect()
}

/// What `replay` prints of a log.
fn replayed(log: &Path) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
    let output = command.arg("replay").arg(log).output().unwrap();
    String::from_utf8(output.stdout).unwrap()
}

/// A change of the numbers of a record behind its kind; the first one is its time.
type Change = fn(&mut [f64]);

/// The log with a change of all records of a kind; those whose time becomes −1 are left out.
fn changed(log: &str, kind: &str, mut change: impl FnMut(&mut [f64])) -> String {
    let line = |line: &str| {
        let mut fields: Vec<_> = line.split(',').map(str::to_owned).collect();
        if fields[0] != kind {
            return line.to_owned();
        }
        let mut numbers: Vec<_> =
            fields[1..].iter().map(|field| field.parse().unwrap_or(f64::NAN)).collect();
        change(&mut numbers);
        for (field, number) in fields[1..].iter_mut().zip(numbers) {
            if !number.is_nan() {
                *field = number.to_string();
            }
        }
        fields.join(",")
    };
    let is_kept = |line: &String| line.split(',').nth(1) != Some("-1");
    log.lines().map(line).filter(is_kept).collect::<Vec<_>>().join("\n") + "\n"
}

/// Mistakes in the log: the cause that must be named first, the kind of the records, and what is wrong with them.
const MISTAKES: [(&str, &str, Change); 30] = [
    ("wheels_swapped", "wheels", |it| it.swap(1, 2)),
    ("encoder_mirrored", "wheels", |it| it[1] = -it[1]),
    ("encoder_mirrored", "wheels", |it| it[2] = -it[2]),
    ("encoder_mirrored", "wheels", |it| it[1..].iter_mut().for_each(|travel| *travel = -*travel)),
    ("wheel_travel", "wheels", |it| it[1] *= 2.0),
    ("wheel_travel", "wheels", |it| it[2] *= 0.8),
    ("wheel_travel", "wheels", |it| it[1..].iter_mut().for_each(|travel| *travel *= 1.3)),
    ("encoder_stopped", "wheels", |it| it[2] = 0.0),
    ("bearing_mirrored", "range", |it| it[1] = -it[1]),
    ("bearing_offset", "range", |it| it[1] -= 0.6),
    ("bearing_unit", "range", |it| it[1] = it[1].to_degrees()),
    ("range_unit", "range", |it| it[2] *= 1e3),
    ("range_unit", "range", |it| it[2] *= 2.0),
    ("range_unit", "range", |it| it[2] *= 0.394),
    ("range_unit", "range", |it| it[2] *= 2.54),
    ("range_offset", "range", |it| it[2] += 0.15),
    ("start_heading", "resume", |it| it[3] += 1.6),
    ("start_pose", "resume", |it| {
        it[1] += 0.5;
        it[2] -= 0.6;
    }),
    ("clock_back", "range", |it| it[0] -= if it[0] > 60.0 { 30.0 } else { 0.0 }),
    ("clock_gap", "wheels", |it| it[0] += if it[0] > 60.0 { 45.0 } else { 0.0 }),
    ("range_stuck", "range", |it| it[2] = if it[0] > 50.0 { 0.731 } else { it[2] }),
    ("wheel_travel", "wheels", |it| it[1..].iter_mut().for_each(|travel| *travel *= 1e3)),
    ("wheels_swapped", "wheels", |it| (it[1], it[2]) = (-it[2], -it[1])),
    ("bearing_scale", "range", |it| it[1] *= 0.7),
    ("bearing_stuck", "range", |it| it[1] = 0.0),
    ("range_scale", "range", |it| it[2] *= 1.25),
    ("range_placeholder", "range", |it| it[2] = if it[0] % 4.0 < 1.0 { 9.99 } else { it[2] }),
    ("start_unit", "resume", |it| it[1..3].iter_mut().for_each(|metres| *metres *= 1e3)),
    ("echoes_end", "range", |it| it[0] = if it[0] > 50.0 { -1.0 } else { it[0] }),
    ("range_noise", "range", |it| it[2] = 0.2 + (it[0] * 997.3).fract() * 2.2),
];

/// Mistakes in the files: the cause, the file, what is written in it, and what is read.
const FILES: [(&str, &str, &str, &str); 6] = [
    ("map_wall", "map.toml", "    { name = \"board\", from = [6.0, 0.0], to = [6.0, 8.0] },\n", ""),
    ("map_wall", "map.toml", "[6.0, 0.0], to = [6.0, 8.0]", "[6.4, 0.0], to = [6.4, 8.0]"),
    ("map_unit", "map.toml", "unit = \"m\"", "unit = \"cm\""),
    ("map_unit", "map.toml", "unit = \"m\"", "unit = \"mm\""),
    ("mount", "robot.toml", "mount = [\"6 cm\", \"0 m\"]", "mount = [\"6 cm\", \"20 cm\"]"),
    ("track_width", "robot.toml", "\ntrack_width = \"12 cm\"", "\ntrack_width = \"6 cm\""),
];

#[test]
fn each_mistake_is_named_first_and_a_right_log_has_none() {
    let dir = recorded(CLASSROOM);
    assert_eq!(causes(dir.path()), Vec::<String>::new());
    let log = dir.path().join("log.csv");
    let right = fs::read_to_string(&log).unwrap();
    let mut wrong = Vec::new();
    let mut check = |expected: &str, what: String| {
        let found = causes(dir.path());
        if found.first().is_none_or(|first| first != expected) {
            wrong.push(format!("{what}: {expected} expected, found {found:?}"));
        }
    };
    for (number, (expected, kind, change)) in MISTAKES.iter().enumerate() {
        fs::write(&log, changed(&right, kind, change)).unwrap();
        check(expected, format!("mistake {number} of {kind}"));
    }
    let kinds = ["resume", "wheels", "range", "skip", "turn", "mode"];
    let in_milliseconds =
        kinds.iter().fold(right.clone(), |log, kind| changed(&log, kind, |it| it[0] *= 1e3));
    fs::write(&log, in_milliseconds).unwrap();
    check("time_unit", "milliseconds".to_owned());
    // Half a line, as from a serial port that loses bytes.
    let torn = right.lines().enumerate().map(|(n, line)| match n % 9 {
        5 => &line[..line.len() / 2],
        _ => line,
    });
    fs::write(&log, torn.collect::<Vec<_>>().join("\n") + "\n").unwrap();
    check("malformed_lines", "torn lines".to_owned());
    fs::write(&log, &right).unwrap();
    for (expected, name, from, to) in FILES {
        let file = dir.path().join(name);
        let text = fs::read_to_string(&file).unwrap();
        assert!(text.contains(from), "{name} has no {from}: {text}");
        fs::write(&file, text.replacen(from, to, 1)).unwrap();
        check(expected, format!("{to} in {name}"));
        fs::write(&file, text).unwrap();
    }
    assert_eq!(wrong, Vec::<String>::new());
}

/// The log of a robot that is carried from where it is at one time to where it is at a later one.
fn carried(log: &str, from: f64, until: f64) -> String {
    let value = |line: &str, field: usize| line.split(',').nth(field)?.parse::<f64>().ok();
    let is = |line: &&str, kind: &str| line.split(',').next() == Some(kind);
    let time = |line: &str| value(line, 1).unwrap_or(0.0);
    let mut wheels = log.lines().filter(|line| is(line, "wheels"));
    let before = wheels.clone().take_while(|line| time(line) < from).last().unwrap();
    let after = wheels.find(|line| time(line) >= until).unwrap();
    let way = [2, 3].map(|field| value(after, field).unwrap() - value(before, field).unwrap());
    let begin = log.lines().filter(|line| time(line) < from);
    let end: Vec<_> = log.lines().filter(|line| time(line) >= until).collect();
    let end = changed(&end.join("\n"), "wheels", |it| {
        it[1] -= way[0];
        it[2] -= way[1];
    });
    let kinds = ["wheels", "range", "skip", "turn", "mode"];
    let earlier =
        kinds.iter().fold(end, |log, kind| changed(&log, kind, |it| it[0] -= until - from));
    begin.chain(earlier.lines()).collect::<Vec<_>>().join("\n") + "\n"
}

#[test]
fn a_robot_that_is_carried_is_named() {
    let dir = recorded(CLASSROOM);
    let log = dir.path().join("log.csv");
    let right = fs::read_to_string(&log).unwrap();
    fs::write(&log, carried(&right, 50.0, 65.0)).unwrap();
    assert_eq!(causes(dir.path()), ["moved"]);
}

/// The log with a random walk of the travel of each wheel, of `deviation` metres per root metre of a robot at 0.2 m/s.
fn noisy(log: &str, deviation: f64, seed: u64) -> String {
    const STEP: f64 = 0.02;
    let mut noise = ChaCha8Rng::seed_from_u64(seed);
    let mut walks = [0.0; 2];
    changed(log, "wheels", |it| {
        for (travel, walk) in it[1..].iter_mut().zip(&mut walks) {
            *walk += deviation * STEP.sqrt() * 12.0_f64.sqrt() * noise.random_range(-0.5..0.5);
            *travel += *walk;
        }
    })
}

/// The noise of the wheels that the first cause states, metres per root metre.
fn named_noise(log: &Path) -> Option<f64> {
    let printed = replayed(log);
    let first = printed.split("probable cause: ").nth(1)?;
    let found = first.split("drive.wheel_noise = \"").nth(1)?;
    Some(1e-3 * found.split(' ').next().unwrap().parse::<f64>().unwrap())
}

/// Of twelve drives: the noise of a short one may look like another mistake, or its files explain it.
#[test]
fn wheels_that_are_noisier_than_their_file_says_are_named_with_their_noise() {
    const ADDED: f64 = 0.01;
    let dir = recorded(CLASSROOM);
    let log = dir.path().join("log.csv");
    let right = fs::read_to_string(&log).unwrap();
    let named = (0..12).filter_map(|seed| {
        fs::write(&log, noisy(&right, ADDED, seed)).unwrap();
        named_noise(&log)
    });
    // The drive has a noise of its own.
    let ratios: Vec<_> = named.map(|noise| noise / ADDED.hypot(0.003)).collect();
    assert!(ratios.len() >= 4, "{ratios:?}");
    assert!(ratios.iter().all(|ratio| (0.4..2.5).contains(ratio)), "{ratios:?}");
}

#[test]
fn a_log_without_a_start_is_examined() {
    let dir = recorded(CLASSROOM);
    let log = dir.path().join("log.csv");
    let right = fs::read_to_string(&log).unwrap();
    fs::write(&log, right.replacen("resume,", "resume;", 1)).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
    let output = command.arg("replay").arg(log).output().unwrap();
    let printed = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success());
    assert!(printed.contains("probable cause: line 2: 1 of"), "{printed}");
}

/// Mistakes in the log of two fixed sonars.
const FIXED_MISTAKES: [(&str, &str, Change); 5] = [
    ("bearing_offset", "range", |it| it[1] += 0.5),
    ("bearing_mirrored", "range", |it| it[1] = -it[1]),
    ("bearing_unit", "range", |it| it[1] = it[1].to_degrees()),
    ("wheels_swapped", "wheels", |it| it.swap(1, 2)),
    ("wheel_travel", "wheels", |it| it[1] *= 1.25),
];

#[test]
fn mistakes_of_a_robot_with_fixed_sonars_are_named() {
    let dir = recorded(FIXED);
    assert_eq!(causes(dir.path()), Vec::<String>::new());
    let log = dir.path().join("log.csv");
    let right = fs::read_to_string(&log).unwrap();
    let found = FIXED_MISTAKES.map(|(expected, kind, change)| {
        fs::write(&log, changed(&right, kind, change)).unwrap();
        (expected, causes(dir.path()).first().cloned())
    });
    let wrong: Vec<_> =
        found.iter().filter(|(expected, first)| first.as_deref() != Some(*expected)).collect();
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn calibrate_names_the_mistake_too() {
    let dir = recorded(CLASSROOM);
    let log = dir.path().join("log.csv");
    let calibrate = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
        let output = command.arg("calibrate").arg(&log).output().unwrap();
        [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap()).concat()
    };
    let printed = calibrate();
    assert!(!printed.contains("probable cause"), "{printed}");
    let right = fs::read_to_string(&log).unwrap();
    fs::write(&log, changed(&right, "wheels", |it| it.swap(1, 2))).unwrap();
    let printed = calibrate();
    let named = "probable cause: the right and the left encoder are exchanged";
    assert!(printed.contains(named), "{printed}");
}

#[test]
fn a_finding_states_its_line_and_the_remedy() {
    let dir = recorded(CLASSROOM);
    let log = dir.path().join("log.csv");
    let right = fs::read_to_string(&log).unwrap();
    let turned = changed(&right, "resume", |it| it[3] += 1.6);
    fs::write(&log, turned).unwrap();
    let printed = replayed(&log);
    let found =
        printed.split("probable cause: line 2: the heading at the start is wrong by ").nth(1);
    let degrees: f64 = found.unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!((-105.0..-80.0).contains(&degrees), "{printed}");
    assert!(printed.contains("% of the ranges then fit)\n    add -1."), "{printed}");
}
