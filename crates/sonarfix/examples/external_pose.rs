//! A global pose from outside: a marker, a docking station or an operator provides the pose, and the
//! localizer continues from it with the calibration that it has learned.
//!
//! ```sh
//! cargo run --package sonarfix --example external_pose
//! ```

use std::error::Error;

use sonarfix::config::Config;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::localizer::{Localizer, Start};
use sonarfix::map::{Map, Wall};

fn main() -> Result<(), Box<dyn Error>> {
    let (a, b) = (Point::new(0.0, 0.0), Point::new(6.0, 0.0));
    let (c, d) = (Point::new(6.0, 5.0), Point::new(0.0, 5.0));
    let walls = [Wall::new(a, b)?, Wall::new(b, c)?, Wall::new(c, d)?, Wall::new(d, a)?];
    let start = Start {
        pose: Pose::new(1.0, 1.0, Radians(0.0)),
        position_deviation: Metres(0.05),
        heading_deviation: Radians::from_degrees(2.0),
    };
    let config = Config::for_track_width(Metres(0.16));
    let mut localizer = Localizer::new(config, Map::new(&walls), start, Instant::from_ticks(0))?;

    // Drive 2 m along x with ranges that are exact; the encoders report 1 % too little.
    let mut x = 1.0;
    for step in 1..=100_u64 {
        x += 0.0202;
        let now = Instant::from_ticks(100_000 * step);
        localizer.odometry(now, WheelTravel::new(0.02, 0.02))?;
        if let Ok(aim) = localizer.aim()
            && let Some(wall) = walls.get(aim.wall.0 as usize)
        {
            let range = wall.signed_distance(Point::new(x, 1.0)).abs();
            let _fix = localizer.fix(&aim, Some(range));
        }
    }
    report("after 2 m", &localizer);

    // The robot is moved. A marker at its new place provides the pose, with deviations of 2 cm and 1°.
    localizer.set_pose(&Start {
        pose: Pose::new(5.0, 4.0, Radians::from_degrees(90.0)),
        position_deviation: Metres(0.02),
        heading_deviation: Radians::from_degrees(1.0),
    })?;
    report("after the marker", &localizer);
    Ok(())
}

fn report(when: &str, localizer: &Localizer) {
    let (state, deviation) = (localizer.filter().state(), localizer.filter().standard_deviations());
    println!(
        "{when:16}  x {:.3} m ± {:4.1} mm, y {:.3} m ± {:4.1} mm, heading {:5.1}° ± {:.2}°, \
         right wheel {:+.2} % ± {:.2} %",
        state.x.0,
        1e3 * deviation.x.0,
        state.y.0,
        1e3 * deviation.y.0,
        state.heading.to_degrees(),
        deviation.heading.to_degrees(),
        100.0 * state.scale_right,
        100.0 * deviation.scale_right,
    );
}
