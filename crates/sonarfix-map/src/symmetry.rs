//! Finds motions by which a map repeats itself: a robot without a start pose cannot distinguish a place
//! from its image (`docs/search.md`).
//!
//! Candidates are the motions of a long wall onto a wall of its length, in both directions. Each is judged
//! by the share of the walls that it moves onto walls, sampled every [`SPACING`].

use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt;

use crate::addition::{Addition, PlacedAddition, inside};
use crate::bake::{BakeError, bake};
use crate::floor::Floor;
use crate::geometry::{Point, Segment, distance, wrap};
use crate::neighbours::Neighbours;

/// Walls nearer than this are the same to a sonar with its map and odometry, metres.
pub const ALIKE: f64 = 0.05;
/// The share of the walls from which on the whole map repeats itself: a door leaf or a pillar less.
pub const WHOLE: f64 = 0.98;
/// The share from which on a part of the map is reported: one of two rooms.
pub const PART: f64 = 0.45;

/// Distance of the sampled points on the walls, metres.
const SPACING: f64 = 0.2;
/// Walls whose motions are tried.
const TRIED: usize = 12;
/// A smaller displacement is no repetition, metres: faces of thick walls, frames of doors.
const LEAST_DISPLACEMENT: f64 = 0.5;
/// Points of each direction after which a motion that met less than half of [`PART`] is dropped.
const FIRST: usize = 16;
/// A stride through the points that visits neighbours late.
const STRIDE: usize = 7_919;
/// Walls on which an addition is tried, the longest, and its places on each: parts of the wall.
const PLACED_ON: usize = 12;
const PARTS: [f64; 7] = [0.5, 0.3, 0.7, 0.4, 0.6, 0.2, 0.8];

/// A motion by which the map repeats itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Symmetry {
    /// The motion.
    pub motion: Motion,
    /// The share of the walls that it moves onto walls: the smaller one of two directions.
    pub share: f64,
    /// The smallest addition that ends every repetition of the whole map.
    pub remedy: Option<PlacedAddition>,
}

/// A turn, or a shift without a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Motion {
    /// A turn by an angle in (0, π] about a point, metres.
    Turn {
        /// Radians.
        by: f64,
        /// The fixed point.
        about: Point,
    },
    /// A shift, metres.
    Shift(Point),
}

impl Symmetry {
    /// Whether the whole map repeats itself.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.share >= WHOLE
    }
}

impl fmt::Display for Motion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Turn { by, about: [x, y] } => {
                write!(f, "rotated by {:.0}° about ({x:.1}, {y:.1}) m", by.to_degrees())
            }
            Self::Shift([x, y]) => write!(f, "shifted by ({x:.1}, {y:.1}) m"),
        }
    }
}

impl fmt::Display for Symmetry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ", self.motion)?;
        if self.is_whole() {
            return f.write_str("this map is itself: a lost robot cannot tell the two apart");
        }
        let percent = 100.0 * self.share;
        write!(
            f,
            "{percent:.0} % of this map is itself: a lost robot has to leave that part to tell \
             the two apart"
        )
    }
}

/// Finds all motions that repeat the whole map, or else the one that repeats the largest part.
///
/// # Errors
/// [`BakeError`], if the walls cannot be indexed.
pub fn symmetries(floor: &Floor) -> Result<Vec<Symmetry>, BakeError> {
    let image = bake(&floor.walls())?;
    let walls = Neighbours::new(floor, &image).map_err(BakeError::Refused)?;
    let Some(points) = Points::of(walls.segments()) else { return Ok(Vec::new()) };
    let mut found: Vec<(Rigid, f64)> = Vec::new();
    for rigid in candidates(walls.segments()) {
        let is_large = rigid.largest_displacement(walls.segments()) >= LEAST_DISPLACEMENT;
        let motion = rigid.motion();
        if is_large
            && !found.iter().any(|(other, _)| other.motion().is_like(&motion))
            && let Some(share) = points.share(&rigid, &walls)
        {
            found.push((rigid, share));
        }
    }
    found.sort_by(|one, other| other.1.total_cmp(&one.1));
    let whole = found.iter().filter(|(_, share)| *share >= WHOLE).count();
    found.truncate(whole.max(1));
    let remedy = if whole > 0 { remedy(&found, floor, walls.segments())? } else { None };
    let symmetry = |(rigid, share): &(Rigid, f64)| Symmetry {
        motion: rigid.motion(),
        share: *share,
        remedy: remedy.clone(),
    };
    Ok(found.iter().map(symmetry).collect())
}

