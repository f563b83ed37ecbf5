//! Maps with known symmetry, at any place and in any direction.
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "all of this file is a test, its helpers too"
)]

use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

use proptest::prelude::*;
use sonarfix_map::{
    Addition, CLASSROOM, Floor, NamedWall, PlacedAddition, Scenario, Symmetry, SymmetryMotion,
    along_walls, symmetries,
};

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

/// Whether an addition begins at its wall, at right angles to it, and is as deep as it says.
fn is_attached(remedy: &PlacedAddition, walls: &[[Point; 2]]) -> bool {
    let (from, to) = (walls[remedy.wall][0], walls[remedy.wall][1]);
    let length = (to[0] - from[0]).hypot(to[1] - from[1]);
    let tangent = [(to[0] - from[0]) / length, (to[1] - from[1]) / length];
    // Along the wall and aside of it.
    let place = |[x, y]: Point| {
        let [dx, dy] = [x - from[0], y - from[1]];
        (dx * tangent[0] + dy * tangent[1], dx * tangent[1] - dy * tangent[0])
    };
    let (half, depth) = match remedy.addition {
        Addition::Board { depth } => (0.0, depth),
        Addition::Cabinet { width, depth } => (0.5 * width, depth),
    };
    let middle = place(remedy.at).0;
    let [near, far] = remedy.faces[0].map(place);
    (near.0 - middle + half).abs() < 1e-9
        && near.1.abs() < 1e-9
        && (far.0 - near.0).abs() < 1e-9
        && (far.1.abs() - depth).abs() < 1e-9
        && (0.0..=length).contains(&middle)
}

fn remedy(walls: &[[Point; 2]]) -> PlacedAddition {
    let remedy = found(walls)[0].remedy.clone().unwrap();
    assert!(is_attached(&remedy, walls), "{remedy:?}");
    remedy
}

/// A board of 30 cm is more than 2 % of the walls in its direction of a room of 4 m × 4 m or 6 m × 8 m: less may be missing in the
/// image of a map.
#[test]
fn a_short_board_breaks_the_symmetry_of_a_room() {
    let classroom = Scenario::parse(CLASSROOM, "classroom.toml", Path::new(".")).unwrap().floor;
    let classroom: Vec<[Point; 2]> =
        classroom.named_walls().iter().map(|wall| [wall.from(), wall.to()]).collect();
    for room in [rectangle(4.0, 4.0), rectangle(6.0, 8.0), classroom] {
        let remedy = remedy(&room);
        assert_eq!(remedy.addition, Addition::Board { depth: 0.3 });
        let mut with = room.clone();
        with.push(remedy.faces[0]);
        assert!(!found(&with)[0].is_whole(), "{:?}", found(&with));
    }
}

/// Boards stand on both sides of a wall, in a room all inside that are clear of its other walls.
#[test]
fn boards_along_walls_are_clear_of_other_walls() {
    let board = Addition::Board { depth: 0.4 };
    let boards = along_walls(&floor(&rectangle(2.0, 0.6)), board, 0.5);
    // Inside there are 20 cm to the wall opposite.
    let is_outside = |[x, y]: Point| !(0.0..=2.0).contains(&x) || !(0.0..=0.6).contains(&y);
    assert!(boards.iter().all(|board| is_outside(board.faces[0][1])), "{boards:?}");
    let room = rectangle(2.0, 3.0);
    let boards = along_walls(&floor(&room), board, 0.5);
    assert!(boards.iter().all(|board| is_attached(board, &room)), "{boards:?}");
    // Of four places on a short wall and six on a long one, those at the corners are near another wall; on both sides.
    assert_eq!(boards.len(), 2 * 2 * (2 + 4));
}

/// In larger rooms an addition has to be larger, and in a hall none of those that are tried is large enough.
#[test]
fn an_addition_grows_with_the_room() {
    let depth = |remedy: &PlacedAddition| match remedy.addition {
        Addition::Board { depth } | Addition::Cabinet { depth, .. } => depth,
    };
    let rooms = [(6.0, 8.0), (12.0, 10.0), (14.0, 18.0), (26.0, 32.0)];
    let remedies = rooms.map(|(width, height)| remedy(&rectangle(width, height)));
    assert!(matches!(remedies[1].addition, Addition::Board { .. }), "{remedies:?}");
    assert!(depth(&remedies[1]) > depth(&remedies[0]), "{remedies:?}");
    assert!(matches!(remedies[3].addition, Addition::Cabinet { .. }), "{remedies:?}");
    assert_eq!(found(&rectangle(90.0, 60.0))[0].remedy, None);
}

/// In an empty room all places differ from their images by the board: it stands in the middle of a long wall, inside. Boards
/// there, one the image of the other, leave less of a difference beside them.
#[test]
fn an_addition_stands_where_it_differs_most_from_its_image() {
    let mut room = rectangle(6.0, 8.0);
    let remedy_of = |room: &[[Point; 2]]| {
        let PlacedAddition { at, faces, .. } = remedy(room);
        let [[from, to]] = faces[..] else { panic!("{faces:?}") };
        assert!((from[0] - at[0]).hypot(from[1] - at[1]) < 1e-12, "{from:?} {at:?}");
        assert!((1.0..5.0).contains(&to[0]) || (to[0] - 3.0).abs() < (from[0] - 3.0).abs());
        at
    };
    let [x, y] = remedy_of(&room);
    assert!((x - 3.0).abs() > 2.9 && (y - 4.0).abs() < 1e-9, "({x}, {y})");
    room.extend([[[0.0, 4.2], [0.6, 4.2]], [[6.0, 3.8], [5.4, 3.8]]]);
    let [x, y] = remedy_of(&room);
    assert!((x - 3.0).abs() < 2.9 || (y - 4.0).abs() > 0.5, "({x}, {y})");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Copies of random walls around a centre: the turn from one to the next is found, and the addition of
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
        let remedy = whole[0].remedy.as_ref().expect("an addition");
        let mut with = all.clone();
        with.extend(remedy.faces.iter().copied());
        let share = symmetries(&floor(&with)).unwrap();
        prop_assert!(!share.iter().any(Symmetry::is_whole), "{share:?}");
        prop_assert!(is_attached(remedy, &all), "{remedy:?}");
    }

    /// The motion between two poses, or its inverse, moves one onto the other.
    #[test]
    fn a_motion_between_two_poses_has_one_as_the_image_of_the_other(
        one in [-5.0..5.0, -5.0..5.0, -3.0..3.0], other in [-5.0..5.0, -5.0..5.0, -3.0..3.0],
    ) {
        let motion = SymmetryMotion::between(one, other);
        let is_other = |image: &[f64; 3]| {
            (image[0] - other[0]).hypot(image[1] - other[1]) < 1e-6
                && (image[2] - other[2]).sin().abs() < 1e-6
        };
        // Below 0.02 rad it is a shift.
        let is_turned = (one[2] - other[2]).abs() > 0.03;
        prop_assume!(is_turned);
        prop_assert!(motion.images(one).iter().any(is_other), "{motion}: {one:?} {other:?}");
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
