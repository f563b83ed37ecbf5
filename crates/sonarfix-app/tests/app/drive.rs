//! The motion that the PC commands, and its dead-man; that of a robot that searches.

use sonarfix::geometry::units::{Duration, Metres, MetresPerSecond, RadiansPerSecond};
use sonarfix_hal::config::{MotorPolicy, RobotConfig, SearchMotion, SearchMotionKind, StartPose};
use sonarfix_link::message::{CommandError, CommandResult};
use sonarfix_link::{Command, Motion};

use crate::flash::SimFlash;
use crate::rig::{self, Baked, Bench, config};

const DONE: CommandResult = CommandResult::Done;
/// The longest time between two polls of a board whose motors are enabled, µs.
const BOARD_PERIOD: u64 = 10_000;

fn motion(speed: f32, turn: f32) -> Motion {
    Motion { speed: MetresPerSecond(speed), turn: RadiansPerSecond(turn) }
}

const AHEAD: Motion = Motion { speed: MetresPerSecond(0.2), turn: RadiansPerSecond(-0.5) };

/// A robot whose loop runs and whose motors are enabled.
fn running(baked: &Baked) -> Bench<'_> {
    let mut bench = rig::running(baked);
    bench.wait(200);
    assert!(bench.poll().may_drive);
    assert_eq!(bench.app.motion(), None);
    bench
}

/// Polls as a board does, until the robot has no motion or a second has passed; returns for how long it had one, µs.
fn drives_on(bench: &mut Bench) -> u64 {
    let since = bench.now();
    while bench.app.motion().is_some() && bench.now() < since + 1_000_000 {
        let next = bench.next_poll().clamp(bench.now() + 1, bench.now() + BOARD_PERIOD);
        bench.set_now(next - 1_000);
        let _ = bench.poll();
    }
    bench.now() - since
}

#[test]
fn a_robot_whose_link_is_cut_stops_within_350_ms_of_the_last_command() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    for renewals in 0..20 {
        for _ in 0..renewals {
            assert_eq!(bench.order(&Command::Drive(AHEAD)), DONE);
            assert_eq!(bench.app.motion(), Some(AHEAD));
            bench.wait(250);
            assert_eq!(bench.app.motion(), Some(AHEAD));
        }
        assert_eq!(bench.order(&Command::Drive(AHEAD)), DONE);
        bench.line.is_unplugged = true;
        let rolled_on = drives_on(&mut bench);
        // Not before the time that a program has for the next command, either.
        assert!((300_000..=350_000).contains(&rolled_on), "{rolled_on} µs");
        bench.wait(1_000);
        assert_eq!(bench.app.motion(), None);
        assert!(bench.app.is_running());
        bench.line.is_unplugged = false;
    }
}

/// A buffer that sends an old frame again and again does not drive the robot on.
#[test]
fn a_repeated_frame_does_not_renew_the_motion() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    let frame = bench.frame(&Command::Drive(AHEAD));
    bench.garble(&frame);
    assert_eq!(bench.poll().answered, Some(DONE));
    for _ in 0..2 {
        bench.wait(149);
        assert_eq!(bench.app.motion(), Some(AHEAD));
        bench.garble(&frame);
        assert_eq!(bench.poll().answered, Some(DONE), "the answer of the first one");
    }
    assert_eq!(bench.app.motion(), None);
}

#[test]
fn a_motion_that_the_robot_cannot_make_is_refused_and_changes_nothing() {
    let mut config = config();
    config.localizer.max_wheel_speed = MetresPerSecond(0.5);
    config.localizer.drive.track_width = Metres(0.2);
    let baked = Baked::new(&config);
    let mut bench = running(&baked);
    let refused = CommandResult::Refused(CommandError::Motion);
    assert_eq!(bench.order(&Command::Drive(AHEAD)), DONE);
    let (nan, infinite) = (f32::NAN, f32::INFINITY);
    let pairs = [(nan, 0.0), (0.0, nan), (infinite, 0.0), (0.0, -infinite), (infinite, infinite)];
    let too_fast =
        [(0.51, 0.0), (-0.51, 0.0), (0.0, 5.1), (0.3, 2.1), (0.3, -2.1), (f32::MAX, 1e9)];
    for (speed, turn) in pairs.into_iter().chain(too_fast) {
        assert_eq!(bench.order(&Command::Drive(motion(speed, turn))), refused, "{speed} {turn}");
        assert_eq!(bench.app.motion(), Some(AHEAD));
    }
    for (speed, turn) in [(0.5, 0.0), (-0.5, 0.0), (0.0, 4.9), (-0.3, 1.9), (0.0, 0.0)] {
        let motion = motion(speed, turn);
        assert_eq!(bench.order(&Command::Drive(motion)), DONE, "{speed} {turn}");
        assert_eq!(bench.app.motion(), Some(motion));
    }
}

