//! Bags of ROS 2 by the command: a log as a bag and back, and what is not replaced.
#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]

use std::path::Path;
use std::process::Command;

use crate::endings;

/// Runs the command; its standard error, and whether it succeeded.
fn run(arguments: &[&str], folder: &Path) -> (bool, String) {
    let path = |argument: &&str| argument.replace("FILES", &folder.display().to_string());
    let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
    let output = command.args(arguments.iter().map(path)).output().unwrap();
    (output.status.success(), String::from_utf8_lossy(&output.stderr).into_owned())
}

/// A bag of a log is converted into a log that replays, and neither is replaced without `--force`.
#[test]
fn a_log_becomes_a_bag_and_a_log_again() {
    let files = endings::files();
    let folder = files.path();
    let back = ["convert", "rosbag", "FILES/recorded", "--out", "FILES/back"];
    let (converted, report) = run(&back, folder);
    assert!(
        converted && report.contains("2 encoder records") && report.contains("1 ranges"),
        "{report}"
    );
    std::fs::copy(folder.join("map.toml"), folder.join("back/map.toml")).unwrap();
    assert!(run(&["replay", "FILES/back/log.csv"], folder).0);
    for again in [back.as_slice(), &["export", "FILES/pings.csv", "--rosbag", "FILES/recorded"]] {
        let (replaced, error) = run(again, folder);
        assert!(!replaced && error.contains("--force"), "{error}");
        let forced = [again, &["--force"]].concat();
        assert!(run(&forced, folder).0, "{forced:?}");
    }
    // A file of the bag alone is a bag, too.
    let file = "FILES/recorded/recorded_0.mcap";
    assert!(run(&["convert", "rosbag", file, "--out", "FILES/alone"], folder).0);
    let [one, other] = ["back", "alone"].map(|name| folder.join(name).join("log.csv"));
    assert_eq!(std::fs::read(one).unwrap(), std::fs::read(other).unwrap());
}

/// A trace has no ranges; a file that is no bag is named with what it is not.
#[test]
fn what_is_no_bag_is_refused() {
    let files = endings::files();
    let trace = ["run", endings::CLASSROOM, "--runs", "1", "--trace", "FILES/trace.csv"];
    assert!(run(&trace, files.path()).0);
    let map = ["--map", endings::CLASSROOM, "--rosbag", "FILES/none"];
    let (exported, error) =
        run(&[["export", "FILES/trace.csv"].as_slice(), &map].concat(), files.path());
    assert!(!exported && error.contains("is a trace"), "{error}");
    let (converted, error) =
        run(&["convert", "rosbag", "FILES/robot.toml", "--out", "FILES/x"], files.path());
    assert!(!converted && error.contains("robot.toml: is no file of a bag"), "{error}");
}
