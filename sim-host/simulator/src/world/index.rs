//! A spatial index of walls or points: which are near a place, and which lie along a line.
//!
//! A query returns a superset, of which the caller tests the exact conditions; the results do not depend on the grid.
//! The cost of a query depends on the density of the walls, not on their number.

use super::grid::{Cells, Grid};
use super::segment::Point;

/// The cells of a grid, each with the walls (points) that it touches.
#[derive(Debug, Clone)]
pub struct Index {
    grid: Grid,
    /// The place in `items` of the first item of each cell; at the end the number of all.
    starts: Vec<usize>,
    /// Indices of items, ascending in each cell.
    items: Vec<usize>,
}

impl Index {
    /// The index of lines between two points each. Lines that are not finite are in no cell.
    #[must_use]
    pub fn new(lines: &[(Point, Point)]) -> Self {
        let grid = Grid::over(lines);
        let is_finite = |(from, to): &(Point, Point)| {
            from.iter().chain(to).all(|coordinate| coordinate.is_finite())
        };
        let lines = lines.iter().enumerate().filter(|(_, line)| is_finite(line));
        let mut touched: Vec<(usize, usize)> = lines
            .flat_map(|(item, &(from, to))| grid.along(from, to).map(move |cells| (item, cells)))
            .flat_map(|(item, cells)| (cells.first..=cells.last).map(move |cell| (cell, item)))
            .collect();
        touched.sort_unstable();
        let start = |cell| touched.partition_point(|&(touching, _)| touching < cell);
        Self {
            grid,
            starts: (0..=grid.cells()).map(start).collect(),
            items: touched.into_iter().map(|(_, item)| item).collect(),
        }
    }

    /// All items of which a part lies within `reach` metres of a point, and others; ascending, each once.
    #[must_use]
    pub fn near(&self, point: Point, reach: f64) -> Vec<usize> {
        let mut found = Vec::new();
        for cells in self.grid.around(point, reach) {
            found.extend_from_slice(self.items_of(cells));
        }
        if self.grid.cells() > 1 {
            found.sort_unstable();
            found.dedup();
        }
        found
    }

    /// All items that come within a nanometre of the line between two points, and others; some repeatedly.
    pub fn along(&self, from: Point, to: Point) -> impl Iterator<Item = usize> + '_ {
        self.grid.along(from, to).flat_map(|cells| self.items_of(cells)).copied()
    }

    /// Whether all items lie within a distance of a point, metres.
    #[must_use]
    pub fn is_within(&self, point: Point, distance: f64) -> bool {
        self.grid.is_within(point, distance)
    }

    fn items_of(&self, cells: Cells) -> &[usize] {
        let place = |cell: usize| self.starts.get(cell).copied().unwrap_or_default();
        self.items.get(place(cells.first)..place(cells.last + 1)).unwrap_or_default()
    }
}
