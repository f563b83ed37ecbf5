//! The uniform grid over a baked map: the cells of a wall, and the cells near a point.
//!
//! One function converts a coordinate to a cell, for the walls when the map is baked and for the point of
//! a query. It is monotonic, so its rounding cannot lose a wall.
//!
//! # Non-finite policy
//! A grid with a number that is not finite cannot be constructed. Around a point that is not finite, or
//! within a reach that is NaN, there are no cells or all; a coordinate that overflows is beyond the last
//! cell.

use super::wall::Wall;
use crate::geometry::pose::Point;
use crate::geometry::units::Metres;

/// A grid of square cells, in rows along x.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Grid {
    origin: Point,
    cell: Metres,
    /// Reciprocal of the cell size, 1/m.
    cells_per_metre: f32,
    columns: u16,
    rows: u16,
}

/// A rectangle of cells, both ends included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Cells {
    /// The first and the last column, counted along x.
    pub columns: (u16, u16),
    /// The first and the last row, counted along y.
    pub rows: (u16, u16),
}

impl Cells {
    /// Number of cells.
    #[must_use]
    pub fn count(&self) -> u64 {
        let across = |(first, last): (u16, u16)| u64::from(last.saturating_sub(first)) + 1;
        across(self.columns) * across(self.rows)
    }

    /// Whether the cell at a column and a row is in the rectangle.
    #[must_use]
    pub fn contain(&self, column: u16, row: u16) -> bool {
        let has = |(first, last), index| first <= index && index <= last;
        has(self.columns, column) && has(self.rows, row)
    }
}

impl Grid {
    /// A grid of `columns` × `rows` cells, `cell` wide and high, with the lower left corner of the first
    /// cell at `origin`. `None` if a number is not finite, the cell size is not positive (or its
    /// reciprocal not a normal number), or there is no cell.
    ///
    /// ```
    /// use sonarfix::map::{Grid, Wall};
    /// use sonarfix::geometry::pose::Point;
    /// use sonarfix::geometry::units::Metres;
    /// let grid = Grid::new(Point::new(0.0, 0.0), Metres(2.0), 3, 2).unwrap();
    /// let cells = grid.cells_of(&Wall::new(Point::new(1.0, 3.0), Point::new(5.0, 3.0))?);
    /// assert_eq!(cells.map(|cells| (cells.columns, cells.rows)), Some(((0, 2), (1, 1))));
    /// # Ok::<(), sonarfix::map::WallError>(())
    /// ```
    #[must_use]
    pub fn new(origin: Point, cell: Metres, columns: u16, rows: u16) -> Option<Self> {
        let cells_per_metre = 1.0 / cell.0;
        let has_cells = cells_per_metre.is_normal() && cell.0 > 0.0 && columns > 0 && rows > 0;
        let is_grid = origin.is_finite() && cell.is_finite() && has_cells;
        is_grid.then_some(Self { origin, cell, cells_per_metre, columns, rows })
    }

    /// Lower left corner of the first cell.
    #[must_use]
    pub fn origin(&self) -> Point {
        self.origin
    }

    /// Width and height of a cell.
    #[must_use]
    pub fn cell_size(&self) -> Metres {
        self.cell
    }

    /// Number of cells along x.
    #[must_use]
    pub fn columns(&self) -> u16 {
        self.columns
    }

    /// Number of cells along y.
    #[must_use]
    pub fn rows(&self) -> u16 {
        self.rows
    }

    /// Number of cells.
    #[must_use]
    pub fn cells(&self) -> u32 {
        u32::from(self.columns) * u32::from(self.rows)
    }

    /// Index of a cell, row by row.
    #[must_use]
    pub fn place(&self, column: u16, row: u16) -> u32 {
        u32::from(row) * u32::from(self.columns) + u32::from(column)
    }

    /// The cells that the bounding box of the wall touches, or `None` if it is not inside the grid.
    #[must_use]
    pub fn cells_of(&self, wall: &Wall) -> Option<Cells> {
        let (from, to) = (wall.from(), wall.to());
        let columns = self.columns_of(ordered(from.x, to.x));
        let rows = self.rows_of(ordered(from.y, to.y));
        let inside = |(first, last), count| {
            Some((u16::try_from(first).ok()?, u16::try_from(last).ok().filter(|&n| n < count)?))
        };
        Some(Cells { columns: inside(columns, self.columns)?, rows: inside(rows, self.rows)? })
    }

