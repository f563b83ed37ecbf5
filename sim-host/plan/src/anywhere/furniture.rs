//! Furniture that the map does not have, at random places beside a drive.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use sonarfix_map::{Obstacle, Outline, Path};
use sonarfix_sim::world::segment::{Point, Segment, distance};

use super::free_space::FreeSpace;

/// Probability that a piece is small and round, and that another one stands along a wall.
const ROUND: f64 = 0.3;
const ALONG_WALL: f64 = 0.6;
/// Sides of large pieces, radii of small ones, metres: those of the furniture of floor plans.
const LENGTH: (f64, f64) = (0.5, 1.6);
const DEPTH: (f64, f64) = (0.35, 0.7);
const RADIUS: (f64, f64) = (0.02, 0.2);
/// From a piece to the robot's side, and to other pieces, metres.
const BESIDE_DRIVE: f64 = 0.1;
const APART: f64 = 0.15;
/// Between a wall and a piece along it, metres.
const GAP: f64 = 0.01;
/// Distance of the tested points on the outline of a piece, metres.
const SPACING: f64 = 0.1;

/// What stands where, before it is tested.
struct Piece {
    middle: Point,
    /// The corners of a large piece; of a round one none.
    corners: Vec<Point>,
    radius: f64,
}

/// Random furniture: attempts to place so many pieces that keep off the walls, the drive by `clearance`, and each other.
pub(super) fn beside(
    drive: &Path,
    space: &FreeSpace,
    walls: &[Segment],
    (pieces, clearance): (f64, f64),
    rng: &mut ChaCha8Rng,
) -> Vec<Obstacle> {
    let corners: Vec<Point> =
        std::iter::once(drive.plan().start).chain(drive.plan().corners.iter().copied()).collect();
    let legs: Vec<Segment> =
        corners.iter().zip(corners.iter().skip(1)).map(|(a, b)| Segment::new(*a, *b)).collect();
    let mut placed: Vec<Piece> = Vec::new();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some pieces")]
    let attempts = pieces.round() as usize;
    for _ in 0..attempts {
        let Some(piece) = Piece::random(space, walls, rng) else { continue };
        let outline = piece.outline();
        let is_far = |apart: f64, from: &Segment| {
            outline.iter().all(|point| distance(from.nearest(*point), *point) >= apart)
        };
        let is_clear = legs.iter().all(|leg| is_far(clearance + BESIDE_DRIVE, leg))
            && !walls.iter().any(|wall| piece.is_cut_by(wall, &outline))
            && placed.iter().all(|other| other.is_apart_from(&outline));
        if is_clear {
            placed.push(piece);
        }
    }
    placed.iter().flat_map(Piece::obstacles).collect()
}

fn within((least, most): (f64, f64), rng: &mut ChaCha8Rng) -> f64 {
    rng.random_range(least..=most)
}

impl Piece {
    fn random(space: &FreeSpace, walls: &[Segment], rng: &mut ChaCha8Rng) -> Option<Self> {
        let free = space.free();
        let cell = (!free.is_empty()).then(|| rng.random_range(0..free.len()))?;
        let at = space.centre(*free.get(cell)?);
        if rng.random_bool(ROUND) {
            return Some(Self { middle: at, corners: Vec::new(), radius: within(RADIUS, rng) });
        }
        let (length, depth) = (within(LENGTH, rng), within(DEPTH, rng));
        let (is_along, is_turned) = (rng.random_bool(ALONG_WALL), rng.random_bool(0.5));
        let nearest = |wall: &&Segment| distance(wall.nearest(at), at);
        let wall = walls.iter().min_by(|one, other| nearest(one).total_cmp(&nearest(other)))?;
        let foot = wall.nearest(at);
        let off = distance(foot, at);
        let normal = [(at[0] - foot[0]) / off, (at[1] - foot[1]) / off];
        let tangent = [-normal[1], normal[0]];
        let (along, across) =
            if is_along || !is_turned { (length, depth) } else { (depth, length) };
        let from_wall = if is_along { GAP + 0.5 * across } else { off };
        let point = |t: f64, n: f64| {
            [0, 1].map(|axis: usize| {
                let of = |vector: &Point| vector.get(axis).copied().unwrap_or_default();
                of(&foot) + t * of(&tangent) + (from_wall + n) * of(&normal)
            })
        };
        let (t, n) = (0.5 * along, 0.5 * across);
        let corners = vec![point(-t, -n), point(t, -n), point(t, n), point(-t, n)];
        Some(Self { middle: point(0.0, 0.0), corners, radius: 0.0 })
    }

    /// Its sides.
    fn sides(&self) -> impl Iterator<Item = (Point, Point)> {
        let next = self.corners.iter().cycle().skip(1);
        self.corners.iter().zip(next).map(|(from, to)| (*from, *to))
    }

    /// Points around it.
    fn outline(&self) -> Vec<Point> {
        if self.corners.is_empty() {
            let [x, y] = self.middle;
            let around = (0..8_u8).map(|eighth| {
                let (sin, cos) = (f64::from(eighth) * std::f64::consts::FRAC_PI_4).sin_cos();
                [x + self.radius * cos, y + self.radius * sin]
            });
            return around.collect();
        }
        let sides = self.sides().flat_map(|(from, to)| {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some")]
            let steps = (distance(from, to) / SPACING).ceil() as u32;
            (0..steps).map(move |step| {
                let part = f64::from(step) / f64::from(steps);
                [from[0] + part * (to[0] - from[0]), from[1] + part * (to[1] - from[1])]
            })
        });
        sides.collect()
    }

    /// Whether a wall is in it or at its outline.
    fn is_cut_by(&self, wall: &Segment, outline: &[Point]) -> bool {
        outline.iter().any(|point| wall.crossing(self.middle, *point).is_some())
            || wall.ends().into_iter().any(|end| self.has(end))
    }

    /// Whether a point is in it: on the same side of all of its sides.
    fn has(&self, point: Point) -> bool {
        if self.corners.is_empty() {
            return distance(self.middle, point) <= self.radius;
        }
        self.sides().all(|(from, to)| {
            let ([ax, ay], [bx, by]) =
                ([to[0] - from[0], to[1] - from[1]], [point[0] - from[0], point[1] - from[1]]);
            ax * by - ay * bx >= 0.0
        })
    }

    fn is_apart_from(&self, outline: &[Point]) -> bool {
        let own = self.outline();
        outline.iter().all(|point| {
            !self.has(*point) && own.iter().all(|other| distance(*other, *point) >= APART)
        })
    }

    fn obstacles(&self) -> Vec<Obstacle> {
        let still = |outline| Obstacle { outline, walk: None };
        if self.corners.is_empty() {
            return vec![still(Outline::Circle { centre: self.middle, radius: self.radius })];
        }
        self.sides().map(|(from, to)| still(Outline::Face { from, to })).collect()
    }
}
