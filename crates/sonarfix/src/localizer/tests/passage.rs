//! Estimated paths through a wall and beside it.

use proptest::prelude::*;

use crate::config::Config;
use crate::filter::motion::WheelTravel;
use crate::geometry::pose::{Point, Pose};
use crate::geometry::units::{Instant, Metres, Radians};
use crate::health::Verdict;
use crate::localizer::{Localizer, Start};
use crate::map::{Map, Wall};

const STEP: f32 = 0.02;
const TRACK: f32 = 0.16;

/// A robot that drives without a range.
struct Drive<'a> {
    localizer: Localizer<'a>,
    ticks: u64,
}

impl<'a> Drive<'a> {
    fn new(walls: &'a [Wall], pose: Pose, deviation: f32) -> Self {
        let config = Config::for_track_width(Metres(TRACK));
        let now = Instant::from_ticks(0);
        let start = start(pose, deviation);
        Self { localizer: Localizer::new(config, Map::new(walls), start, now).unwrap(), ticks: 0 }
    }

    /// Drives so far in steps, to the left by `curvature` (1/m); returns how far the robot got before the verdict was `Lost`.
    fn ahead(&mut self, distance: f32, curvature: f32) -> Option<f32> {
        let difference = 0.5 * TRACK * curvature * STEP;
        let mut driven = 0.0;
        while driven < distance {
            self.ticks += 100_000;
            let travel = WheelTravel::new(STEP + difference, STEP - difference);
            self.localizer.odometry(Instant::from_ticks(self.ticks), travel).unwrap();
            driven += STEP;
            if self.localizer.health().verdict == Verdict::Lost {
                return Some(driven);
            }
        }
        None
    }
}

fn start(pose: Pose, deviation: f32) -> Start {
    Start { pose, position_deviation: Metres(deviation), heading_deviation: Radians(0.01) }
}

/// A wall of 3 m through the origin, in a direction.
fn wall(direction: f32) -> [Wall; 1] {
    let (sin, cos) = (libm::sinf(direction), libm::cosf(direction));
    [Wall::new(Point::new(-1.5 * cos, -1.5 * sin), Point::new(1.5 * cos, 1.5 * sin)).unwrap()]
}

/// The pose at `along` and `beside` a wall in this direction, with a heading relative to it.
fn pose(direction: f32, along: f32, beside: f32, heading: f32) -> Pose {
    let (sin, cos) = (libm::sinf(direction), libm::cosf(direction));
    Pose::new(cos * along - sin * beside, sin * along + cos * beside, Radians(direction + heading))
}

proptest! {
    #[test]
    fn a_path_through_a_wall_makes_the_robot_lost_soon_behind_it(
        direction in -3.0_f32..3.0,
        along in -0.6_f32..0.6,
        before in 0.25_f32..0.6,
        oblique in -0.6_f32..0.6,
        deviation in 0.002_f32..0.02,
    ) {
        let walls = wall(direction);
        let square = core::f32::consts::FRAC_PI_2 + oblique;
        let mut drive = Drive::new(&walls, pose(direction, along, -before, square), deviation);
        let to_wall = before / libm::cosf(oblique);
        let lost = drive.ahead(to_wall + 0.4, 0.0);
        prop_assert!(lost.is_some_and(|driven| driven > to_wall), "{lost:?}, wall after {to_wall}");
    }

    #[test]
    fn a_path_before_beside_and_around_a_wall_leads_not_through_it(
        direction in -3.0_f32..3.0,
        beside in 0.06_f32..0.4,
        steps in 13_u8..50,
        deviation in 0.002_f32..0.1,
    ) {
        let walls = wall(direction);
        // Towards it.
        let square = core::f32::consts::FRAC_PI_2;
        let mut drive = Drive::new(&walls, pose(direction, 0.0, -beside - 0.8, square), deviation);
        prop_assert_eq!(drive.ahead(0.78, 0.0), None);
        // Along it, then around its end, and back along the other side.
        let half_circle = f32::from(steps) * STEP;
        let radius = half_circle / core::f32::consts::PI;
        let mut drive = Drive::new(&walls, pose(direction, 0.5, -radius, 0.0), deviation);
        prop_assert_eq!(drive.ahead(1.0 + 0.5 * radius, 0.0), None);
        prop_assert_eq!(drive.ahead(half_circle - 0.5 * STEP, 1.0 / radius), None);
        prop_assert_eq!(drive.ahead(1.0, 0.0), None);
        let beside = walls[0].signed_distance(drive.localizer.pose().position());
        let before = walls[0].signed_distance(pose(direction, 0.5, -radius, 0.0).position());
        prop_assert!(beside.0 * before.0 < 0.0, "it is on the other side: {beside:?}, {before:?}");
    }
}

#[test]
fn a_path_that_may_have_led_around_the_wall_leads_not_through_it() {
    let walls = wall(0.0);
    // 20 cm from its end, known to 10 cm.
    let mut drive = Drive::new(&walls, pose(0.0, 1.3, -0.8, 1.57), 0.1);
    assert_eq!(drive.ahead(1.6, 0.0), None);
}

#[test]
fn a_path_whose_end_may_be_on_the_same_side_leads_not_through_a_wall() {
    let walls = wall(0.0);
    // To 2 deviations behind the wall, and the same backwards; the path is tested at other places each time.
    for farther in 0..10_u8 {
        let before = 0.8 - 0.02 * f32::from(farther);
        let mut drive = Drive::new(&walls, pose(0.0, 0.0, -before, 1.57), 0.05);
        assert_eq!(drive.ahead(before + 0.08, 0.0), None, "from {before} m before it");
        let mut drive = Drive::new(&walls, pose(0.0, 0.0, 0.1, -1.57), 0.05);
        assert_eq!(drive.ahead(0.1 + before, 0.0), None, "to {before} m before it");
    }
}

#[test]
fn a_new_pose_begins_a_new_path() {
    let walls = wall(0.0);
    let mut drive = Drive::new(&walls, pose(0.0, 0.0, -0.5, 1.57), 0.005);
    assert!(drive.ahead(1.0, 0.0).is_some());
    for beside in [-0.5, 0.1] {
        let start = start(pose(0.0, 0.0, beside, 1.57), 0.005);
        drive.localizer.set_pose(&start).unwrap();
        assert_eq!(drive.ahead(0.4, 0.0), None, "from {beside} m");
    }
}

#[test]
fn after_a_period_without_odometry_the_path_begins_again() {
    let walls = wall(0.0);
    let mut drive = Drive::new(&walls, pose(0.0, 0.0, -0.3, 1.57), 0.005);
    assert_eq!(drive.ahead(0.28, 0.0), None);
    drive.ticks += 400_000;
    drive.localizer.odometry_missing(Instant::from_ticks(drive.ticks));
    assert_eq!(drive.ahead(0.6, 0.0), None);
    assert!(drive.localizer.pose().y.0 > 0.5);
}