/// The smallest addition that ends all motions, where it differs most from what is at its image.
fn remedy(
    motions: &[(Rigid, f64)],
    floor: &Floor,
    walls: &[Segment],
) -> Result<Option<PlacedAddition>, BakeError> {
    let mut longest: Vec<(usize, &Segment)> = walls.iter().enumerate().collect();
    longest.sort_by(|(_, one), (_, other)| other.length().total_cmp(&one.length()));
    longest.truncate(PLACED_ON);
    for addition in Addition::BY_SIZE {
        let mut best: Option<(f64, PlacedAddition)> = None;
        for (wall, segment) in &longest {
            for part in PARTS {
                let (along, side) = (part * segment.length(), inside(segment, walls));
                let placed = PlacedAddition::new(addition, *wall, along, side, walls);
                let Some(placed) = placed else { continue };
                let faces: Vec<Segment> = placed.segments().collect();
                let difference = difference(motions, &faces, walls);
                // The first of equal ones.
                if best.as_ref().is_none_or(|(most, _)| difference > most + 1e-6) {
                    best = Some((difference, placed));
                }
            }
        }
        let Some((_, remedy)) = best else { continue };
        if !repeats(motions, &remedy.on(floor))? {
            return Ok(Some(remedy));
        }
    }
    Ok(None)
}

/// Distance of an addition's images from walls and addition, the mean over its faces, of the motion with the least, metres.
fn difference(motions: &[(Rigid, f64)], faces: &[Segment], walls: &[Segment]) -> f64 {
    let of_a_motion = |(rigid, _): &(Rigid, f64)| {
        let images = faces.iter().flat_map(|face| {
            [0.25, 0.5, 0.75, 1.0].map(|part| rigid.place(face.at(part * face.length())))
        });
        let distances = images.map(|image| {
            let all = walls.iter().chain(faces);
            all.map(|wall| wall.distance_to(image)).fold(f64::INFINITY, f64::min)
        });
        let (sum, count) = distances.fold((0.0, 0.0), |(sum, count), at| (sum + at, count + 1.0));
        sum / count
    };
    motions.iter().map(of_a_motion).fold(f64::INFINITY, f64::min)
}

/// Whether one of the motions repeats the whole of a floor.
fn repeats(motions: &[(Rigid, f64)], floor: &Floor) -> Result<bool, BakeError> {
    let image = bake(&floor.walls())?;
    let walls = Neighbours::new(floor, &image).map_err(BakeError::Refused)?;
    let Some(points) = Points::of(walls.segments()) else { return Ok(false) };
    let shares = motions.iter().filter_map(|(rigid, _)| points.share(rigid, &walls));
    Ok(shares.fold(0.0, f64::max) >= WHOLE)
}

/// A rigid motion: a turn about the origin, then a shift.
#[derive(Debug, Clone, Copy)]
struct Rigid {
    turn: f64,
    shift: Point,
}

impl Rigid {
    /// Moves a segment onto another, middle onto middle.
    fn new(from: Segment, to: Segment) -> Self {
        let heading = |segment: Segment| {
            let [x, y] = segment.tangent();
            y.atan2(x)
        };
        let turn = wrap(heading(to) - heading(from));
        let middle = |segment: Segment| segment.at(0.5 * segment.length());
        let [x, y] = turned(middle(from), turn);
        let [to_x, to_y] = middle(to);
        Self { turn, shift: [to_x - x, to_y - y] }
    }

    fn place(&self, point: Point) -> Point {
        let [x, y] = turned(point, self.turn);
        [x + self.shift[0], y + self.shift[1]]
    }

    fn largest_displacement(&self, walls: &[Segment]) -> f64 {
        let ends = walls.iter().flat_map(|wall| [wall.from, wall.to]);
        ends.map(|end| distance(end, self.place(end))).fold(0.0, f64::max)
    }

    /// This motion or its inverse: a turn to the left, or a shift to the right or up.
    fn motion(&self) -> Motion {
        let [x, y] = self.shift;
        if self.turn.abs() < 0.02 {
            let is_backward = x < -ALIKE || (x.abs() <= ALIKE && y < 0.0);
            return Motion::Shift(if is_backward { [-x, -y] } else { [x, y] });
        }
        // The fixed point of p ↦ R p + s: (1 − R)⁻¹ s, with half the cotangent of half the turn.
        let half = 0.5 / (0.5 * self.turn).tan();
        let about = [0.5 * x - half * y, 0.5 * y + half * x];
        Motion::Turn { by: self.turn.abs(), about }
    }
}

fn turned([x, y]: Point, by: f64) -> Point {
    let (sin, cos) = by.sin_cos();
    [cos * x - sin * y, sin * x + cos * y]
}

