//! The map: walls of a file, or found in an occupancy grid.

use std::path::Path;

use anyhow::{Context, ensure};
use sonarfix::map::{Map, Wall};
use sonarfix_drawings::{Frame, grid};
use sonarfix_map::{Floor, MapFile, bake};
use sonarfix_ros_messages::geometry;
use sonarfix_ros_messages::messages::OccupancyGrid;
use sonarfix_sim::simulate::MANY;

/// The shortest line of a grid that is a wall, metres.
const SHORTEST: f64 = 0.1;
/// The probability from which a cell is occupied, as AMCL's map server has it, percent.
const OCCUPIED: i8 = 65;

/// Walls for a localizer, which borrows them: with an index if there are many.
#[derive(Debug)]
pub struct Walls {
    list: Vec<Wall>,
    image: Option<Vec<u8>>,
    /// Where the walls are from, and what was lost.
    pub notes: Vec<String>,
    /// Whether they were found in a grid.
    pub is_from_grid: bool,
}

impl Walls {
    fn of(floor: &Floor, notes: Vec<String>, is_from_grid: bool) -> Self {
        let list = floor.walls();
        let image = (list.len() > MANY).then(|| bake(&list).ok()).flatten();
        Self { list, image, notes, is_from_grid }
    }

    /// The walls of a map.
    #[must_use]
    pub fn new(floor: &Floor) -> Self {
        Self::of(floor, Vec::new(), false)
    }

    /// Reads a map file.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let file = MapFile::read(path, None)?;
        Ok(Self::of(&file.floor, vec![format!("walls of {}", path.display())], false))
    }

    /// Finds the walls of a grid.
    ///
    /// # Errors
    /// If its size or place is impossible, or no wall is found.
    pub fn find(grid: &OccupancyGrid) -> anyhow::Result<Self> {
        let size = [grid.info.width, grid.info.height].map(usize::try_from);
        let [width, height] = [size[0]?, size[1]?];
        let is_whole = width.checked_mul(height) == Some(grid.data.len()) && width > 0;
        ensure!(is_whole, "the grid has {} cells, not {width} × {height}", grid.data.len());
        let origin = geometry::planar(&grid.info.origin).context("the grid's origin is no pose")?;
        let place = grid::Place { resolution: f64::from(grid.info.resolution), origin };
        let occupied: Vec<bool> = grid.data.iter().map(|&cell| cell >= OCCUPIED).collect();
        let frame = Frame { unit: None, origin: [0.0, 0.0] };
        let found = grid::of_cells(&occupied, [width, height], &place, &frame, SHORTEST)?;
        Ok(Self::of(&found.floor, found.notes, true))
    }

    /// The walls.
    #[must_use]
    pub fn walls(&self) -> &[Wall] {
        &self.list
    }

    /// The map of a localizer.
    #[must_use]
    pub fn map(&self) -> Map<'_> {
        let indexed = self.image.as_deref().and_then(|image| Map::read(image).ok());
        indexed.unwrap_or_else(|| Map::new(&self.list))
    }
}
