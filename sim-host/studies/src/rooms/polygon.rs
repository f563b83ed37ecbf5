//! Plane geometry of rooms: polygons, and the distance of a line from a path.

/// A point, metres.
pub type Point = [f64; 2];
/// A line between two points.
pub type Side = [Point; 2];

/// The point at these shares of a vector from another one.
pub fn along([x, y]: Point, [dx, dy]: Point, share: f64) -> Point {
    [x + share * dx, y + share * dy]
}

/// The vector from one point to another.
pub fn from_to([x0, y0]: Point, [x1, y1]: Point) -> Point {
    [x1 - x0, y1 - y0]
}

/// The length of a line, metres.
pub fn length([from, to]: Side) -> f64 {
    let [dx, dy] = from_to(from, to);
    dx.hypot(dy)
}

/// The point at this share of a line.
pub fn point_on([from, to]: Side, share: f64) -> Point {
    along(from, from_to(from, to), share)
}

/// The unit vector along a line, and the one to its left.
pub fn directions(side: Side) -> (Point, Point) {
    let [dx, dy] = from_to(side[0], side[1]);
    let length = length(side);
    let (x, y) = (dx / length, dy / length);
    ([x, y], [-y, x])
}

/// The sides of a polygon, the last one back to its first corner.
pub fn sides(corners: &[Point]) -> impl Iterator<Item = Side> + Clone {
    corners.iter().zip(corners.iter().cycle().skip(1)).map(|(from, to)| [*from, *to])
}

/// Its area, m².
pub fn area(corners: &[Point]) -> f64 {
    let doubled: f64 = sides(corners).map(|[[x0, y0], [x1, y1]]| x0 * y1 - x1 * y0).sum();
    0.5 * doubled.abs()
}

/// The lesser of its extents along x and y, metres.
pub fn narrowest(corners: &[Point]) -> f64 {
    let extent = |axis: fn(&Point) -> f64| {
        let values = corners.iter().map(axis);
        let least = values.clone().fold(f64::INFINITY, f64::min);
        values.fold(f64::NEG_INFINITY, f64::max) - least
    };
    extent(|[x, _]| *x).min(extent(|[_, y]| *y))
}

/// Whether a point is inside a polygon.
pub fn contains(corners: &[Point], [x, y]: Point) -> bool {
    let crossed = sides(corners).filter(|[[x0, y0], [x1, y1]]| {
        (*y0 > y) != (*y1 > y) && x < x0 + (x1 - x0) * (y - y0) / (y1 - y0)
    });
    crossed.count() % 2 == 1
}

/// The distance between two lines, zero if they cross, metres.
pub fn distance(one: Side, other: Side) -> f64 {
    if cross(one, other) {
        return 0.0;
    }
    let ends = one.map(|end| distance_to(other, end)).into_iter();
    ends.chain(other.map(|end| distance_to(one, end))).fold(f64::INFINITY, f64::min)
}

fn distance_to(side: Side, point: Point) -> f64 {
    let ([dx, dy], [px, py]) = (from_to(side[0], side[1]), from_to(side[0], point));
    let square = dx * dx + dy * dy;
    let share = if square > 0.0 { ((px * dx + py * dy) / square).clamp(0.0, 1.0) } else { 0.0 };
    length([point, point_on(side, share)])
}

fn cross([a, b]: Side, [c, d]: Side) -> bool {
    let turns = |p: Point, q: Point, r: Point| {
        let ([ux, uy], [vx, vy]) = (from_to(p, q), from_to(p, r));
        ux * vy - uy * vx > 0.0
    };
    turns(a, b, c) != turns(a, b, d) && turns(c, d, a) != turns(c, d, b)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ELL: [Point; 6] =
        [[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [2.0, 2.0], [2.0, 5.0], [0.0, 5.0]];

    #[test]
    fn a_room_has_an_inside() {
        assert!(contains(&ELL, [1.0, 4.0]) && contains(&ELL, [3.0, 1.0]));
        assert!(!contains(&ELL, [3.0, 3.0]) && !contains(&ELL, [-0.1, 1.0]));
        assert!((area(&ELL) - 14.0).abs() < 1e-12);
        assert!((narrowest(&ELL) - 4.0).abs() < 1e-12);
    }

    #[test]
    fn lines_that_cross_have_no_distance() {
        let line = [[0.0, 0.0], [2.0, 0.0]];
        assert_eq!(distance(line, [[1.0, -1.0], [1.0, 1.0]]).to_bits(), 0.0_f64.to_bits());
        assert!((distance(line, [[1.0, 0.5], [1.0, 1.0]]) - 0.5).abs() < 1e-12);
        assert!((distance(line, [[5.0, 4.0], [9.0, 9.0]]) - 5.0).abs() < 1e-12);
    }
}
