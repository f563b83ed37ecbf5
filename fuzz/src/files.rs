//! The parsers of files and logs: an error has its position, and accepted input satisfies the rules on which other code relies.

use std::path::Path;

use sonarfix_hal::config::RobotConfig;
use sonarfix_map::{FileError, Floor, Scenario, robot_file as robot};
use sonarfix_replay::log::{self, Record};

/// A map file.
///
/// # Panics
/// If an invariant is violated.
pub fn map_file(bytes: &[u8]) {
    parse(bytes, |text| Floor::parse(text, "any.toml"), check_floor);
}

/// A scenario file.
///
/// # Panics
/// If an invariant is violated.
pub fn scenario_file(bytes: &[u8]) {
    // The files that it names do not exist.
    let base = Path::new("/nonexistent");
    parse(
        bytes,
        |text| Scenario::parse(text, "any.toml", base),
        |scenario| {
            check_floor(&scenario.floor);
            check_robot(&scenario.robot);
            assert!(scenario.path.duration().is_finite() && scenario.path.duration() >= 0.0);
            assert!(scenario.run.runs >= 1);
        },
    );
}

/// A robot file.
///
/// # Panics
/// If an invariant is violated.
pub fn robot_file(bytes: &[u8]) {
    parse(bytes, |text| robot::parse(text, "any.toml"), check_robot);
}

fn parse<T>(bytes: &[u8], parse: impl Fn(&str) -> Result<T, FileError>, check: impl Fn(&T)) {
    let Ok(text) = core::str::from_utf8(bytes) else { return };
    match parse(text) {
        Ok(parsed) => check(&parsed),
        Err(error) => {
            let text = error.to_string();
            assert!(text.starts_with("any.toml") || text.contains("/nonexistent"), "{text}");
        }
    }
}

fn check_floor(floor: &Floor) {
    let (walls, named) = (floor.walls(), floor.named_walls());
    assert_eq!(walls.len(), named.len());
    for wall in &walls {
        assert!(wall.length().is_finite() && wall.length().0 > 0.0);
        let normal = f64::from(wall.a()).hypot(f64::from(wall.b()));
        assert!((normal - 1.0).abs() < 1e-5, "{wall:?}");
    }
}

fn check_robot(robot: &RobotConfig) {
    assert_eq!(robot.check(), Ok(()));
}

/// A log, line by line.
///
/// # Panics
/// If an invariant is violated.
pub fn replay_log(bytes: &[u8]) {
    let Ok(text) = core::str::from_utf8(bytes) else { return };
    for line in text.lines() {
        match log::parse(line) {
            Ok(Some(record)) => check_record(&record),
            Ok(None) => {}
            Err(malformed) => assert!(!malformed.to_string().is_empty()),
        }
    }
}

fn check_record(record: &Record) {
    let (time, numbers) = match record {
        Record::Ticks { time, .. } | Record::Turn { time, .. } => (time, vec![]),
        Record::Wheels { time, right, left } => (time, vec![*right, *left]),
        Record::Range { time, bearing, range, .. } => (time, vec![*bearing, range.unwrap_or(0.0)]),
        Record::Absolute { time, age, .. } => (time, vec![*age]),
        Record::Scan { time, .. } | Record::Skip { time } => (time, vec![]),
        Record::Resume { time, state, deviation } | Record::Mode { time, state, deviation, .. } => {
            (time, state.iter().chain(deviation).copied().collect())
        }
        Record::Start { time, pose, position_deviation, heading_deviation }
        | Record::Pose { time, pose, position_deviation, heading_deviation } => {
            (time, vec![pose.x, pose.y, pose.heading, *position_deviation, *heading_deviation])
        }
    };
    assert!(time.is_finite() && time.abs() <= 1e10, "{record:?}");
    assert!(numbers.iter().all(|v| v.is_finite()), "{record:?}");
}
