//! A virtual robot by its own time, without a port.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test should stop")]

#[path = "support/bench.rs"]
mod bench;

use sonarfix::geometry::units::{MetresPerSecond, RadiansPerSecond};
use sonarfix_link::message::CommandError;
use sonarfix_link::{Command, CommandResult, Motion, Telemetry};
use sonarfix_sim::trace::Pose;
use sonarfix_virtual_robot::robot::Parts;

use bench::{Bench, SECOND};

const AHEAD: Motion = Motion { speed: MetresPerSecond(0.2), turn: RadiansPerSecond(0.5) };

fn classroom() -> Parts {
    Parts::new(bench::classroom()).unwrap()
}

fn distance(one: Pose, other: Pose) -> f64 {
    (one.x - other.x).hypot(one.y - other.y)
}

/// The dead-man down to the wheels: 350 ms after the last command they do not roll any more.
#[test]
fn the_wheels_stop_within_350_ms_of_the_last_command() {
    let parts = classroom();
    let mut bench = Bench::new(&parts, 1, true);
    bench.run(parts.start().unwrap());
    let begin = bench.robot.pose();
    for _ in 0..20 {
        assert_eq!(bench.order(&Command::Drive(AHEAD)), CommandResult::Done);
        bench.wait(100_000);
    }
    assert!(distance(begin, bench.robot.pose()) > 0.2);
    assert_eq!(bench.order(&Command::Drive(AHEAD)), CommandResult::Done);
    let cut = bench.robot.pose();
    bench.wait(250_000);
    let late = bench.robot.pose();
    assert!(distance(cut, late) > 0.04, "it still drives after 250 ms");
    bench.wait(100_000);
    let stopped = bench.robot.pose();
    bench.wait(5 * SECOND);
    assert_eq!(bench.robot.pose(), stopped);
}

#[test]
fn a_robot_waits_for_commands_and_then_tracks_the_commanded_motion() {
    let parts = classroom();
    let mut bench = Bench::new(&parts, 1, true);
    // `Hello` comes every ten seconds.
    let telemetry = bench.wait(11 * SECOND);
    assert!(telemetry.iter().any(|message| matches!(message, Telemetry::Hello(_))));
    assert!(!telemetry.iter().any(|message| matches!(message, Telemetry::Estimate(_))));
    let waiting = CommandResult::Refused(CommandError::Waiting);
    assert_eq!(bench.order(&Command::Drive(AHEAD)), waiting);
    bench.run(parts.start().unwrap());
    for _ in 0..100 {
        assert_eq!(bench.order(&Command::Drive(AHEAD)), CommandResult::Done);
        bench.wait(100_000);
    }
    let estimate = bench.wait(SECOND).into_iter().rev().find_map(|message| match message {
        Telemetry::Estimate(estimate) => Some(estimate.state),
        _ => None,
    });
    let (estimate, truth) = (estimate.unwrap(), bench.robot.pose());
    let error = (f64::from(estimate.x.0) - truth.x).hypot(f64::from(estimate.y.0) - truth.y);
    // Ten seconds of 0.2 m/s with bad wheels: the estimate is within its few centimetres.
    assert!(error < 0.1, "{error}");
}

#[test]
fn without_a_command_it_follows_the_path_of_the_scenario_or_stands() {
    let parts = classroom();
    let driven = [true, false].map(|stands| {
        let mut bench = Bench::new(&parts, 1, stands);
        bench.run(parts.start().unwrap());
        let begin = bench.robot.pose();
        bench.wait(5 * SECOND);
        let driven = distance(begin, bench.robot.pose());
        if !stands {
            // A motion takes it off the path, and later it goes on along it.
            for _ in 0..10 {
                let back = Motion { speed: MetresPerSecond(-0.2), ..Motion::default() };
                assert_eq!(bench.order(&Command::Drive(back)), CommandResult::Done);
                bench.wait(100_000);
            }
            let there = bench.robot.pose();
            assert_eq!(bench.order(&Command::Drive(Motion::default())), CommandResult::Done);
            bench.wait(SECOND / 4);
            assert!(distance(there, bench.robot.pose()) < 0.02, "a commanded stand is a stand");
            bench.wait(5 * SECOND);
            assert!(distance(there, bench.robot.pose()) > 0.8);
        }
        driven
    });
    let [standing, following] = driven;
    assert!(standing < 1e-9 && (0.8..1.1).contains(&following), "{driven:?}");
}

#[test]
fn a_stopped_loop_stops_the_wheels() {
    let parts = classroom();
    let mut bench = Bench::new(&parts, 1, false);
    bench.run(parts.start().unwrap());
    assert_eq!(bench.order(&Command::Stop), CommandResult::Done);
    let there = bench.robot.pose();
    bench.wait(5 * SECOND);
    assert_eq!(bench.robot.pose(), there);
}
