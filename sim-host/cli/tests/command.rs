//! The command `sonarfix`.

#![expect(clippy::unwrap_used, reason = "a test should stop")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

fn sonarfix(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sonarfix")).args(arguments).output().unwrap()
}

fn json(arguments: &[&str]) -> Value {
    let output = sonarfix(arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// The reference scenario, shortened to one lap of 2 m × 1 m around its start.
fn short_scenario() -> String {
    sonarfix_map::PAPER
        .replace("[[0, 40], [-20, 40], [-20, 0], [0, 0]]", "[[0, 2], [-1, 2], [-1, 0], [0, 0]]")
        .replace("laps = 4", "laps = 1")
}

fn write(dir: &Path, name: &str, text: &str) -> String {
    let file = dir.join(name);
    fs::write(&file, text).unwrap();
    file.to_str().unwrap().to_owned()
}

/// Whether `docs/formats.md` has this column or key.
pub fn documented(name: &str) -> bool {
    include_str!("../../../docs/formats.md").contains(&format!("`{name}`"))
}

/// Asserts that every key of a JSON value is documented; the keys of maps by name are excepted.
pub fn assert_documented(value: &Value) {
    match value {
        Value::Object(members) => {
            for (key, member) in members {
                assert!(documented(key), "docs/formats.md has no key {key}");
                assert_documented(member);
            }
        }
        Value::Array(elements) => elements.iter().for_each(assert_documented),
        _ => {}
    }
}

#[test]
fn runs_that_end_lost_are_explained() {
    let classroom =
        concat!(env!("CARGO_MANIFEST_DIR"), "/../../crates/sonarfix-map/scenarios/classroom.toml");
    let output = sonarfix(&["run", classroom, "--runs", "1", "--start", "unknown"]);
    let errors = String::from_utf8(output.stderr).unwrap();
    // A rectangle is itself after half a turn.
    assert!(errors.contains("1 of 1 runs ended lost: rotated by 180°"), "{errors}");
    assert!(errors.contains("start_region"), "{errors}");
    assert!(!String::from_utf8(output.stdout).unwrap().contains("NaN"));
}

#[test]
fn paper_answers_in_json_as_documented() {
    let answer = json(&["paper", "--runs", "3", "--policy", "informative", "--json"]);
    assert_documented(&answer);
    let names: Vec<_> = answer["states"].as_array().unwrap().iter().map(|s| &s["name"]).collect();
    assert_eq!(names, sonarfix_sim::STATES);
    assert_eq!(answer["runs"], 3);
    assert_eq!(answer["fixes"]["accepted"], 3 * 1_248);
    assert_eq!(answer["lost_runs"], 0);
    for key in ["nees_mean", "nis_mean", "cpu_seconds"] {
        assert!(answer[key].as_f64().unwrap() > 0.0, "{key}");
    }
    for key in ["unit", "mean_error", "std_error", "rms_error", "bound", "rms_over_bound"] {
        assert!(!answer["states"][0][key].is_null(), "{key}");
    }
    for key in ["x", "y", "heading"] {
        assert!(answer["rms_path"][key].as_f64().unwrap() > 0.0, "{key}");
    }
    // Its prior variance is zero: it is not estimated.
    assert!(answer["states"][6]["rms_over_bound"].is_null());
}

#[test]
fn paper_prints_table_1_beside_the_papers() {
    let output = sonarfix(&["paper", "--runs", "2"]);
    let text = String::from_utf8(output.stdout).unwrap();
    let row = text.lines().find(|line| line.starts_with("S_L")).unwrap();
    assert!(row.ends_with("1.95e-4"), "{row}");
    // Only the table: no progress bar, no notice.
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn run_writes_trace_and_report() {
    let dir = tempfile::tempdir().unwrap();
    let scenario = write(dir.path(), "short.toml", &short_scenario());
    let trace = dir.path().join("trace.csv");
    let out = dir.path().join("report");
    let arguments = ["run", &scenario, "--runs", "2", "--trace", trace.to_str().unwrap()];
    let output = sonarfix(&[&arguments[..], &["--out", out.to_str().unwrap()]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(out.join("report.html").exists());

    let mut reader = csv::Reader::from_path(&trace).unwrap();
    for column in reader.headers().unwrap() {
        assert!(documented(column), "docs/formats.md has no column {column}");
    }
    let outcome = reader.headers().unwrap().iter().position(|name| name == "fix_outcome").unwrap();
    let lines: Vec<_> = reader.records().map(Result::unwrap).collect();
    // The start; 6 m at 0.4 m/s and four turns of 3 s: 27 s, ten ticks and one fix a second.
    assert_eq!(lines.len(), 1 + 270);
    assert_eq!(lines.iter().filter(|line| !line[outcome].is_empty()).count(), 27);
}

#[test]
fn a_seed_gives_the_same_run_again_and_another_seed_another() {
    let dir = tempfile::tempdir().unwrap();
    let scenario = write(dir.path(), "short.toml", &short_scenario());
    let states =
        |seed| json(&["run", &scenario, "--json", "--runs", "4", "--seed", seed])["states"].clone();
    assert_eq!(states("5"), states("5"));
    assert_ne!(states("5"), states("6"));
}

#[test]
fn bound_grows_where_nothing_is_measured() {
    let dir = tempfile::tempdir().unwrap();
    let scenario = write(dir.path(), "paper.toml", sonarfix_map::PAPER);
    let rows = json(&["bound", &scenario, "--every", "20", "--json"]);
    let at = |time: f64| {
        let rows = rows.as_array().unwrap();
        rows.iter().find(|row| (row["time"].as_f64().unwrap() - time).abs() < 0.2).unwrap().clone()
    };
    let y = |time| at(time)["y"].as_f64().unwrap();
    // The first leg runs along y, and only walls beside it are measured, until the corner.
    assert!(y(40.1) < y(60.1) && y(60.1) < y(80.1) && y(80.1) > 0.08, "{}", y(80.1));
    assert!(y(120.1) < 0.003, "{}", y(120.1));
}

/// The reference scenario with other noise of the robot file and of the simulation, as multiples of its own.
fn with_noise(assumed: f64, simulated: f64) -> String {
    let mut text = String::new();
    let mut factor = assumed;
    for line in sonarfix_map::PAPER.lines() {
        let key = line.split(" =").next().unwrap_or_default();
        factor = if line == "[truth]" { simulated } else { factor };
        let noise = match key {
            "wheel_noise" => format!("{key} = \"{} mm/sqrt(m)\"", 0.5 * factor),
            "noise" | "range_noise" => format!("{key} = \"{} mm\"", 2.4 * factor),
            "scale_walk" => format!("{key} = \"{} /sqrt(m)\"", 5e-6 * factor),
            "track_width_walk" => format!("{key} = \"{} m/sqrt(m)\"", 5e-6 * factor),
            // No range is gated, so that all runs have the same measurements.
            "confidence" => format!("{key} = 10"),
            _ => line.to_owned(),
        };
        text = text + &noise + "\n";
    }
    text
}

#[test]
fn the_bound_is_that_of_the_simulation_and_that_of_the_filter_stands_beside_it() {
    let dir = tempfile::tempdir().unwrap();
    let bound = |assumed: f64, simulated: f64| {
        let scenario = write(dir.path(), "noise.toml", &with_noise(assumed, simulated));
        let rows = json(&["bound", &scenario, "--every", "20", "--json"]);
        assert_documented(&rows);
        let text = String::from_utf8(sonarfix(&["bound", &scenario]).stdout).unwrap();
        (rows.as_array().unwrap().last().unwrap().clone(), text)
    };
    let (usual, text) = bound(1.0, 1.0);
    assert!(usual["with_filter_noise"].is_null(), "{usual}");
    assert!(text.contains("noise of the simulation: wheels 0.500 mm/sqrt(m)"), "{text}");
    assert!(!text.contains("that the filter assumes"), "{text}");
    let (noisy, text) = bound(1.0, 3.0);
    assert!(text.contains("noise of the simulation: wheels 1.500 mm/sqrt(m)"), "{text}");
    assert!(text.contains("The same with the noise that the filter assumes"), "{text}");
    assert!(text.contains("with seed 0; wheels 0.500 mm/sqrt(m)"), "{text}");
    let (known, _) = bound(3.0, 3.0);
    let close = |one: &Value, other: &Value| {
        let [one, other] = [one, other].map(|value| value.as_f64().unwrap());
        (one / other - 1.0).abs() < 0.03
    };
    for state in ["x", "y", "heading", "scale_right", "track_width"] {
        let of_filter = &noisy["with_filter_noise"][state];
        // The bound is that of a filter which knows the noise, and the other one that of a simulation with little noise.
        assert!(close(&noisy[state], &known[state]), "{state}: {noisy} {known}");
        assert!(close(of_filter, &usual[state]), "{state}: {noisy} {usual}");
    }
    // After eight hundred ranges little is left of the start: all noise is three times as large.
    let x = |of: &Value| of["x"].as_f64().unwrap();
    let ratio = x(&noisy) / x(&noisy["with_filter_noise"]);
    assert!((2.7..3.1).contains(&ratio), "{ratio}");
}

#[test]
fn a_wrong_scenario_is_refused_with_file_line_and_key() {
    let dir = tempfile::tempdir().unwrap();
    let wrong = short_scenario().replace("noise = \"2.4 mm\"  ", "noise = 2.4  ");
    let line = 1 + wrong.lines().position(|line| line.starts_with("noise = 2.4")).unwrap();
    let scenario = write(dir.path(), "wrong.toml", &wrong);
    let output = sonarfix(&["run", &scenario]);
    assert!(!output.status.success());
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(error.contains(&format!("wrong.toml:{line}: robot.sonar.noise: ")), "{error}");
}

#[test]
fn zero_runs_and_a_missing_file_are_errors() {
    let output = sonarfix(&["paper", "--runs", "0"]);
    assert!(!output.status.success());
    assert_eq!(String::from_utf8_lossy(&output.stderr), "error: --runs must be at least 1\n");
    let output = sonarfix(&["run", "nowhere.toml"]);
    assert!(!output.status.success());
    assert!(String::from_utf8_lossy(&output.stderr).contains("nowhere.toml"));
}
