//! The walls of a baked map near a point.

use core::ops::Range;

use super::grid::Cells;
use super::image::{Image, Reference};
use super::wall::{Wall, WallId};
use crate::geometry::pose::Point;
use crate::geometry::units::Metres;

/// The walls of a rectangle of cells, each once: in the first column (row) of the rectangle every wall that
/// the cell refers to, in the others those for which the column (row) is their first.
///
/// The references of neighbouring cells of a row are contiguous, so a row consists of two runs: its first
/// cell, and all others.
#[derive(Debug, Clone)]
pub(super) struct Window<'a> {
    image: Image<'a>,
    /// First and last column.
    columns: (u16, u16),
    /// Remaining rows.
    rows: Range<u16>,
    /// Flags that a reference in the first cell of the next row must have.
    row_flags: u32,
    /// Indices of the remaining references of this run.
    run: Range<u32>,
    /// Indices of the references of the other cells of the row, until their run starts.
    others: Range<u32>,
    /// Flags that a reference in this run must have.
    flags: u32,
}

impl<'a> Window<'a> {
    /// The walls of the cells within `reach` of `point`.
    pub fn new(image: Image<'a>, point: Point, reach: Metres) -> Self {
        let (columns, rows) = match image.grid().cells_near(point, reach) {
            None => ((0, 0), 0..0),
            Some(Cells { columns, rows: (first, last) }) => {
                (columns, first..last.saturating_add(1))
            }
        };
        Self { image, columns, rows, row_flags: 0, run: 0..0, others: 0..0, flags: 0 }
    }

    /// Proceeds to the next run, if any. Not inlined: its operands would be loaded for every wall.
    #[inline(never)]
    fn next_run(&mut self) -> Option<()> {
        if self.others.is_empty() {
            let row = self.rows.next()?;
            let (first, last) = self.columns;
            let grid = self.image.grid();
            let start = |column| self.image.start(grid.place(column, row));
            let (start, middle, end) = (start(first)?, start(first + 1)?, start(last + 1)?);
            (self.run, self.others) = (start..middle, middle..end);
            self.flags = self.row_flags;
            self.row_flags = Reference::FIRST_ROW;
        } else {
            self.run = core::mem::replace(&mut self.others, 0..0);
            self.flags |= Reference::FIRST_COLUMN;
        }
        Some(())
    }
}

impl Iterator for Window<'_> {
    type Item = (WallId, Wall);

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            for index in self.run.by_ref() {
                let reference = self.image.reference(index)?;
                if reference.has(self.flags) {
                    let id = reference.wall();
                    return Some((id, self.image.wall(id)?));
                }
            }
            self.next_run()?;
        }
    }
}
