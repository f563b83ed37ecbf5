//! Candidates against all sides of all walls in `f64`.

use std::vec::Vec;

use proptest::prelude::*;

use super::*;
use sonarfix::geometry::pose::Point;
use sonarfix::map::image::Reference;
use sonarfix::map::{Grid, image};

/// Direction of a wall's side away from the robot, distance of its line from the origin, and its ends along it.
type WideSide = (f64, f64, (f64, f64));

fn sides(ends: ((f64, f64), (f64, f64))) -> [WideSide; 2] {
    let ((x0, y0), (x1, y1)) = ends;
    let along = (y1 - y0).atan2(x1 - x0);
    [along + std::f64::consts::FRAC_PI_2, along - std::f64::consts::FRAC_PI_2].map(|angle| {
        let (sin, cos) = angle.sin_cos();
        let (one, other) = (-sin * x0 + cos * y0, -sin * x1 + cos * y1);
        (angle, cos * x0 + sin * y0, (one.min(other), one.max(other)))
    })
}

fn is_clear(value: f64, limit: f64) -> bool {
    (value - limit).abs() > 1e-4
}

/// Ends of a wall.
type Ends = ((f32, f32), (f32, f32));

/// A room of 6 m × 4 m with a slanted wall, and short ones along its sides.
fn room((x, y, turn): (f32, f32, f32), short: u8) -> Vec<Ends> {
    let corners = [(0.0, 0.0), (6.0, 0.0), (6.0, 4.0), (0.0, 4.0), (0.0, 0.0)];
    let mut ends: Vec<Ends> = corners.windows(2).map(|ends| (ends[0], ends[1])).collect();
    ends.push(((x, y), (x + 1.5 * turn.cos(), y + 1.5 * turn.sin())));
    ends.extend((0..short).map(|n| {
        let n = f32::from(n);
        let (x, y) = (5.0 * (0.618 * n).fract(), 3.0 * (0.414 * n).fract());
        let length = 0.5 + 0.1 * (0.732 * n).fract();
        ((x, y), if n % 2.0 < 1.0 { (x + length, y) } else { (x, y + length) })
    }));
    ends
}

fn walls(ends: &[Ends]) -> Vec<Wall> {
    let point = |(x, y)| Point::new(x, y);
    ends.iter().map(|&(from, to)| Wall::new(point(from), point(to)).unwrap()).collect()
}

fn all_sides(ends: &[Ends]) -> Vec<[WideSide; 2]> {
    let wide = |(x, y): (f32, f32)| (f64::from(x), f64::from(y));
    ends.iter().map(|&(from, to)| sides((wide(from), wide(to)))).collect()
}

/// These walls in a map of cells of 25 cm.
fn baked(walls: &[Wall]) -> Vec<u8> {
    let (columns, rows) = (32_u16, 24_u16);
    let origin = Point::new(-1.0, -1.0);
    let grid = Grid::new(origin, Metres(0.25), columns, rows).unwrap();
    let (mut starts, mut references): (Vec<u32>, Vec<u16>) = (Vec::new(), Vec::new());
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        starts.push(u32::try_from(references.len()).unwrap());
        for (id, wall) in (0..).map(WallId).zip(walls) {
            let cells = grid.cells_of(wall).unwrap();
            if cells.contain(column, row) {
                let reference = Reference::new(id, &cells, column, row).stored();
                references.push(u16::try_from(reference).unwrap());
            }
        }
    }
    let all = u32::try_from(references.len()).unwrap();
    starts.push(all);
    let mut bytes = Vec::from(image::MAGIC);
    for number in [image::VERSION, u32::try_from(walls.len()).unwrap(), all] {
        bytes.extend(number.to_le_bytes());
    }
    bytes.extend([columns, rows].map(u16::to_le_bytes).concat());
    bytes.extend([origin.x.0, origin.y.0, 0.25].map(f32::to_le_bytes).concat());
    bytes.extend(walls.iter().flat_map(|wall| wall.stored().map(f32::to_le_bytes).concat()));
    bytes.extend(starts.into_iter().flat_map(u32::to_le_bytes));
    bytes.extend(references.into_iter().flat_map(u16::to_le_bytes));
    bytes.extend(image::checksum(&bytes).to_le_bytes());
    bytes
}

