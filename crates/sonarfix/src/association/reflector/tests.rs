//! Reflectors of a room with a free-standing wall, against geometry in `f64`.

use std::vec::Vec;

use proptest::prelude::*;

use super::*;
use crate::config::Config;
use crate::geometry::pose::Point;
use crate::geometry::units::Radians;

impl Reflectors<'_> {
    /// As [`Self::collect`], returned.
    pub(crate) fn in_beam(
        &self,
        beam: &Beam,
        reach: f32,
        margin: f32,
    ) -> (heapless::Vec<Reflector, REFLECTORS>, f32) {
        let mut found = heapless::Vec::new();
        let free = self.collect(beam, reach, margin, &mut found);
        (found, free)
    }
}

/// Cases in which a limit is closer than this (metres, or a cosine) are left to rounding.
const EDGE: f64 = 2e-3;
const COSINE_EDGE: f64 = 1e-3;

type Place = (f64, f64);

fn minus(one: Place, other: Place) -> Place {
    (one.0 - other.0, one.1 - other.1)
}

fn dot(one: Place, other: Place) -> f64 {
    one.0 * other.0 + one.1 * other.1
}

fn cross(one: Place, other: Place) -> f64 {
    one.0 * other.1 - one.1 * other.0
}

/// What stands at a place.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Foot,
    Corner,
    End,
}

struct Scene {
    walls: Vec<(Place, Place)>,
    sonar: Place,
    axis: Place,
    cone: f64,
    max_range: f64,
}

/// Refuses the comparison if a value is at a limit.
fn clear(value: f64, limit: f64, edge: f64) -> Result<bool, TestCaseError> {
    if (value - limit).abs() < edge {
        return Err(TestCaseError::reject("at a limit"));
    }
    Ok(value > limit)
}

impl Scene {
    /// The feet and ends, wherever they are seen from.
    fn places(&self) -> Result<Vec<(Place, Kind)>, TestCaseError> {
        let mut places = Vec::new();
        for (number, &(from, to)) in self.walls.iter().enumerate() {
            let along = minus(to, from);
            let share = dot(minus(self.sonar, from), along) / dot(along, along);
            let length = dot(along, along).sqrt();
            if clear(share * length, 0.0, EDGE)? && !clear(share * length, length, EDGE)? {
                places.push(((from.0 + share * along.0, from.1 + share * along.1), Kind::Foot));
            }
            // The four walls of the room share their ends.
            if number < 4 {
                places.push((from, Kind::Corner));
            } else {
                places.extend([(from, Kind::End), (to, Kind::End)]);
            }
        }
        Ok(places)
    }