impl Motion {
    /// The motion that moves one pose (x, y, heading) onto another, or its inverse.
    #[must_use]
    pub fn between(one: [f64; 3], other: [f64; 3]) -> Self {
        let turn = wrap(other[2] - one[2]);
        let [x, y] = turned([one[0], one[1]], turn);
        Rigid { turn, shift: [other[0] - x, other[1] - y] }.motion()
    }

    /// The images of a pose (x, y, heading) under the motion and under its inverse.
    #[must_use]
    pub fn images(&self, [x, y, heading]: [f64; 3]) -> [[f64; 3]; 2] {
        match *self {
            Self::Turn { by, about: [cx, cy] } => [by, -by].map(|by| {
                let [dx, dy] = turned([x - cx, y - cy], by);
                [cx + dx, cy + dy, wrap(heading + by)]
            }),
            Self::Shift([dx, dy]) => [[x + dx, y + dy, heading], [x - dx, y - dy, heading]],
        }
    }

    fn is_like(&self, other: &Self) -> bool {
        const NEAR: f64 = 2.0 * ALIKE;
        match (self, other) {
            (Self::Turn { by, about }, Self::Turn { by: other, about: centre }) => {
                (by - other).abs() < 0.02 && distance(*about, *centre) < NEAR
            }
            (Self::Shift(one), Self::Shift(other)) => distance(*one, *other) < NEAR,
            _ => false,
        }
    }
}

/// Motions of the longest walls onto walls of their lengths.
fn candidates(walls: &[Segment]) -> impl Iterator<Item = Rigid> {
    let mut longest: Vec<Segment> = walls.to_vec();
    longest.sort_by(|one, other| other.length().total_cmp(&one.length()));
    longest.truncate(TRIED);
    longest.into_iter().flat_map(move |from| {
        let alike =
            walls.iter().filter(move |to| (to.length() - from.length()).abs() <= 2.0 * ALIKE);
        alike.flat_map(move |to| {
            [*to, Segment { from: to.to, to: to.from }].map(|to| Rigid::new(from, to))
        })
    })
}

/// Points on the walls, in two groups of directions at right angles.
struct Points([Vec<(Point, Point)>; 2]);

impl Points {
    fn of(walls: &[Segment]) -> Option<Self> {
        let longest = walls.iter().max_by(|a, b| a.length().total_cmp(&b.length()))?.tangent();
        let mut groups = [Vec::new(), Vec::new()];
        for wall in walls {
            let tangent = wall.tangent();
            let along = (tangent[0] * longest[0] + tangent[1] * longest[1]).abs();
            let [parallel, across] = &mut groups;
            let group = if along > (0.5 * FRAC_PI_2).cos() { parallel } else { across };
            let count = (wall.length() / SPACING).ceil();
            let step = wall.length() / count;
            let places = std::iter::successors(Some(0.5 * step), |along| Some(along + step));
            let places = places.take_while(|along| *along < wall.length());
            group.extend(places.map(|along| (wall.at(along), tangent)));
        }
        Some(Self(groups))
    }

    /// The smaller share of the points of a group that a motion moves onto walls; `None` below [`PART`].
    fn share(&self, rigid: &Rigid, walls: &Neighbours) -> Option<f64> {
        let shares = self.0.iter().filter(|group| !group.is_empty()).map(|group| {
            let (mut hits, mut seen) = (0.0, 0.0);
            let count = group.len();
            let stride = if count.is_multiple_of(STRIDE) { 1 } else { STRIDE };
            for n in 0..count {
                let (point, tangent) = group.get((n * stride) % count)?;
                seen += 1.0;
                hits += f64::from(u8::from(is_hit(rigid, *point, *tangent, walls)));
                if n + 1 == FIRST && hits < 0.5 * PART * seen {
                    return None;
                }
            }
            Some(hits / seen)
        });
        let least = shares.reduce(|one, other| Some(one?.min(other?)))??;
        (least >= PART).then_some(least)
    }
}

/// Whether the image of a point of a wall lies on a wall in the direction of its image.
fn is_hit(rigid: &Rigid, point: Point, tangent: Point, walls: &Neighbours) -> bool {
    let (point, tangent) = (rigid.place(point), turned(tangent, rigid.turn));
    walls.near(point, ALIKE).any(|(_, wall)| {
        let [x, y] = wall.tangent();
        let across = (x * tangent[1] - y * tangent[0]).abs();
        across < (PI / 18.0).sin() && wall.distance_to(point) <= ALIKE
    })
}
