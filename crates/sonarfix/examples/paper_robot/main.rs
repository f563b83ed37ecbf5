//! Drives the robot of the paper along two walls. Its wheels are wrong by −0.65 % and +0.02 %, which it does not know.
//!
//! `cargo run --example paper_robot` prints true and estimated state every ten metres. The same robot is run on the paper's
//! whole path by a test, and linked for a microcontroller by `cargo xtask compositions`.

mod robot;

use robot::PaperRobot;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::map::Wall;

/// Errors of the wheels: the right one turns farther than it rolls.
const SCALES: (f32, f32) = (-0.0065, 0.0002);
/// Travel between two samples of the encoders, metres: 0.4 m/s at ten samples per second.
const STEP: f32 = 0.04;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let walls = [
        Wall::new(Point::new(-1.0, 0.0), Point::new(41.0, 0.0))?,
        Wall::new(Point::new(41.0, 0.0), Point::new(41.0, 3.0))?,
    ];
    let mut robot = PaperRobot::new(Pose::new(0.0, 1.5, Radians(0.0)), Metres(0.35), &walls)?;
    for step in 1_u16..=1000 {
        // The robot drives straight along x: each wheel reports what it rolls, less its error.
        robot.odometry(WheelTravel::new(STEP / (1.0 + SCALES.0), STEP / (1.0 + SCALES.1)))?;
        let x = f32::from(step) * STEP;
        if step % 10 == 0
            && let Some(target) = robot.aim()
        {
            // The wall ahead, or the one at the robot's right.
            let is_ahead = target.bearing.abs() < Radians::from_degrees(45.0);
            let to_wall = if is_ahead { 41.0 - x } else { 1.5 };
            robot.fix(&target, Metres(to_wall))?;
        }
        if step % 250 == 0 {
            let state = robot.state();
            let (right, left) = (state.scale_right * 100.0, state.scale_left * 100.0);
            println!(
                "x {x:5.2} m, estimated {:5.2} m; wheels {right:+.2} % {left:+.2} %",
                state.x.0
            );
        }
    }
    Ok(())
}
