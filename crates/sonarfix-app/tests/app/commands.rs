//! Effects of commands, also after a power cycle.

use sonarfix::filter::ekf::StandardDeviations;
use sonarfix::geometry::units::{Duration, Instant, Metres, MetresPerSecond, Radians};
use sonarfix::localizer::Start;
use sonarfix::sensor::absolute::AbsoluteMeasurement;
use sonarfix_hal::config::RobotConfig;
use sonarfix_link::message::{CommandError, CommandResult, ImageStatus};
use sonarfix_link::{Command, Telemetry, baked};

use crate::flash::SimFlash;
use crate::rig::{Baked, Bench, config, loop_status, running, start};

const DONE: CommandResult = CommandResult::Done;

fn with_speed(metres_per_second: f32) -> RobotConfig {
    let mut config = config();
    config.localizer.max_wheel_speed = MetresPerSecond(metres_per_second);
    config
}

fn refused(reason: CommandError) -> CommandResult {
    CommandResult::Refused(reason)
}

#[test]
fn it_starts_only_on_command_and_with_map_configuration_and_pose() {
    let whole = Baked::new(&config());
    let nothing = || vec![0xFF; 64];
    let no_map = Baked { map: nothing(), ..Baked::new(&config()) };
    let no_config = Baked { config: nothing(), ..Baked::new(&config()) };
    let cases = [
        (&no_map, CommandError::NoMap),
        (&no_config, CommandError::NoConfiguration),
        (&whole, CommandError::NoPose),
    ];
    for (baked, reason) in cases {
        let mut bench = Bench::switched_on(baked, SimFlash::new());
        assert_eq!(bench.order(&Command::Start), refused(reason));
        let messages = bench.wait(3_000);
        assert!(!loop_status(&messages).running && bench.app.localizer().is_none());
        assert!(!messages.iter().any(|message| matches!(message, Telemetry::Estimate(_))));
    }
    let mut bench = Bench::switched_on(&whole, SimFlash::new());
    assert_eq!(bench.order(&Command::SetPose(start())), DONE);
    assert!(!bench.poll().is_running);
    assert_eq!(bench.order(&Command::Start), DONE);
    // The estimate of a tick is sent by the next poll.
    let messages = bench.wait(3_001);
    let ticks = messages.iter().filter(|message| matches!(message, Telemetry::Estimate(_))).count();
    // The simulated sonar answers at once, so it delays no tick.
    assert_eq!(ticks, 30);
    assert!(loop_status(&messages).running);
    assert_eq!(bench.order(&Command::Stop), DONE);
    assert!(!bench.poll().is_running);
}

/// A motion that the motor code would not obey is not acknowledged.
#[cfg(not(feature = "drive"))]
#[test]
fn a_program_without_the_commanded_motion_refuses_it_by_name() {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    for command in [Command::SetPose(start()), Command::Start] {
        assert_eq!(bench.order(&command), DONE);
    }
    let result = bench.order(&Command::Drive(sonarfix_link::Motion::default()));
    let CommandResult::Refused(reason) = result else { panic!("{result:?}") };
    assert_eq!(reason.to_string(), "this program was built without `drive`");
}

#[test]
fn hello_reports_the_checksums_of_map_and_configuration() {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    let messages = bench.wait(1);
    let Some(Telemetry::Hello(hello)) = messages.first() else { panic!("no Hello") };
    assert_eq!(hello.configuration, ImageStatus::Valid(baked::checksum(&config())));
    assert_eq!(bench.order(&Command::MapChecksum), CommandResult::Map(hello.map));
    assert!(matches!(hello.map, ImageStatus::Valid(_)));

    let mut broken = Baked::new(&config());
    broken.map[50] ^= 4;
    broken.config[20] ^= 4;
    let messages = Bench::switched_on(&broken, SimFlash::new()).wait(1);
    let Some(Telemetry::Hello(hello)) = messages.first() else { panic!("no Hello") };
    assert_eq!((hello.map, hello.configuration), (ImageStatus::Corrupt, ImageStatus::Corrupt));
}

