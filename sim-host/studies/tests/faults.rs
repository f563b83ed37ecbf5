//! Hardware faults in the scenario `classroom`: the loop's reports, and the errors of the robot.
#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]

use std::sync::LazyLock;

use sonarfix_hal::robot::Faults;
use sonarfix_studies::fault_table::{self, Row};

const RUNS: u32 = 5;

static ROWS: LazyLock<Vec<Row>> = LazyLock::new(|| fault_table::rows(RUNS, &|| ()).unwrap());

fn row(name: &str) -> &'static Row {
    ROWS.iter().find(|row| row.name == name).unwrap()
}

/// The counter in every run.
fn counted(name: &str, count: fn(&Faults) -> u32) -> Vec<u32> {
    row(name).results.iter().map(|result| count(&result.faults)).collect()
}

#[test]
fn without_a_fault_the_loop_reports_none() {
    assert!(row("none").results.iter().all(|result| result.faults.is_none()));
}

#[test]
fn faults_that_a_driver_detects_are_reported() {
    // A stuck line is detected at every ping, 60 in 30 s.
    let stuck = counted("echo line stuck high", |faults| faults.ranger);
    assert!(stuck.iter().all(|&n| (30..=60).contains(&n)), "{stuck:?}");
    // A tenth of about 12,000 edges; two successive misses may cancel.
    let illegal = counted("a tenth of an encoder's edges missed", |f| f.right.illegal);
    assert!(illegal.iter().all(|&n| n > 100), "{illegal:?}");
    let untouched = counted("a tenth of an encoder's edges missed", |f| f.left.illegal);
    assert!(untouched.iter().all(|&n| n == 0), "{untouched:?}");
    let late = counted("polls up to 50 ms late", |faults| faults.deadlines);
    assert!(late.iter().all(|&n| n > 100), "{late:?}");
}

#[test]
fn the_robot_recovers_from_faults_other_than_of_odometry() {
    for name in [
        "none",
        "half of the echoes lost",
        "servo stuck",
        "servo three times as slow",
        "polls up to 50 ms late",
        "sonar dead",
        "encoder read errors",
        "all devices dead",
    ] {
        assert_eq!(row(name).recovered(), row(name).results.len(), "{name}");
    }
}

/// Without odometry the verdict is `Tracking` for at most 0.5 s and a tick of 0.1 s that a ping may have delayed; each failed
/// reading is counted.
#[test]
fn blindness_is_not_silent() {
    for name in ["encoder read errors", "all devices dead"] {
        let errors = counted(name, |faults| faults.right.errors + faults.left.errors);
        assert!(errors.iter().all(|&n| n >= 300), "{name}: {errors:?}");
        let none = row("none").longest_silence();
        let silence = row(name).longest_silence();
        // The end of a ping may differ by the flight time of an echo.
        let longest = none.max(0.7) + 0.01;
        assert!(silence <= longest, "{name}: {silence} s, without a fault {none} s");
    }
    for row in ROWS.iter() {
        assert!(row.longest_silence() <= 60.0, "{}: {}", row.name, row.longest_silence());
    }
}

/// With any fault, no run ends with the position error outside of the ellipse and the verdict
/// `Tracking` for longer than the 15 cycles, one each half second, of the detection time
/// (tests/kidnapped.rs).
#[test]
fn no_run_ends_with_an_undetected_error() {
    for row in ROWS.iter() {
        for (seed, result) in row.results.iter().enumerate() {
            let silence = result.integrity.undetected_at_end();
            assert!(silence <= 7.5, "{}, seed {seed}: {:?}", row.name, result.integrity);
        }
    }
    // The test is not vacuous: these faults do make the estimate diverge.
    for name in ["an encoder channel dead", "a tenth of an encoder's edges missed"] {
        assert!(row(name).recovered() < row(name).results.len(), "{name}");
    }
}
