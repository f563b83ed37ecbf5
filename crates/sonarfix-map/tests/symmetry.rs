//! Maps with known symmetry, at any place and in any direction.
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "all of this file is a test, its helpers too"
)]

use std::f64::consts::{FRAC_PI_2, PI};

use proptest::prelude::*;
use sonarfix_map::{Floor, NamedWall, Symmetry, SymmetryMotion, symmetries};

type Point = [f64; 2];

fn floor(walls: &[[Point; 2]]) -> Floor {
    let named = walls.iter().enumerate();
    Floor::new(
        named.map(|(n, [from, to])| NamedWall::new(format!("w{n}"), *from, *to).unwrap()).collect(),
    )
}

fn outline(points: &[Point]) -> Vec<[Point; 2]> {
    points.iter().zip(points.iter().cycle().skip(1)).map(|(from, to)| [*from, *to]).collect()
}

fn rectangle(width: f64, height: f64) -> Vec<[Point; 2]> {
    outline(&[[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])
}

fn moved(walls: &[[Point; 2]], by: f64, [x, y]: Point) -> Vec<[Point; 2]> {
    let (sin, cos) = by.sin_cos();
    let place = |[px, py]: Point| [cos * px - sin * py + x, sin * px + cos * py + y];
    walls.iter().map(|ends| ends.map(place)).collect()
}

fn found(walls: &[[Point; 2]]) -> Vec<Symmetry> {
    symmetries(&floor(walls)).unwrap()
}

fn turns(symmetries: &[Symmetry]) -> Vec<i32> {
    let whole = symmetries.iter().filter(|symmetry| symmetry.is_whole());
    let mut degrees: Vec<i32> = whole
        .filter_map(|symmetry| match symmetry.motion {
            #[expect(clippy::cast_possible_truncation, reason = "below 180")]
            SymmetryMotion::Turn { by, .. } => Some(by.to_degrees().round() as i32),
            SymmetryMotion::Shift(_) => None,
        })
        .collect();
    degrees.sort_unstable();
    degrees
}

#[test]
fn rooms_have_the_symmetry_of_their_outline() {
    let l = outline(&[[0.0, 0.0], [5.0, 0.0], [5.0, 2.0], [3.2, 2.0], [3.2, 4.1], [0.0, 4.1]]);
    assert_eq!(turns(&found(&rectangle(6.0, 8.0))), [180]);
    assert_eq!(turns(&found(&rectangle(4.0, 4.0))), [90, 180]);
    assert!(turns(&found(&l)).is_empty(), "{:?}", found(&l));
    let mut furnished = rectangle(6.0, 8.0);
    furnished.extend([
        [[1.0, 0.0], [1.0, 0.5]],
        [[1.0, 0.5], [2.5, 0.5]],
        [[2.5, 0.5], [2.5, 0.0]],
    ]);
    assert!(turns(&found(&furnished)).is_empty(), "{:?}", found(&furnished));
}

#[test]
fn one_of_two_equal_rooms_is_a_part() {
    let mut rooms = rectangle(4.0, 3.0);
    rooms.extend(rectangle(4.0, 3.0).iter().map(|ends| ends.map(|[x, y]| [x + 9.0, y])));
    // What the rooms do not share.
    rooms.push([[0.5, 0.0], [0.5, 0.8]]);
    rooms.push([[9.0, 1.2], [10.1, 1.2]]);
    let found = found(&rooms);
    let [part] = found.as_slice() else { panic!("{found:?}") };
    assert!(!part.is_whole() && part.remedy.is_none(), "{part:?}");
    let text = part.to_string();
    assert!(text.contains("of this map is itself"), "{text}");
}

#[test]
fn the_message_names_the_motion() {
    let found = found(&rectangle(6.0, 8.0));
    assert_eq!(
        found[0].to_string(),
        "rotated by 180° about (3.0, 4.0) m this map is itself: a lost robot cannot tell the two apart"
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Copies of random walls around a centre: the turn from one to the next is found, and the cabinet of
    /// the remedy ends all repetition.
    #[test]
    fn constructed_rotations_are_found(
        copies in 2_u8..5, width in 1.0..3.0, height in 0.6..2.0, by in -3.0..3.0,
        at in [-20.0..20.0, -20.0..20.0],
    ) {
        let step = 2.0 * PI / f64::from(copies);
        // Apart from each other, and unlike when mirrored.
        let piece =
            moved(&outline(&[[0.0, 0.0], [width, 0.0], [width, height], [0.0, 0.3]]), 0.0, [3.0, -0.5]);
        let all: Vec<_> =
            (0..copies).flat_map(|n| moved(&piece, step * f64::from(n), [0.0, 0.0])).collect();
        let all = moved(&all, by, at);
        let found = found(&all);
        let whole: Vec<_> = found.iter().filter(|symmetry| symmetry.is_whole()).collect();
        prop_assert!(!whole.is_empty(), "{found:?}");
        for symmetry in &whole {
            let SymmetryMotion::Turn { by, about } = symmetry.motion else {
                panic!("{symmetry:?}");
            };
            let times = by / step;
            prop_assert!((times - times.round()).abs() < 0.05, "{symmetry:?}");
            prop_assert!((about[0] - at[0]).hypot(about[1] - at[1]) < 0.1, "{symmetry:?}");
        }
        let (wall, [x, y]) = whole[0].remedy.expect("a cabinet");
        let [from, to] = all[wall];
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        let (tx, ty) = ((to[0] - from[0]) / length, (to[1] - from[1]) / length);
        let corner = |along: f64, aside: f64| {
            [x + along * tx - aside * ty, y + along * ty + aside * tx]
        };
        let mut with = all.clone();
        // As large a share of the walls as the rule for a whole map needs.
        let half = 0.3_f64.min(0.4 * length);
        with.push([corner(-half, 0.0), corner(-half, 0.4)]);
        with.push([corner(-half, 0.4), corner(half, 0.4)]);
        with.push([corner(half, 0.4), corner(half, 0.0)]);
        let share = symmetries(&floor(&with)).unwrap();
        prop_assert!(!share.iter().any(Symmetry::is_whole), "{share:?}");
    }

    /// A room that is not symmetric is not, in any direction.
    #[test]
    fn an_irregular_room_has_none(by in -3.0..3.0, at in [-20.0..20.0, -20.0..20.0]) {
        let l = outline(&[[0.0, 0.0], [5.0, 0.0], [5.0, 2.0], [3.2, 2.0], [3.2, 4.1], [0.0, 4.1]]);
        let found = found(&moved(&l, by, at));
        prop_assert!(!found.iter().any(Symmetry::is_whole), "{found:?}");
        let square = found_turn(&moved(&rectangle(4.0, 4.0), by, at));
        prop_assert!((square - FRAC_PI_2).abs() < 0.02 || (square - PI).abs() < 0.02);
    }
}

fn found_turn(walls: &[[Point; 2]]) -> f64 {
    match found(walls)[0].motion {
        SymmetryMotion::Turn { by, .. } => by,
        SymmetryMotion::Shift(_) => 0.0,
    }
}
