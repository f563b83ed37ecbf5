//! The readings of the devices of a robot that waits: signs of life.

use sonarfix::geometry::units::Radians;
use sonarfix_hal::config::RobotConfig;
use sonarfix_hal::ranger::NoEcho;
use sonarfix_link::message::{CommandError, CommandResult, DeviceReadings, Sweep};
use sonarfix_link::{Command, Telemetry};

use crate::flash::SimFlash;
use crate::rig::{Baked, Bench, config, start};
use crate::room::Truth;

const DONE: CommandResult = CommandResult::Done;

fn readings(messages: &[Telemetry]) -> Vec<DeviceReadings> {
    let devices = messages.iter().filter_map(|message| match message {
        Telemetry::Devices(readings) => Some(*readings),
        _ => None,
    });
    devices.collect()
}

fn sweeps(messages: &[Telemetry]) -> Vec<Sweep> {
    let pings = messages.iter().filter_map(|message| match message {
        Telemetry::Sweep(ping) => Some(*ping),
        _ => None,
    });
    pings.collect()
}

/// A robot whose left wheel is mirrored.
fn mirrored() -> RobotConfig {
    let config = config();
    RobotConfig { left_wheel: config.left_wheel.mirrored(), ..config }
}

#[test]
fn readings_are_those_of_the_devices() {
    let baked = Baked::new(&mirrored());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    assert!(readings(&bench.wait(2_000)).is_empty(), "nobody has asked");
    // It stands 3 m before a wall.
    bench.truth = Some(Truth { x: 1.0, y: 1.5, heading: 0.0 });
    assert_eq!(bench.order(&Command::ShowDevices), DONE);
    let ping = readings(&bench.wait(1_500)).last().unwrap().ping;
    assert!(matches!(ping, Some(Ok(echo)) if (echo.range.0 - 3.0).abs() < 0.01), "{ping:?}");
    bench.truth = None;
    let mut shown = Vec::new();
    for _ in 0..100 {
        bench.roll(3, -2);
        shown.extend(readings(&bench.wait(100)));
    }
    assert!(shown.len().abs_diff(100) <= 1, "{} in 10 s", shown.len());
    let counts: Vec<_> = shown.iter().map(|shown| (shown.right.count, shown.left.count)).collect();
    let (right, left) = counts[50];
    assert!(right.is_some_and(|count| count.abs_diff(3 * 51) <= 3), "{right:?}");
    assert!(left.is_some_and(|count| count.abs_diff(0x1_0000 - 2 * 51) <= 2), "{left:?}");
    let last = shown.last().unwrap();
    assert_eq!((last.right.bits, last.right.illegal), (16, 0));
    let travel = config().right_wheel.travel_per_edge.0;
    assert_eq!(last.right.metres_per_edge.to_bits(), travel.to_bits());
    assert_eq!(last.left.metres_per_edge.to_bits(), (-travel).to_bits());
    // The servo has been ahead and at both of its limits.
    let limit = Radians::from_degrees(90.0);
    for bearing in [Radians(0.0), limit, -limit] {
        let at = |shown: &&DeviceReadings| {
            shown.servo.is_some_and(|servo| (servo.bearing - bearing).abs() < Radians(0.01))
        };
        let servo = shown.iter().find(at).and_then(|shown| shown.servo);
        let micros = servo.unwrap_or_else(|| panic!("never at {bearing:?}")).micros;
        let [one, other] = config().rangers.first.servo_pulses;
        let [from, to] = [one, other].map(|pulse| pulse.width.to_micros() as f32);
        let slope = (to - from) / (other.bearing - one.bearing).0;
        assert!((micros - from - slope * (bearing - one.bearing).0).abs() < 1.0, "{micros}");
    }
}

/// Ahead, to the right, ahead, to the left: eight checks each, a fifth of a second apart.
#[test]
fn the_servo_turns_to_its_limits_in_turn() {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    assert_eq!(bench.order(&Command::ShowDevices), DONE);
    let mut bearings: Vec<(i8, usize)> = Vec::new();
    for reading in readings(&bench.wait(30_000)) {
        let bearing = reading.servo.map_or(0.0, |servo| servo.bearing.to_degrees());
        let side = if bearing.abs() < 1.0 { 0 } else { bearing.signum() as i8 };
        match bearings.last_mut() {
            Some((last, count)) if *last == side => *count += 1,
            _ => bearings.push((side, 1)),
        }
    }
    let sides: Vec<i8> = bearings.iter().map(|(side, _)| *side).collect();
    let expected = [0, -1, 0, 1].into_iter().cycle().take(sides.len());
    assert_eq!(sides, expected.collect::<Vec<i8>>());
    // Each for 1.6 s and the time of eight pings, at ten readings a second.
    let whole = &bearings[1..bearings.len() - 1];
    assert!(
        whole.len() > 10 && whole.iter().all(|(_, count)| (15..20).contains(count)),
        "{bearings:?}"
    );
}