    /// Whether a wall that does not touch a place is between it and the sonar.
    fn is_hidden(&self, place: Place) -> Result<bool, TestCaseError> {
        let sight = minus(place, self.sonar);
        for &(from, to) in &self.walls {
            let along = minus(to, from);
            let length = dot(along, along).sqrt();
            let off = cross(along, minus(place, from)).abs() / length;
            if !clear(off, f64::from(TOUCH), EDGE)? {
                continue;
            }
            let parallel = cross(along, sight);
            let on_sight = cross(along, minus(from, self.sonar)) / parallel;
            let on_wall = cross(minus(from, self.sonar), sight) / cross(sight, along);
            let before = clear(on_sight, 0.0, EDGE)? && !clear(on_sight, 1.0, EDGE)?;
            let within =
                clear(on_wall * length, 0.0, EDGE)? && !clear(on_wall * length, length, EDGE)?;
            if before && within {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Distance, and how it is heard, of all that may answer, nearest first.
    fn expected(
        &self,
        reach: f64,
        beam: (Option<f64>, f64),
    ) -> Result<Vec<(f64, Option<Audibility>)>, TestCaseError> {
        let mut expected = Vec::new();
        for (place, kind) in self.places()? {
            let sight = minus(place, self.sonar);
            let distance = dot(sight, sight).sqrt();
            let cosine = dot(sight, self.axis) / distance;
            let rim = (1.6 * self.cone).cos();
            if clear(distance, reach, EDGE)? || !clear(cosine, rim, COSINE_EDGE)? {
                continue;
            }
            let is_central = clear(cosine, self.cone.cos(), COSINE_EDGE)?;
            if kind == Kind::End {
                // Of a free-standing wall: the near end juts out.
                let (from, to) = self.walls[4];
                let arm = if place == from { minus(to, from) } else { minus(from, to) };
                let off_range = beam.0.map_or(f64::INFINITY, |range| (distance - range).abs());
                if clear(dot(sight, arm), 0.0, EDGE)? && clear(off_range, beam.1, EDGE)? {
                    continue;
                }
            }
            let fades = clear(distance, 0.8 * self.max_range, EDGE)?;
            let heard = match kind {
                Kind::End => Audibility::End,
                _ if fades || !is_central => Audibility::Rim,
                Kind::Corner => Audibility::Corner,
                Kind::Foot => Audibility::Foot,
            };
            expected.push((distance, (!self.is_hidden(place)?).then_some(heard)));
        }
        expected.sort_by(|one, other| one.0.total_cmp(&other.0));
        for pair in expected.windows(2) {
            clear(pair[1].0, pair[0].0, EDGE)?;
        }
        expected.truncate(REFLECTORS);
        Ok(expected)
    }

    /// Where the axis meets the first wall.
    fn free(&self) -> f64 {
        let hit = |&(from, to): &(Place, Place)| {
            let along = minus(to, from);
            let distance = cross(minus(from, self.sonar), along) / cross(self.axis, along);
            let share = cross(minus(from, self.sonar), self.axis) / cross(self.axis, along);
            (distance > 0.0 && (0.0..=1.0).contains(&share)).then_some(distance)
        };
        self.walls.iter().filter_map(hit).fold(f64::INFINITY, f64::min)
    }
}

fn wide((x, y): (f32, f32)) -> Place {
    (x.into(), y.into())
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 1_000, max_global_rejects: 20_000, ..ProptestConfig::default()
    })]

    #[test]
    fn the_reflectors_of_a_room_are_found_and_heard(
        (width, height) in (1.5_f32..4.0, 1.5_f32..4.0), (sx, sy) in (0.1_f32..0.9, 0.1_f32..0.9),
        (wx, wy) in (0.15_f32..0.85, 0.15_f32..0.85), (length, turn) in (0.1_f32..0.6, -3.1_f32..3.1),
        (angle, cone) in (-3.1_f32..3.1, 5.0_f32..35.0), reach in 0.5_f32..6.0,
        range in prop_oneof![Just(None), (0.2_f32..4.0).prop_map(Some)], margin in 0.05_f32..0.5,
        order in 0_usize..5,
    ) {
        let (x, y) = (wx * width, wy * height);
        let end = (x + length * turn.cos(), y + length * turn.sin());
        // A free-standing wall touches none of the room's.
        let inside = |at: f32, size: f32| at > 0.05 && at < size - 0.05;
        prop_assume!(inside(end.0, width) && inside(end.1, height));
        let corners = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)];
        let mut ends: Vec<_> = (0..4).map(|n| (corners[n], corners[(n + 1) % 4])).collect();
        ends.push(((x, y), end));
        let scene = Scene {
            walls: ends.iter().map(|&(from, to)| (wide(from), wide(to))).collect(),
            sonar: wide((sx * width, sy * height)),
            axis: (f64::from(angle).cos(), f64::from(angle).sin()),
            cone: f64::from(cone).to_radians(),
            max_range: 3.0,
        };
        let expected =
            scene.expected(reach.into(), (range.map(f64::from), margin.into()))?;
        ends.rotate_left(order);
        let point = |(x, y)| Point::new(x, y);
        let walls: Vec<Wall> =
            ends.iter().map(|&(from, to)| Wall::new(point(from), point(to)).unwrap()).collect();
        let mut sonar = Config::for_track_width(Metres(0.2)).rangers.first;
        (sonar.cone, sonar.max_range) = (Radians::from_degrees(cone), Metres(3.0));
        let reflectors = Reflectors::new(Map::new(&walls), &sonar);
        let from = Vector::new(sx * width, sy * height);
        let beam = Beam { from, axis: Vector::of_angle(angle), range };
        let (found, free) = reflectors.in_beam(&beam, reach, margin);
        let free_expected = scene.free();
        prop_assert!((f64::from(free) - free_expected).abs() < 1e-3 * (1.0 + free_expected), "{free}");
        let heard: Vec<_> = found
            .iter()
            .map(|it| (f64::from(it.distance), reflectors.heard(&beam, it)))
            .collect();
        prop_assert_eq!(heard.len(), expected.len(), "{:?} {:?}", heard, expected);
        for (is, expected) in heard.iter().zip(&expected) {
            prop_assert!((is.0 - expected.0).abs() < 1e-3, "{heard:?} {expected:?}");
            prop_assert_eq!(is.1, expected.1, "{:?} {:?}", heard, expected);
        }
    }
}

