//! A drive without noise in a rectangular room, and recordings without a map.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Vector2, Vector3};
use sonarfix_batch::odometry::WheelNoise;
use sonarfix_batch::recording::{Ping, Reading, Recording, StartPose};
use sonarfix_survey::problem::Robot;
use sonarfix_survey::survey::{Motion, SurveyError, reversed, survey};

const ROBOT: Robot = Robot {
    track_width: 0.16,
    mount: [0.05, 0.0],
    wheel_noise: WheelNoise::independent(1e-3),
    reach: [0.05, 3.0],
};
/// The room.
const SIZE: [f64; 2] = [4.0, 3.0];
/// Half of the cone.
const CONE: f64 = 0.26;

/// A robot that drives and pings in the room.
struct Simulated {
    pose: Vector3<f64>,
    travel: [f64; 2],
    time: f64,
    bearing: f64,
    has_walls: bool,
    recording: Recording,
}

impl Simulated {
    /// At a metre from two walls, facing along x.
    fn new(has_walls: bool) -> Self {
        let pose = Vector3::new(1.0, 0.9, 0.0);
        let mut recording = Recording::default();
        recording.readings.push(Reading { time: 0.0, travel: [0.0; 2] });
        recording.start = Some(StartPose { time: 0.0, pose, position: 0.01, heading: 0.01 });
        Self { pose, travel: [0.0; 2], time: 0.0, bearing: -1.7, has_walls, recording }
    }

    /// The range to the nearest wall whose perpendicular is in the cone.
    fn range(&self) -> Option<f64> {
        let at = self.pose.xy() + Vector2::new(self.pose.z.cos(), self.pose.z.sin()) * 0.05;
        let direction = self.pose.z + self.bearing;
        let walls =
            [(0.0, SIZE[0] - at.x), (FRAC_PI_2, SIZE[1] - at.y), (PI, at.x), (-FRAC_PI_2, at.y)];
        let heard = walls.iter().filter(|(normal, distance)| {
            let off = (direction - normal + PI).rem_euclid(2.0 * PI) - PI;
            self.has_walls && off.abs() < CONE && *distance < 3.0
        });
        heard.map(|wall| wall.1).min_by(f64::total_cmp)
    }

    fn step(&mut self, advance: f64, turn: f64) {
        let middle = self.pose.z + 0.5 * turn;
        self.pose += Vector3::new(advance * middle.cos(), advance * middle.sin(), turn);
        let half = 0.5 * ROBOT.track_width * turn;
        self.travel = [self.travel[0] + advance + half, self.travel[1] + advance - half];
        self.time += 0.1;
        self.recording.readings.push(Reading { time: self.time, travel: self.travel });
        let range = self.range();
        let ping = Ping { time: self.time, bearing: self.bearing, range };
        self.recording.pings.push(ping);
        self.bearing = if self.bearing > 1.7 { -1.7 } else { self.bearing + 0.31 };
    }

    /// Legs of the path in steps of 12 mm, each followed by a turn to the left.
    fn drive(mut self, legs: &[u32]) -> Recording {
        for leg in legs {
            for _ in 0..*leg {
                self.step(0.012, 0.0);
            }
            for _ in 0..20 {
                self.step(0.0, FRAC_PI_2 / 20.0);
            }
        }
        self.recording
    }
}

#[test]
fn the_walls_of_a_room_are_found_where_they_are() {
    let recording = Simulated::new(true).drive(&[167, 100, 167, 100, 167]);
    let found = survey(&recording, ROBOT).unwrap();
    assert!(found.is_sure(), "{:?}", found.reasons);
    assert_eq!(found.walls.len(), 4, "{:#?}", found.walls);
    for wall in &found.walls {
        let (from, to) = (wall.from, wall.to);
        let [x, y] = [0, 1].map(|k| (from[k] - to[k]).abs());
        let k = usize::from(y < x);
        assert!(x.min(y) < 0.01, "{wall:?}");
        let off = [0.0, SIZE[k]].map(|at| (at - from[k]).abs());
        assert!(off[0].min(off[1]) < 0.01, "{wall:?}");
        // The robot's side is on the left.
        let relative = Vector2::new(2.0, 1.5) - from;
        assert!((to - from).perp(&relative) > 0.0, "{wall:?}");
    }
}

#[test]
fn recordings_without_a_map_are_refused() {
    let silent = Simulated::new(false).drive(&[167, 100, 167, 100]);
    assert_eq!(survey(&silent, ROBOT).unwrap_err(), SurveyError::NoWalls(0));
    let short = Simulated::new(true).drive(&[167]);
    assert!(matches!(survey(&short, ROBOT), Err(SurveyError::TooShort(_))));
}

#[test]
fn a_recording_that_is_reversed_twice_is_the_same() {
    let mut recording = Simulated::new(true).drive(&[80, 80]);
    recording.start = None;
    assert_eq!(reversed(&reversed(&recording)), recording);
}

#[test]
fn the_motion_between_two_sets_of_points_is_found() {
    let truth = Motion { turn: 0.7, shift: Vector2::new(-1.0, 2.0) };
    let points = [[0.0, 0.0], [1.0, 0.2], [-3.0, 4.0], [2.0, 2.0]].map(Vector2::from);
    let pairs: Vec<_> = points.iter().map(|point| (*point, truth.of(point))).collect();
    let found = Motion::fit(&pairs);
    assert!((found.turn - truth.turn).abs() < 1e-12);
    assert!((found.shift - truth.shift).norm() < 1e-12);
}
