//! Faults of the hardware: each is counted, none stops the loop, and it recovers.

use sonarfix::config::PingSchedule;
use sonarfix::geometry::units::{Duration, Instant};
use sonarfix::localizer::Fix;
use sonarfix_hal::encoder::Wheels;
use sonarfix_hal::ranger::{Air, Echo, NoEcho, Outcome, Ranger, TriggerError};
use sonarfix_hal::robot::{Devices, Faults, Report, Robot, Settings, SettingsError, StepResult};
use sonarfix_hal::servo::ServoTiming;

use super::rig::{
    Broken, Drive, Pins, World, accounts, millis, pins, robot, run, servo, walls, wheel,
};

const TICK: f32 = 1.0 / 1_024.0;
const SLOW: Drive = Drive { speed: 0.1, sway: 0.0 };

const SCHEDULE: PingSchedule = PingSchedule::Every(Duration::from_ticks(500_000));

/// Runs for 3.4 s with a ping every half second; two of them (1.5 and 2 s) meet this fault.
fn three_seconds(broken: Broken) -> (Vec<(u64, Report)>, Faults, World) {
    let walls = walls();
    let world = World::new(SLOW, TICK, 0);
    let mut robot = robot(&walls, TICK, SCHEDULE, Settings::default());
    let mut pins: Pins<'_> = pins(&world, ServoTiming::SG90);
    let mut reports = run(&world, &mut robot, &mut pins, millis(0, 1_401));
    world.broken.set(broken);
    reports.extend(run(&world, &mut robot, &mut pins, millis(1_401, 2_401)));
    let jump = broken.jump;
    world.broken.set(Broken { jump, ..Broken::default() });
    reports.extend(run(&world, &mut robot, &mut pins, millis(2_401, 3_401)));
    let faults = robot.faults();
    (reports, faults, world)
}

fn fixes(reports: &[(u64, Report)]) -> Vec<(u64, Fix)> {
    let fix = |report: &Report| report.ping_result.and_then(|heard| heard.fix);
    reports.iter().filter_map(|(time, report)| Some((*time, fix(report)?))).collect()
}

fn accepted_after(reports: &[(u64, Report)], from: u64) -> usize {
    let late = fixes(reports).into_iter().filter(|&(time, _)| time > from);
    late.filter(|(_, fix)| matches!(fix, Fix::Accepted(_))).count()
}

fn outcomes(reports: &[(u64, Report)]) -> Vec<Outcome> {
    let heard = reports.iter().filter_map(|(_, report)| report.ping_result);
    heard.map(|heard| heard.outcome).collect()
}

#[test]
fn healthy_devices_count_no_faults() {
    let (reports, faults, _) = three_seconds(Broken::default());
    assert!(faults.is_none(), "{faults:?}");
    assert_eq!(accepted_after(&reports, 0), 6);
}

#[test]
fn a_failed_counter_reading_delays_its_travel() {
    let (reports, faults, world) =
        three_seconds(Broken { right_counter: true, ..Broken::default() });
    // Ten ticks, and the ping's reading.
    assert!(faults.right.errors >= 10, "{faults:?}");
    assert_eq!((faults.left.errors, faults.travel), (0, 0));
    let stepless = |report: &Report| report.tick.is_some_and(|tick| tick.step.is_none());
    assert_eq!(reports.iter().filter(|(_, report)| stepless(report)).count(), 10);
    let (taken, written_off) = accounts(&reports);
    let counted = world.ticks(3_400_000) as f64 * f64::from(TICK);
    assert!((taken - counted).abs() < 1e-9 && written_off.abs() < 1e-9);
    assert!(accepted_after(&reports, 2_401_000) >= 2);
}

/// A reading that fails when a ping is due delays the ping to the next encoder sample.
#[test]
fn a_failed_reading_delays_a_ping() {
    let walls = walls();
    let world = World::new(SLOW, TICK, 0);
    let mut robot = robot(&walls, TICK, SCHEDULE, Settings::default());
    let mut pins = pins(&world, ServoTiming::SG90);
    let mut reports = vec![];
    for time in millis(0, 5_001) {
        let right_counter = time % 500_000 == 0;
        world.broken.set(Broken { right_counter, ..Broken::default() });
        reports.extend(run(&world, &mut robot, &mut pins, [time]));
    }
    // Of ten, the one that is due at 5 s comes later, and one while the servo turns for the first time is skipped.
    assert_eq!(robot.faults().right.errors, 11);
    assert_eq!(accepted_after(&reports, 0), 8, "{:?}", fixes(&reports));
}