    /// The cells that contain the points within `reach` of `point`. `None` if there are none, and if a
    /// number is NaN or the reach is negative.
    #[must_use]
    pub fn cells_near(&self, point: Point, reach: Metres) -> Option<Cells> {
        let around = |middle: Metres| {
            let (low, high) = (middle - reach, middle + reach);
            (low <= high).then_some((low, high))
        };
        let columns = self.columns_of(around(point.x)?);
        let rows = self.rows_of(around(point.y)?);
        Some(Cells { columns: cut(columns, self.columns)?, rows: cut(rows, self.rows)? })
    }

    fn columns_of(&self, (low, high): (Metres, Metres)) -> (i32, i32) {
        (self.index(low - self.origin.x), self.index(high - self.origin.x))
    }

    fn rows_of(&self, (low, high): (Metres, Metres)) -> (i32, i32) {
        (self.index(low - self.origin.y), self.index(high - self.origin.y))
    }

    /// The column or row at a distance from the edge of the grid. Less than a cell outside counts as in
    /// the first, because a cast rounds towards zero.
    #[expect(clippy::cast_possible_truncation, reason = "a float-to-int cast saturates")]
    fn index(&self, distance: Metres) -> i32 {
        (distance.0 * self.cells_per_metre) as i32
    }
}

fn ordered(a: Metres, b: Metres) -> (Metres, Metres) {
    if b < a { (b, a) } else { (a, b) }
}

/// The part of a range of indices that is inside 0..count, if any.
fn cut((first, last): (i32, i32), count: u16) -> Option<(u16, u16)> {
    let first = if first < 0 { 0 } else { u16::try_from(first).ok()? };
    let last = u16::try_from(last).unwrap_or(if last < 0 { return None } else { u16::MAX });
    let last = if last < count { last } else { count.checked_sub(1)? };
    (first <= last).then_some((first, last))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of four columns and three rows of 0.5 m from (1, 2).
    fn grid() -> Grid {
        Grid::new(Point::new(1.0, 2.0), Metres(0.5), 4, 3).unwrap()
    }

    #[test]
    fn a_wall_that_leaves_the_grid_has_no_cells() {
        let wall = |from, to| Wall::new(from, to).unwrap();
        let inside = wall(Point::new(1.1, 2.1), Point::new(2.9, 3.4));
        assert_eq!(grid().cells_of(&inside), Some(Cells { columns: (0, 3), rows: (0, 2) }));
        let flipped = wall(Point::new(2.9, 3.4), Point::new(1.1, 2.1));
        assert_eq!(grid().cells_of(&flipped), grid().cells_of(&inside));
        // The right edge belongs to the column that is not there any more.
        assert_eq!(grid().cells_of(&wall(Point::new(1.1, 2.1), Point::new(3.0, 2.1))), None);
        assert_eq!(grid().cells_of(&wall(Point::new(1.1, 2.1), Point::new(1.1, 3.5))), None);
    }

    #[test]
    fn the_cells_near_a_point_are_those_of_the_grid() {
        let near = |x, y, reach| grid().cells_near(Point::new(x, y), Metres(reach));
        assert_eq!(near(1.6, 2.6, 0.2), Some(Cells { columns: (0, 1), rows: (0, 1) }));
        assert_eq!(near(1.75, 2.75, 0.1), Some(Cells { columns: (1, 1), rows: (1, 1) }));
        // The largest index is beyond the grid by one, and by many.
        assert_eq!(near(2.75, 3.25, 0.25), Some(Cells { columns: (3, 3), rows: (2, 2) }));
        assert_eq!(near(2.75, 3.25, 50.0), Some(Cells { columns: (0, 3), rows: (0, 2) }));
        assert_eq!(near(9.0, 2.5, 1.0), None);
        assert_eq!(near(-9.0, 2.5, 1.0), None);
        assert_eq!(near(1.5, 2.5, -0.1), None);
        assert_eq!(near(f32::NAN, 2.5, 0.1), None);
    }
}
