//! Baked maps: they contain the same walls, find them by place, and damaged ones are refused.

#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "a test should stop")]

use proptest::collection::vec;
use proptest::prelude::*;
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::Metres;
use sonarfix::map::image::{self, MAGIC, VERSION, VERSION_WITH_ACCURACIES, checksum};
use sonarfix::map::{Map, MapError, Wall, WallId};
use sonarfix_map::{BakeError, bake};

use crate::rooms::{inside, rooms};

const HEADER: usize = 32;

fn wall(x: f32, y: f32, dx: f32, dy: f32) -> Option<Wall> {
    Wall::new(Point::new(x, y), Point::new(x + dx, y + dy)).ok()
}

/// Short and long walls, at any angle, around a place that may be far from the origin.
fn any_walls() -> impl Strategy<Value = Vec<Wall>> {
    let origin = prop_oneof![Just((0.0, 0.0)), (-2e4_f32..2e4, -2e4_f32..2e4)];
    let length = prop_oneof![4 => 0.01_f32..5.0, 1 => 5.0_f32..80.0];
    let one = (-30.0_f32..30.0, -30.0_f32..30.0, length, -3.2_f32..3.2, any::<bool>());
    let accuracies = proptest::option::of(vec(proptest::option::of(0.0_f32..0.3), 60));
    (origin, vec(one, 1..60), accuracies).prop_map(|((x, y), walls, accuracies)| {
        let walls = walls.into_iter().filter_map(|(dx, dy, length, angle, is_square)| {
            // Half of them along an axis, as in buildings, where rounding meets cells' edges.
            let quarter = core::f32::consts::FRAC_PI_2;
            let angle = if is_square { (angle / quarter).round() * quarter } else { angle };
            wall(x + dx.round(), y + dy, length * angle.cos(), length * angle.sin())
        });
        let Some(accuracies) = accuracies else { return walls.collect() };
        let with_accuracy = |(wall, accuracy): (Wall, Option<f32>)| {
            accuracy.map_or(wall, |accuracy| wall.with_accuracy(Metres(accuracy)))
        };
        walls.zip(accuracies).map(with_accuracy).collect()
    })
}

/// The distance of a point from a wall in `f64`.
fn distance(wall: &Wall, point: Point) -> f64 {
    let place = |p: Point| (f64::from(p.x.0), f64::from(p.y.0));
    let ((fx, fy), (tx, ty), (px, py)) = (place(wall.from()), place(wall.to()), place(point));
    let (ax, ay) = (tx - fx, ty - fy);
    let share = (((px - fx) * ax + (py - fy) * ay) / (ax * ax + ay * ay)).clamp(0.0, 1.0);
    f64::hypot(px - fx - share * ax, py - fy - share * ay)
}

/// The Chebyshev distance of a point from the bounding box of a wall.
fn box_distance(wall: &Wall, point: Point) -> f32 {
    let (from, to) = (wall.from(), wall.to());
    let gap = |p: f32, a: f32, b: f32| (a.min(b) - p).max(p - a.max(b)).max(0.0);
    gap(point.x.0, from.x.0, to.x.0).max(gap(point.y.0, from.y.0, to.y.0))
}

fn ids(map: &Map, point: Point, reach: f32) -> Vec<u32> {
    let mut ids: Vec<_> = map.near(point, Metres(reach)).map(|(id, _)| id.0).collect();
    ids.sort_unstable();
    ids
}