fn wall(from: (f32, f32), to: (f32, f32)) -> Wall {
    Wall::new(Point::new(from.0, from.1), Point::new(to.0, to.1)).unwrap()
}

fn reflectors(walls: &[Wall], degrees: f32) -> Reflectors<'_> {
    let mut sonar = Config::for_track_width(Metres(0.2)).rangers.first;
    (sonar.cone, sonar.max_range) = (Radians::from_degrees(degrees), Metres(4.0));
    Reflectors::new(Map::new(walls), &sonar)
}

/// A corner that is convex from where the sonar is returns no more than the end of a wall, however its walls are
/// drawn.
#[test]
fn a_convex_corner_is_an_end() {
    let corner = (2.0, 2.0);
    for (right, up) in [((3.0, 2.0), (2.0, 3.0)), ((2.6, 2.0), (2.0, 2.4))] {
        for flips in 0..4 {
            let ends = |number: u32, end| {
                if flips & number == 0 { wall(corner, end) } else { wall(end, corner) }
            };
            let walls = [ends(1, right), ends(2, up)];
            for (from, kind) in [
                ((2.5_f32, 1.0_f32), Audibility::End),
                ((1.0, 2.5), Audibility::End),
                // From the other side of both walls it is concave.
                ((2.3, 2.3), Audibility::Corner),
            ] {
                let from = Vector::new(from.0, from.1);
                let toward = Vector::new(corner.0, corner.1).minus(from);
                let distance = toward.length_squared().sqrt();
                let beam = Beam { from, axis: toward.times(1.0 / distance), range: Some(distance) };
                let reflectors = reflectors(&walls, 10.0);
                let (found, _) = reflectors.in_beam(&beam, 4.0, 0.1);
                let at = found.iter().find(|it| it.arm.is_some()).unwrap();
                assert_eq!(reflectors.heard(&beam, at), Some(kind), "{from:?} {flips}");
            }
        }
    }
}

/// Where two walls meet in the form of a T, the corner is concave on both sides.
#[test]
fn a_junction_is_a_corner() {
    let bar = wall((0.0, 2.0), (4.0, 2.0));
    for stem in [wall((2.0, 0.5), (2.0, 2.0)), wall((2.0, 2.0), (2.0, 0.5))] {
        let walls = [bar, stem];
        for x in [1.2, 2.8] {
            let from = Vector::new(x, 1.2);
            let toward = Vector::new(2.0, 2.0).minus(from);
            let distance = toward.length_squared().sqrt();
            let beam = Beam { from, axis: toward.times(1.0 / distance), range: None };
            let reflectors = reflectors(&walls, 10.0);
            let (found, _) = reflectors.in_beam(&beam, 4.0, 0.1);
            let at = found.iter().find(|it| it.arm.is_some()).unwrap();
            assert_eq!(reflectors.heard(&beam, at), Some(Audibility::Corner), "{x}");
        }
    }
}

