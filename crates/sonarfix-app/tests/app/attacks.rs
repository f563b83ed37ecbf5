//! Commands, interruptions and dead devices that once made a robot unusable, or let it run without measurements and
//! without a report. `docs/faults.md` has a table of them.

use sonarfix::config::CalibrationPrior;
use sonarfix::filter::ekf::StandardDeviations;
use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Metres, MetresPerSecond, Radians};
use sonarfix::health::Verdict;
use sonarfix::localizer::Start;
use sonarfix_app::store::{Saved, Store, StoreError, StoredConfiguration};
use sonarfix_hal::config::RobotConfig;
use sonarfix_link::message::{CommandError, CommandResult, ImageStatus};
use sonarfix_link::{Command, Telemetry, baked};

use crate::flash::{SECTOR, SECTORS, SimFlash};
use crate::rig::{Baked, Bench, config, loop_status, running, start};

const DONE: CommandResult = CommandResult::Done;

/// Drives both wheels so many ticks ahead, at 0.2 m/s.
fn drive(bench: &mut Bench, ticks: u16) {
    for _ in 0..ticks {
        for wheel in [&mut bench.hardware.right.0, &mut bench.hardware.left.0] {
            *wheel = wheel.map(|count| count.wrapping_add(1));
        }
        let _ = bench.poll();
    }
}

fn at_start(mut bench: Bench) -> (Bench, StandardDeviations) {
    assert_eq!(bench.order(&Command::Start), DONE);
    let deviation = bench.estimate().deviation;
    (bench, deviation)
}

/// Whether no deviation of the calibration exceeds its prior, except by the random walk of a few metres.
pub fn is_within_prior(deviation: &StandardDeviations, prior: &CalibrationPrior) -> bool {
    let at_most = |is: f32, prior: f32| is <= 1.000_1 * prior + 1e-4;
    at_most(deviation.scale_right, prior.scale_right)
        && at_most(deviation.scale_left, prior.scale_left)
        && at_most(deviation.track_width_error.0, prior.track_width.0)
        && at_most(deviation.range_scale, prior.range_scale)
}

#[test]
fn any_number_of_stops_equals_one() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    drive(&mut bench, 1_000);
    assert_eq!(bench.order(&Command::Stop), DONE);
    let (mut bench, once) = at_start(bench);
    for _ in 0..25 {
        assert_eq!(bench.order(&Command::Stop), DONE);
        let again;
        (bench, again) = at_start(bench);
        assert_eq!(again, once);
    }
    assert!(is_within_prior(&once, &config().localizer.prior), "{once:?}");
}

#[test]
fn any_number_of_power_cycles_equals_one() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    drive(&mut bench, 1_000);
    assert_eq!(bench.order(&Command::Stop), DONE);
    let mut flash = bench.switched_off();
    let mut first = None;
    for cycle in 0..30 {
        let mut bench = Bench::switched_on(&baked, flash);
        // A command to a stopped robot writes a record, and so does a start without driving.
        if cycle % 3 == 1 {
            assert_eq!(bench.order(&Command::MapChecksum), bench.order(&Command::MapChecksum));
        }
        let (mut bench, deviation) = at_start(bench);
        assert_eq!(*first.get_or_insert(deviation), deviation, "cycle {cycle}");
        assert!(is_within_prior(&deviation, &config().localizer.prior), "{deviation:?}");
        assert_eq!(bench.order(&Command::Stop), DONE);
        flash = bench.switched_off();
    }
}

/// The pose's deviations over interruptions with driving: each adds 10 cm and 5° once, as independent errors, up to those of an
/// unknown pose.
#[test]
fn interruptions_with_driving_add_as_independent_errors() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    let (pushed, turned) = (0.1_f32, 5.0_f32.to_radians());
    for interruption in 0..40 {
        drive(&mut bench, 200);
        bench.wait(150);
        let before = bench.estimate().deviation;
        assert_eq!(bench.order(&Command::Stop), DONE);
        if interruption % 2 == 0 {
            bench = Bench::switched_on(&baked, bench.switched_off());
        }
        let after;
        (bench, after) = at_start(bench);
        let expected = [before.x.0.hypot(pushed), before.heading.0.hypot(turned)];
        for (is, expected) in [after.x.0, after.heading.0].into_iter().zip(expected) {
            assert!((is - expected).abs() < 1e-5 * expected, "{interruption}: {is} {expected}");
        }
    }
    let wide = Start {
        position_deviation: Metres(1_000.0),
        heading_deviation: Radians(std::f32::consts::PI),
        ..start()
    };
    for _ in 0..3 {
        assert_eq!(bench.order(&Command::SetPose(wide)), DONE);
        drive(&mut bench, 200);
        assert_eq!(bench.order(&Command::Stop), DONE);
        let after;
        (bench, after) = at_start(bench);
        assert_eq!((after.x, after.heading), (Metres(1_000.0), Radians(std::f32::consts::PI)));
    }
}

