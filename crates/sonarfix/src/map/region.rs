//! A part of a map.

use crate::geometry::pose::Point;
use crate::geometry::units::Metres;

/// A rectangle of the map, parallel to its axes: where a robot starts, for example.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Region {
    /// The corner of the smallest coordinates.
    pub from: Point,
    /// The corner of the largest coordinates.
    pub to: Point,
}

impl Region {
    /// Whether it is finite and not empty.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let Self { from, to } = self;
        from.is_finite() && to.is_finite() && from.x < to.x && from.y < to.y
    }

    /// Whether a point is in it or not farther than `margin` beside it.
    #[must_use]
    pub fn contains(&self, at: Point, margin: Metres) -> bool {
        let within = |value: Metres, from: Metres, to: Metres| {
            value >= from - margin && value <= to + margin
        };
        within(at.x, self.from.x, self.to.x) && within(at.y, self.from.y, self.to.y)
    }
}