/// All candidates of two lines.
fn all_of(map: &Map, first: &Line, second: &Line) -> Vec<[f64; 4]> {
    let (mut pairs, mut found) = (Pairs::default(), Vec::new());
    let bend = Bend { drift: 0.1, turn_scale: -0.2 };
    for _ in 0..20_000 {
        match pairs.next(map, first, second, bend) {
            Generated::Candidate(placement) => {
                assert_eq!(placement.bend, bend);
                let Placement { at, rotation, .. } = placement;
                found.push([at.x, at.y, rotation.x, rotation.y].map(f64::from));
            }
            Generated::Nothing => {}
            Generated::Done => break,
        }
    }
    assert_eq!(pairs.next(map, first, second, bend), Generated::Done);
    found
}

fn is_in(one: &[f64; 4], list: &[[f64; 4]]) -> bool {
    list.iter().any(|it| it.iter().zip(one).all(|(a, b)| (a - b).abs() < 1e-3))
}

/// Whether half of a shifted stretch, less the slack, is on the side; `None` at the limit.
fn holds(side: &WideSide, (from, to): (f32, f32), shift: f64) -> Option<bool> {
    let (from, to) = (f64::from(from) + shift, f64::from(to) + shift);
    let overlap = to.min(side.2.1) - from.max(side.2.0);
    let least = 0.5 * (to - from) - 0.15;
    is_clear(overlap, least).then_some(overlap > least)
}