/// A stop while the wheels cannot be observed: the robot does not start from a pose that it may have left unseen.
#[test]
fn an_interruption_while_the_encoders_are_dead_keeps_their_growth() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    bench.wait(1_000);
    let calibration = bench.estimate().deviation;
    (bench.hardware.right.0, bench.hardware.left.0) = (None, None);
    bench.wait(2_000);
    let blind = bench.estimate().deviation;
    assert!(blind.x.0 > 1.9 * config().localizer.max_wheel_speed.0, "{blind:?}");
    assert_eq!(bench.order(&Command::Stop), DONE);
    (bench.hardware.right.0, bench.hardware.left.0) = (Some(0), Some(0));
    let bench = Bench::switched_on(&baked, bench.switched_off());
    let (bench, after) = at_start(bench);
    assert!(after.x.0 >= blind.x.0, "{after:?}");
    assert!((after.heading.0 - std::f32::consts::PI).abs() < 1e-3, "{after:?}");
    assert!(is_within_prior(&after, &config().localizer.prior), "{after:?}");
    assert!(after.scale_right >= calibration.scale_right);
    assert!(bench.app.is_running());
}

/// A robot that starts with a dead encoder enables its motors when the encoder has been read.
#[test]
fn a_robot_drives_after_it_has_read_its_encoders() {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    assert_eq!(bench.order(&Command::SetPose(start())), DONE);
    let left = bench.hardware.left.0.take();
    assert_eq!(bench.order(&Command::Start), DONE);
    for _ in 0..300 {
        let polled = bench.poll();
        assert!(polled.is_running && !polled.may_drive);
    }
    bench.hardware.left.0 = left;
    bench.wait(200);
    assert!(bench.poll().may_drive);
}

/// A new pose while an encoder is dead: the travel before it, which the counter returns later, does not move it.
#[test]
fn a_new_pose_without_odometry_is_not_moved_by_earlier_travel() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    bench.wait(1_000);
    let (right, left) = (bench.hardware.right.0.take(), bench.hardware.left.0.take());
    bench.wait(400);
    assert_eq!(bench.order(&Command::SetPose(start())), DONE);
    bench.wait(400);
    let moved = |count: Option<u16>| count.map(|count| count.wrapping_add(300));
    (bench.hardware.right.0, bench.hardware.left.0) = (moved(right), moved(left));
    bench.wait(300);
    let estimate = bench.estimate();
    assert_eq!(estimate.state.x, start().pose.x);
    assert!(estimate.deviation.x.0 > 0.4 * config().localizer.max_wheel_speed.0, "{estimate:?}");
}

/// New poses of a running robot, and again after a power cycle.
#[test]
fn new_poses_never_add_up() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    for _ in 0..40 {
        assert_eq!(bench.order(&Command::SetPose(start())), DONE);
        drive(&mut bench, 3);
        let deviation = bench.estimate().deviation;
        assert!(is_within_prior(&deviation, &config().localizer.prior), "{deviation:?}");
    }
    let mut bench = Bench::switched_on(&baked, bench.switched_off());
    for _ in 0..40 {
        assert_eq!(bench.order(&Command::SetPose(start())), DONE);
    }
    let (bench, deviation) = at_start(bench);
    assert!(is_within_prior(&deviation, &config().localizer.prior), "{deviation:?}");
    assert!(bench.app.is_running());
}

/// A running robot that gets a new pose keeps its calibration and the calibration's covariance bit for bit.
#[test]
fn a_new_pose_costs_no_calibration() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    drive(&mut bench, 2_000);
    bench.wait(200);
    let before = *bench.app.localizer().unwrap().filter();
    let there = Start { pose: Pose::new(2.0, 1.0, Radians(1.0)), ..start() };
    assert_eq!(bench.order(&Command::SetPose(there)), DONE);
    let after = *bench.app.localizer().unwrap().filter();
    let (p, q) = (before.covariance(), after.covariance());
    assert_eq!(p.fixed_view::<4, 4>(3, 3), q.fixed_view::<4, 4>(3, 3));
    assert_eq!(before.state().to_array()[3..], after.state().to_array()[3..]);
    assert_eq!(after.state().x, Metres(2.0));
    assert!((after.standard_deviations().x.0 - 0.02).abs() < 1e-6);
    let crossed = q.fixed_view::<3, 4>(0, 3);
    assert!(crossed.iter().all(|covariance| covariance.abs() <= 0.0), "{crossed}");
}

