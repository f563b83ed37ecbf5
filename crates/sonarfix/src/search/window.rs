//! The window: recent pings in the odometry frame, each from a place or in a direction from which
//! no other of them was sent.
//!
//! The frame's origin is the *reference*: where the robot was when the current cycle began. Its
//! axes keep the directions that they had when the search began.
//!
//! # Non-finite policy
//! Travel and pings that are not finite are refused by [`super::Search`], so the window is finite.

use heapless::Vec;

use super::vector::Vector;
use crate::trig::sin_cos;
use crate::units::Radians;

/// A ping is novel if no ping of the window was sent from within this distance, metres, in the same direction.
const NOVEL_DISTANCE: f32 = 0.3;
/// Orders of scoring: a stride that does not divide the number of pings visits each once, and
/// neighbours in the order differ in place and direction.
const STRIDES: [usize; 4] = [37, 41, 43, 47];

/// A place on the path by odometry. Distances are signed: negative before the reference.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Station {
    /// Position of the robot's axle, or of the sonar of a ping.
    pub at: Vector,
    /// Distance travelled since the reference, metres.
    pub travelled: f32,
    /// ∫ travelled · d(position): what a heading drift of one radian per metre moves it to the right.
    pub moment: Vector,
}

impl Station {
    /// The position if the odometry's heading drifts by `drift` radians per metre, first order.
    pub fn drifted(&self, drift: f32) -> Vector {
        self.at.plus(self.moment.left().times(drift))
    }

    /// The same place seen from another reference.
    fn seen_from(&self, reference: &Self) -> Self {
        let back = self.at.minus(reference.at);
        Self {
            at: back,
            travelled: self.travelled - reference.travelled,
            moment: self.moment.minus(reference.moment).minus(back.times(reference.travelled)),
        }
    }
}

/// A ping of the window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ping {
    pub station: Station,
    /// Unit vector along the beam.
    pub axis: Vector,
    /// Metres; negative: no echo.
    range: f32,
}

impl Ping {
    pub fn range(&self) -> Option<f32> {
        (self.range >= 0.0).then_some(self.range)
    }
}

/// Recent novel pings and the robot's pose by odometry.
#[derive(Debug, Clone)]
pub(super) struct Window<const PINGS: usize> {
    pings: Vec<Ping, PINGS>,
    robot: Station,
    heading: f32,
    /// Novel pings since the search began, wrapping.
    taken: u16,
}

impl<const PINGS: usize> Window<PINGS> {
    pub fn new() -> Self {
        Self { pings: Vec::new(), robot: Station::default(), heading: 0.0, taken: 0 }
    }

    /// Removes all pings and moves the origin to the robot.
    pub fn restart(&mut self) {
        self.pings.clear();
        self.robot = Station::default();
        self.heading = 0.0;
        self.taken = 0;
    }

    pub fn pings(&self) -> &[Ping] {
        &self.pings
    }

    pub fn taken(&self) -> u16 {
        self.taken
    }

    pub fn robot(&self) -> &Station {
        &self.robot
    }

    /// Heading of the robot in the odometry frame, radians.
    pub fn heading(&self) -> f32 {
        self.heading
    }

    /// Moves the robot by a distance and a turn, both finite.
    pub fn drive(&mut self, advance: f32, turn: f32) {
        let (sin, cos) = sin_cos(Radians(self.heading + 0.5 * turn));
        let step = Vector::new(cos, sin).times(advance);
        let middle = self.robot.travelled + 0.5 * advance.abs();
        self.robot.at = self.robot.at.plus(step);
        self.robot.travelled += advance.abs();
        self.robot.moment = self.robot.moment.plus(step.times(middle));
        self.heading = crate::pose::Heading::new(Radians(self.heading + turn)).radians().0;
    }

    /// Takes a ping of the sonar mounted at `mount` of the robot frame, if it is novel.
    ///
    /// `novel` is the angle within which a ping from the same place is not novel: before the robot
    /// has left the first place, and after.
    pub fn ping(
        &mut self,
        mount: Vector,
        bearing: f32,
        range: Option<f32>,
        novel: [Radians; 2],
    ) -> bool {
        let (sin, cos) = sin_cos(Radians(self.heading));
        let arm = mount.turned(Vector::new(cos, sin));
        let (sin, cos) = sin_cos(Radians(self.heading + bearing));
        let axis = Vector::new(cos, sin);
        let mut station = self.robot;
        station.at = station.at.plus(arm);
        station.moment = station.moment.plus(arm.times(station.travelled));
        let [at_rest, driving] = novel;
        let first = self.pings.first().map_or(station.travelled, |ping| ping.station.travelled);
        let novel = if station.travelled - first > NOVEL_DISTANCE { driving } else { at_rest };
        let novel_cosine = sin_cos(novel).1;
        let is_known = self.pings.iter().any(|ping| {
            ping.axis.dot(axis) > novel_cosine
                && ping.station.at.minus(station.at).length_squared()
                    < NOVEL_DISTANCE * NOVEL_DISTANCE
        });
        if is_known {
            return false;
        }
        if self.pings.is_full() {
            // The oldest; a shift of less than 4 KiB, once per novel ping.
            self.pings.remove(0);
        }
        // There is room now, unless there is room for none.
        self.taken = self.taken.wrapping_add(1);
        self.pings.push(Ping { station, axis, range: range.unwrap_or(-1.0) }).is_ok()
    }

    /// Makes the robot's present place the reference and returns it in the old frame.
    pub fn rebase(&mut self) -> Station {
        let reference = self.robot;
        for ping in &mut self.pings {
            ping.station = ping.station.seen_from(&reference);
        }
        self.robot = Station::default();
        reference
    }

    /// The `k`-th ping in the order of scoring.
    pub fn in_order(&self, k: usize) -> Option<&Ping> {
        let count = self.pings.len();
        if k >= count {
            return None;
        }
        let stride = STRIDES.into_iter().find(|stride| !count.is_multiple_of(*stride))?;
        self.pings.get((k * stride) % count)
    }
}