#[test]
fn every_missing_device_is_counted_and_no_other() {
    let baked = Baked::new(&config());
    for missing in 0..16_u32 {
        let has = |bit: u32| missing & (1 << bit) == 0;
        let mut bench = Bench::switched_on(&baked, SimFlash::new());
        bench.disconnect(missing);
        let faults = loop_status(&bench.wait(2_500)).faults;
        let found = [faults.right.errors, faults.left.errors, faults.servo, faults.ranger];
        for (bit, count) in (0..).zip(found) {
            assert_eq!(count > 0, !has(bit), "{missing:04b}: {faults:?}");
        }
    }
}

/// After `Stop` and a power cycle the pose is restored, with larger deviations than before.
#[test]
fn a_parked_robot_resumes_its_pose() {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    assert_eq!(bench.order(&Command::SetPose(start())), DONE);
    assert_eq!(bench.order(&Command::Start), DONE);
    bench.wait(500);
    // 100 ticks of 0.2 mm: 2 cm ahead.
    (bench.hardware.right.0, bench.hardware.left.0) = (Some(100), Some(100));
    bench.wait(500);
    let before = bench.estimate();
    assert!(before.state.x > Metres(1.01));
    assert_eq!(bench.order(&Command::Stop), DONE);

    let mut bench = Bench::switched_on(&baked, bench.switched_off());
    assert_eq!(bench.order(&Command::Start), DONE);
    let after = bench.estimate();
    assert_eq!(after.state, before.state);
    let (was, is) = (before.deviation, after.deviation);
    assert!(is.x.0 > 0.10 && is.x.0 < 0.12 && is.heading.0 > 0.087 && is.heading.0 < 0.1, "{is:?}");
    // A calibration whose deviations equal the prior keeps them.
    assert!((is.scale_right - was.scale_right).abs() < 1e-4, "{is:?} {was:?}");
    // The temperature of the air may have changed: the range scale returns to its prior.
    assert!((is.range_scale - 0.02).abs() < 1e-6, "{is:?}");
}

/// `Initialized` carries the start values of the localizer, with which a replay begins, bit for bit. The estimate
/// does not reproduce them exactly where the wheels' prior deviations differ.
#[test]
fn initialized_carries_the_exact_start_values() {
    let mut config = config();
    (config.localizer.prior.scale_right, config.localizer.prior.scale_left) = (0.013, 0.007);
    let baked = Baked::new(&config);
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    assert_eq!(bench.order(&Command::SetPose(start())), DONE);
    assert_eq!(bench.order(&Command::Start), DONE);
    let began = bench.received().into_iter().find_map(|message| match message {
        Telemetry::Initialized(began) => Some(began.deviation),
        _ => None,
    });
    let began = began.expect("no Initialized");
    let bits = |deviation: StandardDeviations| {
        let StandardDeviations { scale_right, scale_left, track_width_error, .. } = deviation;
        [scale_right, scale_left, track_width_error.0].map(f32::to_bits)
    };
    let given = [0.013, 0.007, config.localizer.prior.track_width.0].map(f32::to_bits);
    assert_eq!(bits(began), given);
    assert_ne!(bits(bench.estimate().deviation), given);
}

/// After a power loss while the loop ran, the pose is unknown, and `Start` is refused until a pose is set.
#[test]
fn a_robot_that_was_driving_needs_a_new_pose() {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    assert_eq!(bench.order(&Command::SetPose(start())), DONE);
    assert_eq!(bench.order(&Command::Start), DONE);
    bench.wait(1_000);
    let mut bench = Bench::switched_on(&baked, bench.switched_off());
    assert_eq!(bench.order(&Command::Start), refused(CommandError::NoPose));
    assert!(bench.app.known().is_some_and(|known| known.has_calibration && !known.has_pose));
    assert_eq!(bench.order(&Command::SetPose(start())), DONE);
    assert_eq!(bench.order(&Command::Start), DONE);
}

#[test]
fn a_pose_that_was_set_survives_a_power_cycle_without_driving() {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    assert_eq!(bench.order(&Command::SetPose(start())), DONE);
    let bench = Bench::switched_on(&baked, bench.switched_off());
    let known = bench.app.known().copied().unwrap();
    assert!(known.has_pose && (known.state.y.0 - 1.5).abs() < 1e-6);
}

