//! Straight lines among the pings, found by voting: a range from the foot of a perpendicular puts
//! the wall on a tangent of a circle around the sonar, in a direction within the cone of the beam
//! (Tardós, Neira, Newman, Leonard 2002; regions of constant depth: Leonard and Durrant-Whyte 1992).

use heapless::Vec;

use super::window::Ping;
use sonarfix::geometry::elementary::sqrt;
use sonarfix::geometry::list::{insert_in_order, remove_at};
use sonarfix::geometry::trig::sin_cos;
use sonarfix::geometry::units::Radians;
use sonarfix::geometry::vector::Vector;

/// Lines that are kept.
pub(super) const LINES: usize = 10;
/// Directions that are tried for each ping, as parts of the cone.
pub(super) const TILTS: [f32; 5] = [0.0, -0.45, 0.45, -0.9, 0.9];
/// A ping supports a line that its range meets within this, metres.
const TOLERANCE: f32 = 0.05;
/// Fewer pings than these are no line.
const LEAST_SUPPORT: u16 = 3;
/// Lines with normals within this cosine (15°) and this offset, metres, are the same.
const SAME_DIRECTION: f32 = 0.966;
const SAME_OFFSET: f32 = 0.15;

/// A straight line in the odometry frame: `normal · point = offset`, the normal away from the robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    pub normal: Vector,
    pub offset: f32,
    /// The stretch of the feet of its pings, along `normal.left()`.
    pub stretch: (f32, f32),
    pub support: u16,
}

/// The cosine of 75°: two lines at right angles are separate for any cone.
const LARGEST_SEPARATION: f32 = 0.259;

/// The cosine of 30°: points are on one of two lines at that angle, except near their intersection.
const LIT_SEPARATION: f32 = 0.866;
/// Distance between two points that determine a line, metres.
const APART: (f32, f32) = (0.1, 2.5);

/// The best lines, by their support.
#[derive(Debug, Clone)]
pub(super) struct Lines {
    found: Vec<Line, LINES>,
    /// Cosine and angle of the cone in which a ping may support a line.
    cone: Radians,
    cos_cone: f32,
    /// Whether a ping is a point of its wall, not the distance of a foot.
    is_light: bool,
}

impl Lines {
    /// No lines yet, for a sonar with this cone, or for a ranger of light.
    pub fn new(cone: Radians, is_light: bool) -> Self {
        Self { found: Vec::new(), cone, cos_cone: cos_of_support(cone), is_light }
    }

    /// Removes all lines, for another ranger.
    pub fn restart(&mut self, cone: Radians, is_light: bool) {
        self.found.clear();
        (self.cone, self.cos_cone, self.is_light) = (cone, cos_of_support(cone), is_light);
    }

    /// Whether the pings are points, so that two of them determine a line ([`Self::vote_of_two`]).
    pub fn is_light(&self) -> bool {
        self.is_light
    }

    /// These lines, for tests.
    #[cfg(test)]
    pub fn of(cone: Radians, lines: &[Line]) -> Self {
        Self { found: lines.iter().copied().collect(), ..Self::new(cone, false) }
    }

    pub fn all(&self) -> &[Line] {
        &self.found
    }

    pub fn clear(&mut self) {
        self.found.clear();
    }

    /// Whether two lines are at an angle at which no ping supports both, so that they are not one
    /// wall twice: it may appear as two tangents of its echoes.
    pub fn are_separate(&self, one: &Line, other: &Line) -> bool {
        if self.is_light {
            return one.normal.dot(other.normal).abs() < LIT_SEPARATION;
        }
        let twice = 2.0 * self.cos_cone * self.cos_cone - 1.0;
        let limit = if twice > LARGEST_SEPARATION { twice } else { LARGEST_SEPARATION };
        one.normal.dot(other.normal).abs() < limit
    }

    /// Lets all pings vote on the line of one ping and one tilt.
    pub fn vote(&mut self, pings: &[Ping], voter: usize, tilt: f32) {
        let Some(ping) = pings.get(voter) else { return };
        let Some(range) = ping.range() else { return };
        let normal = ping.axis.turned(Vector::of_angle((self.cone * tilt).0));
        let offset = normal.dot(ping.station.at) + range;
        let mut line = Line { normal, offset, stretch: (0.0, 0.0), support: 0 };
        self.gather(pings, &mut line);
        if line.support >= LEAST_SUPPORT {
            self.keep(line);
        }
    }