#[test]
fn a_robot_that_waits_refuses_a_motion_and_a_stop_ends_it() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    assert_eq!(bench.order(&Command::Drive(AHEAD)), DONE);
    assert_eq!(bench.order(&Command::Stop), DONE);
    assert_eq!(bench.app.motion(), None);
    let waiting = CommandResult::Refused(CommandError::Waiting);
    assert_eq!(bench.order(&Command::Drive(AHEAD)), waiting);
    assert_eq!(bench.order(&Command::Start), DONE);
    // Started again in less than the time for which the motion would have lasted.
    bench.wait(150);
    assert!(bench.poll().may_drive);
    assert_eq!(bench.app.motion(), None);
}

#[test]
fn no_motion_is_commanded_while_the_motors_are_off() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    bench.hardware.right.0 = None;
    for _ in 0..20 {
        assert_eq!(bench.order(&Command::Drive(AHEAD)), DONE);
        bench.wait(100);
    }
    assert!(!bench.poll().may_drive);
    assert_eq!(bench.app.motion(), None);
}

/// A clock that is set back does not lengthen a motion.
#[test]
fn a_clock_that_is_set_back_ends_the_motion() {
    let link_timeout = Duration::from_ticks(60_000_000);
    let config = {
        let mut config = config();
        config.motors = MotorPolicy { link_timeout, ..MotorPolicy::DEFAULT };
        config
    };
    let baked = Baked::new(&config);
    let mut bench = running(&baked);
    bench.wait(5_000);
    assert_eq!(bench.order(&Command::Drive(AHEAD)), DONE);
    bench.set_now(0);
    let _ = (bench.poll(), bench.poll());
    assert_eq!(bench.app.motion(), None);
    assert_eq!(bench.order(&Command::Drive(AHEAD)), DONE);
    assert_eq!(bench.app.motion(), Some(AHEAD));
}

/// A robot without a pose that moves like this while it searches.
fn searching(kind: SearchMotionKind) -> Baked {
    let motion = SearchMotion { kind, bumper: Metres(0.3) };
    let start = StartPose::Exploring { region: None, motion };
    Baked::new(&RobotConfig { start, ..config() })
}

fn started(baked: &Baked) -> Bench<'_> {
    let mut bench = Bench::switched_on(baked, SimFlash::new());
    assert_eq!(bench.order(&Command::Start), DONE);
    bench
}

/// No wall answers. The motion is there from the first poll on, at rest; a command is obeyed first, and a pose ends it.
#[test]
fn a_robot_that_searches_drives_ahead_until_it_has_a_pose() {
    let baked = searching(SearchMotionKind::Ahead);
    let mut bench = started(&baked);
    bench.wait(200);
    assert_eq!(bench.app.motion(), Some(Motion::default()));
    for _ in 0..100 {
        bench.wait(100);
    }
    let ahead = bench.app.motion().unwrap();
    assert!(ahead.speed.0 > 0.0 && ahead.turn.0 == 0.0, "{ahead:?}");
    assert_eq!(bench.order(&Command::Drive(motion(0.0, 0.5))), DONE);
    assert_eq!(bench.app.motion(), Some(motion(0.0, 0.5)));
    bench.wait(400);
    assert_eq!(bench.app.motion(), Some(ahead));
    assert_eq!(bench.order(&Command::SetPose(rig::start())), DONE);
    bench.wait(100);
    assert_eq!(bench.app.motion(), None);
}

/// The wheels do not turn, as if they were blocked: it asks for the turn as long as it searches.
#[test]
fn a_robot_that_searches_turns_on_the_spot() {
    let baked = searching(SearchMotionKind::Spin);
    let mut bench = started(&baked);
    bench.wait(3_000);
    let turn = bench.app.motion().unwrap();
    assert!(turn.speed.0 == 0.0 && turn.turn.0 > 0.0, "{turn:?}");
    assert_eq!(bench.order(&Command::Stop), DONE);
    assert_eq!(bench.app.motion(), None);
}

#[test]
fn a_robot_whose_file_asks_for_no_motion_has_none() {
    let baked = Baked::new(&RobotConfig { start: StartPose::Unknown { region: None }, ..config() });
    let mut bench = started(&baked);
    bench.wait(5_000);
    assert_eq!(bench.app.motion(), None);
}

/// A sonar that does not respond finds no free floor.
#[test]
fn a_robot_without_a_sonar_does_not_drive() {
    let baked = searching(SearchMotionKind::Ahead);
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    bench.hardware.ranger.is_there = false;
    assert_eq!(bench.order(&Command::Start), DONE);
    for _ in 0..100 {
        bench.wait(100);
        assert!(bench.app.motion().is_none_or(|motion| motion == Motion::default()));
    }
}