#[test]
fn a_counter_that_fails_at_first_starts_both_wheels_when_it_recovers() {
    let walls = walls();
    let world = World::new(SLOW, TICK, 0);
    world.broken.set(Broken { right_counter: true, ..Broken::default() });
    let mut robot = robot(&walls, TICK, SCHEDULE, Settings::default());
    let mut pins = pins(&world, ServoTiming::SG90);
    run(&world, &mut robot, &mut pins, millis(0, 1_000));
    world.broken.set(Broken::default());
    run(&world, &mut robot, &mut pins, millis(1_000, 1_201));
    // The travel of the left wheel in the first second is not used without that of the right one: that would be a turn.
    let pose = robot.localizer().pose();
    assert!(pose.heading.radians().abs().0 < 1e-6, "{pose:?}");
    let counted = (world.ticks(1_200_000) - world.ticks(1_000_000)) as f64 * f64::from(TICK);
    assert!(counted > 0.0 && (f64::from(pose.x.0) - counted).abs() < 1e-5, "{pose:?}");
}

#[test]
fn a_jump_of_a_counter_is_discarded_once() {
    // Half a metre within 100 ms: the counter was reset or is faulty.
    let (reports, faults, world) = three_seconds(Broken { jump: 512, ..Broken::default() });
    assert_eq!(faults.travel, 1);
    let refused = reports.iter().filter_map(|(_, report)| report.tick?.step);
    let refused: Vec<_> = refused.filter(|step| step.result != StepResult::Accepted).collect();
    assert!(matches!(refused[..], [step] if matches!(step.result, StepResult::Discarded(_))));
    let (taken, written_off) = accounts(&reports);
    let counted = (world.ticks(3_400_000) + 512) as f64 * f64::from(TICK);
    assert!((taken + written_off - counted).abs() < 1e-9);
    assert!(accepted_after(&reports, 2_401_000) >= 2);
}

#[test]
fn a_stuck_servo_is_used_at_its_bearing() {
    let walls = walls();
    let world = World::new(SLOW, TICK, 0);
    // The aim alternates between walls, so the servo moves repeatedly.
    let mut robot = robot(&walls, TICK, SCHEDULE, Settings::default());
    let mut pins = pins(&world, ServoTiming::SG90);
    let mut reports = run(&world, &mut robot, &mut pins, millis(0, 1_001));
    world.broken.set(Broken { pwm: true, ..Broken::default() });
    reports.extend(run(&world, &mut robot, &mut pins, millis(1_001, 6_001)));
    assert!(robot.faults().servo > 0, "{:?}", robot.faults());
    assert_eq!(world.duties.borrow().iter().filter(|&&(time, _)| time > 1_000_000).count(), 0);
    // The beam is still square to a wall, and the ranges are assigned to that wall.
    assert!(accepted_after(&reports, 1_001_000) >= 8, "{:?}", fixes(&reports));
}

#[test]
fn a_servo_dead_from_the_start_leaves_odometry() {
    let walls = walls();
    let world = World::new(SLOW, TICK, 0);
    world.broken.set(Broken { pwm: true, ..Broken::default() });
    let mut robot = robot(&walls, TICK, SCHEDULE, Settings::default());
    let mut pins = pins(&world, ServoTiming::SG90);
    // The choice that is due at the end takes some polls.
    let reports = run(&world, &mut robot, &mut pins, millis(0, 3_006));
    assert_eq!(robot.faults().servo, 6);
    assert!(fixes(&reports).is_empty());
    let counted = world.ticks(3_000_000) as f64 * f64::from(TICK);
    assert!((f64::from(robot.localizer().pose().x.0) - counted).abs() < 1e-5);
}

#[test]
fn a_ranger_that_does_not_respond_leaves_odometry() {
    let (reports, faults, _) = three_seconds(Broken { echo: true, ..Broken::default() });
    let dead = outcomes(&reports).iter().filter(|&&o| o == Err(NoEcho::NoResponse)).count();
    assert_eq!((dead, faults.ranger), (2, 2));
    assert!(accepted_after(&reports, 2_401_000) >= 2);
}

