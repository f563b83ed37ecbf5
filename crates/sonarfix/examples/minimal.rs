//! The minimal loop: a robot drives through a room, pings one wall every 100 ms, and estimates its pose.
//!
//! ```sh
//! cargo run --package sonarfix --example minimal
//! ```
//!
//! Encoders and ranger are replaced by a simulated robot whose right wheel is 1 % larger than nominal; the
//! localizer estimates that, too.

use std::error::Error;

use sonarfix::config::Config;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::localizer::{Fix, Localizer, Start};
use sonarfix::map::{Map, Wall};

const TRACK_WIDTH: f32 = 0.16;

fn main() -> Result<(), Box<dyn Error>> {
    // A room of 4 m × 3 m.
    let (a, b) = (Point::new(0.0, 0.0), Point::new(4.0, 0.0));
    let (c, d) = (Point::new(4.0, 3.0), Point::new(0.0, 3.0));
    let walls = [Wall::new(a, b)?, Wall::new(b, c)?, Wall::new(c, d)?, Wall::new(d, a)?];

    let config = Config::for_track_width(Metres(TRACK_WIDTH));
    let start = Start {
        pose: Pose::new(1.0, 1.0, Radians(0.0)),
        position_deviation: Metres(0.05),
        heading_deviation: Radians::from_degrees(2.0),
    };
    let mut localizer = Localizer::new(config, Map::new(&walls), start, Instant::from_ticks(0))?;

    let mut robot = SimulatedRobot { x: 1.0, y: 1.0, heading: 0.0 };
    println!("   s   estimate x, y, heading    true x, y, heading        deviation   last range");
    for step in 1..=200_u32 {
        let now = Instant::from_ticks(100_000 * u64::from(step));
        // A curve of radius 0.8 m. On a robot: the travel from the encoders.
        let measured = WheelTravel::new(0.0220, 0.0180);
        robot.drive(measured);
        localizer.odometry(now, measured)?;

        // Turn the servo to the bearing, ping, and pass on the range. On a robot: the driver's result.
        let outcome = match localizer.aim() {
            Ok(aim) => {
                let range = walls.get(aim.wall.0 as usize).map(|wall| robot.range(wall));
                match localizer.fix(&aim, range) {
                    Fix::Accepted(innovation) => format!("{:+.1} mm", 1e3 * innovation.value.0),
                    other => format!("{other:?}"),
                }
            }
            Err(reason) => {
                localizer.skip();
                reason.to_string()
            }
        };
        if step % 20 == 0 {
            let pose = localizer.pose();
            let deviation = localizer.filter().standard_deviations();
            println!(
                "{:4.0}   {:.3} m {:.3} m {:6.1}°    {:.3} m {:.3} m {:6.1}°   {:4.1} mm     {outcome}",
                0.1 * f64::from(step),
                pose.x.0,
                pose.y.0,
                pose.heading.radians().to_degrees(),
                robot.x,
                robot.y,
                robot.heading.to_degrees(),
                1e3 * deviation.x.0,
            );
        }
    }
    let state = localizer.filter().state();
    println!(
        "right wheel {:+.2} %, left wheel {:+.2} % (true +1.00 %, 0.00 %); verdict {:?}",
        100.0 * state.scale_right,
        100.0 * state.scale_left,
        localizer.health().verdict
    );
    Ok(())
}

/// A robot whose right wheel is 1 % larger than nominal.
struct SimulatedRobot {
    x: f32,
    y: f32,
    heading: f32,
}

impl SimulatedRobot {
    fn drive(&mut self, measured: WheelTravel) {
        let (right, left) = (1.01 * measured.right.0, measured.left.0);
        let turn = (right - left) / TRACK_WIDTH;
        let direction = self.heading + 0.5 * turn;
        self.x += 0.5 * (right + left) * direction.cos();
        self.y += 0.5 * (right + left) * direction.sin();
        self.heading = (self.heading + turn).rem_euclid(std::f32::consts::TAU);
        if self.heading > std::f32::consts::PI {
            self.heading -= std::f32::consts::TAU;
        }
    }

    fn range(&self, wall: &Wall) -> Metres {
        wall.signed_distance(Point::new(self.x, self.y)).abs()
    }
}
