//! Results on a full disk and of commands that are killed: the old file or the new one, whole, and an exit code that says which.

#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use crate::endings::{CLASSROOM, files, printing};

/// Commands with the option that names their result.
const RESULTS: [(&[&str], &str); 18] = [
    (&["run", CLASSROOM, "--runs", "1"], "--trace=FILES/result.csv"),
    (&["run", CLASSROOM, "--runs", "1"], "--out=FILES/result"),
    (&["run", CLASSROOM, "--runs", "1"], "--rows=FILES/new-rows.parquet"),
    (&["merge", "FILES/rows.csv"], "--rows=FILES/result.csv"),
    (&["merge", "FILES/rows.csv"], "--rows=FILES/result.parquet"),
    (&["replay", "FILES/log.csv"], "--trace=FILES/result.csv"),
    (&["calibrate", "FILES/drive.csv"], "--out=FILES/result.toml"),
    (&["calibrate", "FILES/drive.csv"], "--trajectory=FILES/result.csv"),
    (&["calibrate", "FILES/drive.csv"], "--residuals=FILES/result.svg"),
    (&["export", "FILES/log.csv"], "--mcap=FILES/result.mcap"),
    (&["export", "FILES/log.csv"], "--parquet=FILES/result.parquet"),
    (&["convert", "carmen", "FILES/carmen.log"], "--out=FILES/result"),
    (&["config", "bake", "tests/robot.toml"], "--out=FILES/result.bin"),
    (&["map", "bake", "FILES/map.toml"], "--out=FILES/result.bin"),
    (&["map", "draw", "FILES/map.toml"], "--out=FILES/result.svg"),
    (&["map", "simplify", "FILES/map.toml"], "--out=FILES/result.csv"),
    (&["map", "export", "FILES/map.toml"], "--out=FILES/result.yaml"),
    (&["map", "import", "FILES/room.geojson", "--unit", "m"], "--out=FILES/result.toml"),
];

/// The content of an old result.
const OLD: &[u8] = b"old";

/// The results in a folder, by their names.
fn results(dir: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(dir).unwrap().map(Result::unwrap) {
        let name = entry.file_name().into_string().unwrap();
        if entry.path().is_dir() && name == "result" {
            found.extend(
                results(&entry.path()).into_iter().map(|(of, text)| (format!("{name}/{of}"), text)),
            );
        } else if dir.ends_with("result") || name.contains("result") || name.contains("new-rows") {
            found.insert(name, without_cpu_time(fs::read(entry.path()).unwrap()));
        }
    }
    found
}

/// A report without the CPU time that its runs took.
fn without_cpu_time(text: Vec<u8>) -> Vec<u8> {
    let Ok(report) = str::from_utf8(&text) else { return text };
    let Some((before, after)) = report.split_once(" s of CPU time") else { return text };
    let before = before.trim_end_matches(|char: char| char.is_ascii_digit() || char == '.');
    [before, after].concat().into_bytes()
}

/// Makes the results old ones; a result that is resumed is removed.
fn age(dir: &Path, new: &BTreeMap<String, Vec<u8>>) {
    for name in results(dir).keys() {
        fs::remove_file(dir.join(name)).unwrap();
    }
    for name in new.keys().filter(|name| !name.contains("new-rows")) {
        fs::write(dir.join(name), OLD).unwrap();
    }
}

fn command(arguments: &[&str], result: &str, dir: &Path) -> Command {
    let mut command = printing(&[arguments, &[result]].concat(), dir);
    command.stdout(Stdio::null());
    command
}

fn has_extension(name: &str, extension: &str) -> bool {
    Path::new(name).extension().is_some_and(|it| it == extension)
}

/// Each result is whole: the old one or the new one; without an error all are new. What a killed command leaves beside them
/// is hidden.
fn assert_whole(what: &str, status: ExitStatus, dir: &Path, new: &BTreeMap<String, Vec<u8>>) {
    for (name, text) in results(dir).iter().filter(|(name, _)| !name.contains(".part")) {
        // The rows from which Parquet is made grow in a file of their own.
        let is_growing = name.ends_with(".parquet.csv");
        // An interrupted command reports the runs that have ended: another report, and a whole one.
        let is_report = has_extension(name, "html") && text.ends_with(b"</html>\n");
        let is_new = new.get(name) == Some(text);
        assert!(
            is_new || is_report || is_growing || text == OLD,
            "{what}: {name} is torn, {} bytes",
            text.len()
        );
        assert!(is_new || !status.success(), "{what}: {name} is not written: {status}");
    }
}

