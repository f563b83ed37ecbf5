//! What a poll, a record and a status state, each exactly when it is true.

use sonarfix::filter::ekf::{StandardDeviations, StateEstimate};
use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Duration, Instant, Metres, Radians};
use sonarfix::health::Verdict;
use sonarfix::localizer::{Localizer, Start};
use sonarfix::map::Map;
use sonarfix_app::store::{Resumed, SavePolicy, Saved, Store, WriteLimit};
use sonarfix_link::message::{CommandError, CommandResult};
use sonarfix_link::{Command, Telemetry};

use crate::flash::{SECTOR, SECTORS, SimFlash};
use crate::rig::{Baked, Bench, config, loop_status, start};
use crate::room::Truth;

const DONE: CommandResult = CommandResult::Done;

/// A robot that waits, with a pose.
fn waiting(baked: &Baked) -> Bench<'_> {
    let mut bench = Bench::switched_on(baked, SimFlash::new());
    assert_eq!(bench.order(&Command::SetPose(start())), DONE);
    bench
}

fn running(baked: &Baked) -> Bench<'_> {
    let mut bench = waiting(baked);
    assert_eq!(bench.order(&Command::Start), DONE);
    bench
}

fn record(bench: &Bench) -> Option<Saved> {
    let flash = bench.app.store().flash().clone();
    Store::new(flash, 0..(SECTOR * SECTORS) as u32).unwrap().load().unwrap()
}

#[test]
fn a_poll_states_changes_when_they_happen() {
    let baked = Baked::new(&config());
    let mut bench = waiting(&baked);
    for command in [Command::Start, Command::Stop] {
        let was_running = bench.app.is_running();
        bench.send(&command);
        let polls: Vec<_> = (0..20).map(|_| bench.poll()).collect();
        let changes: Vec<_> = polls.iter().filter(|polled| polled.has_changed).collect();
        let [change] = changes.as_slice() else { panic!("{changes:?}") };
        assert_eq!(change.answered, Some(DONE));
        assert_eq!(change.is_running, !was_running);
    }
}

#[test]
fn a_poll_states_the_verdict_when_it_changes() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    bench.wait(1_000);
    bench.hardware.right.0 = None;
    let mut last = Verdict::Tracking;
    let mut changes = vec![];
    for _ in 0..5_000 {
        let polled = bench.poll();
        let verdict = bench.app.localizer().unwrap().health().verdict;
        assert_eq!(polled.verdict, (verdict != last).then_some(verdict));
        changes.extend(polled.verdict);
        last = verdict;
    }
    assert_eq!(changes, [Verdict::Degraded, Verdict::Lost]);
}

#[test]
fn the_longest_poll_is_reported() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    for millis in [3, 7, 5] {
        bench.app.took(Duration::from_ticks(millis * 1_000));
    }
    assert_eq!(loop_status(&bench.wait(1_200)).worst_poll, Duration::from_ticks(7_000));
}

/// A robot that stands between its stops, while encoder samples arrive, has not rolled.
#[test]
fn stops_of_a_standing_robot_equal_one() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    let mut stop = || {
        assert_eq!(bench.order(&Command::Stop), DONE);
        assert_eq!(bench.order(&Command::Start), DONE);
        bench.wait(1_000);
        bench.estimate().deviation
    };
    let once = stop();
    for _ in 0..5 {
        assert_eq!(stop(), once);
    }
}

/// Whichever wheel rolls, the new pose is kept.
#[test]
fn one_wheel_that_rolls_is_enough() {
    let baked = Baked::new(&config());
    for (right, left) in [(60, 0), (0, 60), (-60, 0), (0, -60)] {
        let mut bench = running(&baked);
        bench.wait(500);
        bench.roll(right, left);
        bench.wait(500);
        let before = bench.estimate().state;
        assert_ne!(before.heading, start().pose.heading.radians());
        assert_eq!(bench.order(&Command::Stop), DONE);
        assert_eq!(bench.order(&Command::Start), DONE);
        assert_eq!(bench.estimate().state.heading, before.heading);
    }
}

