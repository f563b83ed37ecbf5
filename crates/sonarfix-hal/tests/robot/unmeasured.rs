//! Two minutes without a single range, for every reason that the loop has: the verdict is not `Tracking` for long, and the
//! deviation grows with the distance. The verdict of a robot that drives is `Lost`, when its deviation exceeds the limit.

use sonarfix::config::PingSchedule;
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::Duration;
use sonarfix::health::{DEGRADED_WITHOUT_FIX, Verdict};
use sonarfix::map::Wall;
use sonarfix_hal::robot::Settings;
use sonarfix_hal::servo::ServoTiming;

use super::rig::{Broken, Drive, Pins, World, millis, pins, robot, run};

const TICK: f32 = 1.0 / 1_024.0;
const EVERY_SECOND: PingSchedule = PingSchedule::Every(Duration::from_ticks(1_000_000));
const DRIVE: Drive = Drive { speed: 0.1, sway: 0.0 };
const STANDS: Drive = Drive { speed: 0.0, sway: 0.0 };
/// While the left wheel rolls backwards: the servo settles too late for a beam square to a wall.
const SPIN: Drive = Drive { speed: 0.22, sway: 0.0 };

/// A corridor along x whose walls are this far from its middle.
fn corridor(half_width: f32) -> [Wall; 2] {
    [half_width, -half_width]
        .map(|y| Wall::new(Point::new(-100.0, y), Point::new(100.0, y)).unwrap())
}

/// After two minutes.
#[derive(Debug)]
struct Outcome {
    /// When the verdict was first `Degraded`, and first `Lost`, seconds.
    degraded: Option<f64>,
    lost: Option<f64>,
    position_deviation: f32,
}

fn two_minutes(drive: Drive, broken: Broken, half_width: f32, schedule: PingSchedule) -> Outcome {
    let walls = corridor(half_width);
    let world = World::new(drive, TICK, 0);
    world.broken.set(broken);
    let mut robot = robot(&walls, TICK, schedule, Settings::default());
    let mut pins: Pins<'_> = pins(&world, ServoTiming::SG90);
    let (mut degraded, mut lost) = (None, None);
    for millisecond in millis(0, 120_000) {
        run(&world, &mut robot, &mut pins, [millisecond]);
        let at = millisecond as f64 * 1e-6;
        match robot.localizer().health().verdict {
            Verdict::Tracking => {}
            Verdict::Degraded => _ = degraded.get_or_insert(at),
            Verdict::Lost => _ = lost.get_or_insert(at),
        }
    }
    let position_deviation = robot.localizer().filter().standard_deviations().y.0;
    Outcome { degraded, lost, position_deviation }
}

#[test]
fn no_reason_for_missing_ranges_leaves_it_tracking() {
    let healthy = Broken::default();
    let cases = [
        ("no wall in reach", DRIVE, healthy, 50.0, EVERY_SECOND),
        ("no wall in reach, standing", STANDS, healthy, 50.0, EVERY_SECOND),
        ("servo dead", DRIVE, Broken { pwm: true, ..healthy }, 1.0, EVERY_SECOND),
        ("trigger dead", DRIVE, Broken { trigger: true, ..healthy }, 1.0, EVERY_SECOND),
        ("no edges", DRIVE, Broken { echo: true, ..healthy }, 1.0, EVERY_SECOND),
        ("no echo", DRIVE, Broken { deaf: true, ..healthy }, 1.0, EVERY_SECOND),
        (
            "no wall square after the servo has settled",
            SPIN,
            Broken { spin: true, deaf: true, ..healthy },
            1.0,
            PingSchedule::AsFastAsPossible,
        ),
    ];
    for (reason, drive, broken, half_width, schedule) in cases {
        let outcome = two_minutes(drive, broken, half_width, schedule);
        let latest = DEGRADED_WITHOUT_FIX.to_micros() as f64 * 1e-6 + 0.2;
        assert!(outcome.degraded.is_some_and(|at| at < latest), "{reason}: {outcome:?}");
        if drive.speed == DRIVE.speed {
            assert!(outcome.lost.is_some_and(|at| at < 45.0), "{reason}: {outcome:?}");
            // The start deviation of the heading, 0.01, over 12 m, which is across the path.
            assert!(outcome.position_deviation > 0.12, "{reason}: {outcome:?}");
        }
    }
}
