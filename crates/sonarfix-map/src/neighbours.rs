//! Finds neighbouring walls by the index of the baked map.

use sonarfix::geometry::pose;
use sonarfix::geometry::units::Metres;
use sonarfix::map::{Map, MapError};

use crate::floor::{Floor, NamedWall};
use crate::geometry::{Point, Segment};
use crate::single;

/// The largest error of the index, metres: at 100 km, coordinates in `f32` are rounded to 4 mm.
const ROUNDING: f64 = 0.02;

/// The walls of a floor in `f64`, indexed.
pub(crate) struct Neighbours<'a> {
    segments: Vec<Segment>,
    map: Map<'a>,
}

impl<'a> Neighbours<'a> {
    /// Creates the index of a floor. `image` is the baked floor.
    pub fn new(floor: &Floor, image: &'a [u8]) -> Result<Self, MapError> {
        let segments = floor.named_walls().iter().map(NamedWall::segment).collect();
        Ok(Self { segments, map: Map::read(image)? })
    }

    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// All walls within `reach` of a point, and possibly others.
    pub fn near(&self, point: Point, reach: f64) -> impl Iterator<Item = (usize, Segment)> {
        let [x, y] = point.map(single);
        let near = self.map.near(pose::Point::new(x, y), Metres(single(reach + ROUNDING)));
        near.filter_map(|(id, _)| {
            let wall = usize::try_from(id.0).ok()?;
            Some((wall, *self.segments.get(wall)?))
        })
    }

    /// All walls within `reach` of a wall, and possibly others.
    pub fn beside(&self, wall: Segment, reach: f64) -> impl Iterator<Item = (usize, Segment)> {
        self.near(wall.at(0.5 * wall.length()), 0.5 * wall.length() + reach)
    }
}