/// The record that is written because the calibration has improved.
#[test]
fn the_record_of_a_running_robot_is_not_parked() {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    bench.truth = Some(Truth::at(&start()));
    for command in [Command::SetPose(start()), Command::Start] {
        assert_eq!(bench.order(&command), DONE);
    }
    bench.wait(500);
    let parked = record(&bench);
    let mut written = None;
    for leg in 0..60_i16 {
        // A metre ahead and back, and a pause.
        for millis in 0..4_000_i16 {
            let edges = if leg % 2 == 0 { 1 } else { -1 };
            bench.roll(edges * i16::from(millis % 2 == 0), edges * i16::from(millis % 2 == 0));
            let _ = bench.poll();
        }
        bench.wait(3_000);
        written = record(&bench).filter(|saved| Some(*saved) != parked);
        if written.is_some() {
            break;
        }
    }
    let written = written.expect("the range scale is known better after some metres");
    assert!(!written.is_parked && bench.app.is_running(), "{written:?}");
    let age = bench.now / 1_000_000 - u64::from(written.seconds);
    assert!(age <= 4, "written {age} s ago");
    assert_eq!(bench.order(&Command::Stop), DONE);
    bench.wait(61_000);
    let parked = record(&bench).unwrap();
    assert!(parked.is_parked && parked.seconds > written.seconds, "{parked:?}");
}

#[test]
fn a_pose_without_a_number_is_refused() {
    let baked = Baked::new(&config());
    let mut bench = waiting(&baked);
    let known = bench.app.known().copied();
    for (x, y, heading) in [(f32::NAN, 0.0, 0.0), (0.0, f32::INFINITY, 0.0), (0.0, 0.0, f32::NAN)] {
        let pose = Pose::new(x, y, Radians(heading));
        let command = Command::SetPose(Start { pose, ..start() });
        let refused = CommandResult::Refused(CommandError::Pose);
        assert_eq!(bench.order(&command), refused, "{x} {y}");
        assert_eq!(bench.app.known().copied(), known);
    }
}

/// The devices of a robot that waits are checked once a second.
#[test]
fn a_waiting_robot_checks_its_devices_once_a_second() {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    let before = loop_status(&bench.wait(1_100)).faults;
    bench.hardware.right.0 = None;
    // An echo that takes a minute: the ranger never ends its ping.
    bench.hardware.ranger.echo = Some(Metres(1e4));
    let after = loop_status(&bench.wait(10_000)).faults;
    let (errors, silent) = (after.right.errors - before.right.errors, after.ranger - before.ranger);
    assert!((8..=10).contains(&errors), "{errors}");
    assert!((8..=10).contains(&silent), "{silent}");
}

/// A ranger that is being set up refuses triggers for a while, and one that is broken forever.
#[test]
fn a_trigger_that_is_too_soon_is_repeated_every_millisecond() {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    bench.wait(1_100);
    let before = loop_status(&bench.wait(1_100)).faults;
    bench.hardware.ranger.refusals = 20;
    bench.hardware.ranger.echo = Some(Metres(1e4));
    let pinged = (0..1_100).any(|_| {
        bench.wait(1);
        bench.hardware.ranger.is_pinging()
    });
    assert!(pinged && bench.hardware.ranger.refusals == 0);
    bench.hardware.ranger.echo = None;
    bench.wait(1_100);
    bench.hardware.ranger.refusals = u32::MAX;
    let after = loop_status(&bench.wait(10_000)).faults;
    // The ping without an end, and each check.
    assert!((8..=11).contains(&(after.ranger - before.ranger)), "{}", after.ranger);
}

#[test]
fn a_long_pause_permits_a_burst_of_writes_and_no_more() {
    let second = |seconds: u64| Instant::from_ticks(seconds * 1_000_000);
    let mut limit = WriteLimit::new(second(0));
    assert_eq!((0..200).filter(|_| limit.take(second(10_000), 0)).count(), 120);
    assert_eq!((0..200).filter(|_| limit.take(second(1_000_000), 0)).count(), 120);
}

