//! The localizer with a heading and a pose from outside.
#![no_std]
#![no_main]

use emulated_board::meter::{Cost, Meter};
use emulated_board::report;
use emulated_probe::{Robot, STEPS, STEPS_A_RANGE, end, room, travel};
use sonarfix::config::Config;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::sensor::absolute::{AbsoluteMeasurement, PoseNoise};

/// A measurement and its time.
struct Measured {
    at: Instant,
    measurement: AbsoluteMeasurement,
}

#[unsafe(no_mangle)]
extern "C" fn probe_heading(robot: &mut Robot, measured: &Measured) {
    let fix = robot.localizer.absolute(measured.at, &measured.measurement);
    robot.all_well &= fix.is_used();
}

#[unsafe(no_mangle)]
extern "C" fn probe_pose(robot: &mut Robot, measured: &Measured) {
    let fix = robot.localizer.absolute(measured.at, &measured.measurement);
    robot.all_well &= fix.is_used();
}

#[emulated_board::entry]
fn main() -> ! {
    end(drive())
}

fn drive() -> Option<bool> {
    let walls = room().ok()?;
    let mut robot = Robot::new(Config::for_track_width(Metres(0.16)), &walls).ok()?;
    let mut meter = Meter::start();
    let [mut headings, mut poses] = [Cost::default(); 2];
    for step in 0..STEPS {
        let now = u64::from(step + 1) * 100_000;
        let rolled = robot.localizer.odometry(Instant::from_ticks(now), travel(step));
        robot.all_well &= rolled.is_ok();
        if !(step + 1).is_multiple_of(STEPS_A_RANGE / 2) {
            continue;
        }
        // In the middle of the step, with a noise of a compass and of a camera.
        let at = Instant::from_ticks(now - 50_000);
        let pose = robot.localizer.pose();
        let angle = pose.heading.radians() + Radians(0.01);
        if (step + 1).is_multiple_of(STEPS_A_RANGE) {
            let measurement = AbsoluteMeasurement::Heading { angle, deviation: Radians(0.05) };
            meter.measure(&mut headings, probe_heading, &mut robot, &Measured { at, measurement });
        } else {
            let noise = PoseNoise::independent(Metres(0.03), Radians(0.05));
            let Point { x, y } = pose.position();
            let measurement =
                AbsoluteMeasurement::Pose { pose: Pose::new(x.0 + 0.01, y.0, angle), noise };
            meter.measure(&mut poses, probe_pose, &mut robot, &Measured { at, measurement });
        }
    }
    report::cost(c"heading", &headings);
    report::cost(c"pose", &poses);
    report::line(c"object", u32::try_from(size_of::<AbsoluteMeasurement>()).unwrap_or(u32::MAX));
    Some(robot.all_well)
}
