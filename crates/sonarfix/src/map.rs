//! The map: walls as straight segments, fixed and known.
//!
//! A map is either walls in code ([`Map::new`]) or a baked image ([`Map::read`]): one byte slice,
//! made on a PC by `sonarfix map bake`, read in place from flash and never copied. The image holds an
//! index, so that what it costs to ask for the walls near a point does not depend on how many others
//! there are.
//!
//! # Non-finite policy
//! A [`Wall`] cannot be made from NaN or infinite coordinates, so a map holds none. Near a point
//! that is not finite are no walls, or all.

mod grid;
pub mod image;
mod wall;

pub use grid::{Cells, Grid};
use image::{Image, Window};
pub use wall::{Wall, WallError};

use crate::pose::Point;
use crate::units::Metres;

/// A wall's place in its map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WallId(pub u32);

/// Why a baked map was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum MapError {
    /// The bytes do not start as a baked map does.
    NotAMap,
    /// The map was baked for another version of this crate: its format is this one.
    Version(u32),
    /// The checksum is wrong: bytes were changed, cut off or added.
    Checksum,
    /// The bytes are fewer or more than the header says.
    Length,
    /// The header describes no grid.
    Grid,
    /// This wall is none, or lies outside the grid.
    Wall(WallId),
    /// The index is not that of these walls.
    Index,
}

impl core::fmt::Display for MapError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NotAMap => f.write_str("this is not a baked map"),
            Self::Version(version) => write!(
                f,
                "the map has format {version} and this reads format {}: bake it again",
                image::VERSION
            ),
            Self::Checksum => f.write_str("the map is damaged or cut off: its checksum is wrong"),
            Self::Length => f.write_str("the map is not as long as its header says"),
            Self::Grid => f.write_str("the map's header describes no grid"),
            Self::Wall(WallId(id)) => write!(f, "wall {id} of the map is not a wall of its grid"),
            Self::Index => f.write_str("the map's index is not that of its walls"),
        }
    }
}

impl core::error::Error for MapError {}

/// The walls of a place; it borrows them, so that they can stay in flash.
///
/// ```
/// use sonarfix::map::{Map, Wall, WallId};
/// use sonarfix::pose::Point;
/// let walls = [Wall::new(Point::new(0.0, 0.0), Point::new(4.0, 0.0))?];
/// let map = Map::new(&walls);
/// assert!(map.wall(WallId(0)).is_some() && map.wall(WallId(1)).is_none());
/// # Ok::<(), sonarfix::map::WallError>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Map<'a>(Source<'a>);

#[derive(Debug, Clone, Copy)]
enum Source<'a> {
    Walls(&'a [Wall]),
    Image(Image<'a>),
}

impl<'a> Map<'a> {
    /// A map of these walls, without an index: [`Self::near`] gives them all, which suits a room.
    /// Walls beyond the 2³²-th have no [`WallId`] and are never looked at.
    #[must_use]
    pub const fn new(walls: &'a [Wall]) -> Self {
        Self(Source::Walls(walls))
    }

    /// Reads a baked map in place. Every length, number and reference is checked here, once (some
    /// 40 instructions a byte), so that no later lookup can fail: a damaged map is refused.
    ///
    /// The slice is the whole image and nothing else, at any address.
    ///
    /// # Errors
    /// [`MapError`], by the first thing that is wrong.
    ///
    /// # Panics
    /// Never.
    pub fn read(image: &'a [u8]) -> Result<Self, MapError> {
        Image::read(image).map(|image| Self(Source::Image(image)))
    }

    /// The number of walls; their ids are those below it.
    #[must_use]
    pub fn count(&self) -> u32 {
        match self.0 {
            Source::Walls(walls) => u32::try_from(walls.len()).unwrap_or(u32::MAX),
            Source::Image(image) => image.count(),
        }
    }

    /// The wall with this id, if the map has it.
    #[must_use]
    pub fn wall(&self, id: WallId) -> Option<Wall> {
        match self.0 {
            Source::Walls(walls) => walls.get(usize::try_from(id.0).ok()?).copied(),
            Source::Image(image) => image.wall(id),
        }
    }

    /// Every wall with its id.
    pub fn walls(&self) -> impl Iterator<Item = (WallId, Wall)> + use<'a> {
        let map = *self;
        (0..map.count()).map(WallId).filter_map(move |id| Some((id, map.wall(id)?)))
    }

    /// Every wall of which a part lies within `reach` of `point` (map frame), each once, with its id.
    /// It gives others too: those in the same cells of a baked map's grid, or, without an index, all.
    ///
    /// If a coordinate or the reach is NaN, or the reach negative: no wall, or all of them. If the
    /// reach is infinite and the point is not: all of them.
    pub fn near(
        &self,
        point: Point,
        reach: Metres,
    ) -> impl Iterator<Item = (WallId, Wall)> + use<'a> {
        match self.0 {
            Source::Walls(_) => Near::All(self.walls()),
            Source::Image(image) => Near::Window(image.near(point, reach)),
        }
    }

    /// The grid of a baked map's index.
    #[must_use]
    pub fn grid(&self) -> Option<Grid> {
        match self.0 {
            Source::Walls(_) => None,
            Source::Image(image) => Some(image.grid()),
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
