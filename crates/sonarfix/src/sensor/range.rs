//! The measurement model: the range that a sonar measures to a wall, its derivatives and its noise
//! (`docs/model.md`, eqs. 1 and 11 to 13).
//!
//! With a wide cone and a smooth wall the first echo comes from the foot of the perpendicular,
//! whatever the exact bearing, so the range is the distance of the sonar from the line of the wall. Light
//! returns from where its beam meets the wall (eqs. 45 and 46).
//!
//! # Non-finite policy
//! No value is refused here; [`Ekf`](crate::filter::ekf::Ekf) refuses an expected range that is not finite.

use crate::geometry::pose::{Heading, Point};
use crate::geometry::trig::{atan2, sin_cos};
use crate::geometry::units::{Metres, Radians, SquareMetres};
use crate::geometry::vector::Vector;
use crate::map::Wall;
use crate::state::StateEstimate;

/// Noise of one range, which grows with the range: variance σ₀² + (σ₁ h)².
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RangeNoise {
    /// σ₀, standard deviation at range zero.
    pub floor: Metres,
    /// σ₁, standard deviation per metre of range, dimensionless.
    pub per_metre: f32,
}

impl RangeNoise {
    // ===== Eq. (13): R =====
    /// Variance of a range of `range` metres.
    ///
    /// ```
    /// use sonarfix::sensor::range::RangeNoise;
    /// use sonarfix::geometry::units::Metres;
    /// let noise = RangeNoise { floor: Metres(0.003), per_metre: 0.004 };
    /// assert!((noise.variance(Metres(1.0)).0 - 25e-6).abs() < 1e-9);
    /// ```
    #[must_use]
    pub fn variance(self, range: Metres) -> SquareMetres {
        let proportional = self.per_metre * range.0;
        SquareMetres(self.floor.0 * self.floor.0 + proportional * proportional)
    }
}

/// Least cosine of the angle between a beam of light and the perpendicular of a wall: 84°.
const LEAST_APPROACH: f32 = 0.1;

/// The sonar at an estimate: what its expected ranges have in common.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SonarPosition {
    /// Position in the map.
    pub point: Point,
    /// The lever arm in map axes, metres; also its derivative by the heading.
    pub lever: (f32, f32),
    /// 1 + κ.
    pub stretch: f32,
    /// The unit vector ahead of the robot, in map axes.
    pub ahead: Vector,
}

impl SonarPosition {
    /// A sonar at `mount` (robot frame) at this estimate.
    #[inline]
    pub fn new(mount: Point, state: &StateEstimate) -> Self {
        let (sin, cos) = sin_cos(state.heading);
        let x = cos * mount.x.0 - sin * mount.y.0;
        let y = sin * mount.x.0 + cos * mount.y.0;
        let point = Point::new(state.x.0 + x, state.y.0 + y);
        let ahead = Vector::new(cos, sin);
        Self { point, lever: (x, y), stretch: 1.0 + state.range_scale, ahead }
    }
}

/// A range expected from a wall, linearized at an estimate: z ≈ h(X̂) + H (X − X̂). H has four
/// entries that are not zero.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ExpectedRange {
    /// h(X̂): the range that the sonar is expected to report, its scale error included.
    pub range: Metres,
    /// ∂h/∂x, dimensionless.
    pub by_x: f32,
    /// ∂h/∂y, dimensionless.
    pub by_y: f32,
    /// ∂h/∂ψ, metres per radian; zero for a sonar at the robot's centre.
    pub by_heading: f32,
    /// ∂h/∂κ, metres: the true distance.
    pub by_range_scale: f32,
    /// Direction from the sonar to the foot of the perpendicular, of a beam of light that of the beam; map frame.
    pub direction: Heading,
}

impl ExpectedRange {
    // ===== Eqs. (11) and (12): h(X̂) and H =====
    /// The range expected from `wall` by a sonar at `mount` (robot frame) at this estimate.
    #[must_use]
    pub fn new(wall: &Wall, mount: Point, state: &StateEstimate) -> Self {
        Self::from_sonar(wall, &SonarPosition::new(mount, state))
    }

