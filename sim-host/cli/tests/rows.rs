//! Many runs in parts: shards, interruptions, sweeps.

#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

const CLASSROOM: &str = include_str!("../../../crates/sonarfix-map/scenarios/classroom.toml");

/// A lap of the classroom.
fn scenario(dir: &Path) -> PathBuf {
    let file = dir.join("lap.toml");
    assert!(CLASSROOM.contains("laps = 7"));
    fs::write(&file, CLASSROOM.replace("laps = 7", "laps = 1")).unwrap();
    file
}

fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
    command.args(arguments).stdin(Stdio::null());
    command
}

/// Standard output, without the processor time.
fn printed(arguments: &[&str]) -> String {
    let output = command(arguments).output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {errors}");
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().filter(|line| !line.contains("cpu_seconds")).collect::<Vec<_>>().join("\n")
}

fn failure(arguments: &[&str]) -> String {
    let output = command(arguments).output().unwrap();
    assert!(!output.status.success(), "{arguments:?}");
    String::from_utf8(output.stderr).unwrap()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Eight shards, in both formats, give the statistics and the rows of one computation, to the bit; so do they if they are
/// merged in another order. A shard too few, or one twice, is an error.
#[test]
fn eight_shards_are_one_run() {
    let dir = tempfile::tempdir().unwrap();
    let scenario = scenario(dir.path());
    let run = ["run", text(&scenario), "--runs", "43", "--seed", "70", "--json"];
    let whole = dir.path().join("whole.csv");
    let once = printed(&run);
    assert_eq!(printed(&[&run[..], &["--rows", text(&whole)]].concat()), once);
    let shards: Vec<PathBuf> = (1..=8)
        .map(|index| {
            let ending = if index % 2 == 0 { "csv" } else { "parquet" };
            let file = dir.path().join(format!("shard-{index}.{ending}"));
            let shard = format!("{index}/8");
            printed(&[&run[..], &["--shard", &shard, "--rows", text(&file)]].concat());
            file
        })
        .collect();
    let mut files: Vec<&str> = shards.iter().rev().map(|file| text(file)).collect();
    let merged = dir.path().join("merged.csv");
    let merge = [&["merge", "--json", "--rows", text(&merged)], &files[..]].concat();
    // A merge reads no scenario that it could warn of.
    let statistics = once.replace("  \"warnings\": []\n", "");
    assert_ne!(statistics, once);
    assert_eq!(printed(&merge), statistics);
    assert!(fs::read(&merged).unwrap() == fs::read(&whole).unwrap(), "the rows differ");
    let parquet = dir.path().join("merged.parquet");
    printed(&["merge", text(&merged), "--rows", text(&parquet)]);
    assert_eq!(printed(&["merge", text(&parquet), "--json"]), statistics);

    files.pop();
    let missing = failure(&[&["merge"], &files[..]].concat());
    assert!(missing.contains("shard"), "{missing}");
    files.push(files[0]);
    assert!(failure(&[&["merge"], &files[..]].concat()).contains("shard"));
    let other_seed = ["run", text(&scenario), "--runs", "43", "--rows", text(&whole)];
    assert!(failure(&other_seed).contains("other runs"));
}

/// A computation that is killed, with its last line cut off, goes on where it was, to the same rows.
#[test]
fn a_killed_computation_is_resumed() {
    let dir = tempfile::tempdir().unwrap();
    let scenario = scenario(dir.path());
    let (once, killed) = (dir.path().join("once.csv"), dir.path().join("killed.csv"));
    let run = |file: &Path| {
        ["run", text(&scenario), "--runs", "900", "--json", "--rows", text(file)].map(str::to_owned)
    };
    let arguments = run(&killed);
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let mut child = command(&arguments).stdout(Stdio::null()).spawn().unwrap();
    let rows = |file: &Path| fs::read_to_string(file).map_or(0, |text| text.lines().count());
    while rows(&killed) < 100 {
        std::thread::sleep(Duration::from_millis(5));
        assert!(child.try_wait().unwrap().is_none(), "it ended before it could be killed");
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let left = rows(&killed);
    assert!(left < 900, "{left} rows: nothing is left to do");
    let length = fs::metadata(&killed).unwrap().len();
    fs::OpenOptions::new().write(true).open(&killed).unwrap().set_len(length - 7).unwrap();
    let resumed = printed(&arguments);
    let arguments = run(&once);
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    assert_eq!(resumed, printed(&arguments));
    assert!(fs::read(&killed).unwrap() == fs::read(&once).unwrap(), "the rows differ");
}

/// The worst seeds are those with the largest errors in the rows, and their traces are those of these seeds.
#[test]
fn the_worst_seeds_have_traces() {
    let dir = tempfile::tempdir().unwrap();
    let scenario = scenario(dir.path());
    let (rows, traces) = (dir.path().join("rows.csv"), dir.path().join("traces"));
    let run = ["run", text(&scenario), "--runs", "20", "--rows", text(&rows)];
    printed(&[&run[..], &["--worst", "2", "--traces", text(&traces)]].concat());
    let mut errors: Vec<(f64, String)> = fs::read_to_string(&rows)
        .unwrap()
        .lines()
        .skip(2)
        .map(|line| line.split(',').collect::<Vec<_>>())
        .map(|cells| (cells[cells.len() - 2].parse().unwrap(), cells[0].to_owned()))
        .collect();
    errors.sort_by(|one, other| other.0.total_cmp(&one.0));
    for (_, seed) in &errors[..2] {
        let alone = dir.path().join("alone.csv");
        let run = ["run", text(&scenario), "--runs", "1", "--seed", seed, "--trace", text(&alone)];
        printed(&run);
        let trace = fs::read(traces.join(format!("seed-{seed}.csv"))).unwrap();
        assert!(trace == fs::read(&alone).unwrap(), "the trace of seed {seed} differs");
    }
    assert_eq!(fs::read_dir(&traces).unwrap().count(), 2);
}

/// A sweep gives the results of the edited files; a range has its ends; a wrong key is named.
#[test]
fn a_sweep_is_a_run_of_each_edited_file() {
    let dir = tempfile::tempdir().unwrap();
    let scenario = scenario(dir.path());
    let out = dir.path().join("out");
    let runs = ["--runs", "3", "--seed", "5", "--json"];
    let sweep = ["run", text(&scenario), "--sweep", "sonar.noise=2mm..10mm:3"];
    let policies = ["--sweep", "schedule.policy=nearest,informative", "--out", text(&out)];
    let printed_points = printed(&[&sweep[..], &policies, &runs].concat());
    let points: serde_json::Value = serde_json::from_str(&printed_points).unwrap();
    assert_eq!(points.as_array().unwrap().len(), 6);
    assert!(fs::read_to_string(out.join("sweep.svg")).unwrap().contains("sonar.noise (mm)"));

    let text_of = fs::read_to_string(&scenario).unwrap();
    let edited = text_of.replace("noise = \"2 mm\"", "noise = \"6 mm\"");
    assert!(edited != text_of && edited.contains("policy = \"informative\""));
    fs::write(&scenario, edited.replace("policy = \"informative\"", "policy = \"nearest\""))
        .unwrap();
    let alone: serde_json::Value =
        serde_json::from_str(&printed_all(&[&["run", text(&scenario)], &runs[..]].concat()))
            .unwrap();
    // The noises are the slower ones: 2 mm with both policies, then 6 mm with the nearest.
    for key in ["rms_path", "states", "nis_mean", "fixes"] {
        assert_eq!(points[2][key], alone[key], "{key}");
    }
    let wrong = failure(&["run", text(&scenario), "--sweep", "sonar.nose=1mm,2mm"]);
    assert!(wrong.contains("robot.sonar.nose"), "{wrong}");
}

fn printed_all(arguments: &[&str]) -> String {
    String::from_utf8(command(arguments).output().unwrap().stdout).unwrap()
}
