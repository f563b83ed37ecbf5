//! Recordings of real robots. They are not part of the project: the tests read them from the folder
//! `SONARFIX_DATA`, or from `../shared/data` beside the project, and are reported as skipped without
//! it.
#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "all of this file is a test, its helpers too"
)]

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

use crate::skipped;

fn sonarfix(args: &[&str]) -> Output {
    let output = Command::new(env!("CARGO_BIN_EXE_sonarfix")).args(args).output().unwrap();
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

fn replay(folder: &Path, robot: &str, policy: &str) -> Value {
    let log = folder.join("log.csv");
    let robot = folder.join(robot);
    let (log, robot) = (log.to_str().unwrap(), robot.to_str().unwrap());
    let args = ["replay", log, "--config", robot, "--policy", policy, "--strict", "--json"];
    serde_json::from_slice(&sonarfix(&args).stdout).unwrap()
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("no number {key} in {value}"))
}

fn lego() -> Option<TempDir> {
    let from = skipped::unless_recorded("lego_urg")?;
    let dir = TempDir::new().unwrap();
    let to = dir.path().to_str().unwrap();
    sonarfix(&["convert", "lego", from.to_str().unwrap(), "--out", to]);
    Some(dir)
}

#[test]
fn lego_from_the_fitted_wheels() {
    let Some(dir) = lego() else { return };
    for policy in ["nearest", "informative"] {
        let found = replay(dir.path(), "robot-fitted.toml", policy);
        let rms = number(&found, "position_rms");
        assert!(rms < 0.020, "{policy}: {rms}");
        // Dead reckoning is several times worse.
        assert!(number(&found, "odometry_position_rms") > 5.0 * rms, "{found}");
        // One range in 0.8 s; some are echoes of an unmapped post, and gated.
        let fixes = |key| number(&found["fixes"], key);
        let turns = fixes("accepted") + fixes("gated") + fixes("refused");
        assert!(turns <= (number(&found, "duration") / 0.8).ceil(), "{found}");
        assert!(fixes("gated") >= 5.0 && fixes("accepted") >= 0.4 * turns, "{found}");
    }
}

#[test]
fn lego_from_rounded_wheels_estimates_the_fitted_ones() {
    let Some(dir) = lego() else { return };
    for policy in ["nearest", "informative"] {
        let found = replay(dir.path(), "robot-rounded.toml", policy);
        let rms = number(&found, "position_rms");
        assert!(rms < 0.025, "{policy}: {rms}");
        let end = &found["final"];
        // In a minute each wheel is estimated to 0.4 %, and the observable difference more accurately.
        let fitted = [("scale_right", 0.3289 / 0.327 - 1.0), ("scale_left", 0.3255 / 0.327 - 1.0)];
        let [right, left] = fitted.map(|(state, fitted)| number(end, state) - fitted);
        for error in [right, left] {
            assert!(error.abs() < 0.008, "{policy}: off by {error}; {end}");
        }
        let kept = (right - left).abs() / (fitted[0].1 - fitted[1].1);
        assert!(kept < 0.5, "{policy}: the difference keeps {kept} of its error; {end}");
    }
}

/// Leaves out the records after a time, seconds.
fn shorten(log: &Path, until: f64) {
    let text = std::fs::read_to_string(log).unwrap();
    let is_kept = |line: &&str| {
        let time = line.split(',').nth(1).and_then(|time| time.parse::<f64>().ok());
        time.is_none_or(|time| time <= until)
    };
    let kept: String = text.split_inclusive('\n').filter(is_kept).collect();
    std::fs::write(log, kept).unwrap();
}

#[test]
fn freiburg_is_lost_and_found_again() {
    let Some(folder) = skipped::unless_recorded("carmen") else { return };
    let dir = TempDir::new().unwrap();
    let to = dir.path().to_str().unwrap();
    let log = folder.join("freiburg-079_rawodo.txt.gz");
    let walls = folder.join("freiburg-079_walls.csv");
    let (log, walls) = (log.to_str().unwrap(), walls.to_str().unwrap());
    sonarfix(&["convert", "carmen", log, "--walls", walls, "--out", to]);
    // Searching in a map of 150 walls takes most of the time of this test.
    shorten(&dir.path().join("log.csv"), 500.0);
    let found = replay(dir.path(), "robot.toml", "informative");
    let diverged = number(&found["consistency"], "diverged_at");
    // Longer than dead reckoning, whose error reaches half a metre after 18 s.
    assert!(diverged > 120.0, "diverged at {diverged} s");
    // It diverges, which the verdict reports: at first `Degraded`, then `Lost`.
    let undetected = number(&found["consistency"]["beyond_half_a_metre"], "tracking");
    // What follows a loss depends on the last bit of an estimate: up to 1.1 % of the whole log were seen.
    assert!(undetected < 0.02, "{undetected}");
    let lost = number(&found["health"], "lost_at");
    assert!(lost < diverged + 60.0, "lost at {lost} s, diverged at {diverged} s");
    let search = &found["search"];
    assert!(search["handed_over"].as_u64().unwrap() > 0, "{search}");
    let within = &found["consistency"]["within_half_a_metre"];
    let known = number(within, "tracking") + number(within, "degraded");
    assert!(known > 0.25, "{within}");
}

