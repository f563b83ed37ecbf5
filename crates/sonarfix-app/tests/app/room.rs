//! The room of the rig's map with exact geometry: where the robot is, and what its sonar hears.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use sonarfix::localizer::Start;

/// Length of the room along x and along y, metres; a corner is the origin.
pub const ROOM: [f64; 2] = [4.0, 3.0];
/// Diameter and edges of a wheel, track width of the rig's robot.
const DIAMETER: f64 = 0.065;
const EDGES: f64 = 1_024.0;
const TRACK_WIDTH: f64 = 0.16;
/// Half of the sonar's beam, radians.
const CONE: f64 = 0.25;

/// The true pose of the robot.
#[derive(Debug, Clone, Copy)]
pub struct Truth {
    pub x: f64,
    pub y: f64,
    pub heading: f64,
}

impl Truth {
    /// A robot that stands where this start is.
    pub fn at(start: &Start) -> Self {
        let heading = start.pose.heading.radians().0;
        Self { x: start.pose.x.0.into(), y: start.pose.y.0.into(), heading: heading.into() }
    }

    /// Rolls the wheels by these numbers of edges.
    pub fn roll(&mut self, right: i16, left: i16) {
        let edge = PI * DIAMETER / EDGES;
        let [right, left] = [right, left].map(|edges| edge * f64::from(edges));
        let (advance, turn) = (0.5 * (right + left), (right - left) / TRACK_WIDTH);
        let middle = self.heading + 0.5 * turn;
        self.x += advance * middle.cos();
        self.y += advance * middle.sin();
        self.heading += turn;
    }

    /// The distance of the nearest wall whose perpendicular is in the beam of a sonar at this bearing; the sonar is at
    /// the centre of the robot.
    pub fn range(&self, bearing: f64) -> Option<f64> {
        let [length, width] = ROOM;
        let walls = [length - self.x, width - self.y, self.x, self.y];
        let normals = [0.0, FRAC_PI_2, PI, -FRAC_PI_2];
        let beam = self.heading + bearing;
        let is_in_beam = |normal: f64| (beam - normal + PI).rem_euclid(TAU) - PI;
        let heard = walls.into_iter().zip(normals);
        let heard = heard.filter(|(_, normal)| is_in_beam(*normal).abs() <= CONE);
        heard.map(|(distance, _)| distance).filter(|distance| *distance > 0.0).reduce(f64::min)
    }
}

#[test]
fn the_room_is_exact() {
    let mut truth = Truth { x: 1.0, y: 1.0, heading: FRAC_PI_2 };
    assert_eq!(truth.range(0.0), Some(2.0));
    assert_eq!(truth.range(-FRAC_PI_2), Some(3.0));
    assert_eq!(truth.range(0.25 * PI), None);
    truth.roll(1_024, 1_024);
    let wall = truth.range(0.1).unwrap();
    assert!((wall - (2.0 - 0.065 * PI)).abs() < 1e-12);
}
