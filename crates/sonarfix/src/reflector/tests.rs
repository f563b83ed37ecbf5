//! Reflectors of a room with a free-standing wall, against geometry in `f64`.

use std::vec::Vec;

use proptest::prelude::*;

use super::*;
use crate::config::Config;
use crate::pose::Point;
use crate::units::Radians;

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
    ) -> Result<Vec<(f64, Option<Heard>)>, TestCaseError> {
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
                Kind::End => Heard::End,
                _ if fades || !is_central => Heard::Rim,
                Kind::Corner => Heard::Corner,
                Kind::Foot => Heard::Foot,
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
        let mut sonar = Config::for_track_width(Metres(0.2)).sonar;
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