#[test]
fn readings_end_after_a_minute_and_when_the_loop_starts() {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    assert_eq!(bench.order(&Command::ShowDevices), DONE);
    bench.wait(40_000);
    assert_eq!(bench.order(&Command::ShowDevices), DONE, "asked again in time");
    assert!(readings(&bench.wait(59_500)).len() > 590);
    bench.wait(1_000);
    assert!(readings(&bench.wait(5_000)).is_empty());
    // The servo is ahead again.
    assert_eq!(bench.hardware.servo.target().map(|bearing| bearing.0.abs() < 0.01), Some(true));

    for command in [Command::ShowDevices, Command::SetPose(start()), Command::Start] {
        assert_eq!(bench.order(&command), DONE);
    }
    bench.received();
    assert!(bench.poll().may_drive);
    assert!(readings(&bench.wait(2_000)).is_empty(), "the loop runs");
    let refused = CommandResult::Refused(CommandError::Running);
    assert_eq!(bench.order(&Command::ShowDevices), refused);
    assert_eq!(bench.order(&Command::Stop), DONE);
    assert!(readings(&bench.wait(2_000)).is_empty(), "asked before the loop ran");
    assert_eq!(bench.order(&Command::ShowDevices), DONE);
    assert!(!bench.poll().may_drive, "a robot that waits does not drive");
    assert!(!readings(&bench.wait(200)).is_empty());
}

#[test]
fn each_missing_device_is_seen_and_no_other() {
    let baked = Baked::new(&config());
    for missing in 0..16_u32 {
        let has = |bit: u32| missing & (1 << bit) == 0;
        let mut bench = Bench::switched_on(&baked, SimFlash::new());
        bench.disconnect(missing);
        assert_eq!(bench.order(&Command::ShowDevices), DONE);
        let shown = *readings(&bench.wait(3_000)).last().unwrap();
        let silence = if has(3) { NoEcho::Nothing } else { NoEcho::NoResponse };
        assert_eq!(shown.right.count, has(0).then_some(7), "{missing:04b}");
        assert_eq!(shown.left.count, has(1).then_some(7), "{missing:04b}");
        assert_eq!(shown.servo.is_some(), has(2), "{missing:04b}");
        assert_eq!(shown.ping, Some(Err(silence)), "{missing:04b}");
    }
}

#[test]
fn a_board_without_a_configuration_shows_what_it_can() {
    let erased = vec![0xFF; 64];
    let baked = Baked { map: erased.clone(), config: erased };
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    assert_eq!(bench.order(&Command::ShowDevices), DONE);
    bench.roll(5, 6);
    let shown = *readings(&bench.wait(1_000)).last().unwrap();
    assert_eq!((shown.right.count, shown.left.count), (Some(5), Some(6)));
    assert!([shown.right, shown.left].iter().all(|wheel| wheel.metres_per_edge.abs() < 1e-9));
    assert_eq!((shown.servo, shown.ping), (None, Some(Err(NoEcho::Nothing))));
}

#[test]
fn the_servo_points_where_it_is_asked_to_and_the_ranger_pings_there() {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    bench.truth = Some(Truth { x: 1.0, y: 1.5, heading: 0.0 });
    bench.wait(2_000);
    // It stands 3 m before a wall, and 1.5 m from the one at its left.
    for (degrees, range) in [(0.0, 3.0), (90.0, 1.5), (2.0, 3.0)] {
        let bearing = Radians::from_degrees(degrees);
        assert_eq!(bench.order(&Command::Point(bearing)), DONE);
        let ordered = bench.now;
        let pings: Vec<Sweep> = sweeps(&bench.wait(3_000));
        assert!(pings.len() > 20, "{} pings in 3 s", pings.len());
        for ping in &pings {
            assert!((ping.bearing - bearing).abs() < Radians(0.005), "{ping:?}");
            let echo = ping.outcome.unwrap();
            assert!((echo.range.0 - range).abs() < 0.02, "{echo:?} at {degrees}°");
        }
        // The turn from one limit to the other takes longer than a small one, and no ping is earlier than its end.
        let first = pings[0].at.ticks() - ordered;
        let turn = if degrees > 80.0 { 250_000..900_000 } else { 0..600_000 };
        assert!(turn.contains(&first), "{first} µs to {degrees}°");
    }
    assert_eq!(bench.order(&Command::ShowDevices), DONE);
    assert!(sweeps(&bench.wait(2_000)).is_empty(), "in turn again");
}

#[test]
fn a_bearing_that_the_servo_does_not_reach_is_refused() {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    let refused = CommandResult::Refused(CommandError::OutOfReach);
    for bearing in [1.6, -1.6, f32::NAN, f32::INFINITY] {
        assert_eq!(bench.order(&Command::Point(Radians(bearing))), refused, "{bearing}");
    }
    assert!(readings(&bench.wait(2_000)).is_empty(), "nothing has changed");
    let erased = vec![0xFF; 64];
    let without = Baked { map: erased.clone(), config: erased };
    let mut bench = Bench::switched_on(&without, SimFlash::new());
    let refused = CommandResult::Refused(CommandError::NoConfiguration);
    assert_eq!(bench.order(&Command::Point(Radians(0.0))), refused);
}
