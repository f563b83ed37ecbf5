//! The search for the pose on recorded sweeps of a rotating sonar.
#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "all of this file is a test, its helpers too"
)]

use std::path::Path;
use std::process::Command;

use serde_json::Value;
use tempfile::TempDir;

use crate::skipped;

fn sonarfix(args: &[&str]) -> Vec<u8> {
    let output = Command::new(env!("CARGO_BIN_EXE_sonarfix")).args(args).output().unwrap();
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    output.stdout
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

/// Whether a hypothesis is within 15 cm and 10° of the first row of a reference.
fn is_right(hypothesis: &Value, reference: &str) -> bool {
    let row: Vec<f64> = reference
        .lines()
        .find_map(|line| {
            line.split(',').map(|cell| cell.parse().ok()).collect::<Option<Vec<f64>>>()
        })
        .unwrap();
    let [_, x, y, heading] = row.as_slice() else { panic!("{row:?}") };
    let pose = &hypothesis["pose"];
    let apart = (number(&pose["x"]) - x).hypot(number(&pose["y"]) - y);
    let turn = number(&pose["heading"]) - heading;
    apart < 0.15 && turn.cos() > 10_f64.to_radians().cos()
}

#[test]
fn one_sweep_of_a_real_sonar_without_a_start_pose() {
    let Some(from) = skipped::unless_recorded("nxt_rotating_sonar") else { return };
    let dir = TempDir::new().unwrap();
    sonarfix(&["convert", "nxt", from.to_str().unwrap(), "--out", dir.path().to_str().unwrap()]);
    let (mut sweeps, mut in_answers, mut best, mut answers) = (0, 0, 0, 0);
    for sweep in std::fs::read_dir(dir.path()).unwrap() {
        let sweep = sweep.unwrap().path();
        let read = |name: &str| std::fs::read_to_string(sweep.join(name)).unwrap();
        let log = sweep.join("log.csv");
        let found = sonarfix(&["find", log.to_str().unwrap(), "--json"]);
        let found: Value = serde_json::from_slice(&found).unwrap();
        let count = usize::try_from(found["answers"].as_u64().unwrap()).unwrap();
        let hypotheses = found["hypotheses"].as_array().unwrap();
        let reference = read("reference.csv");
        let rank = hypotheses.iter().position(|one| is_right(one, &reference));
        sweeps += 1;
        answers += count;
        in_answers += usize::from(rank.is_some_and(|rank| rank < count));
        best += usize::from(rank == Some(0));
        let is_unique = found["answer"] == "unique";
        assert!(!is_unique || rank == Some(0), "unique and wrong: {}", sweep.display());
    }
    assert_eq!(sweeps, 20);
    // In the other one (kentheo_loc2) the heading differs by 11° from the reference, which is a fit.
    assert!(in_answers >= 19, "the true pose is among the answers in {in_answers}");
    assert!(best >= 15, "the best answer is right in {best}");
    assert!(answers <= 40, "{answers} answers in 20 sweeps");
}

#[test]
fn a_missing_file_is_named() {
    let missing = Path::new("missing.csv");
    let output = Command::new(env!("CARGO_BIN_EXE_sonarfix")).arg("find").arg(missing).output();
    let output = output.unwrap();
    assert!(!output.status.success());
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(text.contains("map.toml"), "{text}");
}
