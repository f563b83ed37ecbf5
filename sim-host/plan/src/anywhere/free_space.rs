//! Where a robot may be on a map: a grid of cells that are clear of walls and enclosed by them.

use sonarfix_map::Floor;
use sonarfix_sim::world::World;
use sonarfix_sim::world::segment::{Point, distance};

/// Size of a cell, metres, unless the map is so large that it has more than [`MOST_CELLS`].
const CELL: f64 = 0.1;
const MOST_CELLS: f64 = 250_000.0;
/// Distance from walls from which on more distance is no advantage, metres: that of the paths of floor plans.
pub(super) const ROOMY: f64 = 0.4;
/// Area of the smallest part in which a robot starts, m²: smaller ones are the insides of furniture.
const LEAST_PART: f64 = 1.0;
/// A place is near the free cells within this, metres: the error of an uncertain pose.
const BESIDE: f64 = 0.2;
/// Directions in which a place that is not enclosed is tested, and in how many of them it must have a wall.
const DIRECTIONS: u8 = 16;
const ENCLOSED: usize = 14;

/// The cells of a map.
#[derive(Debug, Clone)]
pub(super) struct FreeSpace {
    origin: Point,
    columns: usize,
    rows: usize,
    cell: f64,
    /// Distance of each cell's centre from the nearest wall, at most [`ROOMY`], metres.
    room: Vec<f64>,
    /// The connected part of each free cell.
    part: Vec<Option<usize>>,
    /// The free cells.
    free: Vec<usize>,
}

impl FreeSpace {
    /// The places of a floor that are so many metres clear of its walls.
    pub fn new(floor: &Floor, clearance: f64) -> Self {
        let mut space = Self::around(floor);
        let mut is_free: Vec<bool> = space.room.iter().map(|room| *room >= clearance).collect();
        let parts = space.label(&is_free);
        let open = space.open_parts(&parts);
        let world = World::new(floor);
        for (cell, part) in parts.iter().enumerate() {
            let is_open = part.is_some_and(|part| open.get(part) == Some(&true));
            if is_open
                && !is_enclosed(&world, space.centre(cell))
                && let Some(free) = is_free.get_mut(cell)
            {
                *free = false;
            }
        }
        space.part = space.label(&is_free);
        space.leave_out_small_parts();
        space
    }

    /// The grid of a floor with a margin, and the distances of its cells from the walls.
    fn around(floor: &Floor) -> Self {
        let ends = floor.named_walls().iter().flat_map(|wall| [wall.from(), wall.to()]);
        let (least, most) =
            ends.fold(([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]), |(least, most), [x, y]| {
                ([x.min(least[0]), y.min(least[1])], [x.max(most[0]), y.max(most[1])])
            });
        let [width, height] = [0, 1].map(|axis: usize| {
            let side = |of: &Point| of.get(axis).copied().unwrap_or_default();
            (side(&most) - side(&least)).max(0.0) + 2.0 * ROOMY
        });
        let cell = CELL.max((width * height / MOST_CELLS).sqrt());
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some cells")]
        let [columns, rows] = [width, height].map(|side| (side / cell).ceil() as usize + 1);
        let origin = [least[0] - ROOMY, least[1] - ROOMY];
        let room = vec![ROOMY; columns * rows];
        let mut space =
            Self { origin, columns, rows, cell, room, part: Vec::new(), free: Vec::new() };
        for wall in World::new(floor).walls() {
            let [from, to] = wall.ends();
            for cell in space.cells_around(from, to) {
                let centre = space.centre(cell);
                let apart = distance(centre, wall.nearest(centre));
                if let Some(room) = space.room.get_mut(cell) {
                    *room = room.min(apart);
                }
            }
        }
        space
    }

    /// The cells in the box around a wall, with the margin [`ROOMY`].
    fn cells_around(&self, from: Point, to: Point) -> impl Iterator<Item = usize> + use<> {
        let low = [from[0].min(to[0]) - ROOMY, from[1].min(to[1]) - ROOMY];
        let high = [from[0].max(to[0]) + ROOMY, from[1].max(to[1]) + ROOMY];
        let ([left, bottom], [right, top]) = (self.place(low), self.place(high));
        let columns = self.columns;
        (bottom..=top).flat_map(move |row| (left..=right).map(move |column| row * columns + column))
    }

    /// Column and row of the cell at a point, or of the nearest one.
    fn place(&self, [x, y]: Point) -> [usize; 2] {
        let index = |along: f64, count: usize| {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
            let index = (along / self.cell).max(0.0) as usize;
            index.min(count - 1)
        };
        [index(x - self.origin[0], self.columns), index(y - self.origin[1], self.rows)]
    }

    /// The cell at a point.
    pub fn cell_at(&self, point: Point) -> usize {
        let [column, row] = self.place(point);
        row * self.columns + column
    }

    /// The centre of a cell.
    #[expect(clippy::cast_precision_loss, reason = "some hundred thousand cells")]
    pub fn centre(&self, cell: usize) -> Point {
        let (column, row) = (cell % self.columns, cell / self.columns);
        let along = |index: usize| (index as f64 + 0.5) * self.cell;
        [self.origin[0] + along(column), self.origin[1] + along(row)]
    }