#[test]
fn an_invalid_pose_is_refused_and_changes_nothing() {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    assert_eq!(bench.order(&Command::SetPose(start())), DONE);
    let known = bench.app.known().copied();
    let bad = [
        Start { position_deviation: Metres(-0.1), ..start() },
        Start { position_deviation: Metres(f32::NAN), ..start() },
        Start { heading_deviation: Radians(f32::INFINITY), ..start() },
    ];
    for start in bad {
        assert_eq!(bench.order(&Command::SetPose(start)), refused(CommandError::Pose));
        assert_eq!(bench.app.known().copied(), known);
    }
}

/// A configuration that was sent is used until another one is baked.
#[test]
fn a_configuration_survives_a_power_cycle_but_not_the_next_baked_one() {
    let baked = Baked::new(&config());
    let sent = with_speed(0.7);
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    assert_eq!(bench.order(&Command::SetConfiguration(sent)), DONE);
    let flash = bench.switched_off();

    let configuration = |bench: &mut Bench| match bench.wait(1).first() {
        Some(Telemetry::Hello(hello)) => hello.configuration,
        other => panic!("{other:?}"),
    };
    let mut bench = Bench::switched_on(&baked, flash.clone());
    assert_eq!(configuration(&mut bench), ImageStatus::Valid(baked::checksum(&sent)));

    let newer = with_speed(0.9);
    let rebaked = Baked::new(&newer);
    let mut bench = Bench::switched_on(&rebaked, flash);
    assert_eq!(configuration(&mut bench), ImageStatus::Valid(baked::checksum(&newer)));

    let wrong = with_speed(-1.0);
    assert_eq!(
        bench.order(&Command::SetConfiguration(wrong)),
        refused(CommandError::Configuration)
    );
}

/// With a flash that cannot be written the robot still starts. If the flash holds a record *parked* that cannot be
/// replaced, `Start` is refused.
#[test]
fn a_flash_that_fails() {
    let baked = Baked::new(&config());
    let mut never = SimFlash::new();
    never.is_read_only = true;
    let mut bench = Bench::switched_on(&baked, never);
    assert_eq!(bench.order(&Command::SetPose(start())), DONE);
    assert_eq!(bench.order(&Command::Start), DONE);

    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    assert_eq!(bench.order(&Command::SetPose(start())), DONE);
    let mut worn_out = bench.switched_off();
    worn_out.is_read_only = true;
    // The record says that the robot is parked and cannot be replaced: it may be of an earlier drive.
    let mut bench = Bench::switched_on(&baked, worn_out);
    assert_eq!(bench.order(&Command::Start), refused(CommandError::NoPose));
    assert!(!bench.poll().is_running);
    // A pose that is set now is valid, and the telemetry states that the flash fails.
    assert_eq!(bench.order(&Command::SetPose(start())), DONE);
    assert_eq!(bench.order(&Command::Start), DONE);
    assert!(bench.poll().is_running);
    assert!(loop_status(&bench.wait(1_200)).flash.failures >= 2);
    // Stopped and started again, it continues at the pose of this run.
    assert_eq!(bench.order(&Command::Stop), DONE);
    assert_eq!(bench.order(&Command::Start), DONE);
    // A configuration is used although it cannot be stored.
    assert_eq!(bench.order(&Command::SetConfiguration(config())), DONE);
}

/// A robot that is reset every minute writes no more often than one that runs on.
#[test]
fn resets_do_not_refill_the_budget_of_writes() {
    let baked = Baked::new(&config());
    let mut flash = SimFlash::new();
    let (resets, mut writes) = (60, 0);
    for _ in 0..resets {
        let mut bench = Bench::switched_on(&baked, flash);
        for _ in 0..3 {
            for command in [Command::SetPose(start()), Command::Start, Command::Stop] {
                let _ = bench.order(&command);
            }
        }
        bench.wait(59_000);
        writes = loop_status(&bench.wait(1_200)).flash.writes;
        flash = bench.switched_off();
    }
    // One a minute, and the burst at the start.
    assert!((120..=resets + 120 + 1).contains(&writes), "{writes} writes in {resets} minutes");
}

#[test]
fn a_calibration_can_be_forgotten() {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    assert_eq!(bench.order(&Command::SetPose(start())), DONE);
    assert_eq!(bench.order(&Command::ResetCalibration), DONE);
    let bench = Bench::switched_on(&baked, bench.switched_off());
    let known = bench.app.known().copied().unwrap();
    assert!(known.has_pose && known.state.scale_right.abs() < 1e-9);
    assert!((known.deviation.scale_right - config().localizer.prior.scale_right).abs() < 1e-6);
}