/// The results of a command that is neither stopped nor short of room, and how long it takes.
fn whole(arguments: &[&str], result: &str, dir: &Path) -> (BTreeMap<String, Vec<u8>>, Duration) {
    age(dir, &BTreeMap::new());
    let begun = Instant::now();
    assert!(command(arguments, result, dir).status().unwrap().success(), "{arguments:?} {result}");
    let new = results(dir);
    assert!(!new.is_empty(), "{arguments:?} {result}");
    (new, begun.elapsed())
}

/// A limit of the size of files fails as a full disk does, with another number.
#[cfg(unix)]
#[test]
fn on_a_full_disk_the_old_results_are_whole() {
    let files = files();
    let dir = files.path();
    for (arguments, result) in RESULTS {
        let (new, _) = whole(arguments, result, dir);
        for blocks in ["0", "1", "16"] {
            age(dir, &new);
            let full = command(arguments, result, dir);
            let mut limited = Command::new("sh");
            limited.args(["-c", "trap '' XFSZ; ulimit -f $0; exec \"$@\"", blocks]);
            limited.arg(full.get_program()).args(full.get_args());
            let output = limited.stdin(Stdio::null()).output().unwrap();
            let what = format!("{arguments:?} {result}, {blocks} blocks");
            assert_whole(&what, output.status, dir, &new);
            assert!(blocks != "0" || !output.status.success(), "{what}");
            let names: Vec<_> = results(dir).into_keys().collect();
            assert!(!names.iter().any(|name| has_extension(name, "part")), "{what}: {names:?}");
        }
    }
}

/// Killed, or ended by Ctrl-C, at moments from the start to the end of each command; `SONARFIX_MOMENTS` sets their number.
#[cfg(unix)]
#[test]
fn killed_commands_leave_whole_results() {
    let moments = std::env::var("SONARFIX_MOMENTS").map_or(4, |text| text.parse().unwrap());
    let files = files();
    let dir = files.path();
    for (arguments, result) in RESULTS {
        let (new, duration) = whole(arguments, result, dir);
        for moment in 0..moments {
            age(dir, &new);
            let mut child = command(arguments, result, dir).spawn().unwrap();
            std::thread::sleep(duration * moment / moments);
            let signal = if moment % 2 == 0 { "KILL" } else { "INT" };
            let id = child.id().to_string();
            // It may have ended already.
            let _ = Command::new("kill").args(["-s", signal, &id]).stderr(Stdio::null()).status();
            let status = child.wait().unwrap();
            assert_whole(&format!("{arguments:?} {result}, {signal} {moment}"), status, dir, &new);
        }
        let again = whole(arguments, result, dir).0;
        let changed: Vec<&String> = new
            .keys()
            .chain(again.keys())
            .filter(|name| again.get(*name) != new.get(*name))
            .collect();
        assert!(
            changed.is_empty(),
            "{arguments:?} {result}: what was left over changes the next result: {changed:?}"
        );
    }
}

/// A torn or changed row of a shard is named, and not taken for another number.
#[test]
fn merge_names_the_torn_row() {
    let files = files();
    let rows = files.path().join("rows.csv");
    let whole = fs::read_to_string(&rows).unwrap();
    let error = |text: &str| {
        fs::write(&rows, text).unwrap();
        let output = printing(&["merge", "FILES/rows.csv"], files.path()).output().unwrap();
        assert!(!output.status.success(), "{text}");
        String::from_utf8(output.stderr).unwrap()
    };
    let start = whole.len() - whole.lines().last().unwrap().len() - 1;
    for end in start + 1..whole.len() {
        let error = error(&whole[..end]);
        assert!(error.contains("shard 1/1") && error.contains("row 1: it is torn"), "{error}");
    }
    assert!(error(&whole[..start]).contains("0 of 1 rows"));
    let (head, last) = whole.split_at(start);
    let changed = last.replacen('.', ".1", 1);
    assert!(error(&format!("{head}{changed}")).contains("row 1: it is torn or changed"));
}

/// A recording is kept, unless it is to be replaced.
#[test]
fn a_recording_is_not_overwritten() {
    let files = files();
    let old = files.path().join("old.csv");
    fs::write(&old, OLD).unwrap();
    let record = ["monitor", "--port", "FILES/bytes", "--record", "FILES/old.csv"];
    let output = printing(&record, files.path()).stdout(Stdio::null()).output().unwrap();
    let errors = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success() && errors.contains("--force"), "{errors}");
    assert_eq!(fs::read(&old).unwrap(), OLD);
    let forced = [&record[..], &["--force"]].concat();
    assert!(printing(&forced, files.path()).stdout(Stdio::null()).status().unwrap().success());
}