/// With an index only the walls near the first one are compared: a line whose stretch begins 2.7 m before its wall, where
/// the other wall is, is found there as without.
#[test]
fn an_index_has_the_candidate_on_a_wall_that_is_far_from_the_first() {
    let ends: [Ends; 2] = [((2.8, 1.0), (6.8, 1.0)), ((0.1, 1.0), (0.1, 2.0))];
    let walls = walls(&ends);
    let line = |angle: f32, offset, stretch| Line {
        normal: Vector::of_angle(angle),
        offset,
        stretch,
        support: 5,
    };
    // In the frame of the map: one wall is below the robot, the other one to its left.
    let below = line(-core::f32::consts::FRAC_PI_2, -1.0, (0.1, 6.0));
    let beside = line(core::f32::consts::PI, -0.1, (-2.0, -1.0));
    let image = baked(&walls);
    for map in [Map::new(&walls), Map::read(&image).unwrap()] {
        let found = all_of(&map, &below, &beside);
        assert!(found.iter().any(|found| is_in(found, &[[0.0, 0.0, 1.0, 0.0]])), "{found:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 500, max_global_rejects: 50_000, ..ProptestConfig::default()
    })]

    /// Eq. (35) by trying all sides of all walls in `f64`.
    #[test]
    fn the_candidates_of_a_pair_are_all_that_fit(
        angle in -3.1_f32..3.1, (quarter, tilt) in (0_u8..4, -0.3_f32..0.3),
        offsets in (0.3_f32..4.0, 0.3_f32..4.0),
        starts in (-3.0_f32..2.0, -3.0_f32..2.0), lengths in (0.1_f32..4.0, 0.1_f32..4.0),
        supports in (3_u16..40, 3_u16..40), slanted in (0.5_f32..4.0, 0.5_f32..2.5, 0.1_f32..1.4),
        short in 0_u8..20,
    ) {
        let ends = room(slanted, short);
        let walls = walls(&ends);
        let line = |angle: f32, offset, start, length, support| Line {
            normal: Vector::of_angle(angle), offset, stretch: (start, start + length), support,
        };
        let first = line(angle, offsets.0, starts.0, lengths.0, supports.0);
        let second_angle = angle + f32::from(quarter) * core::f32::consts::FRAC_PI_2 + tilt;
        let second = line(second_angle, offsets.1, starts.1, lengths.1, supports.1);
        let sine = f64::from(second_angle - angle).sin().abs();
        prop_assume!(is_clear(sine, 0.5));
        prop_assert_eq!(make_a_pair(&first, &second), sine > 0.5);
        prop_assume!(sine > 0.5);

        let all = all_sides(&ends);
        let (n1, n2) = (f64::from(angle), f64::from(second_angle));
        let mut expected: Vec<[f64; 4]> = Vec::new();
        for (one, other) in (0..all.len()).flat_map(|one| (0..all.len()).map(move |other| (one, other))) {
            if one == other {
                continue;
            }
            for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(a, b)| (all[one][a], all[other][b])) {
                let (by_first, by_second) = (a.0 - n1, b.0 - n2);
                let agreement = (by_first - by_second).cos();
                prop_assume!(is_clear(agreement, 0.97));
                if agreement < 0.97 {
                    continue;
                }
                let (w1, w2) = (f64::from(supports.0), f64::from(supports.1));
                let mean = (w1 * by_first.sin() + w2 * by_second.sin())
                    .atan2(w1 * by_first.cos() + w2 * by_second.cos());
                let (p, q) = (a.1 - f64::from(offsets.0), b.1 - f64::from(offsets.1));
                let determinant = (b.0 - a.0).sin();
                let x = (p * b.0.sin() - q * a.0.sin()) / determinant;
                let y = (q * a.0.cos() - p * b.0.cos()) / determinant;
                let along = |angle: f64| -angle.sin() * x + angle.cos() * y;
                let fits = (holds(&a, first.stretch, along(a.0)), holds(&b, second.stretch, along(b.0)));
                let (Some(one), Some(other)) = fits else {
                    return Err(TestCaseError::reject("at a limit"));
                };
                if one && other {
                    expected.push([x, y, mean.cos(), mean.sin()]);
                }
            }
        }
        let found = all_of(&Map::new(&walls), &first, &second);
        prop_assert!(expected.iter().all(|it| is_in(it, &found)), "{expected:?} {found:?}");
        prop_assert!(found.iter().all(|it| is_in(it, &expected)), "{expected:?} {found:?}");
        prop_assert_eq!(found.len(), expected.len());
    }
    /// With an index the walls near the first one suffice, whatever the lengths of the lines.
    #[test]
    fn an_index_loses_no_candidate(
        quarter in -1_i8..3, tilt in -0.3_f32..0.3, is_left in any::<bool>(),
        offsets in (0.3_f32..4.0, 0.3_f32..4.0), starts in (-6.0_f32..5.0, -6.0_f32..5.0),
        lengths in (0.05_f32..6.0, 0.05_f32..6.0), slanted in (0.5_f32..4.0, 0.5_f32..2.5, 0.1_f32..1.4), short in 0_u8..20,
    ) {
        let angle = f32::from(quarter) * core::f32::consts::FRAC_PI_2;
        let walls = walls(&room(slanted, short));
        let image = baked(&walls);
        let map = Map::read(&image).unwrap();
        let line = |angle, offset, start, length| Line {
            normal: Vector::of_angle(angle), offset, stretch: (start, start + length), support: 5,
        };
        let first = line(angle, offsets.0, starts.0, lengths.0);
        let turn = if is_left { core::f32::consts::FRAC_PI_2 } else { -core::f32::consts::FRAC_PI_2 };
        let second = line(angle + turn + tilt, offsets.1, starts.1, lengths.1);
        let mut found = all_of(&map, &first, &second);
        let mut expected = all_of(&Map::new(&walls), &first, &second);
        found.sort_by(|one, other| one.partial_cmp(other).unwrap());
        expected.sort_by(|one, other| one.partial_cmp(other).unwrap());
        prop_assert_eq!(found.len(), expected.len());
        prop_assert!(found.iter().all(|one| is_in(one, &expected)));
    }

    /// Each wall holds a place within the slack of its line's middle, and the frames of both walls are turned by up to 14°
    /// about the origin: the distance of any two such places is within the gap.
    #[test]
    fn the_gap_bounds_the_distance_of_two_walls(
        angles in (-3.1_f32..3.1, -3.1_f32..3.1), offsets in (0.3_f32..4.0, 0.3_f32..4.0),
        starts in (-3.0_f32..2.0, -3.0_f32..2.0), lengths in (0.1_f32..4.0, 0.1_f32..4.0),
        turn in -0.2455_f64..0.2455, shifts in (-0.15_f64..0.15, -0.15_f64..0.15),
    ) {
        let line = |angle, offset, start, length| Line {
            normal: Vector::of_angle(angle), offset, stretch: (start, start + length), support: 5,
        };
        let one = line(angles.0, offsets.0, starts.0, lengths.0);
        let other = line(angles.1, offsets.1, starts.1, lengths.1);
        let place = |line: &Line, angle: f32, (shift, turn): (f64, f64)| {
            let along = 0.5 * (f64::from(line.stretch.0) + f64::from(line.stretch.1)) + shift;
            let ((sin, cos), offset) = ((f64::from(angle) + turn).sin_cos(), f64::from(line.offset));
            (cos * offset - sin * along, sin * offset + cos * along)
        };
        let distance = |turn, shifts: (f64, f64)| {
            let from = place(&one, angles.0, (shifts.0, 0.0));
            let to = place(&other, angles.1, (shifts.1, turn));
            (to.0 - from.0).hypot(to.1 - from.1)
        };
        let bound = f64::from(gap(&one, &other));
        let is = distance(turn, shifts);
        prop_assert!(is <= bound, "{is} {bound}");
        let straight = distance(0.0, (0.0, 0.0));
        let reach = |line: &Line, angle: f32| {
            let (x, y) = place(line, angle, (0.0, 0.0));
            x.hypot(y)
        };
        let most = 0.245 * reach(&one, angles.0).min(reach(&other, angles.1)) + 0.31;
        prop_assert!((bound - straight - most).abs() < 1e-4, "{bound} {straight} {most}");
    }

    /// Half of the line's stretch before an end of the wall, every 30 cm from there, to as much beyond the other end's.
    #[test]
    fn a_line_is_moved_along_all_sides_of_all_walls(
        angle in -3.1_f32..3.1, offset in 0.3_f32..4.0, start in -3.0_f32..2.0, length in 0.05_f32..3.0,
        slanted in (0.5_f32..4.0, 0.5_f32..2.5, 0.1_f32..1.4), short in 0_u8..4,
    ) {
        let ends = room(slanted, short);
        let walls = walls(&ends);
        let map = Map::new(&walls);
        let line = Line { normal: Vector::of_angle(angle), offset, stretch: (start, start + length), support: 5 };
        let bend = Bend { drift: 0.1, turn_scale: -0.2 };
        let (mut along_walls, mut found) = (AlongWalls::default(), Vec::new());
        loop {
            match along_walls.next(&map, &line, bend) {
                Generated::Candidate(Placement { at, rotation, bend: of }) => {
                    prop_assert_eq!(of, bend);
                    found.push([at.x, at.y, rotation.x, rotation.y].map(f64::from));
                }
                Generated::Nothing => {}
                Generated::Done => break,
            }
        }
        let mut found = found.into_iter().peekable();
        let (angle, offset) = (f64::from(angle), f64::from(offset));
        let middle = f64::from(start) + 0.5 * f64::from(length);
        for side in all_sides(&ends).into_iter().flatten() {
            let (toward, distance, (from, to)) = side;
            let inset = (0.5 * f64::from(length)).min(0.5 * (to - from));
            for step in 0..40 {
                let place = from + inset + 0.3 * f64::from(step);
                let beyond = place - (to - inset + 0.3);
                if beyond > 1e-4 {
                    break;
                }
                // The middle of the line on the wall.
                let (sin, cos) = (toward - angle).sin_cos();
                let foot = (angle.cos() * offset - angle.sin() * middle, angle.sin() * offset + angle.cos() * middle);
                let at = [
                    toward.cos() * distance - toward.sin() * place - (cos * foot.0 - sin * foot.1),
                    toward.sin() * distance + toward.cos() * place - (sin * foot.0 + cos * foot.1),
                    cos, sin,
                ];
                let is_next = found.peek().is_some_and(|next| is_in(next, &[at]));
                // At the limit either is right.
                prop_assert!(is_next || beyond > -1e-4, "{at:?} {:?}", found.peek());
                if is_next {
                    found.next();
                }
            }
        }
        prop_assert_eq!(found.next(), None);
    }
}

/// Each side of a wall has at most as many steps as a number of 16 bits can count.
#[test]
fn a_wall_of_many_steps_is_left() {
    let walls = [Wall::new(Point::new(0.0, 0.0), Point::new(1e6, 0.0)).unwrap()];
    let line = Line { normal: Vector::new(0.0, 1.0), offset: 1.0, stretch: (0.0, 1.0), support: 5 };
    let (map, mut along) = (Map::new(&walls), AlongWalls::default());
    let mut found = 0_u32;
    loop {
        match along.next(&map, &line, Bend::NONE) {
            Generated::Candidate(_) => found += 1,
            Generated::Nothing => {}
            Generated::Done => break,
        }
    }
    assert_eq!(found, 2 * u32::from(u16::MAX));
}