/// A sonar at the end of a wall, to the last bit or less than a millimetre away, has no direction to it.
#[test]
fn a_sonar_at_an_end_finds_finite_reflectors() {
    let walls = [wall((1.0, 1.0), (3.0, 1.0)), wall((1.0, 1.0), (1.0, 3.0))];
    for off in [0.0, 1e-20, 1e-4] {
        for degrees in [0.0_f32, 45.0, 90.0, -135.0] {
            let from = Vector::new(1.0 + off, 1.0 + off);
            let axis = Vector::of_angle(degrees.to_radians());
            let (found, _) =
                reflectors(&walls, 40.0).in_beam(&Beam { from, axis, range: None }, 4.0, 0.1);
            for it in &found {
                assert!(it.toward.x.is_finite() && it.toward.y.is_finite(), "{it:?}");
                assert!(it.arm.is_none() || it.distance > 1e-3, "{it:?}");
            }
        }
    }
}

/// Distance, direction and arm of each reflector, to the bit.
fn list(walls: &[Wall], beam: &Beam) -> Vec<[u32; 5]> {
    let (found, _) = reflectors(walls, 40.0).in_beam(beam, 4.0, 5.0);
    let bits = |it: &Reflector| {
        let arm = it.arm.unwrap_or(Vector::new(9.0, 9.0));
        [it.distance, it.toward.x, it.toward.y, arm.x, arm.y].map(f32::to_bits)
    };
    found.iter().map(bits).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    /// More reflectors than there is room for: the nearest, sorted, whatever the order of the walls; mirrored ones are
    /// equally far.
    #[test]
    fn the_nearest_reflectors_do_not_depend_on_the_order_of_the_walls(
        bends in prop::collection::vec((0.1_f32..0.5, -0.6_f32..0.6), 1..9), turns in 1_usize..8,
        start in 0.6_f32..1.2, is_mirrored in any::<bool>(), has_range in any::<bool>(),
    ) {
        // A line of walls that share their ends, ahead of the sonar, and its mirror image.
        let mut ends = Vec::from([(start, 0.0_f32)]);
        for (along, aside) in bends {
            let (x, y) = *ends.last().unwrap();
            ends.push((x + aside * 0.5, y + along));
        }
        let mut walls: Vec<Wall> = ends.windows(2).map(|ends| wall(ends[0], ends[1])).collect();
        if is_mirrored {
            walls.extend(ends.windows(2).map(|ends| wall((ends[0].0, -ends[0].1), (ends[1].0, -ends[1].1))));
        }
        let axis = Vector::new(1.0, 0.0);
        let range = has_range.then_some(start);
        let beam = Beam { from: Vector::new(0.0, 0.0), axis, range };
        let expected = list(&walls, &beam);
        let (found, _) = reflectors(&walls, 40.0).in_beam(&beam, 4.0, 5.0);
        prop_assert!(found.windows(2).all(|pair| pair[0].distance <= pair[1].distance));
        if let Some(last) = found.last().filter(|_| found.is_full() && has_range) {
            // Every nearer end in the rim is in the list; without a range those that jut out are not.
            let cos_rim = f64::from(40.0_f32.to_radians() * RIM).cos();
            for (x, y) in &ends {
                let distance = f64::from(*x).hypot((*y).into());
                if f64::from(*x) / distance > cos_rim + 1e-4 && distance < f64::from(last.distance) - 1e-4 {
                    let is_there = found.iter().any(|it| (f64::from(it.distance) - distance).abs() < 1e-4);
                    prop_assert!(is_there, "{x} {y} {found:?}");
                }
            }
        }
        if is_mirrored && found.is_full() {
            // Of two that are equally far to the last bit, rounding decides which one is the last of a full list.
            return Ok(());
        }
        let turns = turns % walls.len();
        walls.rotate_left(turns);
        prop_assert_eq!(&list(&walls, &beam), &expected);
        walls.reverse();
        prop_assert_eq!(&list(&walls, &beam), &expected);
    }
}