    /// [`Self::new`] with the position of the sonar computed before.
    #[inline]
    pub(crate) fn from_sonar(wall: &Wall, sonar: &SonarPosition) -> Self {
        let signed = wall.signed_distance(sonar.point);
        let side = if signed.0 < 0.0 { -1.0 } else { 1.0 };
        let away = (side * sonar.stretch * wall.a(), side * sonar.stretch * wall.b());
        Self::at(side * signed.0, away, wall.direction_from(signed), sonar)
    }

    /// The range expected from a point at `distance` along the unit vector `toward`.
    pub(crate) fn from_point(toward: Vector, distance: f32, sonar: &SonarPosition) -> Self {
        let away = (-sonar.stretch * toward.x, -sonar.stretch * toward.y);
        let direction = Heading::new(Radians(atan2(toward.y, toward.x)));
        Self::at(distance, away, direction, sonar)
    }

    // ===== Eqs. (45) and (46): h(X̂) and H of a beam of light =====
    /// The range expected from the line of `wall` along a beam at `bearing` (relative to the heading) by a
    /// time-of-flight ranger at `mount` (robot frame) at this estimate; `None` if the beam does not meet the line, or
    /// meets it at more than 84° from its perpendicular.
    #[must_use]
    pub fn along_beam(
        wall: &Wall,
        mount: Point,
        bearing: Radians,
        state: &StateEstimate,
    ) -> Option<Self> {
        let direction = Heading::new(state.heading).turned(bearing);
        let axis = Vector::of_angle(direction.radians().0);
        Self::of_beam(wall, (direction, axis), &SonarPosition::new(mount, state))
    }

    /// [`Self::along_beam`] with the position of the ranger and the direction of the beam computed before; the axis is
    /// the unit vector of the direction.
    pub(crate) fn of_beam(
        wall: &Wall,
        (direction, axis): (Heading, Vector),
        sonar: &SonarPosition,
    ) -> Option<Self> {
        let approach = wall.a() * axis.x + wall.b() * axis.y;
        let distance = -wall.signed_distance(sonar.point).0 / approach;
        // Neither holds for NaN.
        let is_met = approach.abs() >= LEAST_APPROACH && distance >= 0.0;
        if !is_met {
            return None;
        }
        let by_distance = -sonar.stretch / approach;
        let away = Vector::new(by_distance * wall.a(), by_distance * wall.b());
        let expected = Self::at(distance, (away.x, away.y), direction, sonar);
        let by_heading = expected.by_heading + distance * away.dot(axis.left());
        Some(Self { by_heading, ..expected })
    }

    /// A linear combination of x, y and heading as a measurement. Only its derivatives have a meaning.
    pub(crate) fn linear(by_x: f32, by_y: f32, by_heading: f32) -> Self {
        let (range, direction) = (Metres(0.0), Heading::default());
        Self { range, by_x, by_y, by_heading, by_range_scale: 0.0, direction }
    }

    /// At a distance; `away` are the derivatives by x and y.
    #[inline]
    fn at(
        distance: f32,
        (by_x, by_y): (f32, f32),
        direction: Heading,
        sonar: &SonarPosition,
    ) -> Self {
        let SonarPosition { lever: (lever_x, lever_y), stretch, .. } = *sonar;
        Self {
            range: Metres(stretch * distance),
            by_x,
            by_y,
            by_heading: by_y * lever_x - by_x * lever_y,
            by_range_scale: distance,
            direction,
        }
    }

    /// H.
    #[inline]
    pub(crate) fn jacobian(&self) -> MeasurementJacobian {
        MeasurementJacobian {
            x: self.by_x,
            y: self.by_y,
            h: self.by_heading,
            k: self.by_range_scale,
        }
    }
}

/// H: the entries that are not zero, by the letters of P.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct MeasurementJacobian {
    pub x: f32,
    pub y: f32,
    pub h: f32,
    pub k: f32,
}

