//! The bearing of a time-of-flight ranger: a fan of bearings across the travel of the servo, and the one at which the
//! servo stands. Each beam measures the wall that it meets first; the policy chooses among them (`docs/model.md`,
//! "Bearing of a beam").
//!
//! # Non-finite policy
//! Comparisons are written so that a beam whose numbers are NaN is not chosen.

use super::{BearingRule, Candidate, Choice, Planner, Pointing};
use crate::config::LightBeam;
use crate::geometry::pose::{Heading, Point};
use crate::geometry::units::Radians;
use crate::geometry::vector::Vector;
use crate::map::{Wall, WallId};

/// Bearings of the fan: 12.5° apart on a servo of 200°.
const FAN: u32 = 17;
/// Those and the bearing of the last ping.
const BEAMS: u32 = FAN + 1;
/// Beams of a slice of the choice: as many as cost what a slice with a sonar costs.
const SLICE: usize = 3;

/// A beam, and the wall that it meets first.
#[derive(Clone, Copy)]
struct Ray {
    bearing: Radians,
    /// Seconds until the ping.
    until_ping: f32,
    direction: Heading,
    axis: Vector,
    met: Option<NearestWall>,
}

#[derive(Clone, Copy)]
struct NearestWall {
    id: WallId,
    distance: f32,
}

impl Ray {
    /// Notes a wall that is nearer than those before.
    fn meet(&mut self, from: Point, id: WallId, wall: &Wall) {
        let (start, end) = (aside(self.axis, from, wall.from()), aside(self.axis, from, wall.to()));
        if (start > 0.0) == (end > 0.0) {
            return;
        }
        let approach = wall.a() * self.axis.x + wall.b() * self.axis.y;
        let distance = -wall.signed_distance(from).0 / approach;
        if distance >= 0.0 && self.met.is_none_or(|met| distance < met.distance) {
            self.met = Some(NearestWall { id, distance });
        }
    }
}

fn aside(axis: Vector, from: Point, to: Point) -> f32 {
    axis.left().dot(Vector::from(to).minus(from.into()))
}

impl<P: BearingRule> Planner<'_, P> {
    /// Lists the next beams of the fan; returns whether they are the last. Not inlined: its stack is not that of a sonar.
    #[inline(never)]
    pub(super) fn list_beams(&self, beam: LightBeam, choice: &mut Choice) -> bool {
        if !P::CHOOSES {
            choice.take(0, Some(0.0));
            return true;
        }
        let mut number = choice.taken;
        let mut rays = [(); SLICE].map(|()| {
            let ray = self.numbered(number);
            number += 1;
            ray
        });
        self.cast(&mut rays);
        for ray in &rays {
            let candidate = self.by_beam(beam, ray).map(|(_, candidate)| candidate.score);
            choice.take(choice.taken, candidate);
        }
        choice.taken >= BEAMS
    }

    /// The candidate of the beam with this number, and its wall. Not inlined, as above.
    #[inline(never)]
    pub(super) fn by_light(&self, beam: LightBeam, number: u32) -> Option<(WallId, Candidate)> {
        let mut rays = [self.numbered(number)];
        self.cast(&mut rays);
        let [ray] = &rays;
        self.by_beam(beam, ray)
    }

    /// The beam with this number: those of the fan, then that along the bearing of the servo; or the one whose bearing the planner
    /// does not choose.
    #[inline(never)]
    fn numbered(&self, number: u32) -> Ray {
        let (current, rest) = self.standing();
        let (bearing, until_ping) = if let Some(bearing) = self.given_bearing() {
            (bearing, 0.0)
        } else if number >= FAN {
            (current, rest)
        } else {
            let (right, left) = self.sonar.servo;
            #[expect(clippy::cast_precision_loss, reason = "a few bearings")]
            let (number, last) = (number as f32, (FAN - 1) as f32);
            let bearing = right + (left - right) * (1.0 / last) * number;
            let turn = self.duration.turn(bearing - current);
            (bearing, if turn > rest { turn } else { rest })
        };
        let direction = self.heading_after(until_ping).turned(bearing);
        let axis = Vector::of_angle(direction.radians().0);
        Ray { bearing, until_ping, direction, axis, met: None }
    }

    /// Finds the wall that each ray meets first.
    #[inline(never)]
    fn cast(&self, rays: &mut [Ray]) {
        let from = self.view.position();
        for (id, wall) in self.map.near(from, self.sonar.max_range) {
            for ray in &mut *rays {
                ray.meet(from, id, &wall);
            }
        }
    }

    /// A beam at the wall that it meets first, if that can be measured.
    #[inline(never)]
    fn by_beam(&self, beam: LightBeam, ray: &Ray) -> Option<(WallId, Candidate)> {
        let Ray { bearing, until_ping, direction, met, .. } = *ray;
        let NearestWall { id, .. } = met?;
        let sight = self.view.lit(&self.map.wall(id)?, beam, direction).ok()?;
        if !self.view.is_square(sight.off) {
            return None;
        }
        let pointing = Pointing { bearing, off: sight.off, until_ping };
        let mut candidate = self.candidate(id, &sight, &pointing);
        candidate.score = self.score_of(&candidate, id, self.config.policy);
        // False for NaN.
        (candidate.score >= 0.0).then_some((id, candidate))
    }
}
