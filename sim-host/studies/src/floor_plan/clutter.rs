//! Furniture: cupboards along walls, tables and boxes in rooms, bins and chair legs. Some of the large
//! pieces are mapped, none of the small ones.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::doors::Door;
use super::rooms::{Room, Span};
use super::site::{CLEARANCE, Point};
use super::walls::Face;

/// Floor area per attempted piece of furniture, cm².
const AREA: i32 = 50_000;
/// Probability that a piece stands along a wall.
const ALONG_WALL: f64 = 0.6;
/// Probability that a piece is small and round.
const ROUND: f64 = 0.3;
/// Probability that a large piece is mapped.
const MAPPED: f64 = 0.5;
/// Clearance between a piece and the path, beyond the robot's, centimetres.
const BESIDE_WAY: i32 = 10;
/// Clearance before doors and between pieces, centimetres.
const APART: i32 = 15;
/// Sides of large pieces, radii of small ones, centimetres. Chosen.
const LENGTH: (i32, i32) = (50, 160);
const DEPTH: (i32, i32) = (35, 70);
const RADIUS: (i32, i32) = (2, 20);

/// A round piece.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Round {
    pub centre: Point,
    pub radius: i32,
}

/// All furniture of a plan.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Clutter {
    /// Mapped faces, piece by piece.
    pub mapped: Vec<Vec<Face>>,
    /// Unmapped faces.
    pub faces: Vec<Face>,
    /// Unmapped round pieces.
    pub rounds: Vec<Round>,
}

/// The floor under a piece.
#[derive(Debug, Clone, Copy)]
struct Footprint {
    x: Span,
    y: Span,
}

impl Footprint {
    fn grown(self, by: i32) -> Self {
        Self { x: self.x.inset(-by), y: self.y.inset(-by) }
    }

    fn overlaps(self, other: Self) -> bool {
        self.x.shared(other.x).length() > 0 && self.y.shared(other.y).length() > 0
    }

    /// Whether the line between two points enters it: the shares of the line within both spans
    /// overlap.
    fn is_entered(self, from: Point, to: Point) -> bool {
        let (mut enters, mut leaves) = (0.0_f64, 1.0_f64);
        for (span, from, to) in [(self.x, from[0], to[0]), (self.y, from[1], to[1])] {
            if from == to {
                if from <= span.from || from >= span.to {
                    return false;
                }
                continue;
            }
            let share = |at: i32| f64::from(at - from) / f64::from(to - from);
            let (one, other) = (share(span.from), share(span.to));
            enters = enters.max(one.min(other));
            leaves = leaves.min(one.max(other));
        }
        enters < leaves
    }

    /// Its four faces, without those against a face of the room.
    fn faces(self, room: Self) -> Vec<Face> {
        let (x, y) = (self.x, self.y);
        let sides = [
            (x.from == room.x.from, [[x.from, y.from], [x.from, y.to]]),
            (y.to == room.y.to, [[x.from, y.to], [x.to, y.to]]),
            (x.to == room.x.to, [[x.to, y.to], [x.to, y.from]]),
            (y.from == room.y.from, [[x.to, y.from], [x.from, y.from]]),
        ];
        sides.into_iter().filter(|(at_wall, _)| !at_wall).map(|(_, face)| face).collect()
    }
}

pub(super) fn beside(
    path: &[Point],
    rooms: &[Room],
    doors: &[Door],
    thickness: i32,
    rng: &mut ChaCha8Rng,
) -> Clutter {
    let mut clutter = Clutter::default();
    let mut taken: Vec<Footprint> = doors.iter().map(|door| in_front(door, thickness)).collect();
    for room in rooms {
        let half = thickness / 2;
        let inside = Footprint { x: room.x.inset(half), y: room.y.inset(half) };
        for _ in 0..inside.x.length() * inside.y.length() / AREA {
            let is_round = rng.random_bool(ROUND);
            let is_mapped = rng.random_bool(MAPPED);
            let piece = if is_round { round(inside, rng) } else { large(inside, rng) };
            let free = piece.grown(CLEARANCE + BESIDE_WAY);
            let is_in_path = path.windows(2).any(|leg| match leg {
                [from, to] => free.is_entered(*from, *to),
                _ => false,
            });
            let apart = piece.grown(APART);
            if is_in_path || taken.iter().any(|other| apart.overlaps(*other)) {
                continue;
            }
            taken.push(piece);
            if is_round {
                let radius = piece.x.length() / 2;
                let centre = [piece.x.from + radius, piece.y.from + radius];
                clutter.rounds.push(Round { centre, radius });
            } else if is_mapped {
                clutter.mapped.push(piece.faces(inside));
            } else {
                clutter.faces.extend(piece.faces(inside));
            }
        }
    }
    clutter
}

/// The floor on both sides of a door that is kept free of furniture.
fn in_front(door: &Door, thickness: i32) -> Footprint {
    let across = Span { from: door.at, to: door.at }.inset(-thickness / 2 - 2 * CLEARANCE);
    if door.wall_along_y {
        Footprint { x: across, y: door.gap }
    } else {
        Footprint { x: door.gap, y: across }
    }
}

fn within((least, most): (i32, i32), rng: &mut ChaCha8Rng) -> i32 {
    rng.random_range(least..=most)
}

/// A random interval of a length inside a longer one.
fn place(length: i32, span: Span, rng: &mut ChaCha8Rng) -> Span {
    let from = rng.random_range(span.from..=span.to - length);
    Span { from, to: from + length }
}

fn round(room: Footprint, rng: &mut ChaCha8Rng) -> Footprint {
    let size = 2 * within(RADIUS, rng);
    let inner = room.grown(-1);
    Footprint { x: place(size, inner.x, rng), y: place(size, inner.y, rng) }
}

fn large(room: Footprint, rng: &mut ChaCha8Rng) -> Footprint {
    let (length, depth) = (within(LENGTH, rng), within(DEPTH, rng));
    let lies_along_x = rng.random_bool(0.5);
    let (in_x, in_y) = if lies_along_x { (length, depth) } else { (depth, length) };
    // Every piece is shorter than the narrowest corridor is wide.
    let shorten = |length: i32, span: Span| length.min(span.length() - 2 * APART);
    let (in_x, in_y) = (shorten(in_x, room.x), shorten(in_y, room.y));
    let (mut x, mut y) = (place(in_x, room.x, rng), place(in_y, room.y, rng));
    if rng.random_bool(ALONG_WALL) {
        let at_start = rng.random_bool(0.5);
        let (span, around) = if lies_along_x { (&mut y, room.y) } else { (&mut x, room.x) };
        let by = if at_start { around.from - span.from } else { around.to - span.to };
        *span = Span { from: span.from + by, to: span.to + by };
    }
    Footprint { x, y }
}
