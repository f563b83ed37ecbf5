//! The range measurement model: what the sonar hears from a wall, and how that depends on the
//! state (`docs/model.md`, eqs. 1 and 10–12).
//!
//! A wide cone and a smooth wall make the first echo come from the foot of the perpendicular,
//! whatever the exact aim, so the range is the distance of the sonar from the wall's line.
//!
//! # Non-finite policy
//! The model computes with what it is given; [`Ekf`](crate::ekf::Ekf) refuses a result that is
//! not finite.

use crate::map::Wall;
use crate::pose::{Heading, Point};
use crate::state::State;
use crate::trig::sin_cos;
use crate::units::{Metres, Radians, SquareMetres};

/// Noise of one range, growing with the range: variance σ₀² + (σ₁ d)².
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RangeNoise {
    /// σ₀, standard deviation at no range.
    pub floor: Metres,
    /// σ₁, standard deviation per metre of range, dimensionless.
    pub per_metre: f32,
}

impl RangeNoise {
    /// Variance of a range of `range` metres.
    ///
    /// ```
    /// use sonarfix::range::RangeNoise;
    /// use sonarfix::units::Metres;
    /// let noise = RangeNoise { floor: Metres(0.003), per_metre: 0.004 };
    /// assert!((noise.variance(Metres(1.0)).0 - 25e-6).abs() < 1e-9);
    /// ```
    #[must_use]
    pub fn variance(self, range: Metres) -> SquareMetres {
        let proportional = self.per_metre * range.0;
        SquareMetres(self.floor.0 * self.floor.0 + proportional * proportional)
    }
}

/// The range expected from a wall, linearised at a state: `z = range + H (X − X̂)`, where H has
/// four entries that are not zero.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ExpectedRange {
    /// h(X̂): the range that the sonar should report, its scale error included.
    pub range: Metres,
    /// ∂h/∂x, dimensionless.
    pub by_x: f32,
    /// ∂h/∂y, dimensionless.
    pub by_y: f32,
    /// ∂h/∂ψ, metres per radian; zero for a sonar at the robot's centre.
    pub by_heading: f32,
    /// ∂h/∂κ, metres: the true distance.
    pub by_range_scale: f32,
    /// Direction from the sonar to the foot of the perpendicular, in the map frame.
    pub direction: Heading,
}

impl ExpectedRange {
    /// What a sonar at `mount` (robot frame) should hear from `wall` if the robot is as `state`
    /// says.
    #[must_use]
    pub fn new(wall: &Wall, mount: Point, state: &State) -> Self {
        let (sin, cos) = sin_cos(Radians(state.heading));
        // The lever arm in map axes, and its derivative by the heading.
        let lever_x = cos * mount.x.0 - sin * mount.y.0;
        let lever_y = sin * mount.x.0 + cos * mount.y.0;
        let sonar = Point::new(state.x + lever_x, state.y + lever_y);

        let signed = wall.signed_distance(sonar);
        let side = if signed.0 < 0.0 { -1.0 } else { 1.0 };
        let distance = side * signed.0;
        let stretch = 1.0 + state.range_scale;
        let (by_x, by_y) = (side * stretch * wall.a(), side * stretch * wall.b());
        Self {
            range: Metres(stretch * distance),
            by_x,
            by_y,
            by_heading: by_y * lever_x - by_x * lever_y,
            by_range_scale: distance,
            direction: wall.direction_from(signed),
        }
    }
}