/// The numbers of the records of one kind in a log, packed or not. No return, 0 and a range beyond the reach of the scanner are the same.
fn records(log: &Path, kind: &str) -> Vec<Vec<f64>> {
    const REACH: f64 = 80.0;
    let mut text = String::new();
    let mut log = sonarfix_replay::convert::open(log).unwrap();
    std::io::Read::read_to_string(&mut log, &mut text).unwrap();
    let number = |(index, field): (usize, &str)| {
        let number = field.parse().unwrap_or(0.0);
        if kind == "scan" && index > 0 && number > REACH { 0.0 } else { number }
    };
    let numbers = |line: &str| line.split([',', ' ']).skip(1).enumerate().map(number).collect();
    text.lines().filter(|line| line.split(',').next() == Some(kind)).map(numbers).collect()
}

/// The largest difference of the numbers of two lists of records. The last line of a log without a newline is left out as torn.
fn apart(one: &[Vec<f64>], other: &[Vec<f64>]) -> f64 {
    assert!(other.len() - one.len() <= 1, "{} {}", one.len(), other.len());
    let mut apart = 0.0_f64;
    for (one, other) in one.iter().zip(other) {
        assert_eq!(one.len(), other.len());
        let differences = one.iter().zip(other).map(|(one, other)| (one - other).abs());
        apart = differences.fold(apart, f64::max);
    }
    apart
}

/// The public corrected logs give the recordings that were made of them without this converter.
#[test]
fn public_corrected_logs_give_the_recordings() {
    let Some(public) = skipped::unless_recorded("carmen_public") else { return };
    let Some(folder) = skipped::unless_recorded("carmen") else { return };
    let convert = |log: &Path| {
        let dir = TempDir::new().unwrap();
        let to = dir.path().to_str().unwrap();
        let output = sonarfix(&["convert", "carmen", log.to_str().unwrap(), "--out", to]);
        (dir, String::from_utf8(output.stderr).unwrap())
    };
    for name in ["intel", "seattle", "freiburg-101"] {
        let (dir, told) = convert(&public.join(format!("{name}-corrected.log.gz")));
        assert!(told.contains("recognised: the odometry continues"), "{name}: {told}");
        let log = dir.path().join("log.csv");
        let expected = folder.join(format!("{name}_log.csv.gz"));
        // Both have micrometres and microseconds; bearings of the beams have seven digits.
        for (kind, rounding) in [("wheels", 2e-6), ("scan", 2e-6), ("start", 1e-5)] {
            let apart = apart(&records(&log, kind), &records(&expected, kind));
            assert!(apart < rounding, "{name}, {kind}: {apart}");
        }
        let reference = |path: &Path| -> Vec<Vec<f64>> {
            let text = std::fs::read_to_string(path).unwrap();
            let row = |line: &str| {
                let mut row: Vec<f64> =
                    line.split(',').map(|field| field.parse().unwrap()).collect();
                row[3] = row[3].rem_euclid(std::f64::consts::TAU);
                row
            };
            text.lines().skip(1).map(row).collect()
        };
        let expected = reference(&folder.join(format!("{name}_reference.csv")));
        let apart = apart(&reference(&dir.path().join("reference.csv")), &expected);
        assert!(apart < 1e-5, "{name}: {apart}");
    }
    // This recording has poses of four digits instead of wheel travel: up to 0.1 mm and 10 µrad from record to record.
    let (public, _) = convert(&public.join("freiburg-079-corrected.log.gz"));
    let (shared, _) = convert(&folder.join("freiburg-079_rawodo.txt.gz"));
    let steps = |dir: &TempDir| -> Vec<Vec<f64>> {
        let wheels = records(&dir.path().join("log.csv"), "wheels");
        let step =
            |pair: &[Vec<f64>]| (1..3).map(|field| pair[1][field] - pair[0][field]).collect();
        wheels.windows(2).map(step).collect()
    };
    let apart = apart(&steps(&public), &steps(&shared));
    assert!(apart < 2e-4, "{apart}");
}
