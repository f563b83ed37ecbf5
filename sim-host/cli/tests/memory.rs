//! The memory of a replay does not grow with the log. The only test of its program, because it
//! measures the memory of the whole process.
#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]

mod common;
mod skipped;

use sonarfix_map::{Floor, robot_file};
use sonarfix_replay::Replay;
use sonarfix_replay::thinned::Thinned;

use common::{Endless, MAP, ROBOT, Sonar, second};

const CAPACITY: usize = 1000;

/// Peak memory of this process, bytes.
fn peak() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kilobytes: u64 = line.split_ascii_whitespace().nth(1)?.parse().ok()?;
    Some(kilobytes * 1024)
}

fn replay(seconds: u32) {
    let floor = Floor::parse(MAP, "map.toml").unwrap();
    let robot = robot_file::parse(ROBOT, "robot.toml").unwrap();
    let walls = floor.walls();
    let mut trace = Thinned::new(&floor, robot.localizer.rangers.first.cone, CAPACITY);
    let log = Endless::new(seconds, |s| second(s, Sonar::Scans).0);
    let reference = Endless::new(seconds, |s| second(s, Sonar::Scans).1);
    let replay = Replay { robot: &robot, walls: &walls, strict: true, pings_per_scan: 1 };
    let summary = replay.run(log, Some(reference), &mut trace, &mut |_| {}).unwrap();
    assert_eq!(summary.encoder_records, u64::from(seconds) * 10);
    assert!(summary.position_rms.unwrap() < 0.01, "{summary:?}");
    let (ticks, fixes) = (trace.trace().ticks.len(), trace.trace().fixes.len());
    assert!(ticks <= CAPACITY && fixes <= CAPACITY, "{ticks} ticks, {fixes} fixes");
    assert!(ticks >= CAPACITY / 2 && fixes >= CAPACITY / 4, "{ticks} ticks, {fixes} fixes");
}

#[test]
fn memory_does_not_grow_with_the_log() {
    replay(5 * 60);
    let Some(before) = peak() else {
        skipped::because("the memory test: this system has no /proc/self/status");
        return;
    };
    replay(75 * 60);
    let grown = peak().unwrap() - before;
    // The log is 40 MB, its encoder records alone 1 MB, the reference 3 MB.
    assert!(grown < 400_000, "{grown} bytes more");
}