/// Ticks stay on their grid, whatever commands arrive between them.
#[test]
fn commands_do_not_move_the_tick() {
    let baked = Baked::new(&config());
    let faster = config();
    let commands =
        [Command::SetPose(start()), Command::SetConfiguration(faster), Command::ResetCalibration];
    for period in [20, 33, 50, 99] {
        for command in &commands {
            let mut bench = running(&baked);
            let mut on_time = 0;
            for milli in 0..10_000 {
                let polled = if milli % period == 0 {
                    bench.send(command);
                    bench.poll()
                } else {
                    bench.poll()
                };
                on_time += u32::from(polled.is_on_time);
            }
            assert!(on_time >= 90, "every {period} ms {command:?}: {on_time} ticks in 10 s");
        }
    }
}

/// A command every 20 ms for ten minutes writes no more than the limit permits.
#[test]
fn commands_write_the_flash_at_a_limited_rate() {
    let baked = Baked::new(&config());
    for is_running in [false, true] {
        let mut bench = running(&baked);
        if !is_running {
            assert_eq!(bench.order(&Command::Stop), DONE);
        }
        let mut writes = 0;
        for milli in 0_u32..600_000 {
            if milli.is_multiple_of(20) {
                let x = 1.0 + 1e-6 * milli as f32;
                let pose = Pose::new(x, 1.5, Radians(0.5));
                bench.send(&match milli / 20 % 4 {
                    0 => Command::ResetCalibration,
                    1 => Command::SetConfiguration(config()),
                    _ => Command::SetPose(Start { pose, ..start() }),
                });
            }
            writes += u32::from(bench.poll().saved.is_some());
        }
        assert!(writes <= 120 + 10 + 1, "{writes} writes in ten minutes, running: {is_running}");
    }
}

/// When the limit permits a postponed write, the newest state is written.
#[test]
fn the_newest_state_is_written_after_the_limit() {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    let at = |x: f32| Start { pose: Pose::new(x, 1.5, Radians(0.5)), ..start() };
    for pose in 0_u16..50 {
        assert_eq!(bench.order(&Command::SetPose(at(0.01 * f32::from(pose)))), DONE);
    }
    bench.wait(121_000);
    let bench = Bench::switched_on(&baked, bench.switched_off());
    let known = bench.app.known().copied().unwrap();
    assert!(known.has_pose && (known.state.x.0 - 0.49).abs() < 1e-6, "{known:?}");
}

/// While a robot may drive, its record is never *parked*, whatever the limit.
#[test]
fn a_driving_robot_is_never_recorded_as_parked() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    for times in 0..60 {
        let commands: &[Command] = match times % 4 {
            0 => &[Command::Stop, Command::Start],
            1 => &[Command::Stop, Command::SetPose(start()), Command::Start],
            2 => &[Command::Stop, Command::ResetCalibration, Command::Start],
            _ => &[Command::Stop, Command::SetConfiguration(config()), Command::Start],
        };
        for command in commands {
            assert_eq!(bench.order(command), DONE, "{command:?}");
        }
        drive(&mut bench, 10);
        let flash = bench.app.store().flash().clone();
        let mut store = Store::new(flash, 0..(SECTOR * SECTORS) as u32).unwrap();
        let saved = store.load().unwrap();
        assert!(saved.is_none_or(|saved| !saved.is_parked), "after {times}: {saved:?}");
        bench.wait(if times % 10 == 0 { 70_000 } else { 100 });
    }
}

