//! Pieces of one wall, and corners.

use super::piece::Piece;

/// The sine of the largest angle between pieces of one wall: 2°.
const PARALLEL: f64 = 0.035;
/// How far ends may be from the corner in which they meet, metres, besides the thickness of the walls.
const CORNER: f64 = 0.05;

/// Joins the pieces of each wall: on one line within `aside` metres, and not farther apart than `gap` metres. Copies are such pieces.
pub fn collinear(mut pieces: Vec<Piece>, aside: f64, gap: f64) -> Vec<Piece> {
    pieces.sort_by(|a, b| b.length().total_cmp(&a.length()));
    let mut walls: Vec<Piece> = Vec::new();
    for piece in pieces {
        let mut piece = piece;
        // A joined piece may reach the next one.
        while let Some(at) = walls.iter().position(|wall| is_one_wall(wall, &piece, aside, gap)) {
            piece = union(&walls.swap_remove(at), &piece);
        }
        walls.push(piece);
    }
    walls
}

/// Whether two pieces are on one line within `aside` metres, and not farther apart than `gap` metres.
pub fn is_one_wall(wall: &Piece, piece: &Piece, aside: f64, gap: f64) -> bool {
    let (long, short) = if wall.length() < piece.length() { (piece, wall) } else { (wall, piece) };
    let ([from, to], _) = long.shadow(short);
    let is_near = from <= long.length() + gap && to >= -gap;
    let is_beside = |end| long.place(end)[1].abs() <= aside;
    // The direction of a short piece is uncertain.
    let parallel = PARALLEL.max(aside / short.length());
    is_near && is_beside(short.from) && is_beside(short.to) && long.angle(short) <= parallel
}

/// The line of least squares through two pieces, as long as both.
pub fn union(a: &Piece, b: &Piece) -> Piece {
    let (long, short) = if a.length() < b.length() { (b, a) } else { (a, b) };
    let ([begin, end], _) = long.shadow(short);
    let (from, to) = (begin.min(0.0), end.max(long.length()));
    // Each piece pulls the line to itself by its length.
    let weight = |piece: &Piece| piece.length().powi(3);
    let share = weight(short) / (weight(long) + weight(short));
    let middle = f64::midpoint(begin, end);
    let half = 0.5 * long.length();
    let [_, left] = long.place(short.at(0.5 * short.length(), 0.0));
    // The line through the middle of the long piece, turned towards that of the short one.
    let slope = if (middle - half).abs() > half { share * left / (middle - half) } else { 0.0 };
    let shift =
        if slope == 0.0 { left * short.length() / (long.length() + short.length()) } else { 0.0 };
    let off = |along: f64| shift + slope * (along - half);
    let thickness =
        (a.thickness * a.length() + b.thickness * b.length()) / (a.length() + b.length());
    Piece {
        name: long.name.clone(),
        from: long.at(from, off(from)),
        to: long.at(to, off(to)),
        thickness,
    }
}

/// Moves the ends of walls to the corners in which they meet.
pub fn corners(walls: &mut [Piece]) {
    let moved: Vec<[Option<f64>; 2]> =
        walls.iter().enumerate().map(|(at, _)| ends(walls, at)).collect();
    for (wall, [from, to]) in walls.iter_mut().zip(moved) {
        let old = wall.clone();
        wall.from = from.map_or(old.from, |along| old.at(along, 0.0));
        wall.to = to.map_or(old.to, |along| old.at(along, 0.0));
    }
}

/// Where along a wall its two ends meet other walls: the nearest crossing within reach.
fn ends(walls: &[Piece], at: usize) -> [Option<f64>; 2] {
    let Some(wall) = walls.get(at) else { return [None; 2] };
    let mut nearest = [(f64::INFINITY, None); 2];
    for other in walls.iter().enumerate().filter(|(index, _)| *index != at).map(|(_, it)| it) {
        let Some([along, across]) = wall.crossing(other) else { continue };
        let reach = CORNER + 0.75 * wall.thickness.max(other.thickness);
        if across < -reach || across > other.length() + reach {
            continue;
        }
        for (end, here) in nearest.iter_mut().zip([0.0, wall.length()]) {
            let off = (along - here).abs();
            if off <= reach.min(0.4 * wall.length()) && off < end.0 {
                *end = (off, Some(along));
            }
        }
    }
    nearest.map(|(_, along)| along)
}