#[test]
fn a_trigger_pin_that_fails_leaves_odometry() {
    let (reports, faults, _) = three_seconds(Broken { trigger: true, ..Broken::default() });
    assert_eq!(faults.ranger, 2);
    assert!(accepted_after(&reports, 2_401_000) >= 2);
    assert_eq!(reports.iter().filter(|(_, report)| report.tick.is_some()).count(), 34);
}

#[test]
fn a_missing_echo_is_not_a_fault() {
    let (reports, faults, _) = three_seconds(Broken { deaf: true, ..Broken::default() });
    let silent = outcomes(&reports).iter().filter(|&&o| o == Err(NoEcho::Nothing)).count();
    assert_eq!(silent, 2);
    assert!(faults.is_none(), "{faults:?}");
}

/// Reports of 5 s of a robot that spins with this speed of its wheels, and what its pins did.
fn spinning(speed: f64) -> (Vec<(u64, Report)>, World) {
    let walls = walls();
    let world = World::new(Drive { speed, sway: 0.0 }, TICK, 0);
    world.broken.set(Broken { spin: true, deaf: true, ..Broken::default() });
    let schedule = PingSchedule::AsFastAsPossible;
    let mut robot = robot(&walls, TICK, schedule, Settings::default());
    let mut pins: Pins<'_> = pins(&world, ServoTiming::SG90);
    let reports = run(&world, &mut robot, &mut pins, millis(0, 5_001));
    let aims = reports.iter().filter(|(_, report)| report.aimed.is_some());
    let aims: Vec<_> = aims.map(|&(time, _)| time).collect();
    // At most once per tick, because nothing changes between ticks, and repeatedly.
    assert!(aims.windows(2).all(|pair| pair[1] - pair[0] >= 99_000), "{aims:?}");
    assert!(aims.len() >= 10, "{aims:?}");
    (reports, world)
}

/// While the robot spins at 2.75 rad/s, a servo that takes a quarter of a second always settles too late for a beam
/// square to a wall.
#[test]
fn a_spinning_robot_aims_again_instead_of_pinging() {
    let (_, world) = spinning(0.22);
    assert!(world.triggers.borrow().is_empty(), "{:?}", world.triggers.borrow());
}

/// At 2.5 rad/s the beam may become square to another wall; then that wall is pinged. The cone is 15°, and the estimated
/// heading is that of the last tick.
#[test]
fn a_spinning_robot_pings_only_walls_that_are_square() {
    let (reports, world) = spinning(0.2);
    let tolerance = 0.262 + 0.1 * 2.5;
    for (time, report) in &reports {
        let Some(aim) = report.pinged else { continue };
        let heading = 2.0 * world.x(*time) / 0.16;
        let direction = core::f64::consts::FRAC_PI_2 * (f64::from(aim.wall.0) - 1.0);
        let duties = world.duties.borrow();
        let sent = duties.iter().rfind(|(sent, _)| sent <= time).unwrap();
        let off = heading + world.degrees(sent.1).to_radians() - direction;
        let off = off.sin().atan2(off.cos());
        assert!(off.abs() < tolerance, "{off} at {time}");
    }
    assert!(!world.triggers.borrow().is_empty());
}

#[test]
fn a_clock_that_runs_backwards_is_counted() {
    let walls = walls();
    let world = World::new(SLOW, TICK, 0);
    let mut robot = robot(&walls, TICK, SCHEDULE, Settings::default());
    let mut pins = pins(&world, ServoTiming::SG90);
    run(&world, &mut robot, &mut pins, millis(0, 1_001));
    let before = robot.localizer().pose();
    let report = robot.poll(Instant::from_ticks(999_999), &mut pins);
    assert_eq!(
        report,
        Report { faults: Faults { clock: 1, ..Faults::default() }, ..Report::default() }
    );
    assert_eq!(robot.localizer().pose(), before);
    assert_eq!(robot.faults().clock, 1);
}

#[test]
fn a_loop_that_sleeps_until_the_next_deadline_misses_nothing() {
    let walls = walls();
    let world = World::new(SLOW, TICK, 0);
    let mut robot = robot(&walls, TICK, SCHEDULE, Settings::default());
    let mut pins = pins(&world, ServoTiming::SG90);
    let (mut now, mut polls, mut accepted) = (0, 0, 0);
    while now <= 3_100_000 {
        world.advance(now);
        let report = robot.poll(Instant::from_ticks(now), &mut pins);
        let fix = report.ping_result.and_then(|heard| heard.fix);
        accepted += u32::from(matches!(fix, Some(Fix::Accepted(_))));
        polls += 1;
        let next = robot.idle_until(&mut pins).map(|until| until.ticks());
        // What else is due is done by the next poll.
        assert!(report.has_worked() || next.is_none_or(|next| next > now), "{next:?} at {now}");
        now = next.unwrap_or(now + 500).max(now + 1);
    }
    assert_eq!(accepted, 5);
    assert!(polls < 400, "{polls}");
    assert!(robot.faults().is_none(), "{:?}", robot.faults());
}

