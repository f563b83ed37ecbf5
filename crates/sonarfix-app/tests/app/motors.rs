//! The motor policy: when the motors are enabled.

use sonarfix::geometry::units::Duration;
use sonarfix::health::Verdict;
use sonarfix_hal::config::MotorPolicy;
use sonarfix_link::Command;
use sonarfix_link::message::CommandResult;

use crate::flash::SimFlash;
use crate::rig::{Baked, Bench, config, start};

/// A robot with this policy that has just been started.
fn baked(motors: MotorPolicy) -> Baked {
    let mut config = config();
    config.motors = motors;
    Baked::new(&config)
}

fn started(baked: &Baked) -> Bench<'_> {
    let mut bench = Bench::switched_on(baked, SimFlash::new());
    assert!(!bench.poll().may_drive);
    for command in [Command::SetPose(start()), Command::Start] {
        assert_eq!(bench.order(&command), CommandResult::Done);
    }
    bench.wait(200);
    assert!(bench.poll().may_drive);
    bench
}

/// Whether the motors are enabled with the encoders dead for 1 s, which is `Degraded`, and for 4 s, which is `Lost`.
fn with_dead_encoders(motors: MotorPolicy) -> [bool; 2] {
    let baked = baked(motors);
    let mut bench = started(&baked);
    let counts = (bench.hardware.right.0.take(), bench.hardware.left.0.take());
    let enabled = [1_000, 3_000].map(|millis| {
        bench.wait(millis);
        bench.poll().may_drive
    });
    assert_eq!(bench.estimate().health.verdict, Verdict::Lost);
    // The counters return all travel: what is left is the verdict.
    (bench.hardware.right.0, bench.hardware.left.0) = counts;
    bench.wait(200);
    assert_eq!(bench.poll().may_drive, motors.lost);
    assert_eq!(bench.order(&Command::SetPose(start())), CommandResult::Done);
    assert!(bench.poll().may_drive);
    assert_eq!(bench.order(&Command::Stop), CommandResult::Done);
    assert!(!bench.poll().may_drive);
    enabled
}

#[test]
fn each_situation_has_its_own_switch() {
    let on = MotorPolicy { dead_encoder: true, ..MotorPolicy::DEFAULT };
    assert_eq!(with_dead_encoders(MotorPolicy::DEFAULT), [false, false]);
    assert_eq!(with_dead_encoders(on), [true, true]);
    assert_eq!(with_dead_encoders(MotorPolicy { lost: false, ..on }), [true, false]);
}

#[test]
fn a_lost_link_stops_the_motors_if_the_policy_says_so() {
    let link_timeout = Duration::from_ticks(500_000);
    for lost_link in [true, false] {
        let baked = baked(MotorPolicy { lost_link, link_timeout, ..MotorPolicy::DEFAULT });
        let mut bench = started(&baked);
        // Any command counts, and noise does not.
        for _ in 0..10 {
            bench.wait(400);
            assert!(matches!(bench.order(&Command::MapChecksum), CommandResult::Map(_)));
            assert!(bench.poll().may_drive);
        }
        bench.garble(&[0x55; 40]);
        bench.wait(490);
        assert!(bench.poll().may_drive);
        bench.garble(&[0x55, 0]);
        bench.wait(20);
        assert_eq!(bench.poll().may_drive, lost_link);
        assert!(bench.app.is_running());
        bench.send(&Command::MapChecksum);
        assert!(bench.poll().may_drive);
    }
}

/// A clock that is set back does not begin the time-out of the link anew; one that is set ahead ends it.
#[test]
fn a_lost_link_stops_the_motors_over_a_leap_of_the_clock() {
    let link_timeout = Duration::from_ticks(2_000_000);
    let baked = baked(MotorPolicy { lost_link: false, link_timeout, ..MotorPolicy::DEFAULT });
    for (clock, drives_on) in [(0, true), (3_600_000_000, false)] {
        let mut bench = started(&baked);
        bench.send(&Command::MapChecksum);
        bench.wait(1_500);
        assert!(bench.poll().may_drive);
        bench.set_now(clock);
        bench.wait(400);
        assert_eq!(bench.poll().may_drive, drives_on, "at {clock}");
        bench.wait(200);
        assert!(!bench.poll().may_drive, "at {clock}");
    }
}

/// A clock that is set back while an encoder cannot be read does not enable the motors.
#[test]
fn dead_encoders_stop_the_motors_over_a_leap_of_the_clock() {
    let baked = baked(MotorPolicy::DEFAULT);
    let mut bench = started(&baked);
    bench.hardware.right.0 = None;
    bench.wait(700);
    assert!(!bench.poll().may_drive);
    bench.set_now(0);
    for _ in 0..1_000 {
        assert!(!bench.poll().may_drive);
    }
}

/// A clock of which each reading is another time says nothing about the age of an estimate.
#[test]
fn a_clock_that_always_leaps_stops_the_motors() {
    let baked = baked(MotorPolicy::DEFAULT);
    let mut bench = started(&baked);
    for poll in 1..20 {
        bench.set_now((1 << 40) * (20 - poll));
        assert_eq!(bench.poll().may_drive, poll == 1, "poll {poll}");
    }
}
