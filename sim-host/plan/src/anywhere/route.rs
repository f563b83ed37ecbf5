//! The shortest way between two places of the free space that keeps off the walls where there is room.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use sonarfix_sim::world::segment::{Point, distance};

use super::free_space::{FreeSpace, ROOMY};

/// How much longer a way may be that is at a distance of [`ROOMY`] from the walls, in place of one at the walls.
const DETOUR: f64 = 3.0;

/// A cell that a way has reached; the first one of a heap is that of the shortest way.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Reached {
    /// Length of the way to it and, at least, from it to the end.
    length: f64,
    cell: usize,
}

impl Eq for Reached {}

impl Ord for Reached {
    fn cmp(&self, other: &Self) -> Ordering {
        other.length.total_cmp(&self.length).then(other.cell.cmp(&self.cell))
    }
}

impl PartialOrd for Reached {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The corners of the way from one cell to another, without the first; none if there is no way.
pub(super) fn corners(space: &FreeSpace, from: usize, to: usize) -> Vec<Point> {
    let cells = cells(space, from, to);
    let mut corners = Vec::new();
    let mut here = 0;
    while here + 1 < cells.len() {
        let mut next = here + 1;
        let mut least = ROOMY;
        for (n, cell) in cells.iter().enumerate().skip(here + 1) {
            least = least.min(space.room(*cell));
            let is_open = cells.get(here).is_some_and(|from| is_clear(space, *from, *cell, least));
            if !is_open {
                break;
            }
            next = n;
        }
        corners.extend(cells.get(next).map(|cell| space.centre(*cell)));
        here = next;
    }
    corners
}

/// Whether the straight line between two cells is as far from the walls as this.
fn is_clear(space: &FreeSpace, from: usize, to: usize, least: f64) -> bool {
    let (start, end) = (space.centre(from), space.centre(to));
    let length = distance(start, end);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some steps")]
    let steps = (2.0 * length / space.cell()).ceil().max(1.0) as u32;
    (0..=steps).all(|step| {
        let part = f64::from(step) / f64::from(steps);
        let at = [start[0] + part * (end[0] - start[0]), start[1] + part * (end[1] - start[1])];
        space.room(space.cell_at(at)) >= least
    })
}

/// The cells of the shortest way, found by A*.
fn cells(space: &FreeSpace, from: usize, to: usize) -> Vec<usize> {
    let Some(part) = space.part(from).filter(|part| space.part(to) == Some(*part)) else {
        return Vec::new();
    };
    let remaining = |cell: usize| distance(space.centre(cell), space.centre(to)) / space.cell();
    // For each cell the length of the way to it, and the cell before it.
    let mut known: Vec<Option<(f64, usize)>> = Vec::new();
    known.resize(space.cells(), None);
    let mut pending = BinaryHeap::from([Reached { length: remaining(from), cell: from }]);
    if let Some(first) = known.get_mut(from) {
        *first = Some((0.0, from));
    }
    while let Some(Reached { length, cell }) = pending.pop() {
        if cell == to {
            break;
        }
        let Some((so_far, _)) = known.get(cell).copied().flatten() else { continue };
        if length > so_far + remaining(cell) + 1e-9 {
            continue;
        }
        for (next, step) in space.neighbours(cell) {
            if space.part(next) != Some(part) {
                continue;
            }
            let nearness = 1.0 - space.room(next) / ROOMY;
            let by_here = so_far + step * (1.0 + DETOUR * nearness);
            let Some(entry) = known.get_mut(next) else { continue };
            if entry.is_none_or(|(length, _)| by_here < length) {
                *entry = Some((by_here, cell));
                pending.push(Reached { length: by_here + remaining(next), cell: next });
            }
        }
    }
    back_from(to, from, &known)
}

/// The cells from the first to the last, each of which is known with the one before it.
fn back_from(last: usize, first: usize, known: &[Option<(f64, usize)>]) -> Vec<usize> {
    let before = |cell: &usize| {
        let (_, before) = known.get(*cell).copied().flatten()?;
        (*cell != first).then_some(before)
    };
    let mut cells: Vec<usize> = std::iter::successors(Some(last), before).collect();
    cells.reverse();
    cells
}
