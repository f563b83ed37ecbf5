//! Baking: walls to the one byte slice that a robot reads in place ([`sonarfix::map::image`]).

use std::fmt;

use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::Metres;
use sonarfix::map::image::{
    MAGIC, MOST, MOST_NARROW, Reference, VERSION, VERSION_WITH_ACCURACIES, checksum,
};
use sonarfix::map::{Cells, Grid, Map, MapError, Wall, WallId};

/// The smallest cell, about half of the reach of a cheap sonar. Measured in rooms of 4 m × 5 m with a reach of 4 m: an
/// aim takes the same time with cells of 1 m, and 40 % more with cells of 4 m.
const SMALLEST_CELL: Metres = Metres(2.0);

/// Largest size of the index per wall, bytes. With 20 bytes for the wall itself and 36 for the header, 100,000 walls
/// fit in 3 MiB.
const MOST_INDEX: usize = 11;

/// Why walls could not be baked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum BakeError {
    /// There is no wall.
    NoWall,
    /// There are more walls than a reference can number.
    TooMany,
    /// The robot would refuse the map: a wall is too long for the numbers of the format.
    Refused(MapError),
}

impl fmt::Display for BakeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoWall => f.write_str("there is no wall"),
            Self::TooMany => write!(f, "there are more than {MOST} walls"),
            Self::Refused(error) => write!(f, "the robot would refuse the map: {error}"),
        }
    }
}

impl std::error::Error for BakeError {}

/// Bakes walls, in their order: the n-th is [`WallId`] n, from 0. The map has accuracies if a wall has one of its own.
///
/// Cells are squares of 2 m, or of the least power of two metres with which the index (starts and
/// references) takes at most 11 bytes for each wall.
///
/// # Errors
/// [`BakeError`], by the cause.
///
/// ```
/// use sonarfix::map::{Map, Wall, WallId};
/// use sonarfix::geometry::pose::Point;
/// let walls = [Wall::new(Point::new(0.0, 0.0), Point::new(4.0, 0.0))?];
/// let image = sonarfix_map::bake(&walls)?;
/// assert_eq!(Map::read(&image)?.wall(WallId(0)), Some(walls[0]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn bake(walls: &[Wall]) -> Result<Vec<u8>, BakeError> {
    if walls.is_empty() {
        return Err(BakeError::NoWall);
    }
    let count = u32::try_from(walls.len()).ok().filter(|&count| count <= MOST);
    let count = count.ok_or(BakeError::TooMany)?;
    let index = Index::of(walls).ok_or(BakeError::Refused(MapError::Grid))?;
    let image = index.write(walls, count);
    Map::read(&image).map_err(BakeError::Refused)?;
    Ok(image)
}

/// A grid, and the cells that each wall touches.
struct Index {
    grid: Grid,
    cells: Vec<Cells>,
}

impl Index {
    /// The index with the smallest cells that is not too large. `None` if no cell is large enough for the longest wall.
    fn of(walls: &[Wall]) -> Option<Self> {
        let sizes = std::iter::successors(Some(SMALLEST_CELL), |&cell| Some(cell * 2.0));
        sizes
            .take_while(|cell| cell.is_finite())
            .filter_map(|cell| Self::with_cell(walls, cell))
            .find(|index| index.size() <= MOST_INDEX * walls.len())
    }

    /// `None` if the grid would have too many columns or rows.
    fn with_cell(walls: &[Wall], cell: Metres) -> Option<Self> {
        let origin = least_corner(walls);
        let largest = Grid::new(origin, cell, u16::MAX, u16::MAX)?;
        let cells = walls.iter().map(|wall| largest.cells_of(wall)).collect::<Option<Vec<_>>>()?;
        let columns = cells.iter().map(|cells| cells.columns.1).max()?;
        let rows = cells.iter().map(|cells| cells.rows.1).max()?;
        Some(Self { grid: Grid::new(origin, cell, columns + 1, rows + 1)?, cells })
    }

    fn references(&self) -> u64 {
        self.cells.iter().map(Cells::count).sum()
    }

    /// Bytes of starts and references.
    fn size(&self) -> usize {
        let each = if self.is_narrow() { 2 } else { 3 };
        let bytes = 4 * (u64::from(self.grid.cells()) + 1) + each * self.references();
        usize::try_from(bytes).unwrap_or(usize::MAX)
    }

    fn is_narrow(&self) -> bool {
        self.cells.len() <= MOST_NARROW as usize
    }

    /// The whole image, by the table in [`sonarfix::map::image`].
    fn write(&self, walls: &[Wall], count: u32) -> Vec<u8> {
        let grid = &self.grid;
        let (starts, references) = self.by_cell();
        let mut image = Vec::from(MAGIC);
        let mut put = |bytes: &[u8]| image.extend_from_slice(bytes);
        let has_accuracies = walls.iter().any(|wall| wall.accuracy().is_some());
        let version = if has_accuracies { VERSION_WITH_ACCURACIES } else { VERSION };
        put(&version.to_le_bytes());
        put(&count.to_le_bytes());
        put(&starts.last().copied().unwrap_or_default().to_le_bytes());
        put(&grid.columns().to_le_bytes());
        put(&grid.rows().to_le_bytes());
        put(&grid.origin().x.0.to_le_bytes());
        put(&grid.origin().y.0.to_le_bytes());
        put(&grid.cell_size().0.to_le_bytes());
        for number in walls.iter().flat_map(Wall::stored) {
            put(&number.to_le_bytes());
        }
        for start in starts {
            put(&start.to_le_bytes());
        }
        for reference in references {
            let [a, b, c, _] = reference.stored().to_le_bytes();
            if self.is_narrow() { put(&[a, b]) } else { put(&[a, b, c]) }
        }
        if has_accuracies {
            image.extend(walls.iter().map(Wall::stored_accuracy));
        }
        let seal = checksum(&image);
        image.extend_from_slice(&seal.to_le_bytes());
        image
    }

    /// The index of each cell's first reference, then the number of references; and the references.
    fn by_cell(&self) -> (Vec<u32>, Vec<Reference>) {
        let mut references: Vec<(u32, Reference)> = Vec::new();
        for (id, cells) in (0..).map(WallId).zip(&self.cells) {
            for row in cells.rows.0..=cells.rows.1 {
                for column in cells.columns.0..=cells.columns.1 {
                    let reference = Reference::new(id, cells, column, row);
                    references.push((self.grid.place(column, row), reference));
                }
            }
        }
        // A stable sort keeps the order of the walls within a cell.
        references.sort_by_key(|&(place, _)| place);
        let mut starts = Vec::new();
        let mut start = 0;
        for cell in 0..=self.grid.cells() {
            while references.get(start as usize).is_some_and(|&(place, _)| place < cell) {
                start += 1;
            }
            starts.push(start);
        }
        (starts, references.into_iter().map(|(_, reference)| reference).collect())
    }
}

/// The least x and the least y of all ends.
fn least_corner(walls: &[Wall]) -> Point {
    let ends = walls.iter().flat_map(|wall| [wall.from(), wall.to()]);
    ends.fold(Point::new(f32::INFINITY, f32::INFINITY), |least, end| {
        Point::new(least.x.0.min(end.x.0), least.y.0.min(end.y.0))
    })
}
