//! The map: known, fixed walls as straight segments.
//!
//! A map is either a slice of walls ([`Map::new`]) or a baked image ([`Map::read`]): one byte slice,
//! written on a PC by `sonarfix map bake` and read in place from flash without a copy. The image contains
//! an index, so that the cost of finding the walls near a point does not depend on the size of the map.
//!
//! # Non-finite policy
//! A [`Wall`] cannot be constructed from NaN or infinite coordinates, so a map contains none. A query
//! near a point that is not finite returns no wall or all walls.

mod grid;
pub mod image;
mod region;
mod wall;
mod window;

use image::Image;
use window::Window;

pub use grid::{Cells, Grid};
pub use image::MapError;
pub use region::Region;
pub use wall::{Wall, WallError, WallId};

use crate::geometry::pose::Point;
use crate::geometry::units::Metres;

/// The walls of a place. They are borrowed, so that they can stay in flash.
///
/// ```
/// use sonarfix::map::{Map, Wall, WallId};
/// use sonarfix::geometry::pose::Point;
/// let walls = [Wall::new(Point::new(0.0, 0.0), Point::new(4.0, 0.0))?];
/// let map = Map::new(&walls);
/// assert!(map.wall(WallId(0)).is_some() && map.wall(WallId(1)).is_none());
/// # Ok::<(), sonarfix::map::WallError>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Map<'a>(Storage<'a>);

#[derive(Debug, Clone, Copy)]
enum Storage<'a> {
    Walls(&'a [Wall]),
    Image(Image<'a>),
}

impl<'a> Map<'a> {
    /// A map of these walls without an index, which is suitable for a room: [`Self::near`] returns all
    /// of them. Walls beyond the 2³²-th have no [`WallId`] and are ignored.
    #[must_use]
    pub const fn new(walls: &'a [Wall]) -> Self {
        Self(Storage::Walls(walls))
    }

    /// Reads a baked map in place.
    ///
    /// Every length, number and reference is checked once, in a time proportional to the size of the map,
    /// so that no later access can fail. The slice is exactly the image, with any alignment.
    ///
    /// # Errors
    /// [`MapError`], by the first fault.
    ///
    /// # Panics
    /// Never.
    pub fn read(image: &'a [u8]) -> Result<Self, MapError> {
        Image::read(image).map(|image| Self(Storage::Image(image)))
    }

    /// The number of walls; ids are smaller than it.
    #[must_use]
    pub fn count(&self) -> u32 {
        match self.0 {
            Storage::Walls(walls) => u32::try_from(walls.len()).unwrap_or(u32::MAX),
            Storage::Image(image) => image.count(),
        }
    }

    /// The wall with this id, if the map has it.
    #[must_use]
    pub fn wall(&self, id: WallId) -> Option<Wall> {
        match self.0 {
            Storage::Walls(walls) => walls.get(usize::try_from(id.0).ok()?).copied(),
            Storage::Image(image) => image.wall(id),
        }
    }

    /// Every wall with its id.
    pub fn walls(&self) -> impl Iterator<Item = (WallId, Wall)> + use<'a> {
        let map = *self;
        (0..map.count()).map(WallId).filter_map(move |id| Some((id, map.wall(id)?)))
    }

    /// Every wall of which a part lies within `reach` of `point` (map frame), each once, with its id.
    ///
    /// Others may be included: those in the same cells of the grid of a baked map, or, without an index,
    /// all. If a coordinate or the reach is NaN, or the reach is negative: no wall or all walls. If the
    /// reach is infinite and the point is not: all walls.
    pub fn near(
        &self,
        point: Point,
        reach: Metres,
    ) -> impl Iterator<Item = (WallId, Wall)> + use<'a> {
        match self.0 {
            Storage::Walls(_) => Near::All(self.walls()),
            Storage::Image(image) => Near::Window(Window::new(image, point, reach)),
        }
    }

    /// The grid of the index of a baked map.
    #[must_use]
    pub fn grid(&self) -> Option<Grid> {
        match self.0 {
            Storage::Walls(_) => None,
            Storage::Image(image) => Some(image.grid()),
        }
    }
}

/// The walls near a point: all of a map without an index, or those of a window.
enum Near<'a, I> {
    All(I),
    Window(Window<'a>),
}

impl<I: Iterator<Item = (WallId, Wall)>> Iterator for Near<'_, I> {
    type Item = (WallId, Wall);

    fn next(&mut self) -> Option<Self::Item> {
        match self {
            Self::All(walls) => walls.next(),
            Self::Window(window) => window.next(),
        }
    }
}
