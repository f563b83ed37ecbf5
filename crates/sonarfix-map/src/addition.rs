//! What is added to a map of walls: a board or a cabinet that stands at a wall.

use std::fmt;

use crate::floor::{Floor, NamedWall};
use crate::geometry::{Point, Segment};

/// From an addition to all walls but its own, metres.
const CLEARANCE: f64 = 0.3;

/// What stands at a wall, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Addition {
    /// A board at right angles to the wall.
    Board {
        /// From the wall.
        depth: f64,
    },
    /// A cabinet, whose back is the wall.
    Cabinet {
        /// Along the wall.
        width: f64,
        /// From the wall.
        depth: f64,
    },
}

impl Addition {
    /// The cabinet of `find --cabinet`.
    const USUAL: Self = Self::Cabinet { width: 0.6, depth: 0.4 };
    /// What may break a symmetry, the smallest first.
    pub(crate) const BY_SIZE: [Self; 7] = [
        Self::Board { depth: 0.3 },
        Self::Board { depth: 0.5 },
        Self::Board { depth: 0.8 },
        Self::Cabinet { width: 0.4, depth: 0.3 },
        Self::USUAL,
        Self::Cabinet { width: 0.9, depth: 0.5 },
        Self::Cabinet { width: 1.2, depth: 0.6 },
    ];

    /// Its faces with its middle at a place of a wall, on the left (1) or right (−1) of the wall's direction.
    pub(crate) fn faces(self, at: Point, wall: &Segment, side: f64) -> Vec<Segment> {
        let [x, y] = wall.tangent();
        let point = |along: f64, depth: f64| {
            [at[0] + along * x - side * depth * y, at[1] + along * y + side * depth * x]
        };
        let corners = match self {
            Self::Board { depth } => vec![point(0.0, 0.0), point(0.0, depth)],
            Self::Cabinet { width, depth } => {
                let half = 0.5 * width;
                vec![point(-half, 0.0), point(-half, depth), point(half, depth), point(half, 0.0)]
            }
        };
        let ends = corners.iter().zip(corners.iter().skip(1));
        ends.map(|(from, to)| Segment { from: *from, to: *to }).collect()
    }

    /// Its extent along the wall.
    pub(crate) fn width(self) -> f64 {
        match self {
            Self::Board { .. } => 0.0,
            Self::Cabinet { width, .. } => width,
        }
    }
}

impl fmt::Display for Addition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Board { depth } => write!(f, "a board of {depth} m at right angles"),
            Self::Cabinet { width, depth } => write!(f, "a cabinet of {width} m × {depth} m"),
        }
    }
}

/// An addition at a place of a wall.
#[derive(Debug, Clone, PartialEq)]
pub struct PlacedAddition {
    /// What it is.
    pub addition: Addition,
    /// The wall at which it stands.
    pub wall: usize,
    /// The place of its middle there, metres.
    pub at: Point,
    /// Its faces, each from end to end, metres.
    pub faces: Vec<[Point; 2]>,
}

impl PlacedAddition {
    /// An addition so many metres along a wall, on its left (1) or right (−1) side; `None` where it is not within the wall, or
    /// where another wall is near.
    pub(crate) fn new(
        addition: Addition,
        wall: usize,
        along: f64,
        side: f64,
        walls: &[Segment],
    ) -> Option<Self> {
        let own = walls.get(wall)?;
        let at = own.at(along);
        let faces = addition.faces(at, own, side);
        let end = along.min(own.length() - along);
        let is_placed = end >= 0.5 * addition.width() && is_clear(&faces, wall, walls);
        let ends = |face: &Segment| [face.from, face.to];
        is_placed.then(|| Self { addition, wall, at, faces: faces.iter().map(ends).collect() })
    }

    /// Its faces.
    pub(crate) fn segments(&self) -> impl Iterator<Item = Segment> {
        self.faces.iter().map(|[from, to]| Segment { from: *from, to: *to })
    }

    /// A floor with it in its map.
    #[must_use]
    pub fn on(&self, floor: &Floor) -> Floor {
        with_faces(floor, self.segments(), "addition")
    }
}

/// Whether nothing but its own wall is near an addition.
fn is_clear(faces: &[Segment], own: usize, walls: &[Segment]) -> bool {
    let others = walls.iter().enumerate().filter(|(wall, _)| *wall != own);
    let mut all = others.flat_map(|(_, wall)| faces.iter().map(move |face| face.distance(*wall)));
    all.all(|distance| distance >= CLEARANCE)
}

/// An addition at places along all walls, on both sides of each, at most so many metres apart.
#[must_use]
pub fn along_walls(floor: &Floor, addition: Addition, apart: f64) -> Vec<PlacedAddition> {
    let walls: Vec<Segment> = floor.named_walls().iter().map(NamedWall::segment).collect();
    let places = walls.iter().enumerate().flat_map(|(wall, segment)| {
        let length = segment.length();
        let step = length / (length / apart).ceil();
        let all = std::iter::successors(Some(0.5 * step), move |along| Some(along + step));
        all.take_while(move |along| *along < length).map(move |along| (wall, along))
    });
    let both = places.flat_map(|(wall, along)| [1.0, -1.0].map(|side| (wall, along, side)));
    both.filter_map(|(wall, along, side)| PlacedAddition::new(addition, wall, along, side, &walls))
        .collect()
}

/// A floor with faces in its map, whose names begin with `name`.
fn with_faces(floor: &Floor, faces: impl IntoIterator<Item = Segment>, name: &str) -> Floor {
    let mut walls = floor.named_walls().to_vec();
    for (n, Segment { from, to }) in faces.into_iter().enumerate() {
        // Faces have a length and lie near the map.
        walls.extend(NamedWall::new(format!("{name} {n}"), from, to));
    }
    Floor::new(walls)
}

/// The side of a wall on which the middle of the map is: left (1) or right (−1) of its direction.
pub(crate) fn inside(wall: &Segment, walls: &[Segment]) -> f64 {
    let ends = walls.iter().flat_map(|wall| [wall.from, wall.to]);
    let sum = ends.fold([0.0, 0.0], |sum: Point, end| [sum[0] + end[0], sum[1] + end[1]]);
    #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53 walls")]
    let count = 2.0 * walls.len() as f64;
    wall.place([sum[0] / count, sum[1] / count])[1].signum()
}

/// A floor with a cabinet of 0.6 m × 0.4 m in its map, at the place of a wall that is nearest to a point; `None` of a
/// floor without walls.
#[must_use]
pub fn with_cabinet(floor: &Floor, near: [f64; 2]) -> Option<Floor> {
    let segments: Vec<Segment> = floor.named_walls().iter().map(NamedWall::segment).collect();
    let distance = |wall: &&Segment| wall.distance_to(near);
    let wall = segments.iter().min_by(|one, other| distance(one).total_cmp(&distance(other)))?;
    let at = wall.at(wall.place(near)[0].clamp(0.0, wall.length()));
    let faces = Addition::USUAL.faces(at, wall, inside(wall, &segments));
    Some(with_faces(floor, faces, "cabinet"))
}