    /// The neighbours of a cell, those at its sides first, with their distances in cells.
    pub fn neighbours(&self, cell: usize) -> impl Iterator<Item = (usize, f64)> {
        const OFFSETS: [(isize, isize); 8] =
            [(1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, 1), (-1, -1), (1, -1)];
        let (column, row) = (cell % self.columns, cell / self.columns);
        OFFSETS.into_iter().filter_map(move |(right, up)| {
            let column = column.checked_add_signed(right).filter(|it| *it < self.columns)?;
            let row = row.checked_add_signed(up).filter(|it| *it < self.rows)?;
            let is_diagonal = right != 0 && up != 0;
            Some((row * self.columns + column, if is_diagonal { 2_f64.sqrt() } else { 1.0 }))
        })
    }

    /// Numbers the parts of free cells that are connected over their sides.
    fn label(&self, is_free: &[bool]) -> Vec<Option<usize>> {
        let mut parts = vec![None; is_free.len()];
        let is_free = |cell: usize| is_free.get(cell).copied().unwrap_or(false);
        let mut count = 0;
        for first in 0..parts.len() {
            if !is_free(first) || parts.get(first).is_some_and(Option::is_some) {
                continue;
            }
            let mut pending = vec![first];
            while let Some(cell) = pending.pop() {
                let Some(part @ None) = parts.get_mut(cell) else { continue };
                *part = Some(count);
                let beside = self.neighbours(cell).filter(|(_, length)| *length <= 1.0);
                pending.extend(beside.map(|(next, _)| next).filter(|next| is_free(*next)));
            }
            count += 1;
        }
        parts
    }

    /// Which parts reach the border of the grid: no walls enclose them.
    fn open_parts(&self, parts: &[Option<usize>]) -> Vec<bool> {
        let count = parts.iter().flatten().max().map_or(0, |last| last + 1);
        let mut is_open = vec![false; count];
        for (cell, part) in parts.iter().enumerate() {
            let (column, row) = (cell % self.columns, cell / self.columns);
            let is_at_border =
                column == 0 || row == 0 || column + 1 == self.columns || row + 1 == self.rows;
            if is_at_border && let Some(open) = part.and_then(|part| is_open.get_mut(part)) {
                *open = true;
            }
        }
        is_open
    }

    /// Keeps the parts that are large enough, or else the largest one.
    fn leave_out_small_parts(&mut self) {
        let count = self.part.iter().flatten().max().map_or(0, |last| last + 1);
        let mut sizes = vec![0_usize; count];
        for part in self.part.iter().flatten() {
            if let Some(size) = sizes.get_mut(*part) {
                *size += 1;
            }
        }
        let largest = sizes.iter().copied().max().unwrap_or(0);
        #[expect(clippy::cast_precision_loss, reason = "some hundred thousand cells")]
        let is_large =
            |size: usize| size == largest || size as f64 * self.cell * self.cell >= LEAST_PART;
        for part in &mut self.part {
            *part = part.filter(|part| sizes.get(*part).is_some_and(|size| is_large(*size)));
        }
        let free = self.part.iter().enumerate().filter(|(_, part)| part.is_some());
        self.free = free.map(|(cell, _)| cell).collect();
    }

    /// All free cells.
    pub fn free(&self) -> &[usize] {
        &self.free
    }

    /// The connected part of a cell, if it is free.
    pub fn part(&self, cell: usize) -> Option<usize> {
        self.part.get(cell).copied().flatten()
    }

    /// Whether a free cell is within [`BESIDE`] of a point, in one of eight directions.
    pub fn is_near(&self, [x, y]: Point) -> bool {
        let steps = [-BESIDE, 0.0, BESIDE];
        steps
            .iter()
            .any(|dx| steps.iter().any(|dy| self.part(self.cell_at([x + dx, y + dy])).is_some()))
    }

    /// Distance of a cell from the nearest wall, at most [`ROOMY`], metres.
    pub fn room(&self, cell: usize) -> f64 {
        self.room.get(cell).copied().unwrap_or_default()
    }

    /// How many cells there are, free ones and others.
    pub fn cells(&self) -> usize {
        self.room.len()
    }

    /// Size of a cell, metres.
    pub fn cell(&self) -> f64 {
        self.cell
    }

    /// The free area, m².
    #[expect(clippy::cast_precision_loss, reason = "some hundred thousand cells")]
    pub fn area(&self) -> f64 {
        self.free.len() as f64 * self.cell * self.cell
    }
}

/// Whether a place has walls around it, in nearly every direction.
fn is_enclosed(world: &World, at: Point) -> bool {
    let hits = (0..DIRECTIONS).filter(|index| {
        // Off the axes, so that no beam runs along a wall.
        let axis = (f64::from(*index) + 0.37) * std::f64::consts::TAU / f64::from(DIRECTIONS);
        world.on_axis(at, axis).is_some()
    });
    hits.count() >= ENCLOSED
}
