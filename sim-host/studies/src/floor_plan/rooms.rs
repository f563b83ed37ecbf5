//! Partition of a site into rooms, with an optional corridor.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::site::Kind;

/// An interval along an axis, centimetres.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Span {
    pub from: i32,
    pub to: i32,
}

impl Span {
    pub fn length(self) -> i32 {
        self.to - self.from
    }

    /// The interval with both ends moved inwards.
    pub fn inset(self, by: i32) -> Self {
        Self { from: self.from + by, to: self.to - by }
    }

    /// The intersection of two intervals; of negative length if they are disjoint.
    pub fn shared(self, other: Self) -> Self {
        Self { from: self.from.max(other.from), to: self.to.min(other.to) }
    }
}

/// A rectangle of floor, up to the middle of the walls around it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Room {
    pub x: Span,
    pub y: Span,
    /// Whether it is the corridor.
    pub is_corridor: bool,
}

impl Room {
    fn new(x: Span, y: Span) -> Self {
        Self { x, y, is_corridor: false }
    }

    fn is_wide(self) -> bool {
        self.x.length() >= self.y.length()
    }

    /// Both parts of the room, cut at a distance from its start, across x or y.
    fn cut(self, across_x: bool, at: i32) -> [Self; 2] {
        let split = |span: Span| {
            let middle = span.from + at;
            [Span { to: middle, ..span }, Span { from: middle, ..span }]
        };
        if across_x {
            split(self.x).map(|x| Self { x, ..self })
        } else {
            split(self.y).map(|y| Self { y, ..self })
        }
    }
}

/// Dimensions of a kind of plan, centimetres.
struct Sizes {
    width: (i32, i32),
    depth: (i32, i32),
    /// Minimum side of a room; a door with its walls must fit into half of it.
    smallest: i32,
    /// Maximum side of a room.
    largest: i32,
}

/// Chosen: flats, a floor of an office building, a school lab.
fn sizes(kind: Kind) -> Sizes {
    match kind {
        Kind::Home => {
            Sizes { width: (400, 1_200), depth: (400, 1_000), smallest: 240, largest: 500 }
        }
        Kind::Office => {
            Sizes { width: (1_000, 2_000), depth: (800, 1_600), smallest: 280, largest: 550 }
        }
        Kind::Lab => {
            Sizes { width: (600, 2_000), depth: (500, 1_200), smallest: 400, largest: 900 }
        }
    }
}

/// Widths of corridors, centimetres.
const CORRIDOR: (i32, i32) = (160, 260);
/// Probability that a room within the maximum is cut.
const CUT: f64 = 0.5;

pub(super) fn partition(kind: Kind, rng: &mut ChaCha8Rng) -> Vec<Room> {
    let sizes = sizes(kind);
    let mut side = |(least, most): (i32, i32)| Span { from: 0, to: rng.random_range(least..=most) };
    let site = Room::new(side(sizes.width), side(sizes.depth));
    let mut rooms = Vec::new();
    if kind == Kind::Office {
        along_corridor(site, &sizes, rng, &mut rooms);
    } else {
        divide(site, &sizes, rng, &mut rooms);
    }
    rooms
}

/// Cuts a room across its longer side, recursively, until no room is too large.
fn divide(room: Room, sizes: &Sizes, rng: &mut ChaCha8Rng, into: &mut Vec<Room>) {
    let across_x = room.is_wide();
    let length = if across_x { room.x.length() } else { room.y.length() };
    let can_be_cut = length >= 2 * sizes.smallest;
    let is_cut = can_be_cut && (length > sizes.largest || rng.random_bool(CUT));
    if !is_cut {
        into.push(room);
        return;
    }
    let at = rng.random_range(sizes.smallest..=length - sizes.smallest);
    for part in room.cut(across_x, at) {
        divide(part, sizes, rng, into);
    }
}

/// A corridor along the longer side, and rooms on both sides, each of which touches it.
fn along_corridor(site: Room, sizes: &Sizes, rng: &mut ChaCha8Rng, into: &mut Vec<Room>) {
    let lengthwise = site.is_wide();
    let depth = if lengthwise { site.y.length() } else { site.x.length() };
    // In a narrow office, what the rooms on both sides leave.
    let width = rng.random_range(CORRIDOR.0..=CORRIDOR.1).min(depth - 2 * sizes.smallest);
    let first = rng.random_range(sizes.smallest..=depth - width - sizes.smallest);
    let [one_side, rest] = site.cut(!lengthwise, first);
    let [corridor, other_side] = rest.cut(!lengthwise, width);
    into.push(Room { is_corridor: true, ..corridor });
    for side in [one_side, other_side] {
        row(side, lengthwise, sizes, rng, into);
    }
}

/// Rooms in a row.
fn row(side: Room, across_x: bool, sizes: &Sizes, rng: &mut ChaCha8Rng, into: &mut Vec<Room>) {
    let length = if across_x { side.x.length() } else { side.y.length() };
    let most = sizes.largest.min(length - sizes.smallest);
    if most < sizes.smallest {
        into.push(side);
        return;
    }
    let [room, rest] = side.cut(across_x, rng.random_range(sizes.smallest..=most));
    into.push(room);
    row(rest, across_x, sizes, rng, into);
}
