//! Walls: distances, directions, and precision far from the origin.

use proptest::prelude::*;
use sonarfix::geometry::pose::Point;
use sonarfix::map::{Wall, WallError};

use crate::oracle::{ROUNDING, View, coordinates};
use crate::strategies::{Sight, any_sight};

/// Tolerance of the distance of a point: the coordinates are exact, their differences are rounded
/// once, the unit vectors twice.
fn allowed(reach: f64) -> f64 {
    8.0 * ROUNDING * reach
}

/// Compares distance and foot of a wall at a point with `f64`.
fn agrees(sight: Sight, origin: Point, beside: (f32, f32)) -> Result<(), TestCaseError> {
    let (from, to) = sight.ends(origin);
    prop_assume!(Wall::new(from, to).is_ok());
    let wall = Wall::new(from, to).unwrap();
    let exact = View::new(from, to, Point::default());
    let (_, _, length) = exact.tangent();
    let point = Point::new(origin.x.0 + beside.0, origin.y.0 + beside.1);
    let at = coordinates(point);
    let reach = length + (at.0 - exact.from.0).hypot(at.1 - exact.from.1);
    let distance = f64::from(wall.signed_distance(point).0);
    prop_assert!((distance - exact.distance(at)).abs() <= allowed(reach), "{distance}");
    let along = f64::from(wall.along(point).0);
    prop_assert!((along - exact.along(at)).abs() <= allowed(reach), "{along}");
    prop_assert!((f64::from(wall.length().0) - length).abs() <= allowed(length));
    let norm = f64::from(wall.a()).powi(2) + f64::from(wall.b()).powi(2);
    prop_assert!((norm - 1.0).abs() <= 8.0 * ROUNDING, "a² + b² = {norm}");

    // The direction points to the wall, from either side of it.
    let direction = f64::from(wall.direction_from(wall.signed_distance(point)).radians().0);
    let d = exact.distance(at).abs();
    let foot = (at.0 + d * direction.cos(), at.1 + d * direction.sin());
    prop_assert!(exact.distance(foot).abs() <= allowed(reach) + 1e-6 * d);

    // The far end is at its given place, to the rounding of its coordinates.
    let (end, drawn) = (coordinates(wall.to()), exact.to);
    let size = drawn.0.abs().max(drawn.1.abs()) + length;
    prop_assert!((end.0 - drawn.0).abs().max((end.1 - drawn.1).abs()) <= 4.0 * ROUNDING * size);
    Ok(())
}

proptest! {
    #[test]
    fn distances_equal_those_in_f64(
        sight in any_sight(), x in -20.0_f32..20.0, y in -20.0_f32..20.0, aside in -8.0_f32..8.0, ahead in -8.0_f32..8.0,
    ) {
        agrees(sight, Point::new(x, y), (aside, ahead))?;
    }

    /// A kilometre from the origin the distance of given points is as precise as near it (some
    /// micrometres); only the coordinates themselves lose 0.03 mm. The form a x + b y + c would
    /// lose ten times more.
    #[test]
    fn distances_are_precise_a_kilometre_away(
        sight in any_sight(), direction in -3.1_f32..3.1, aside in -8.0_f32..8.0, ahead in -8.0_f32..8.0,
    ) {
        let origin = Point::new(1000.0 * direction.cos(), 1000.0 * direction.sin());
        agrees(sight, origin, (aside, ahead))?;
    }

    /// Crossing the line changes the sign and nothing else.
    #[test]
    fn the_sign_is_the_side(sight in any_sight(), d in 0.01_f32..5.0) {
        let (from, to) = sight.ends(Point::default());
        let wall = sight.wall(Point::default());
        let middle = (0.5 * (from.x.0 + to.x.0), 0.5 * (from.y.0 + to.y.0));
        let beside = |d: f32| Point::new(middle.0 + wall.a() * d, middle.1 + wall.b() * d);
        prop_assert!((wall.signed_distance(beside(d)).0 - d).abs() < 1e-5);
        prop_assert!((wall.signed_distance(beside(-d)).0 + d).abs() < 1e-5);
        // With the ends exchanged, the sides are exchanged.
        let back = Wall::new(to, from).unwrap();
        prop_assert!((back.signed_distance(beside(d)).0 + d).abs() < 1e-5);
    }
}

#[test]
fn a_degenerate_wall_is_refused() {
    let at = Point::new(1.0, 2.0);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for point in [Point::new(bad, 0.0), Point::new(0.0, bad)] {
            assert_eq!(Wall::new(at, point), Err(WallError::NotFinite));
            assert_eq!(Wall::new(point, at), Err(WallError::NotFinite));
            assert_eq!(Wall::new(point, point), Err(WallError::NotFinite));
        }
    }
    let far = Point::new(f32::MAX, f32::MAX);
    assert_eq!(Wall::new(far, Point::new(-f32::MAX, 0.0)), Err(WallError::NotFinite));
    assert_eq!(Wall::new(at, at), Err(WallError::ZeroLength));
    assert_eq!(Wall::new(at, Point::new(1.000_05, 2.0)), Err(WallError::ZeroLength));
    assert!(Wall::new(at, Point::new(1.000_2, 2.0)).is_ok());
}