/// A refused command changes neither memory nor flash, and the robot can still start.
#[test]
fn a_refused_command_changes_nothing() {
    let baked = Baked::new(&config());
    let wide = |position, heading| Start {
        position_deviation: Metres(position),
        heading_deviation: Radians(heading),
        ..start()
    };
    let poses = [wide(1e7, 0.1), wide(0.1, 1e7), wide(f32::NAN, 0.1), wide(-1.0, 0.1)];
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    assert_eq!(bench.order(&Command::SetPose(start())), DONE);
    let mut unstartable = config();
    unstartable.localizer.prior.track_width = Metres(1e7);
    let mut broken = config();
    broken.localizer.max_wheel_speed = MetresPerSecond(-1.0);
    let commands = poses
        .map(Command::SetPose)
        .into_iter()
        .chain([Command::SetConfiguration(unstartable), Command::SetConfiguration(broken)]);
    for is_running in [false, true] {
        if is_running {
            assert_eq!(bench.order(&Command::Start), DONE);
        }
        for command in commands.clone() {
            let (known, flash) = (bench.app.known().copied(), bench.app.store().flash().clone());
            let refused = bench.order(&command);
            assert!(matches!(refused, CommandResult::Refused(_)), "{command:?}: {refused:?}");
            assert_eq!(bench.app.known().copied(), known);
            assert_eq!(bench.app.store().flash().clone(), flash, "{command:?} was written");
            assert_eq!(bench.app.is_running(), is_running);
        }
    }
    assert_eq!(bench.order(&Command::Stop), DONE);
    let mut bench = Bench::switched_on(&baked, bench.switched_off());
    assert_eq!(bench.order(&Command::Start), DONE);
}

/// With a stored configuration that cannot start, the baked one is used, and this is reported.
#[test]
fn a_stored_configuration_that_cannot_start_is_not_used() {
    let baked = Baked::new(&config());
    let bad: [fn(&mut RobotConfig); 3] = [
        |config| config.localizer.prior.track_width = Metres(1e7),
        |config| {
            config.localizer.max_wheel_speed = MetresPerSecond(-1.0);
        },
        |config| config.localizer.rangers.first.servo = (Radians(-3.0), Radians(3.0)),
    ];
    for make_bad in bad {
        let mut sent = config();
        make_bad(&mut sent);
        let mut store = Store::new(SimFlash::new(), 0..(SECTOR * SECTORS) as u32).unwrap();
        store
            .save_config(&StoredConfiguration {
                replaces: baked::checksum(&config()),
                config: sent,
            })
            .unwrap();
        let mut bench = Bench::switched_on(&baked, store.release());
        assert!(bench.first.saved.is_some_and(|read| read.is_err()), "{:?}", bench.first);
        let messages = bench.wait(1);
        let Some(Telemetry::Hello(hello)) = messages.first() else { panic!("no Hello") };
        assert_eq!(hello.configuration, ImageStatus::Valid(baked::checksum(&config())));
        assert_eq!(bench.order(&Command::SetPose(start())), DONE);
        assert_eq!(bench.order(&Command::Start), DONE);
    }
}

/// A configuration that is not used is reported, also if the store cannot be repaired.
#[test]
fn a_configuration_that_cannot_start_is_reported_first() {
    let baked = Baked::new(&config());
    let mut bad = config();
    bad.localizer.prior.track_width = Metres(1e7);
    let mut store = Store::new(SimFlash::new(), 0..(SECTOR * SECTORS) as u32).unwrap();
    let stored = StoredConfiguration { replaces: baked::checksum(&config()), config: bad };
    store.save_config(&stored).unwrap();
    let mut flash = store.release();
    // Foreign bytes behind the record are to be removed by a copy, which fails.
    flash.damage(SECTOR - 100, 0);
    flash.is_read_only = true;
    let mut unrepaired = Store::new(flash.clone(), 0..(SECTOR * SECTORS) as u32).unwrap();
    assert!(unrepaired.open().is_err_and(|error| error != StoreError::Configuration));
    let bench = Bench::switched_on(&baked, flash);
    assert_eq!(bench.first.saved, Some(Err(StoreError::Configuration)));
}

/// A recorded conversation that is sent again, in the same run or after a power cycle, starts nothing.
#[test]
fn a_recorded_start_does_not_start_the_robot() {
    let baked = Baked::new(&config());
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    let recording: Vec<Vec<u8>> = [Command::OpenSession, Command::SetPose(start()), Command::Start]
        .map(|command| {
            let frame = bench.frame(&command);
            bench.garble(&frame);
            let result = bench.poll().answered;
            if let Some(CommandResult::Session(session)) = result {
                bench.session = session;
            }
            frame
        })
        .to_vec();
    assert!(bench.app.is_running());
    assert_eq!(bench.order(&Command::Stop), DONE);
    let old = CommandResult::Refused(CommandError::Session);
    for run in 0..3 {
        // The start alone, then the whole conversation.
        bench.garble(&recording[2]);
        assert_eq!(bench.poll().answered, Some(old), "run {run}");
        for frame in &recording {
            bench.garble(frame);
            let answered = bench.poll().answered;
            assert!(!matches!(answered, Some(CommandResult::Done)), "run {run}: {answered:?}");
        }
        bench.wait(100);
        assert!(!bench.app.is_running() && !bench.poll().may_drive);
        let flash = bench.switched_off();
        bench = Bench::switched_on(&baked, flash);
    }
    // A request for a session is always granted.
    assert_eq!(bench.order(&Command::SetPose(start())), DONE);
    assert_eq!(bench.order(&Command::Start), DONE);
    // An old stop stops it.
    bench.session = 0;
    assert_eq!(bench.order(&Command::Stop), DONE);
}