/// The watchdog is fed only when a deadline is met.
#[test]
fn a_late_poll_is_not_on_time() {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    assert!(bench.poll().is_on_time);
    // It waits for the next check of the devices, which was due a second after the last ping: 50 ms later is too late.
    bench.wait(10);
    bench.now = bench.next_poll() + 50_000;
    assert!(!bench.poll().is_on_time);
    assert_eq!(bench.order(&Command::SetPose(start())), DONE);
    assert_eq!(bench.order(&Command::Start), DONE);
    let on_time = (0..1_000).filter(|_| bench.poll().is_on_time).count();
    assert_eq!(on_time, 10);
    // 115 ms without a poll: the tick in this interval is late.
    bench.now += 115_000;
    let late = bench.poll();
    let report = bench.app.report().copied().unwrap_or_default();
    assert!(report.tick.is_some() && !late.is_on_time, "{late:?}");
}

/// Telemetry takes at most half of the capacity of the line at 115,200 baud.
#[test]
fn telemetry_leaves_half_of_the_line_free() {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    assert_eq!(bench.order(&Command::SetPose(start())), DONE);
    assert_eq!(bench.order(&Command::Start), DONE);
    let before = bench.line.sent;
    bench.wait(60_000);
    let a_second = (bench.line.sent - before) / 60;
    println!("{a_second} bytes a second");
    assert!(a_second > 500 && a_second < 11_520 / 2, "{a_second} bytes a second");
}

/// A heading from outside is taken by a running loop, with its outcome in a message; otherwise it is refused.
#[test]
fn a_heading_is_taken_by_a_running_loop() {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    let heading = |angle, age| Command::Absolute {
        age: Duration::from_ticks(age),
        measurement: AbsoluteMeasurement::Heading { angle, deviation: Radians(0.05) },
    };
    let here = start().pose.heading.radians();
    assert_eq!(bench.order(&heading(here, 0)), refused(CommandError::Waiting));
    assert_eq!(bench.order(&Command::SetPose(start())), DONE);
    assert_eq!(bench.order(&Command::Start), DONE);
    bench.wait(1_000);
    let off = Radians(here.0 + 1.0);
    for (angle, age, expected) in [
        (here, 20_000, "Accepted"),
        (off, 20_000, "Gated"),
        (here, 300_000, "Refused(BeforeLastStep)"),
    ] {
        assert_eq!(bench.order(&heading(angle, age)), DONE);
        let messages = bench.wait(200);
        let results = messages.iter().filter_map(|message| match message {
            Telemetry::Absolute(result) => Some(format!("{:?}", result.fix)),
            _ => None,
        });
        let results: Vec<_> = results.collect();
        assert!(matches!(&results[..], [fix] if fix.starts_with(expected)), "{results:?}");
    }
    assert_eq!(bench.order(&heading(here, 0)), DONE);
    assert_eq!(bench.order(&heading(here, 0)), refused(CommandError::Occupied));
}

/// What a poll did is reported before a command of the program around the application changes it.
#[test]
fn telemetry_of_a_poll_precedes_that_of_a_command_after_it() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    bench.wait(1_000);
    for command in [Command::SetPose(start()), Command::Stop] {
        while bench.app.report().unwrap().tick.is_none() {
            let _ = bench.poll();
        }
        bench.received();
        let now = Instant::from_ticks(bench.now);
        let Bench { app, hardware, line, .. } = &mut bench;
        assert_eq!(app.command(now, hardware, line, &command), DONE);
        let _ = bench.poll();
        let messages = bench.received();
        let place = |is: fn(&Telemetry) -> bool| messages.iter().position(is);
        let estimate = place(|it| matches!(it, Telemetry::Estimate(_)));
        let pose_set = place(|it| matches!(it, Telemetry::PoseSet(_)));
        assert!(estimate.is_some() && pose_set.is_none_or(|at| at > estimate.unwrap()));
        assert_eq!(pose_set.is_some(), command != Command::Stop, "{messages:?}");
    }
}
