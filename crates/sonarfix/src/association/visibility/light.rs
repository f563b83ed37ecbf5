//! A wall as a beam of light meets it (`docs/model.md`, eqs. 45 to 47).
//!
//! # Non-finite policy
//! Comparisons are written so that a wall whose numbers are NaN cannot be measured.

use super::viewpoint::{FOOT_MARGIN, RANGE_MARGIN, Sight, Viewpoint, probability_within};
use crate::association::outcome::Refusal;
use crate::config::LightBeam;
use crate::geometry::pose::Heading;
use crate::geometry::trig::atan2;
use crate::geometry::units::{Metres, Radians};
use crate::geometry::vector::Vector;
use crate::map::Wall;
use crate::sensor::range::ExpectedRange;

/// The field of view over its inner half, the spot, which returns most of the light.
const FIELD: f32 = 2.0;

/// Where a beam meets a wall.
pub(crate) struct Spot {
    pub expected: ExpectedRange,
    /// Probability that it is on the wall, given the uncertainty of the estimate.
    pub on_wall: f32,
    /// Angle of incidence: between the beam and the perpendicular.
    pub incidence: Radians,
    /// Variance of the range: noise of the ranger, direction of the beam and curvature, m².
    pub noise: f32,
    /// Variance of the range by the place of the wall in the map, m².
    pub of_map: f32,
}

impl Viewpoint<'_> {
    /// The wall as a beam in this direction meets it.
    ///
    /// # Errors
    /// [`Refusal::FootOffWall`], [`Refusal::OutOfRange`] or [`Refusal::NotSquare`] if that is too improbable.
    #[inline(never)]
    pub fn lit(&self, wall: &Wall, beam: LightBeam, direction: Heading) -> Result<Sight, Refusal> {
        let spot = self.spot(wall, beam, direction).ok_or(Refusal::FootOffWall)?;
        // None of the comparisons holds for NaN.
        let is_on_wall = spot.on_wall >= self.least;
        if !is_on_wall {
            return Err(Refusal::FootOffWall);
        }
        let expected = &spot.expected;
        let (nearest, farthest) = (self.sonar.min_range.0, self.sonar.max_range.0);
        let variance = self.variance(expected.by_x, expected.by_y) + RANGE_MARGIN * RANGE_MARGIN;
        let range = expected.range.0;
        let in_range = probability_within(range - nearest, farthest - range, variance);
        let is_in_range = in_range >= self.least;
        if !is_in_range {
            return Err(Refusal::OutOfRange);
        }
        let square = self.probability_of_square(spot.incidence);
        let is_possible = square >= self.least;
        if !is_possible {
            return Err(Refusal::NotSquare);
        }
        Ok(Sight {
            expected: spot.expected,
            on_wall: spot.on_wall * in_range,
            square,
            off: spot.incidence,
            noise: spot.noise,
            of_map: spot.of_map,
            place: wall.along(self.position()),
        })
    }

    // ===== Eq. (47): g and R of a beam of light =====
    /// Where a beam in this direction meets the line of a wall; `None` if it does not.
    pub fn spot(&self, wall: &Wall, beam: LightBeam, direction: Heading) -> Option<Spot> {
        let axis = Vector::of_angle(direction.radians().0);
        let met = ExpectedRange::of_beam(wall, (direction, axis), self.sonar_position())?;
        let distance = met.by_range_scale;
        let turn = self.heading_variance() + beam.pointing.0 * beam.pointing.0;
        let aside = |point| Vector::from(point).minus(self.position().into()).dot(axis.left());
        let (from, to) = (aside(wall.from()), aside(wall.to()));
        let (right, left) = if from < to { (from, to) } else { (to, from) };
        let variance =
            self.variance(-axis.y, axis.x) + distance * distance * turn + FOOT_MARGIN * FOOT_MARGIN;
        // The mean of a field of view that another wall shares is not the range of this one.
        let field = FIELD * beam.spot.0 * distance;
        let on_wall = probability_within(-right - field, left - field, variance);
        let away = Vector::new(met.by_x, met.by_y);
        // Derivative by the bearing, and the tangent of the incidence.
        let by_bearing = distance * away.dot(axis.left());
        let tangent = away.dot(axis.left()) / away.dot(axis);
        // Mean and deviation of the term of second order in the direction.
        let curvature = 0.5 * met.range.0 * (1.0 + 2.0 * tangent * tangent) * turn;
        let expected = ExpectedRange { range: met.range + Metres(curvature), ..met };
        let by_pointing = by_bearing * beam.pointing.0;
        let noise = self.sonar.noise.variance(expected.range).0
            + by_pointing * by_pointing
            + 2.0 * curvature * curvature;
        Some(Spot {
            on_wall,
            incidence: Radians(atan2(tangent.abs(), 1.0)),
            noise,
            of_map: self.echo.map_variance(wall.accuracy()) * away.length_squared(),
            expected,
        })
    }
}