/// A record with implausible numbers.
#[test]
fn an_implausible_record_does_not_prevent_a_start() {
    let baked = Baked::new(&config());
    let bench = running(&baked);
    let mut flash = bench.switched_off();
    for numbers in [[1e30; 7], [-1.0; 7], [f32::NAN; 7], [1e6; 7]] {
        let mut store = Store::new(flash, 0..(SECTOR * SECTORS) as u32).unwrap();
        let saved = store.load().unwrap().unwrap();
        let deviation = StandardDeviations::from_array(numbers);
        store.save(&Saved { is_parked: true, deviation, ..saved }).unwrap();
        let mut bench = Bench::switched_on(&baked, store.release());
        assert_eq!(bench.order(&Command::SetPose(start())), DONE);
        assert_eq!(bench.order(&Command::Start), DONE);
        flash = bench.switched_off();
    }
}

fn verdict(bench: &Bench) -> Verdict {
    bench.estimate().health.verdict
}

/// An encoder that cannot be read: `Degraded` within 0.7 s, `Lost` within 3.2 s, motors off.
#[test]
fn a_dead_encoder_is_noticed() {
    let baked = Baked::new(&config());
    for wheel in 0..3 {
        let mut bench = running(&baked);
        bench.wait(1_000);
        let well = bench.estimate().health;
        assert!(bench.poll().may_drive);
        if wheel != 1 {
            bench.hardware.right.0 = None;
        }
        if wheel != 0 {
            bench.hardware.left.0 = None;
        }
        bench.wait(700);
        assert_ne!(verdict(&bench), Verdict::Tracking);
        assert!(!bench.poll().may_drive);
        bench.wait(2_500);
        assert_eq!(verdict(&bench), Verdict::Lost);
        let unseen = bench.estimate().health.position_deviation.0 - well.position_deviation.0;
        let fastest = config().localizer.max_wheel_speed.0;
        assert!(unseen > 3.0 * fastest && unseen < 3.5 * fastest, "{unseen} m");
        bench.wait(600_000);
        assert_eq!(verdict(&bench), Verdict::Lost);
        assert!(!bench.poll().may_drive);
        assert!(loop_status(&bench.wait(1_000)).faults.right.errors > 0 || wheel == 1);
    }
}

/// When an encoder can be read again, its counter contains the whole travel: nothing is lost, and the motors are enabled.
#[test]
fn an_encoder_that_can_be_read_again_returns_the_whole_travel() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    bench.wait(1_000);
    let x = bench.estimate().state.x.0;
    let count = bench.hardware.right.0.take().unwrap();
    bench.wait(1_000);
    (bench.hardware.right.0, bench.hardware.left.0) = (Some(count + 100), Some(count + 100));
    bench.wait(200);
    let rolled = 100.0 * std::f32::consts::PI * 0.065 / 1_024.0;
    assert!((bench.estimate().state.x.0 - x - rolled * 0.5_f32.cos()).abs() < 1e-4);
    assert!(bench.poll().may_drive);
}

#[test]
fn all_devices_dead_is_noticed() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    bench.wait(1_000);
    (bench.hardware.right.0, bench.hardware.left.0) = (None, None);
    bench.servo_is_there.set(false);
    bench.hardware.ranger.is_there = false;
    bench.wait(3_500);
    assert_eq!(verdict(&bench), Verdict::Lost);
    bench.wait(120_000);
    assert_eq!(verdict(&bench), Verdict::Lost);
    assert!(!bench.poll().may_drive);
    // The devices work again.
    bench.mend();
    assert_eq!(bench.order(&Command::Stop), DONE);
    assert_eq!(bench.order(&Command::SetPose(start())), DONE);
    assert_eq!(bench.order(&Command::Start), DONE);
    bench.wait(1_000);
    assert_eq!(verdict(&bench), Verdict::Tracking);
    assert!(bench.poll().may_drive);
}

