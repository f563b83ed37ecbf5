//! Reduces the number of walls: joins collinear pieces and removes short ones.

use crate::bake::{BakeError, bake};
use crate::floor::{Floor, NamedWall};
use crate::geometry::{Point, Segment};
use crate::neighbours::Neighbours;

/// The largest difference between a simplified floor and the original, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Largest distance of an end of a piece from the joined wall, and largest gap that is closed.
    pub tolerance: f64,
    /// Walls shorter than this are removed after joining.
    pub shortest: f64,
}

/// A simplified floor. Walls are numbered as in the original, from 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Simplified {
    /// The simplified floor.
    pub floor: Floor,
    /// The pieces of each joined wall, which has the name of the first.
    pub joined: Vec<Vec<usize>>,
    /// The pieces of each removed wall.
    pub dropped: Vec<Vec<usize>>,
}

/// Joins collinear walls that touch or overlap, and removes short ones.
///
/// # Errors
/// [`BakeError`], if the walls cannot be indexed, or none would be left.
pub fn simplify(floor: &Floor, limits: Limits) -> Result<Simplified, BakeError> {
    let image = bake(&floor.walls())?;
    let walls = Neighbours::new(floor, &image).map_err(BakeError::Refused)?;
    let mut taken = vec![false; walls.segments().len()];
    let mut simplified =
        Simplified { floor: Floor::new(Vec::new()), joined: Vec::new(), dropped: Vec::new() };
    let mut left = Vec::new();
    for (wall, named) in floor.named_walls().iter().enumerate() {
        if taken.get(wall).copied().unwrap_or(true) {
            continue;
        }
        let line = Line::from(&walls, wall, &mut taken, limits.tolerance);
        let Some(joined) = line
            .wall(floor.named_walls(), named)
            .filter(|wall| wall.segment().length() >= limits.shortest)
        else {
            simplified.dropped.push(line.pieces);
            continue;
        };
        left.push(joined);
        if line.pieces.len() > 1 {
            simplified.joined.push(line.pieces);
        }
    }
    if left.is_empty() {
        return Err(BakeError::NoWall);
    }
    simplified.floor = Floor::new(left);
    Ok(simplified)
}

/// A wall that grows by the pieces in line with it.
struct Line {
    pieces: Vec<usize>,
    ends: Vec<Point>,
    /// The segment between the two ends that are farthest apart.
    whole: Segment,
}

impl Line {
    /// Takes all pieces that can be joined to the first one; returns their line.
    fn from(walls: &Neighbours, first: usize, taken: &mut [bool], tolerance: f64) -> Self {
        let segment = |wall: usize| walls.segments().get(wall).copied();
        let none = Segment { from: [0.0; 2], to: [0.0; 2] };
        let whole = segment(first).unwrap_or(none);
        let mut line = Self { pieces: vec![first], ends: vec![whole.from, whole.to], whole };
        take(taken, first);
        let mut grown = vec![whole];
        while let Some(piece) = grown.pop() {
            for (other, candidate) in walls.beside(piece, tolerance) {
                let is_free = taken.get(other).is_some_and(|taken| !taken);
                let touches = candidate.distance(piece) <= tolerance;
                if is_free && touches && line.join(other, candidate, tolerance) {
                    take(taken, other);
                    grown.push(candidate);
                }
            }
        }
        line.pieces.sort_unstable();
        line
    }

    /// Adds a piece if all ends stay within the tolerance.
    fn join(&mut self, wall: usize, piece: Segment, tolerance: f64) -> bool {
        let whole = farthest([self.whole.from, self.whole.to, piece.from, piece.to]);
        let fits = |&end: &Point| whole.distance_to(end) <= tolerance;
        let in_line = self.ends.iter().chain(&[piece.from, piece.to]).all(fits);
        if in_line {
            self.pieces.push(wall);
            self.ends.extend([piece.from, piece.to]);
            self.whole = whole;
        }
        in_line
    }

    /// The line as a wall with the name and the direction of its first piece, and the worst accuracy of all; without one if
    /// a piece has none.
    fn wall(&self, walls: &[NamedWall], named: &NamedWall) -> Option<NamedWall> {
        let Segment { from, to } = self.whole;
        let [start, end] = [from, to].map(|end| named.segment().place(end)[0]);
        let (from, to) = if start <= end { (from, to) } else { (to, from) };
        let joined = NamedWall::new(named.name().to_owned(), from, to).ok()?;
        let accuracies = self.pieces.iter().map(|&piece| walls.get(piece)?.accuracy());
        let worst = accuracies.reduce(|one, other| Some(one?.max(other?))).flatten();
        Some(joined.with_accuracy(worst))
    }
}

fn take(taken: &mut [bool], wall: usize) {
    if let Some(taken) = taken.get_mut(wall) {
        *taken = true;
    }
}

/// The two of four points that are farthest apart.
fn farthest([a, b, c, d]: [Point; 4]) -> Segment {
    let pairs = [(a, c), (a, d), (b, c), (b, d), (c, d)];
    pairs.into_iter().fold(Segment { from: a, to: b }, |longest, (from, to)| {
        let pair = Segment { from, to };
        if pair.length() > longest.length() { pair } else { longest }
    })
}