proptest! {
    /// Every wall within reach is found once, and none that is farther than the reach by more than a cell.
    #[test]
    fn near_walls_are_found_once(
        walls in any_walls(),
        which in any::<prop::sample::Index>(),
        beside in (-12.0_f32..12.0, -12.0_f32..12.0),
        more in 0.0_f32..8.0,
    ) {
        prop_assume!(!walls.is_empty());
        let image = bake(&walls).unwrap();
        let map = Map::read(&image).unwrap();
        // At least one wall is within reach.
        let chosen = &walls[which.index(walls.len())];
        let point = Point::new(chosen.from().x.0 + beside.0, chosen.from().y.0 + beside.1);
        #[expect(clippy::cast_possible_truncation, reason = "rounded up")]
        let reach = (distance(chosen, point) as f32).next_up() + more;

        let found = ids(&map, point, reach);
        let mut once = found.clone();
        once.dedup();
        prop_assert_eq!(&found, &once);
        prop_assert!(!found.is_empty());
        for (id, wall) in (0..).zip(&walls) {
            let is_near = distance(wall, point) <= f64::from(reach);
            prop_assert!(!is_near || found.contains(&id), "{id} at {}", distance(wall, point));
        }
        let cell = map.grid().unwrap().cell_size().0;
        for id in found {
            let off = box_distance(&walls[id as usize], point);
            prop_assert!(off <= (reach + cell) * 1.001 + 0.01, "{id} at {off}, reach {reach}");
        }
    }

    /// A baked wall equals the wall bit for bit, with the same id.
    #[test]
    fn a_baked_wall_is_the_wall(walls in any_walls()) {
        prop_assume!(!walls.is_empty());
        let image = bake(&walls).unwrap();
        let map = Map::read(&image).unwrap();
        prop_assert_eq!(map.count() as usize, walls.len());
        for ((id, wall), (baked_id, baked)) in (0..).zip(&walls).zip(map.walls()) {
            prop_assert_eq!(baked_id, WallId(id));
            prop_assert_eq!(map.wall(baked_id), Some(baked));
            prop_assert_eq!(baked.stored().map(f32::to_bits), wall.stored().map(f32::to_bits));
            prop_assert_eq!(baked.stored_accuracy(), wall.stored_accuracy());
        }
        prop_assert_eq!(map.wall(WallId(map.count())), None);
    }

    /// Bytes with the header and the checksum of a map are refused or usable.
    #[test]
    fn noise_is_refused_or_harmless(
        shape in (0..5_u32, 0..9_u32, 0..4_u16, 0..4_u16),
        (exact, has_accuracies) in (prop::bool::weighted(0.9), any::<bool>()),
        bytes in vec(prop_oneof![Just(0_u8), Just(1), Just(63), any::<u8>()], 0..240),
    ) {
        let (walls, references, columns, rows) = shape;
        let version = if has_accuracies { VERSION_WITH_ACCURACIES } else { VERSION };
        let mut image = [&MAGIC[..], &version.to_le_bytes()].concat();
        image.extend([walls.to_le_bytes(), references.to_le_bytes()].concat());
        image.extend([columns.to_le_bytes(), rows.to_le_bytes()].concat());
        image.extend([0.0_f32.to_le_bytes(), 0.0_f32.to_le_bytes(), 1.0_f32.to_le_bytes()].concat());
        let cells = usize::from(columns) * usize::from(rows);
        let wall = 20 + usize::from(has_accuracies);
        let length = wall * walls as usize + 4 * (cells + 1) + 2 * references as usize;
        let length = if exact && !bytes.is_empty() { length } else { bytes.len() };
        image.extend(bytes.iter().cycle().take(length));
        let _ = use_or_refuse(&sealed(image));
    }
}

#[test]
fn accuracies_are_in_millimetres() {
    let one = wall(0.0, 0.0, 1.0, 0.0).unwrap();
    assert_eq!(one.accuracy(), None);
    for (metres, millimetres) in [
        (0.0, 1),
        (0.0004, 1),
        (0.012, 12),
        (0.0125, 13),
        (0.255, 255),
        (9.0, 255),
        (f32::INFINITY, 255),
    ] {
        let wall = one.with_accuracy(Metres(metres));
        assert_eq!(wall.stored_accuracy(), millimetres, "{metres}");
        assert_eq!(wall.accuracy(), Some(Metres(1e-3 * f32::from(millimetres))));
        // One byte for each wall, and a version that older programs refuse.
        let (with, without) = (bake(&[wall, one]).unwrap(), bake(&[one, one]).unwrap());
        assert_eq!((with.len(), with[4]), (without.len() + 2, 2));
        assert_eq!(image::length(&with), Ok(with.len()));
        let read: Vec<_> = Map::read(&with).unwrap().walls().map(|(_, wall)| wall).collect();
        assert_eq!(read, [wall, one]);
    }
    for metres in [-0.01, f32::NAN, f32::NEG_INFINITY] {
        assert_eq!(one.with_accuracy(Metres(metres)).accuracy(), None);
    }
}

/// The image with a valid checksum.
fn sealed(mut content: Vec<u8>) -> Vec<u8> {
    let seal = checksum(&content);
    content.extend(seal.to_le_bytes());
    content
}

fn resealed(image: &[u8]) -> Vec<u8> {
    sealed(image[..image.len() - 4].to_vec())
}