/// No echo for a minute, whatever the reason, is not `Tracking`.
#[test]
fn a_ranger_that_never_answers_is_noticed() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    bench.hardware.ranger.is_there = false;
    bench.wait(61_000);
    assert_ne!(verdict(&bench), Verdict::Tracking);
    assert_eq!(bench.order(&Command::SetPose(start())), DONE);
    assert_eq!(verdict(&bench), Verdict::Tracking);
    assert_eq!(
        bench.order(&Command::SetPose(Start { position_deviation: Metres(-1.0), ..start() })),
        CommandResult::Refused(CommandError::Pose)
    );
}

/// After repeated resets the store, which may be their cause, is not used, and this is reported.
#[test]
fn after_three_resets_in_a_row_the_store_is_not_used() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    assert_eq!(bench.order(&Command::Stop), DONE);
    let flash = bench.switched_off();
    for resets in 0..6 {
        let mut bench = Bench::reset(&baked, flash.clone(), resets);
        let is_used = resets < 3;
        assert_eq!(bench.first.saved, (!is_used).then_some(Err(StoreError::Ignored)));
        assert_eq!(bench.app.known().unwrap().has_pose, is_used);
        assert_eq!(bench.order(&Command::SetPose(start())), DONE);
        assert_eq!(bench.order(&Command::SetConfiguration(config())), DONE);
        assert_eq!(bench.order(&Command::Start), DONE);
        bench.wait(1_000);
        assert_eq!(verdict(&bench), Verdict::Tracking);
        assert!(!bench.poll().is_settled);
        if !is_used {
            assert_eq!(bench.app.store().flash(), &flash);
        }
        bench.wait(59_000);
        assert!(bench.poll().is_settled);
    }
}

/// A line that never falls silent holds no poll: each reads a bounded number of bytes, and ticks stay on time. One that sends telemetry reads
/// none, and the next one does.
#[test]
fn a_saturated_line_does_not_hold_the_poll() {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    let (mut on_time, mut has_read) = (0, true);
    for milli in 0..1_000_usize {
        bench.garble(&[0x55; 200]);
        let waiting = bench.unread();
        on_time += u32::from(bench.poll().is_on_time);
        let read = waiting - bench.unread();
        assert!(read <= 64 && (read > 0 || has_read), "{read} bytes in poll {milli}");
        has_read = read > 0;
        let next = bench.next_poll();
        assert!(next <= bench.now(), "more bytes wait, but the next poll is at {next}");
    }
    assert!(on_time >= 9, "{on_time} ticks in 1 s");
}

/// The distance of a robot that drives ahead at one speed, after a leap of its clock: `leap` changes the time of the next
/// poll.
fn drive_over_a_leap(leap: impl Fn(u64) -> u64, lasts: bool) -> (f32, u32, u32) {
    let baked = Baked::new(&config());
    let mut bench = running(&baked);
    drive(&mut bench, 1_000);
    let (from, faults) = (bench.estimate().state.x, loop_status(&bench.wait(1_200)).faults.clock);
    let usual = bench.now();
    bench.set_now(leap(usual));
    let _ = bench.poll();
    if !lasts {
        bench.set_now(usual + 1_000);
    }
    let mut on_time = 0;
    for _ in 0..2_000 {
        on_time += u32::from(bench.poll().is_on_time);
    }
    let far = bench.estimate().state.x - from;
    (far.0, loop_status(&bench.wait(1_200)).faults.clock - faults, on_time)
}

/// A torn reading of the clock, and a clock that is set ahead or back for good: the loop samples again within a second, the
/// fault is counted, and a robot that stands has not moved.
#[test]
fn the_loop_continues_after_a_leap_of_the_clock() {
    type Leap = fn(u64) -> u64;
    let cases: [(&str, Leap, bool); 5] = [
        ("torn by 2^32", |now| now + (1 << 32), false),
        ("torn back", |_| 3, false),
        ("set ahead by an hour", |now| now + 3_600_000_000, true),
        ("set back to zero", |_| 3, true),
        ("set back by a second", |now| now - 1_000_000, true),
    ];
    for (name, leap, lasts) in cases {
        let (moved, faults, on_time) = drive_over_a_leap(leap, lasts);
        assert!(moved.abs() < 0.05, "{name}: {moved} m");
        assert!(faults >= 1, "{name}: no fault was counted");
        assert!(on_time >= 15, "{name}: {on_time} ticks in 2 s");
    }
}