    /// Lets all pings vote on the line through the points of one ping and of a later one.
    #[inline(never)]
    pub fn vote_of_two(&mut self, pings: &[Ping], voter: usize, later: usize) {
        let (Some(one), Some(other)) = (pings.get(voter), pings.get(voter + later)) else { return };
        let (Some(at), Some(to)) = (one.point(), other.point()) else { return };
        let along = to.minus(at);
        let length = sqrt(along.length_squared());
        let is_apart = length >= APART.0 && length <= APART.1;
        if !is_apart {
            return;
        }
        let normal = along.left().times(1.0 / length);
        let normal = if normal.dot(one.axis) < 0.0 { normal.times(-1.0) } else { normal };
        let mut line = Line { normal, offset: normal.dot(at), stretch: (0.0, 0.0), support: 0 };
        self.gather(pings, &mut line);
        if line.support >= LEAST_SUPPORT {
            self.keep(line);
        }
    }

    /// Counts the pings that support a line, and finds the stretch that they cover.
    fn gather(&self, pings: &[Ping], line: &mut Line) {
        let (mut support, mut from, mut to) = (0, f32::INFINITY, f32::NEG_INFINITY);
        for ping in pings.iter().filter(|ping| self.supports(ping, line)) {
            let along = if self.is_light {
                ping.point().map_or(0.0, |at| line.normal.left().dot(at))
            } else {
                line.normal.left().dot(ping.station.at)
            };
            from = if along < from { along } else { from };
            to = if along > to { along } else { to };
            support += 1;
        }
        line.support = support;
        line.stretch = (from, to);
    }

    fn supports(&self, ping: &Ping, line: &Line) -> bool {
        ping.range().is_some_and(|range| {
            let ahead = if self.is_light { range * line.normal.dot(ping.axis) } else { range };
            let at = line.normal.dot(ping.station.at) + ahead;
            (at - line.offset).abs() < TOLERANCE && line.normal.dot(ping.axis) >= self.cos_cone
        })
    }

    /// Keeps a line unless a similar one has more support.
    #[inline(never)]
    fn keep(&mut self, line: Line) {
        let similar = self.found.iter().position(|other| {
            other.normal.dot(line.normal) > SAME_DIRECTION
                && (other.offset - line.offset).abs() < SAME_OFFSET
        });
        if let Some(at) = similar {
            match self.found.get(at) {
                Some(other) if other.support < line.support => {
                    remove_at(&mut self.found, at);
                }
                _ => return,
            }
        }
        insert_in_order(&mut self.found, line, |one, other| one.support > other.support);
    }

    /// Fits a line to its pings by one Gauss–Newton step: ranges to 3 cm, and beams that on the mean
    /// are square to it.
    pub fn fit(&mut self, pings: &[Ping], number: usize) {
        const RANGE_WEIGHT: f32 = 1.0 / (0.03 * 0.03);
        let Some(&line) = self.found.get(number) else { return };
        let beam = 0.7 * self.cone.0;
        let beam_weight = if self.is_light { 0.0 } else { 1.0 / (beam * beam) };
        // Normal equations of turn and offset.
        let (mut aa, mut ab, mut bb, mut ga, mut gb) = (1e-3_f32, 0.0, 1e-3_f32, 0.0, 0.0);
        for ping in pings.iter().filter(|ping| self.supports(ping, &line)) {
            let Some(range) = ping.range() else { continue };
            let (ahead, aside) = if self.is_light {
                let met = ping.axis.times(range);
                (line.normal.dot(met), line.normal.left().dot(met))
            } else {
                (range, 0.0)
            };
            let residual = line.normal.dot(ping.station.at) + ahead - line.offset;
            let by_turn = line.normal.left().dot(ping.station.at) + aside;
            let off_axis = line.normal.left().dot(ping.axis);
            aa += RANGE_WEIGHT * by_turn * by_turn + beam_weight;
            ab -= RANGE_WEIGHT * by_turn;
            bb += RANGE_WEIGHT;
            ga += RANGE_WEIGHT * by_turn * residual - beam_weight * off_axis;
            gb -= RANGE_WEIGHT * residual;
        }
        let determinant = aa * bb - ab * ab;
        let turn = -(bb * ga - ab * gb) / determinant;
        let shift = -(aa * gb - ab * ga) / determinant;
        if !(turn.abs() < self.cone.0 && shift.is_finite()) {
            return;
        }
        let mut fitted = Line {
            normal: line.normal.turned(Vector::of_angle(turn)),
            offset: line.offset + shift,
            ..line
        };
        self.gather(pings, &mut fitted);
        if fitted.support >= line.support
            && let Some(slot) = self.found.get_mut(number)
        {
            *slot = fitted;
        }
    }
}

/// Cosine of the angle between a ping's axis and a normal up to which the ping supports the line.
fn cos_of_support(cone: Radians) -> f32 {
    sin_cos(cone * 1.3).1
}

#[cfg(test)]
mod tests;
