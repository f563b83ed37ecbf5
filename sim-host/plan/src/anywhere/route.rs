//! The shortest way between two places of the free space that keeps off the walls where there is room.

use petgraph::algo::astar;
use petgraph::graph::{DiGraph, NodeIndex};
use sonarfix_sim::world::segment::{Point, distance};

use super::free_space::{FreeSpace, ROOMY};

/// How much longer a way may be that is at a distance of [`ROOMY`] from the walls, in place of one at the walls.
const DETOUR: f64 = 3.0;

/// The steps between the cells of a free space.
pub(super) struct Steps {
    /// The node of each cell has its number; a step has its length in cells, longer at the walls.
    graph: DiGraph<(), f64>,
}

impl Steps {
    /// The steps from each free cell to those around it in its part.
    pub fn new(space: &FreeSpace) -> Self {
        let free = (0..space.cells()).filter(|cell| space.part(*cell).is_some());
        let steps = free.flat_map(|cell| {
            let is_one_part = move |next: usize| space.part(next) == space.part(cell);
            let around = space.neighbours(cell).filter(move |(next, _)| is_one_part(*next));
            around.map(move |(next, length)| {
                let nearness = 1.0 - space.room(next) / ROOMY;
                (NodeIndex::new(cell), NodeIndex::new(next), length * (1.0 + DETOUR * nearness))
            })
        });
        let mut graph = DiGraph::new();
        for _ in 0..space.cells() {
            graph.add_node(());
        }
        graph.extend_with_edges(steps);
        Self { graph }
    }

    /// The cells of the shortest way; none if there is no way.
    fn cells(&self, space: &FreeSpace, from: usize, to: usize) -> Vec<usize> {
        let [from, to] = [from, to].map(NodeIndex::new);
        let end = space.centre(to.index());
        let remaining = |cell: NodeIndex| distance(space.centre(cell.index()), end) / space.cell();
        let way = astar(&self.graph, from, |cell| cell == to, |step| *step.weight(), remaining);
        way.map_or_else(Vec::new, |(_, cells)| cells.into_iter().map(NodeIndex::index).collect())
    }
}

/// The corners of the way from one cell to another, without the first; none if there is no way.
pub(super) fn corners(space: &FreeSpace, steps: &Steps, from: usize, to: usize) -> Vec<Point> {
    let cells = steps.cells(space, from, to);
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