/// A ranger with one of several faults.
struct Bad {
    kind: Kind,
    triggered: Option<Instant>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    NeverEnds,
    NeverReady,
    Fails,
    /// Its echoes were reflected before the trigger.
    Early,
    /// Its echoes are received in the future.
    Late,
}

impl Ranger for Bad {
    type Error = &'static str;

    fn ready_at(&self) -> Instant {
        Instant::from_ticks(0)
    }

    fn trigger(&mut self, now: Instant) -> Result<(), TriggerError<Self::Error>> {
        if self.kind == Kind::NeverReady {
            return Err(TriggerError::TooSoon);
        }
        self.triggered = Some(now);
        Ok(())
    }

    fn poll(&mut self, now: Instant) -> Result<Option<Outcome>, Self::Error> {
        let Some(triggered) = self.triggered else {
            return Ok(None);
        };
        let flight = Duration::from_ticks(5_823);
        match self.kind {
            Kind::Fails => Err("broken"),
            Kind::Early => {
                let sent = triggered - Duration::from_ticks(1);
                let is_back = now >= sent + flight;
                Ok(is_back.then(|| Ok(Echo::new(sent, flight, Air::ROOM))))
            }
            Kind::Late => Ok(Some(Ok(Echo::new(now, flight, Air::ROOM)))),
            Kind::NeverEnds | Kind::NeverReady => Ok(None),
        }
    }
}

#[test]
fn faulty_rangers_are_counted_and_time_out() {
    for (kind, reason) in [
        (Kind::NeverEnds, Some(NoEcho::NoResponse)),
        (Kind::NeverReady, None),
        (Kind::Fails, Some(NoEcho::Failed)),
        (Kind::Early, Some(NoEcho::Mistimed)),
        (Kind::Late, Some(NoEcho::Mistimed)),
    ] {
        let walls = walls();
        let world = World::new(SLOW, TICK, 0);
        let patience = Duration::from_ticks(30_000);
        let settings = Settings { patience, ..Settings::default() };
        let mut robot = robot(&walls, TICK, SCHEDULE, settings);
        let Pins { right, left, .. } = pins(&world, ServoTiming::SG90);
        let triggered = None;
        let mut devices = Devices {
            right,
            left,
            servo: servo(&world, ServoTiming::SG90),
            ranger: Bad { kind, triggered },
        };
        let (mut heard, mut ticks) = (vec![], 0);
        for time in millis(0, 2_990) {
            world.advance(time);
            let report = robot.poll(Instant::from_ticks(time), &mut devices);
            heard.extend(report.ping_result.map(|heard| (heard.outcome, report.reached)));
            ticks += u32::from(report.tick.is_some());
        }
        assert_eq!(robot.faults().ranger, 5, "{kind:?}");
        let count = if reason.is_some() { 5 } else { 0 };
        assert_eq!(heard.len(), count, "{kind:?}");
        let expected = reason.map(Err);
        assert!(heard.iter().all(|&(o, step)| Some(o) == expected && step.is_none()), "{kind:?}");
        assert_eq!(ticks, 29, "{kind:?}");
        let counted = world.ticks(2_900_000) as f64 * f64::from(TICK);
        assert!((f64::from(robot.localizer().pose().x.0) - counted).abs() < 1e-5);
    }
}

#[test]
fn settings_that_stop_the_clock_are_refused() {
    let zero = Duration::from_ticks(0);
    let good = Settings::default();
    let new = |settings| {
        let walls = walls();
        let localizer = robot(&walls, TICK, SCHEDULE, good).localizer().clone();
        Robot::new(localizer, Wheels::alike(wheel(TICK)), settings).map(|_| ())
    };
    assert_eq!(new(good), Ok(()));
    let period = Settings { encoder_period: zero, ..good };
    assert_eq!(new(period), Err(SettingsError::EncoderPeriod));
    let patience = zero;
    assert_eq!(new(Settings { patience, ..good }), Err(SettingsError::Patience));
}
