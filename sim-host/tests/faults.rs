//! One fault at a time in the classroom: what the loop reports, and what becomes of the robot.
#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]

use std::sync::LazyLock;

use sonarfix_hal::robot::Faults;
use sonarfix_sim::fault_table::{self, Row};

const RUNS: u64 = 5;

static ROWS: LazyLock<Vec<Row>> = LazyLock::new(|| fault_table::rows(RUNS).unwrap());

fn row(name: &str) -> &'static Row {
    ROWS.iter().find(|row| row.name == name).unwrap()
}

/// In every run, what the counter holds.
fn counted(name: &str, count: fn(&Faults) -> u32) -> Vec<u32> {
    row(name).results.iter().map(|result| count(&result.faults)).collect()
}

#[test]
fn without_a_fault_the_loop_reports_none() {
    assert!(row("none").results.iter().all(|result| result.faults.is_none()));
}

#[test]
fn what_a_driver_can_notice_is_reported() {
    // A stuck line is found at every ping, of which 30 s have 60.
    let stuck = counted("echo line stuck high", |faults| faults.ranger);
    assert!(stuck.iter().all(|&n| (30..=60).contains(&n)), "{stuck:?}");
    // A tenth of some 12,000 edges; two misses in a row may pass for none.
    let illegal = counted("a tenth of an encoder's edges missed", |f| f.right.illegal);
    assert!(illegal.iter().all(|&n| n > 100), "{illegal:?}");
    let untouched = counted("a tenth of an encoder's edges missed", |f| f.left.illegal);
    assert!(untouched.iter().all(|&n| n == 0), "{untouched:?}");
    let late = counted("polls up to 50 ms late", |faults| faults.deadlines);
    assert!(late.iter().all(|&n| n > 100), "{late:?}");
}

#[test]
fn the_robot_recovers_from_what_leaves_it_its_odometry() {
    for name in [
        "none",
        "half of the echoes lost",
        "servo stuck",
        "servo three times as slow",
        "polls up to 50 ms late",
    ] {
        assert_eq!(row(name).recovered(), row(name).results.len(), "{name}");
    }
}

/// Whatever fails, no run ends with the robot elsewhere than it claims and health content for longer
/// than the 15 looks, one each half second, that health may need to judge (tests/kidnapped.rs).
#[test]
fn no_run_ends_in_a_silent_error() {
    for row in ROWS.iter() {
        for (seed, result) in row.results.iter().enumerate() {
            let silence = result.claim.silence_at_the_end();
            assert!(silence <= 7.5, "{}, seed {seed}: {:?}", row.name, result.claim);
        }
    }
    // There is something to be silent about: these faults do lead the robot astray.
    for name in ["an encoder channel dead", "a tenth of an encoder's edges missed"] {
        assert!(row(name).recovered() < row(name).results.len(), "{name}");
    }
}
