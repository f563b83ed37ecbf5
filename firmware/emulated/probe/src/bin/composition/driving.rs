//! The controllers of a robot that drives a route: linked and not measured.

use core::hint::black_box;

use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::{Duration, Metres, MetresPerSecond};
use sonarfix::localizer::Localizer;
use sonarfix_drive::obstacles::{Obstacles, Ping, Settings};
use sonarfix_drive::pursuit::{Limits, Pursuit, Situation};
use sonarfix_drive::wheel::{self, Motor, SpeedController};

/// Bytes of the controllers; the route is the robot's own.
pub const BYTES: usize = size_of::<Driver>();

const MOTOR: Motor = Motor {
    full_speed: MetresPerSecond(0.6),
    dead_band: 0.15,
    time_constant: Duration::from_ticks(80_000),
    travel_per_tick: Metres(0.0004),
};
const PERIOD: Duration = Duration::from_ticks(50_000);

/// The route, the objects on it, and the speeds of the right and the left wheel.
struct Driver<'r> {
    pursuit: Pursuit<'r>,
    obstacles: Obstacles,
    wheels: [SpeedController; 2],
}

impl<'r> Driver<'r> {
    fn new(route: &'r [Point]) -> Option<Self> {
        let limits =
            wheel::Limits { response: PERIOD, ramp: Duration::from_ticks(500_000), duty: 1.0 };
        let wheel = SpeedController::new(black_box(MOTOR), limits).ok()?;
        Some(Self {
            pursuit: Pursuit::new(route, Limits::SMALL).ok()?,
            obstacles: Obstacles::new(Settings::SMALL),
            wheels: [wheel, wheel],
        })
    }
}

/// What a robot drives by.
struct Seen<'l, 'm> {
    localizer: &'l Localizer<'m>,
    ping: Ping,
    positions: [i64; 2],
}

#[unsafe(no_mangle)]
extern "C" fn probe_drive(driver: &mut Driver, seen: &Seen) {
    let Seen { localizer, ping, positions } = seen;
    driver.obstacles.take(&localizer.map(), ping);
    let pose = localizer.pose();
    let situation = Situation {
        pose,
        deviation: localizer.filter().standard_deviations().x,
        verdict: localizer.health().verdict,
        ahead: driver.obstacles.ahead(localizer.time(), pose),
    };
    let (_, motion) = driver.pursuit.drive(&situation);
    let speeds = motion.wheels(localizer.config().drive.track_width);
    for ((wheel, speed), position) in driver.wheels.iter_mut().zip(speeds).zip(positions) {
        let _ = black_box(wheel.update(speed, *position, PERIOD));
    }
}

/// Links the controllers of a robot at the pose of this localizer.
pub fn link(localizer: &Localizer) {
    let route = black_box([Point::new(2.0, 1.1), Point::new(2.0, 4.0)]);
    let Some(mut driver) = Driver::new(&route) else { return };
    let sonar = &localizer.config().rangers.first;
    let ping = Ping {
        at: localizer.time(),
        pose: localizer.pose(),
        mount: sonar.mount,
        bearing: sonar.servo.0,
        half_cone: sonar.cone,
        range: Some(Metres(0.8)),
    };
    probe_drive(&mut driver, &black_box(Seen { localizer, ping, positions: [10, -10] }));
}
