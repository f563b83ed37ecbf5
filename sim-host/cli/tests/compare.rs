//! `sonarfix compare`: logs, traces and scenarios side by side.

#![expect(clippy::unwrap_used, reason = "a test should stop")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

use crate::endings::errors;
use crate::json::assert_documented;

const CLASSROOM: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../../crates/sonarfix-map/scenarios/classroom.toml");

fn run(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
    command.args(arguments).current_dir(folder).output().unwrap()
}

fn done(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", errors(&output));
    String::from_utf8(output.stdout).unwrap()
}

fn json(folder: &Path, arguments: &[&str]) -> Value {
    serde_json::from_str(&done(folder, &[arguments, &["--json"]].concat())).unwrap()
}

/// A simulated run, its trace and its log have the same figures, and those of `run`; the trace has nine digits.
#[test]
fn a_run_is_the_same_as_scenario_trace_and_log() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    fs::create_dir(here.join("drive")).unwrap();
    let files = ["--trace", "trace.csv", "--record", "drive/log.csv"];
    let of_run = json(here, &[&["run", CLASSROOM, "--runs", "1"], &files[..]].concat());
    let compared = json(here, &["compare", CLASSROOM, "trace.csv", "--map", CLASSROOM]);
    assert_documented(&compared);
    let [first, second] = ["first", "second"].map(|side| &compared[side]);
    assert_eq!(first["fixes"], of_run["fixes"]);
    assert_eq!(first["fixes"], second["fixes"]);
    assert_eq!(first["health"]["lost_at"], second["health"]["lost_at"]);
    let near =
        |a: &Value, b: &Value, most: f64| (a.as_f64().unwrap() - b.as_f64().unwrap()).abs() < most;
    for key in ["duration", "distance", "position_rms", "position_max", "heading_rms"] {
        assert!(near(&first[key], &second[key], 1e-6), "{key}: {} {}", first[key], second[key]);
    }
    let degraded = [first, second].map(|side| &side["health"]["degraded_seconds"]);
    assert!(near(degraded[0], degraded[1], 1e-6), "{degraded:?}");
    let path = &of_run["rms_path"];
    let rms = path["x"].as_f64().unwrap().hypot(path["y"].as_f64().unwrap());
    assert!((first["position_rms"].as_f64().unwrap() - rms).abs() < 1e-6, "{rms}: {first}");
    // A log begins with the first encoder record.
    let logged = json(here, &["compare", CLASSROOM, "drive/log.csv"]);
    assert!(near(&logged["first"]["position_rms"], &logged["second"]["position_rms"], 1e-3));
    assert_eq!(logged["settings"], Value::Array(Vec::new()), "it is the same robot");
}

/// One log with two robot files: the settings that differ are named, and the page has both.
#[test]
fn one_log_with_two_robot_files_shows_what_differs() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    done(here, &["run", CLASSROOM, "--runs", "1", "--record", "log.csv"]);
    let robot = fs::read_to_string(here.join("robot.toml")).unwrap();
    let other = robot.replace("policy = \"informative\"", "policy = \"nearest\"");
    assert_ne!(robot, other);
    fs::write(here.join("other.toml"), other).unwrap();
    let robots = ["--config", "robot.toml", "--config", "other.toml"];
    let command = [&["compare", "log.csv", "log.csv"], &robots[..]].concat();
    let settings = &json(here, &command)["settings"];
    assert_eq!(settings.as_array().unwrap().len(), 1, "{settings}");
    assert_eq!(settings[0]["key"], "schedule.policy");
    assert_eq!(
        (&settings[0]["first"], &settings[0]["second"]),
        (&"informative".into(), &"nearest".into())
    );
    let text = done(here, &[&command[..], &["--out", "page"]].concat());
    assert!(text.contains("schedule.policy") && text.contains("second − first"), "{text}");
    let page = fs::read_to_string(here.join("page/comparison.html")).unwrap();
    assert!(page.contains("<h3 id=\"side-1\">Second: log.csv</h3>"), "{text}");
}

#[test]
fn what_cannot_be_compared_is_refused_with_its_reason() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    fs::write(here.join("no.csv"), "a,b\n1,2\n").unwrap();
    let thrice = ["--map", CLASSROOM, "--map", CLASSROOM, "--map", CLASSROOM];
    for (arguments, reason) in [
        (
            &["compare", "no.csv", CLASSROOM, "--map", CLASSROOM][..],
            "no.csv: the columns are not those of a trace",
        ),
        (&["compare", CLASSROOM, "missing.csv"], "missing.csv"),
        (&[&["compare", CLASSROOM, CLASSROOM], &thrice[..]].concat(), "--map was given 3 times"),
        (&["run", CLASSROOM, "--beside", "x.csv"], "--serve"),
        (&["run", CLASSROOM, "--serve", "--beside", "missing.csv"], "missing.csv"),
    ] {
        let output = run(here, arguments);
        assert!(
            !output.status.success() && errors(&output).contains(reason),
            "{arguments:?}: {}",
            errors(&output)
        );
    }
}