/// Each deviation of the calibration is a reason to write.
#[test]
fn an_improvement_of_any_one_is_written() {
    let config = config().localizer;
    let written = Resumed::afresh(&config).deviation;
    let is_due = |better: StandardDeviations| {
        let (map, start) = (Map::new(&[]), Instant::from_ticks(0));
        let localizer =
            Localizer::resume(config, map, StateEstimate::default(), better, start).unwrap();
        SavePolicy::new(start, written).is_due(Instant::from_ticks(100_000_000), &localizer)
    };
    assert!(!is_due(written));
    let half = |metres: Metres| Metres(0.5 * metres.0);
    let track_width_error = half(written.track_width_error);
    assert!(is_due(StandardDeviations { scale_right: 0.5 * written.scale_right, ..written }));
    assert!(is_due(StandardDeviations { scale_left: 0.5 * written.scale_left, ..written }));
    assert!(is_due(StandardDeviations { track_width_error, ..written }));
    assert!(is_due(StandardDeviations { range_scale: 0.5 * written.range_scale, ..written }));
}

/// A robot that stands learns nothing and writes nothing.
#[test]
fn a_standing_robot_writes_nothing() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    bench.wait(2_000);
    let written = bench.app.store().flash().written;
    bench.wait(180_000);
    assert_eq!(bench.app.store().flash().written, written);
}

/// While commands come faster than they may be written, the record of the flash has the newest pose or is not parked.
#[test]
fn a_parked_record_has_the_newest_pose() {
    let baked = Baked::new(&config());
    let mut bench = waiting(&baked);
    let mut written = 0;
    for number in 0..160_u8 {
        let x = 1.0 + f32::from(number);
        let pose = Pose::new(x, 1.5, Radians(0.5));
        assert_eq!(bench.order(&Command::SetPose(Start { pose, ..start() })), DONE);
        let Some(saved) = record(&bench) else { continue };
        let is_newest = saved.state.x == Metres(x);
        assert!(is_newest || !saved.is_parked, "{number}: {saved:?}");
        written += u32::from(is_newest && saved.is_parked);
    }
    assert!((110..=122).contains(&written), "{written}");
    bench.wait(200_000);
    let saved = record(&bench).unwrap();
    assert!(saved.is_parked && saved.state.x == Metres(160.0), "{saved:?}");
}

/// Each deviation of a pose has its own limit.
#[test]
fn a_pose_with_one_deviation_beyond_its_limit_is_refused() {
    let baked = Baked::new(&config());
    let mut bench = waiting(&baked);
    for (position, heading, is_refused) in [
        (1_000.0, 3.1, false),
        (0.0, 0.0, false),
        (1_000.1, 0.1, true),
        (0.1, 3.15, true),
        (-1e-3, 0.1, true),
        (0.1, -1e-3, true),
        (f32::NAN, 0.1, true),
        (0.1, f32::NAN, true),
    ] {
        let (position_deviation, heading_deviation) = (Metres(position), Radians(heading));
        let command = Command::SetPose(Start { position_deviation, heading_deviation, ..start() });
        let expected = if is_refused { CommandResult::Refused(CommandError::Pose) } else { DONE };
        assert_eq!(bench.order(&command), expected, "{position} {heading}");
    }
}

/// The travel up to a new pose is sent before the pose.
#[test]
fn the_travel_before_a_new_pose_is_sent() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    bench.wait(1_030);
    bench.roll(30, 20);
    bench.received();
    bench.send(&Command::SetPose(start()));
    let messages = bench.wait(5);
    let at = |wanted: fn(&Telemetry) -> bool| messages.iter().position(wanted);
    let odometry = at(|message| matches!(message, Telemetry::Odometry(_))).unwrap();
    let set = at(|message| matches!(message, Telemetry::PoseSet(_))).unwrap();
    assert!(odometry < set, "{messages:?}");
    let (Telemetry::Odometry(step), Telemetry::PoseSet(estimate)) =
        (messages[odometry], messages[set])
    else {
        panic!("{messages:?}");
    };
    assert_eq!(step.at, estimate.at);
    assert!(step.right_metres > step.left_metres && step.left_metres > 0.0, "{step:?}");
}

/// A calibration that is reset while the loop runs interrupts no pose.
#[test]
fn a_reset_calibration_leaves_the_pose_known() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    bench.wait(1_000);
    let before = bench.estimate();
    assert_eq!(bench.order(&Command::ResetCalibration), DONE);
    let after = bench.estimate();
    assert_eq!(after.state.x, before.state.x);
    assert!(after.deviation.x.0 <= before.deviation.x.0 * 1.01, "{after:?}");
    assert!(after.deviation.heading.0 <= before.deviation.heading.0 * 1.01, "{after:?}");
}
