//! The command `sonarfix replay`.
#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

use crate::command::assert_documented;
use crate::common::{MAP, ROBOT, Sonar, recording};

/// A folder with a recording in it.
fn folder(log: &str, reference: &str) -> TempDir {
    let dir = TempDir::new().unwrap();
    let files =
        [("log.csv", log), ("reference.csv", reference), ("map.toml", MAP), ("robot.toml", ROBOT)];
    for (name, text) in files {
        fs::write(dir.path().join(name), text).unwrap();
    }
    dir
}

fn sonarfix(dir: &Path, args: &[&str]) -> Output {
    let program = Path::new(env!("CARGO_BIN_EXE_sonarfix"));
    Command::new(program).current_dir(dir).args(args).output().unwrap()
}

#[test]
fn a_number_of_pings_that_is_no_scan_s_is_refused_with_the_limits() {
    let (log, reference) = recording(5, Sonar::Scans);
    let dir = folder(&log, &reference);
    for wrong in ["0", "10", "two"] {
        let output = sonarfix(dir.path(), &["replay", "log.csv", "--pings-per-scan", wrong]);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && stderr.contains("--pings-per-scan <N>"), "{stderr}");
        assert!(wrong == "two" || stderr.contains("is not in 1..=9"), "{stderr}");
    }
    let fixes = |most| {
        let args = ["replay", "log.csv", "--json", "--pings-per-scan", most];
        let found: Value = serde_json::from_slice(&sonarfix(dir.path(), &args).stdout).unwrap();
        found["fixes"]["accepted"].as_u64().unwrap()
    };
    assert!(fixes("3") > 2 * fixes("1"), "{} {}", fixes("3"), fixes("1"));
}

#[test]
fn files_beside_the_log_are_found_and_the_json_has_its_keys() {
    let (log, reference) = recording(20, Sonar::Scans);
    let dir = folder(&log, &reference);
    let args = ["replay", "log.csv", "--json", "--out", "report", "--trace", "trace.csv"];
    let output = sonarfix(dir.path(), &args);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    assert_eq!(stderr.lines().count(), 1, "no progress in a pipe: {stderr}");
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_documented(&found);
    let keys = ["position_rms", "position_median", "position_max", "heading_rms"];
    for key in keys.into_iter().chain(["odometry_position_rms"]) {
        assert!(found[key].as_f64().unwrap() > 0.0, "{key}");
    }
    for key in ["accepted", "gated", "refused"] {
        assert!(found["fixes"][key].is_u64(), "{key}");
    }
    for key in ["scale_right", "scale_left", "track_width", "range_scale"] {
        assert!(found["final"][key].is_f64(), "{key}");
    }
    let page = fs::read_to_string(dir.path().join("report/report.html")).unwrap();
    assert!(page.contains("Errors against the reference") && !page.contains("Figure 2"));
    // Without a reference there is no table of errors.
    fs::remove_file(dir.path().join("reference.csv")).unwrap();
    let output = sonarfix(dir.path(), &["replay", "log.csv"]);
    let printed = String::from_utf8_lossy(&output.stdout);
    assert!(
        printed.contains("the errors are not known") && !printed.contains("Errors"),
        "{printed}"
    );
    let trace = fs::read_to_string(dir.path().join("trace.csv")).unwrap();
    assert!(trace.lines().count() >= 200);
}

/// The log of a robot that searched decides about the mode; the summary has its searches and their times.
#[test]
fn recorded_changes_of_the_mode_are_counted() {
    let (log, reference) = recording(20, Sonar::Silent);
    let mut lines: Vec<String> = log.lines().map(str::to_owned).collect();
    for (time, mode) in [(5, "searching"), (10, "provisional"), (12, "tracking")] {
        let tick = format!("ticks,{time},");
        let at = lines.iter().position(|line| line.starts_with(&tick)).unwrap();
        let line = format!("mode,{time},{mode},1,1,0,0,0,0,0,0.1,0.1,0.05,0.01,0.01,0.004,0");
        lines.insert(at + 1, line);
    }
    let dir = folder(&(lines.join("\n") + "\n"), &reference);
    let robot = ROBOT.replacen("[drive]", "start = \"unknown\"\n[drive]", 1);
    fs::write(dir.path().join("robot.toml"), robot).unwrap();
    let output = sonarfix(dir.path(), &["replay", "log.csv", "--json"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let search = &found["search"];
    for (key, count) in [("begun", 1), ("handed_over", 1), ("confirmed", 1)] {
        assert_eq!(search[key].as_u64(), Some(count), "{key}: {search}");
    }
    for (key, seconds) in [("searching_seconds", 5.0), ("provisional_seconds", 2.0)] {
        let found = search[key].as_f64().unwrap();
        assert!((found - seconds).abs() < 0.01, "{key}: {found}");
    }
}

#[test]
fn without_a_reference_there_are_no_errors_to_print() {
    let (log, _) = recording(20, Sonar::Ranges);
    let dir = folder(&log, "");
    fs::remove_file(dir.path().join("reference.csv")).unwrap();
    let output = sonarfix(dir.path(), &["replay", "log.csv"]);
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && text.contains("no reference:"), "{text}");
    let missing = sonarfix(dir.path(), &["replay", "log.csv", "--reference", "other.csv"]);
    assert!(!missing.status.success(), "a requested reference must exist");
}

#[test]
fn ten_lines_are_printed_and_the_rest_counted() {
    let (log, reference) = recording(20, Sonar::Ranges);
    let dir = folder(&format!("{log}{}", "?\n".repeat(25)), &reference);
    let output = sonarfix(dir.path(), &["replay", "log.csv"]);
    let stderr = String::from_utf8_lossy(&output.stderr);
    let first = format!("skipped: log line {}: `?` is not one of", log.lines().count() + 1);
    assert!(stderr.starts_with(&first), "{stderr}");
    assert_eq!(stderr.lines().count(), 11);
    assert!(stderr.ends_with("skipped: 15 more lines\n"), "{stderr}");
    assert!(String::from_utf8_lossy(&output.stdout).contains("lines skipped 25 of"));
    let strict = sonarfix(dir.path(), &["replay", "log.csv", "--strict"]);
    let stderr = String::from_utf8_lossy(&strict.stderr);
    assert!(!strict.status.success() && stderr.contains("`?` is not one of"), "{stderr}");
}
