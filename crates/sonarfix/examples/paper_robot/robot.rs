//! The robot of the paper and nothing more: two wheel encoders, one sonar at the centre of the robot, a few walls.
//!
//! Between two ranges the robot predicts its pose from the encoders. For a range it turns the sonar square to the nearest wall,
//! takes one range, and corrects pose, wheel diameters and track width at once. The equation numbers are those of the paper.

use sonarfix::filter::ekf::{Ekf, EkfError, StandardDeviations, StateEstimate};
use sonarfix::filter::motion::{Drive, WheelTravel};
use sonarfix::geometry::pose::{Heading, Point, Pose};
use sonarfix::geometry::units::{Metres, PerRootMetre, Radians, SquareMetres};
use sonarfix::map::Wall;
use sonarfix::sensor::range::ExpectedRange;

/// The sonar is at the midpoint between the wheels.
const MOUNT: Point = Point { x: Metres(0.0), y: Metres(0.0) };
/// Variance of a range: the standard deviation is 2.4 mm.
const RANGE_NOISE: SquareMetres = SquareMetres(0.0024 * 0.0024);
/// Longest range of the sonar.
const MAX_RANGE: Metres = Metres(10.0);
/// A range farther from the expected one than so many standard deviations is not of this wall.
const GATE: f32 = 4.0;

/// The robot in its map.
pub struct PaperRobot<'m> {
    ekf: Ekf,
    walls: &'m [Wall],
}

/// The wall to measure.
pub struct Target<'m> {
    wall: &'m Wall,
    /// Where to turn the sonar, relative to the heading of the robot.
    pub bearing: Radians,
}

/// What became of a range.
#[derive(Debug, PartialEq)]
pub enum Outcome {
    /// It corrected the estimate.
    Accepted,
    /// It is not of this wall: the estimate is unchanged.
    Gated,
}

impl<'m> PaperRobot<'m> {
    /// A robot at `start`, whose position is known to 1 mm and whose heading to 1 mrad; the wheels are known to 1 %, the track
    /// width to 10 mm.
    pub fn new(start: Pose, track_width: Metres, walls: &'m [Wall]) -> Result<Self, EkfError> {
        let drive = Drive {
            track_width,
            wheel_noise: PerRootMetre(Metres(0.0005)),
            scale_walk: PerRootMetre(5e-6),
            track_width_walk: PerRootMetre(Metres(5e-6)),
        };
        let deviations = StandardDeviations {
            x: Metres(0.001),
            y: Metres(0.001),
            heading: Radians(0.001),
            scale_right: 0.01,
            scale_left: 0.01,
            track_width_error: Metres(0.01),
            range_scale: 0.0,
        };
        let ekf = Ekf::new(drive, StateEstimate::at_pose(start), deviations)?;
        Ok(Self { ekf, walls })
    }

    /// Eqs. (3) to (5), at every encoder sample: the pose moves, its uncertainty grows.
    pub fn odometry(&mut self, travel: WheelTravel) -> Result<(), EkfError> {
        self.ekf.predict(travel)
    }

    /// Section 2, steps 1 and 2: the nearest wall to which a perpendicular leads, and the bearing square to it.
    pub fn aim(&self) -> Option<Target<'m>> {
        let state = self.ekf.state();
        let here = Point { x: state.x, y: state.y };
        let mut nearest: Option<(Metres, &Wall)> = None;
        for wall in self.walls {
            let (along, distance) = (wall.along(here), wall.signed_distance(here).abs());
            let is_in_view = along >= Metres(0.0) && along <= wall.length() && distance < MAX_RANGE;
            if is_in_view && nearest.is_none_or(|(least, _)| distance < least) {
                nearest = Some((distance, wall));
            }
        }
        let (_, wall) = nearest?;
        let direction = wall.direction_from(wall.signed_distance(here));
        Some(Target { wall, bearing: direction.from(Heading::new(state.heading)) })
    }

    /// Eqs. (1) and (6): corrects the estimate by a range to the wall, if it is one.
    pub fn fix(&mut self, target: &Target, range: Metres) -> Result<Outcome, EkfError> {
        let expected = ExpectedRange::new(target.wall, MOUNT, &self.ekf.state());
        let innovation = self.ekf.innovation(range, &expected, RANGE_NOISE);
        // Not true for NaN.
        if innovation.nis() <= GATE * GATE {
            self.ekf.update(range, &expected, RANGE_NOISE)?;
            return Ok(Outcome::Accepted);
        }
        Ok(Outcome::Gated)
    }

    /// The estimate: pose, scale errors of the wheels, error of the track width.
    pub fn state(&self) -> StateEstimate {
        self.ekf.state()
    }
}
