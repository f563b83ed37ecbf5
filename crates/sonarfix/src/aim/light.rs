//! The bearing of a time-of-flight ranger: a fan of bearings across the travel of the servo, and the one at which the
//! servo stands. Each beam measures the wall that it meets first; the policy chooses among them (`docs/model.md`,
//! "Bearing of a beam").
//!
//! # Non-finite policy
//! Comparisons are written so that a beam whose numbers are NaN is not chosen.

use super::{Aim, Candidate, HYSTERESIS, NoAim, Planner, Pointing};
use crate::config::LightBeam;
use crate::geometry::pose::{Heading, Point};
use crate::geometry::units::Radians;
use crate::geometry::vector::Vector;
use crate::map::{Wall, WallId};

/// Bearings of the fan: 12.5° apart on a servo of 200°.
const FAN: usize = 17;
/// Those and the bearing of the last ping.
const BEAMS: usize = FAN + 1;

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

impl Planner<'_> {
    /// The best beam of the fan. Not inlined: its stack is not that of a sonar.
    #[inline(never)]
    pub(super) fn best_beam(&self, beam: LightBeam) -> Result<Aim, NoAim> {
        self.best_of(beam, self.fan())
    }

    /// A beam along a bearing that the planner does not choose.
    #[inline(never)]
    pub(super) fn beam_at(&self, beam: LightBeam, bearing: Radians) -> Result<Aim, NoAim> {
        self.best_of(beam, [self.ray(bearing, 0.0)])
    }

    fn ray(&self, bearing: Radians, until_ping: f32) -> Ray {
        let direction = self.heading_after(until_ping).turned(bearing);
        let axis = Vector::of_angle(direction.radians().0);
        Ray { bearing, until_ping, direction, axis, met: None }
    }

    fn fan(&self) -> [Ray; BEAMS] {
        let (current, rest) = self.standing();
        let (right, left) = self.sonar.servo;
        let step = (left - right) * (1.0 / LAST_OF_FAN);
        let mut number = 0.0;
        [(); BEAMS].map(|()| {
            let place = number;
            number += 1.0;
            if place > LAST_OF_FAN {
                return self.ray(current, rest);
            }
            let bearing = right + step * place;
            let turn = self.duration.turn(bearing - current);
            self.ray(bearing, if turn > rest { turn } else { rest })
        })
    }

    /// The best of these beams whose wall is not occluded. Only scores are kept, so that the stack is small; the candidate of the
    /// best one is computed again.
    fn best_of<const N: usize>(&self, beam: LightBeam, mut rays: [Ray; N]) -> Result<Aim, NoAim> {
        let from = self.view.position();
        for (id, wall) in self.map.near(from, self.sonar.max_range) {
            for ray in &mut rays {
                ray.meet(from, id, &wall);
            }
        }
        let mut scores = [NOT_MEASURED; N];
        let mut count = 0_u16;
        for (score, ray) in scores.iter_mut().zip(&rays) {
            if let Some((_, candidate)) = self.by_beam(beam, ray) {
                *score = candidate.score;
                count = count.saturating_add(1);
            }
        }
        loop {
            let mut best: Option<(&mut f32, &Ray)> = None;
            for (score, ray) in scores.iter_mut().zip(&rays) {
                let least = best.as_ref().map_or(NOT_MEASURED, |(best, _)| **best);
                if *score > least {
                    best = Some((score, ray));
                }
            }
            let (score, ray) = best.ok_or(NoAim::NoWall)?;
            *score = NOT_MEASURED;
            if let Some((id, candidate)) = self.by_beam(beam, ray)
                && !self.is_occluded(id, &candidate)
            {
                return Ok(candidate.aim(self.ranger, id, count));
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
        candidate.score = candidate.score_by(self.config.policy);
        if self.slot.wall == Some(id) {
            candidate.score *= HYSTERESIS;
        }
        // False for NaN.
        (candidate.score >= 0.0).then_some((id, candidate))
    }
}

/// Below every score.
const NOT_MEASURED: f32 = -1.0;
/// Number of the last bearing of the fan.
#[expect(clippy::cast_precision_loss, reason = "a few bearings")]
const LAST_OF_FAN: f32 = (FAN - 1) as f32;
