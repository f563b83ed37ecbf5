//! The faces of walls: single lines, or both faces of thick ones.

use std::collections::BTreeMap;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::doors::Door;
use super::rooms::{Room, Span};
use super::site::Point;

/// Half of the thickness of thick walls, centimetres: light partitions to brick.
const HALF_THICKNESS: (i32, i32) = (4, 12);
/// Share of the plans with walls without thickness, as in hand-drawn maps.
const LINES: f64 = 0.3;

/// A straight face.
pub(super) type Face = [Point; 2];

/// The line of a face: whether it runs along y, and its coordinate.
type Line = (bool, i32);

/// Thickness of the walls of a plan, centimetres, an even number; zero for single lines.
pub(super) fn thickness(rng: &mut ChaCha8Rng) -> i32 {
    if rng.random_bool(LINES) {
        return 0;
    }
    2 * rng.random_range(HALF_THICKNESS.0..=HALF_THICKNESS.1)
}

/// All faces, with gaps for the doors, and the door jambs.
pub(super) fn faces(rooms: &[Room], doors: &[Door], thickness: i32) -> Vec<Face> {
    let half = thickness / 2;
    let mut lines: BTreeMap<Line, Vec<Span>> = BTreeMap::new();
    for room in rooms {
        let (x, y) = (room.x.inset(half), room.y.inset(half));
        for at in [x.from, x.to] {
            lines.entry((true, at)).or_default().push(y);
        }
        for at in [y.from, y.to] {
            lines.entry((false, at)).or_default().push(x);
        }
    }
    for (line, spans) in &mut lines {
        *spans = without_gaps(&joined(spans), *line, doors, half);
    }
    let drawn = lines.iter().flat_map(|(line, spans)| spans.iter().map(|span| face(*line, *span)));
    let jambs = doors.iter().flat_map(|door| jambs(door, half));
    drawn.chain(jambs).collect()
}

fn face((along_y, at): Line, span: Span) -> Face {
    [span.from, span.to].map(|end| if along_y { [at, end] } else { [end, at] })
}

/// The union of intervals: single lines belong to the rooms on both sides.
fn joined(spans: &[Span]) -> Vec<Span> {
    let mut sorted = spans.to_vec();
    sorted.sort_by_key(|span| span.from);
    let mut joined: Vec<Span> = Vec::new();
    for span in sorted {
        match joined.last_mut() {
            Some(last) if span.from <= last.to => last.to = last.to.max(span.to),
            _ => joined.push(span),
        }
    }
    joined
}

fn without_gaps(spans: &[Span], (along_y, at): Line, doors: &[Door], half: i32) -> Vec<Span> {
    let mut left = spans.to_vec();
    let in_line = |door: &&Door| door.wall_along_y == along_y && (door.at - at).abs() == half;
    for Door { gap, .. } in doors.iter().filter(in_line) {
        left = left
            .iter()
            .flat_map(|span| {
                let before = Span { to: gap.from.min(span.to), ..*span };
                let after = Span { from: gap.to.max(span.from), ..*span };
                [before, after]
            })
            .filter(|span| span.length() > 0)
            .collect();
    }
    left
}

fn jambs(door: &Door, half: i32) -> Vec<Face> {
    if half == 0 {
        return Vec::new();
    }
    let across = Span { from: door.at - half, to: door.at + half };
    [door.gap.from, door.gap.to].map(|at| face((!door.wall_along_y, at), across)).to_vec()
}