impl MeasurementJacobian {
    /// The squares of the entries.
    pub fn squared(&self) -> Self {
        Self { x: self.x * self.x, y: self.y * self.y, h: self.h * self.h, k: self.k * self.k }
    }

    /// The sum of the entries.
    pub fn sum(&self) -> f32 {
        self.x + self.y + self.h + self.k
    }
}

/// A measured range compared with the expected one.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Innovation {
    /// ν = z − h(X̂).
    pub value: Metres,
    /// S = H P Hᵀ + R.
    pub variance: SquareMetres,
}

impl Innovation {
    /// Normalised innovation squared ν²/S, dimensionless: 1 on average if the filter is
    /// consistent.
    ///
    /// ```
    /// use sonarfix::filter::ekf::Innovation;
    /// use sonarfix::geometry::units::{Metres, SquareMetres};
    /// let innovation = Innovation { value: Metres(0.02), variance: SquareMetres(0.0001) };
    /// assert!((innovation.nis() - 4.0).abs() < 1e-5);
    /// ```
    #[must_use]
    pub fn nis(&self) -> f32 {
        self.value.0 * self.value.0 / self.variance.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::units::Radians;

    #[test]
    fn squares_and_sum_have_every_entry() {
        let h = MeasurementJacobian { x: 2.0, y: -3.0, h: 5.0, k: 7.0 };
        assert_eq!(h.squared(), MeasurementJacobian { x: 4.0, y: 9.0, h: 25.0, k: 49.0 });
        assert!((h.sum() - 11.0).abs() < 1e-6);
    }

    /// The range to a point, and its derivatives, against differences in `f64`.
    #[test]
    fn a_point_has_the_derivatives_of_its_distance() {
        let (x, y, heading, scale) = (1.3_f64, -0.7_f64, 0.4_f64, 0.02_f64);
        let (ahead, aside) = (0.11_f64, 0.05_f64);
        let point = (3.1_f64, 1.9_f64);
        let range = |x: f64, y: f64, heading: f64, scale: f64| {
            let (sin, cos) = heading.sin_cos();
            let sonar = (x + cos * ahead - sin * aside, y + sin * ahead + cos * aside);
            (1.0 + scale) * (point.0 - sonar.0).hypot(point.1 - sonar.1)
        };
        #[expect(clippy::cast_possible_truncation, reason = "a few metres")]
        let [fx, fy, fheading, fscale, fahead, faside] =
            [x, y, heading, scale, ahead, aside].map(|value| value as f32);
        let state = StateEstimate {
            x: Metres(fx),
            y: Metres(fy),
            heading: Radians(fheading),
            range_scale: fscale,
            ..StateEstimate::default()
        };
        let sonar = SonarPosition::new(Point::new(fahead, faside), &state);
        let (sin, cos) = heading.sin_cos();
        let toward =
            (point.0 - (x + cos * ahead - sin * aside), point.1 - (y + sin * ahead + cos * aside));
        let distance = toward.0.hypot(toward.1);
        #[expect(clippy::cast_possible_truncation, reason = "a few metres")]
        let expected = ExpectedRange::from_point(
            Vector { x: (toward.0 / distance) as f32, y: (toward.1 / distance) as f32 },
            distance as f32,
            &sonar,
        );
        let step = 1e-6;
        let central = |plus: f64, minus: f64| (plus - minus) / (2.0 * step);
        let h = expected.jacobian();
        for (is, expected) in [
            (h.x, central(range(x + step, y, heading, scale), range(x - step, y, heading, scale))),
            (h.y, central(range(x, y + step, heading, scale), range(x, y - step, heading, scale))),
            (h.h, central(range(x, y, heading + step, scale), range(x, y, heading - step, scale))),
            (h.k, central(range(x, y, heading, scale + step), range(x, y, heading, scale - step))),
            (expected.range.0, range(x, y, heading, scale)),
        ] {
            assert!((f64::from(is) - expected).abs() < 1e-5, "{is} {expected}");
        }
    }
}
