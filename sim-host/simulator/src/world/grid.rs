//! The uniform grid of an index: the cells near a point, and along a line.

use std::ops::RangeInclusive;

use super::segment::{Point, distance};

/// Enlargement of every region, metres: far above the rounding of coordinates up to 100 km, 1e-11 m.
const MARGIN: f64 = 1e-6;
/// Up to this number of lines the grid is one cell: more cells would cost more than they save.
const FEW: usize = 12;

/// Contiguous cells of a column, from the first to the last.
#[derive(Debug, Clone, Copy)]
pub struct Cells {
    pub first: usize,
    pub last: usize,
}

/// A grid of square cells; what lies outside of it counts as in its outermost cells.
#[derive(Debug, Clone, Copy)]
pub struct Grid {
    low: Point,
    high: Point,
    /// Width and height of a cell, metres.
    cell: f64,
    columns: usize,
    rows: usize,
}

impl Grid {
    /// A grid over lines, with about as many cells as lines.
    pub fn over(lines: &[(Point, Point)]) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for point in lines.iter().flat_map(|&(from, to)| [from, to]) {
            low = [low[0].min(point[0]), low[1].min(point[1])];
            high = [high[0].max(point[0]), high[1].max(point[1])];
        }
        let (width, height) = (high[0] - low[0], high[1] - low[1]);
        let is_sensible = width.is_finite() && height.is_finite();
        if lines.len() <= FEW || !is_sensible {
            return Self { low, high, cell: f64::INFINITY, columns: 1, rows: 1 };
        }
        #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
        let count = lines.len() as f64;
        let cell = (width * height / count).sqrt().max(width.max(height) / count).max(MARGIN);
        let columns = whole(width / cell) + 1;
        Self { low, high, cell, columns, rows: whole(height / cell) + 1 }
    }

    /// The number of cells.
    pub fn cells(&self) -> usize {
        self.columns * self.rows
    }

    /// The cells within `reach` metres of a point, a column at a time.
    pub fn around(self, [x, y]: Point, reach: f64) -> impl Iterator<Item = Cells> {
        let columns = self.columns_between(x - reach, x + reach);
        columns.map(move |column| self.cells_between(column, y - reach, y + reach))
    }

    /// The cells that a line between two points touches, a column at a time.
    pub fn along(self, from: Point, to: Point) -> impl Iterator<Item = Cells> {
        let (left, right) = if from[0] <= to[0] { (from, to) } else { (to, from) };
        let columns = self.columns_between(left[0], right[0]);
        let (first, last) = (*columns.start(), *columns.end());
        let slope = (right[1] - left[1]) / (right[0] - left[0]);
        let height = move |x: f64| left[1] + slope * (x - left[0]);
        columns.map(move |column| {
            // The part of the line in this column; in the outermost ones also what is outside of the grid.
            let (start, end) = (self.edge(column) - MARGIN, self.edge(column + 1) + MARGIN);
            let enters = if column == first || start <= left[0] { left[1] } else { height(start) };
            let leaves = if column == last || end >= right[0] { right[1] } else { height(end) };
            self.cells_between(column, enters.min(leaves), enters.max(leaves))
        })
    }

    /// Whether the grid lies within a distance of a point, metres.
    pub fn is_within(&self, point: Point, reach: f64) -> bool {
        let far = |at: f64, low: f64, high: f64| (at - low).abs().max((high - at).abs());
        let [x, y] = point;
        let farthest = [far(x, self.low[0], self.high[0]), far(y, self.low[1], self.high[1])];
        distance([0.0; 2], farthest) < reach
    }

    #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
    fn edge(&self, column: usize) -> f64 {
        self.low[0] + self.cell * column as f64
    }

    fn columns_between(&self, low: f64, high: f64) -> RangeInclusive<usize> {
        let column = |x: f64| whole((x - self.low[0]) / self.cell).min(self.columns - 1);
        column(low - MARGIN)..=column(high + MARGIN)
    }

    fn cells_between(&self, column: usize, low: f64, high: f64) -> Cells {
        let row = |y: f64| whole((y - self.low[1]) / self.cell).min(self.rows - 1);
        let base = column * self.rows;
        Cells { first: base + row(low - MARGIN), last: base + row(high + MARGIN) }
    }
}

/// The whole part; zero of what is negative.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a float-to-int cast saturates"
)]
fn whole(value: f64) -> usize {
    value as usize
}