/// Reads an image; if it is accepted, every query must be correct.
fn use_or_refuse(image: &[u8]) -> Result<(), MapError> {
    let map = Map::read(image)?;
    let is_sound = |(id, wall): (WallId, Wall)| {
        assert!(id.0 < map.count() && map.wall(id) == Some(wall));
        assert!(wall.from().is_finite() && wall.to().is_finite() && wall.length().is_finite());
    };
    map.walls().for_each(is_sound);
    let grid = map.grid().unwrap();
    let far = f32::INFINITY;
    let origin = grid.origin();
    for (x, y, reach) in [
        (origin.x.0, origin.y.0, 1.0),
        (0.0, 0.0, far),
        (1.5, 1.5, 2.0),
        (f32::NAN, 0.0, far),
        (far, far, 3.0),
    ] {
        let near = ids(&map, Point::new(x, y), reach);
        assert!(near.windows(2).all(|pair| pair[0] < pair[1]));
        map.near(Point::new(x, y), Metres(reach)).for_each(is_sound);
    }
    Ok(())
}

/// A map with every case: walls in one cell and in several, cells with several walls and with none.
fn small() -> Vec<u8> {
    const WALLS: [(f32, f32, f32, f32); 10] = [
        (0.0, 0.0, 4.5, 0.0),
        (4.5, 0.0, 0.0, 5.0),
        (0.5, 2.5, 1.0, 0.2),
        (1.0, 1.0, 0.3, 0.3),
        (1.3, 1.3, 0.3, 0.0),
        (1.3, 1.6, 0.3, 0.0),
        (1.3, 1.3, 0.0, 0.3),
        (3.0, 1.0, -0.5, 0.0),
        (3.0, 1.5, 0.0, -0.5),
        (0.5, 2.5, 0.0, -1.0),
    ];
    let walls: Vec<_> = WALLS.iter().map(|&(x, y, dx, dy)| wall(x, y, dx, dy).unwrap()).collect();
    bake(&walls).unwrap()
}

#[test]
fn every_flipped_bit_is_seen() {
    let image = small();
    assert_eq!(use_or_refuse(&image), Ok(()));
    let grid = Map::read(&image).unwrap().grid().unwrap();
    assert!(grid.cells() > 4, "the map is to have several cells: {grid:?}");
    let walls = HEADER..HEADER + 10 * 20;
    let mut accepted = 0;
    for at in 0..image.len() {
        for flip in (0..8).map(|bit| 1 << bit).chain([0xFF]) {
            let mut damaged = image.clone();
            damaged[at] ^= flip;
            let seen = use_or_refuse(&damaged);
            assert!(seen.is_err(), "byte {at} ^ {flip:#x} is accepted");
            // With a valid checksum the other checks must find the damage. They cannot detect moved walls and grids that fit together.
            let is_number = walls.contains(&at) || (20..HEADER).contains(&at);
            let outcome = use_or_refuse(&resealed(&damaged));
            let in_seal = at >= image.len() - 4;
            if outcome.is_ok() && !in_seal {
                assert!(is_number, "byte {at} ^ {flip:#x} is accepted with a new checksum");
                accepted += 1;
            }
        }
    }
    // Mostly the low bits of coordinates.
    assert!(accepted > 100, "too few images with a new checksum are accepted: {accepted}");
}

#[test]
fn every_other_length_is_refused() {
    let image = small();
    for length in 0..image.len() {
        assert!(Map::read(&image[..length]).is_err(), "{length} bytes");
        if length >= 4 {
            assert!(Map::read(&resealed(&image[..length])).is_err(), "{length} bytes, resealed");
        }
    }
    for more in 1..=40 {
        let longer = [&image[..], &vec![0; more]].concat();
        assert_eq!(Map::read(&longer).unwrap_err(), MapError::Checksum);
        assert_eq!(Map::read(&resealed(&longer)).unwrap_err(), MapError::Length);
    }
}

#[test]
fn each_error_is_named() {
    let image = small();
    let with = |at: usize, bytes: &[u8]| {
        let mut image = image.clone();
        image[at..at + bytes.len()].copy_from_slice(bytes);
        Map::read(&resealed(&image)).unwrap_err()
    };
    assert_eq!(Map::read(b"").unwrap_err(), MapError::NotAMap);
    assert_eq!(with(0, b"PNG"), MapError::NotAMap);
    assert_eq!(with(4, &[2]), MapError::Length);
    assert_eq!(with(4, &[3]), MapError::Version(3));
    assert_eq!(with(8, &[9]), MapError::Length);
    assert_eq!(with(12, &[0]), MapError::Length);
    assert_eq!(with(8, &[0xFF; 4]), MapError::Length);
    assert_eq!(with(16, &[0, 0]), MapError::Grid);
    assert_eq!(with(28, &f32::NAN.to_le_bytes()), MapError::Grid);
    assert_eq!(with(28, &(-1.0_f32).to_le_bytes()), MapError::Grid);
    assert_eq!(with(HEADER + 20, &f32::NAN.to_le_bytes()), MapError::Wall(WallId(1)));
    assert_eq!(with(HEADER + 48, &0.5_f32.to_le_bytes()), MapError::Wall(WallId(2)));
    // The first wall, moved by a cell: its references are wrong.
    assert_eq!(with(HEADER + 4, &2.5_f32.to_le_bytes()), MapError::Index);
    assert_eq!(with(HEADER + 4, &9.0_f32.to_le_bytes()), MapError::Wall(WallId(0)));
    let message = with(4, &[3]).to_string();
    assert!(message.contains("format 3") && message.contains("bake it again"), "{message}");
}

