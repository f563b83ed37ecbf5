//! Which walls are near which, by the index that the robot itself uses.

use sonarfix::map::{Map, MapError};
use sonarfix::pose;
use sonarfix::units::Metres;

use crate::floor::{Floor, NamedWall};
use crate::geometry::{Point, Segment};
use crate::single;

/// What the index may be off by, metres: 100 km out, coordinates in `f32` are rounded to 4 mm.
const ROUNDING: f64 = 0.02;

/// The walls of a floor in `f64`, indexed.
pub(crate) struct Neighbours<'a> {
    segments: Vec<Segment>,
    map: Map<'a>,
}

impl<'a> Neighbours<'a> {
    /// `image` is the floor, baked.
    pub fn new(floor: &Floor, image: &'a [u8]) -> Result<Self, MapError> {
        let segments = floor.named_walls().iter().map(NamedWall::segment).collect();
        Ok(Self { segments, map: Map::read(image)? })
    }

    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// The walls of which a part may be within `reach` of a point, and some others.
    pub fn near(&self, point: Point, reach: f64) -> impl Iterator<Item = (usize, Segment)> {
        let [x, y] = point.map(single);
        let near = self.map.near(pose::Point::new(x, y), Metres(single(reach + ROUNDING)));
        near.filter_map(|(id, _)| {
            let wall = usize::try_from(id.0).ok()?;
            Some((wall, *self.segments.get(wall)?))
        })
    }

    /// The walls of which a part may be within `reach` of a wall, and some others.
    pub fn beside(&self, wall: Segment, reach: f64) -> impl Iterator<Item = (usize, Segment)> {
        self.near(wall.at(0.5 * wall.length()), 0.5 * wall.length() + reach)
    }
}
