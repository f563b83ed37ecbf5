//! Headings and positions from outside in the loop: they wait for their step, and each has an outcome.

use sonarfix::config::PingSchedule;
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::{Duration, Instant, Metres, Radians};
use sonarfix::localizer::{AbsoluteFix, AbsoluteRefusal};
use sonarfix::sensor::absolute::{AbsoluteMeasurement, PositionNoise};
use sonarfix_hal::robot::{AbsoluteResult, Occupied, Report, Settings};
use sonarfix_hal::servo::ServoTiming;

use super::rig::{Drive, World, millis, pins, robot, run, walls};

const TICK: f32 = 1.0 / 1_024.0;
const DRIVE: Drive = Drive { speed: 0.2, sway: 0.0 };
const FAST: PingSchedule = PingSchedule::AsFastAsPossible;

fn at(millis: u64) -> Instant {
    Instant::from_ticks(millis * 1_000)
}

fn heading() -> AbsoluteMeasurement {
    AbsoluteMeasurement::Heading { angle: Radians(0.0), deviation: Radians(0.05) }
}

fn position(x: f32) -> AbsoluteMeasurement {
    let noise = PositionNoise::circular(Metres(0.03));
    AbsoluteMeasurement::Position { point: Point::new(x, 0.0), noise }
}

fn results(reports: &[(u64, Report)]) -> Vec<AbsoluteResult> {
    reports.iter().filter_map(|(_, report)| report.absolute).collect()
}

/// It is used after the step in which it was made, whether a tick or an echo ends that, one in a poll.
#[test]
fn a_measurement_waits_for_its_step() {
    let (walls, world) = (walls(), World::new(DRIVE, TICK, 0));
    let mut robot = robot(&walls, TICK, FAST, Settings::default());
    let mut pins = pins(&world, ServoTiming::SG90);
    run(&world, &mut robot, &mut pins, millis(0, 1_000));
    let mut taken = 0;
    for poll in millis(1_000, 8_000) {
        let measured_at = at(poll / 1_000);
        if poll % 370_000 == 0 {
            let x = world.x(poll) as f32;
            assert_eq!(robot.absolute(measured_at, &heading()), Ok(()));
            assert_eq!(robot.absolute(measured_at, &position(x)), Ok(()));
            assert_eq!(robot.absolute(measured_at, &heading()), Err(Occupied));
            assert_eq!(robot.absolute(measured_at, &position(x)), Err(Occupied));
        }
        let before = robot.localizer().time();
        let reports = run(&world, &mut robot, &mut pins, [poll]);
        for result in results(&reports) {
            assert!(matches!(result.fix, AbsoluteFix::Accepted(_)), "{result:?}");
            assert!(result.measured_at <= result.at && result.at >= before);
            assert!(result.at.ticks() - result.measured_at.ticks() <= 140_000, "{result:?}");
            taken += 1;
        }
    }
    assert_eq!(taken, 2 * 19);
}

/// One that arrives after its step has ended is used if that is the latest, else refused by its name.
#[test]
fn a_late_measurement_is_used_in_the_latest_step_only() {
    let (walls, world) = (walls(), World::new(DRIVE, TICK, 0));
    let every_minute = PingSchedule::Every(Duration::from_ticks(60_000_000));
    let mut robot = robot(&walls, TICK, every_minute, Settings::default());
    let mut pins = pins(&world, ServoTiming::SG90);
    run(&world, &mut robot, &mut pins, millis(0, 1_051));
    for (measured_at, is_used) in [(900, true), (899, false), (1_000, true), (950, true)] {
        assert_eq!(robot.absolute(at(measured_at), &heading()), Ok(()));
        let now = robot.localizer().time();
        let reports = run(&world, &mut robot, &mut pins, [1_051_000]);
        let [result] = results(&reports)[..] else { panic!("{reports:?}") };
        assert_eq!((result.at, result.measured_at), (now, at(measured_at)));
        let expected = AbsoluteFix::Refused(AbsoluteRefusal::BeforeLastStep);
        assert_eq!(result.fix.is_used(), is_used);
        assert!(is_used || result.fix == expected);
    }
}

/// Nothing is refused because the loop rests: a poll is due at once.
#[test]
fn a_resting_loop_wakes_up() {
    let (walls, world) = (walls(), World::new(DRIVE, TICK, 0));
    let mut robot = robot(&walls, TICK, FAST, Settings::default());
    let mut pins = pins(&world, ServoTiming::SG90);
    run(&world, &mut robot, &mut pins, millis(0, 1_001));
    let quiet = (1_001..1_100).find(|&millis| {
        world.advance(millis * 1_000);
        robot.rest(at(millis), &mut pins)
    });
    let now = quiet.unwrap() + 1;
    assert_eq!(robot.absolute(robot.localizer().time(), &heading()), Ok(()));
    world.advance(now * 1_000);
    assert!(!robot.rest(at(now), &mut pins));
    let reports = run(&world, &mut robot, &mut pins, [now * 1_000]);
    assert_eq!(results(&reports).len(), 1);
}

/// A loop that is polled once a tick has a measurement and the tick in one poll, so that it loses neither.
#[test]
fn a_loop_that_is_polled_once_a_tick_loses_no_tick() {
    let (walls, world) = (walls(), World::new(DRIVE, TICK, 0));
    let settings = Settings::default();
    let period = settings.encoder_period.ticks();
    let every_minute = PingSchedule::Every(Duration::from_ticks(60_000_000));
    let mut robot = robot(&walls, TICK, every_minute, settings);
    let mut pins = pins(&world, ServoTiming::SG90);
    run(&world, &mut robot, &mut pins, (0..3).map(|tick| tick * period));
    for tick in 3..50 {
        assert_eq!(robot.absolute(robot.localizer().time(), &heading()), Ok(()));
        let reports = run(&world, &mut robot, &mut pins, [tick * period]);
        assert!(results(&reports)[0].fix.is_used());
        let [(_, Report { tick: Some(tick), .. })] = &reports[..] else { panic!("{reports:?}") };
        assert_eq!((tick.skipped, tick.lateness.to_micros()), (0, 0));
    }
}