/// At any address: nothing in the slice needs to be aligned.
#[test]
fn alignment_does_not_matter() {
    let image = small();
    for offset in 0..4 {
        let shifted = [&vec![0; offset], &image[..]].concat();
        assert_eq!(use_or_refuse(&shifted[offset..]), Ok(()));
    }
}

#[test]
fn a_point_that_is_not_finite_has_no_wall_or_all() {
    let walls = rooms(100);
    let image = bake(&walls).unwrap();
    let map = Map::read(&image).unwrap();
    let all: Vec<_> = (0..100).collect();
    let here = inside(100);
    assert_eq!(ids(&map, here, f32::INFINITY), all);
    assert_eq!(ids(&map, here, 1e30), all);
    assert!(!ids(&map, here, 3.0).is_empty() && ids(&map, here, 3.0).len() < 50);
    let nowhere = [
        (f32::NAN, 0.0, 1.0),
        (0.0, f32::NAN, 1.0),
        (0.0, 0.0, f32::NAN),
        (0.0, 0.0, -1.0),
        (f32::INFINITY, 0.0, 1.0),
        (f32::INFINITY, 0.0, f32::INFINITY),
        (0.0, f32::NEG_INFINITY, 1.0),
        (1e9, 0.0, 10.0),
        (0.0, -1e9, 10.0),
        (-20.0, 10.0, 3.0),
    ];
    for (x, y, reach) in nowhere {
        assert_eq!(ids(&map, Point::new(x, y), reach), [0; 0], "{x} {y} {reach}");
    }
}

/// Every wall is found, with fewer and with more walls than two bytes can count.
#[test]
fn references_have_the_smallest_width() {
    for count in [16_384, 16_385] {
        let walls = rooms(count);
        let image = bake(&walls).unwrap();
        let map = Map::read(&image).unwrap();
        for (id, wall) in map.walls() {
            let middle = Point::new(
                0.5 * (wall.from().x + wall.to().x).0,
                0.5 * (wall.from().y + wall.to().y).0,
            );
            assert!(map.near(middle, Metres(0.1)).any(|(found, _)| found == id), "{id:?}");
        }
    }
}

#[test]
fn maps_are_as_small_as_promised() {
    let size = |walls: &[Wall]| bake(walls).unwrap().len();
    assert!(size(&rooms(1_000)) <= 32 * 1024);
    assert!(size(&rooms(100_000)) <= 3 * 1024 * 1024);
    // The same, turned by half a radian: no wall along an axis, which is the hard case for boxes.
    let turned = |wall: &Wall| {
        let (sin, cos) = 0.5_f32.sin_cos();
        let turn = |p: Point| Point::new(cos * p.x.0 - sin * p.y.0, sin * p.x.0 + cos * p.y.0);
        Wall::new(turn(wall.from()), turn(wall.to())).unwrap()
    };
    for count in [1, 2, 8, 1_000, 100_000] {
        let size = size(&rooms(count).iter().map(turned).collect::<Vec<_>>());
        assert!(size <= 31 * count + 36, "{count} walls take {size} bytes");
    }
}

#[test]
fn an_invalid_map_is_not_baked() {
    assert_eq!(bake(&[]), Err(BakeError::NoWall));
    // Its far end exceeds the range of f32.
    let beyond = Wall::new(Point::new(3.4e38, 0.0), Point::new(3.0e38, 1e38)).unwrap();
    let far = Wall::new(Point::new(-3e38, 0.0), Point::new(0.0, 0.0)).unwrap();
    assert!(matches!(bake(&[beyond, far]), Err(BakeError::Refused(_))));
    // Two walls on opposite sides of the earth are valid.
    let here = wall(0.0, 0.0, 1.0, 0.0).unwrap();
    let there = wall(1e7, 1e7, 4.0, 0.0).unwrap();
    let image = bake(&[here, there]).unwrap();
    assert_eq!(use_or_refuse(&image), Ok(()));
}
