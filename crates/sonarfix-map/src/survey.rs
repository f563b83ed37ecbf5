//! What is wrong with walls that can each be read, but not be right together.
//!
//! | finding | severity | when |
//! |---|---|---|
//! | duplicate | error | two walls have the same ends, in either order |
//! | overlap | error | two walls lie on each other for more than [`TOLERANCE`] |
//! | crossing | warning | two walls cut through each other; an end on another wall is no crossing |
//! | narrow gap | warning | a gap in a line that fills less than the cone even from `min_range` |
//! | unreachable | warning | at no foot, [`FEET`] apart, a sonar has `min_range` of free way before the wall |
//!
//! Errors make the localizer blind to a wall: each of two that lie on each other may hide the other.

use std::fmt;

use sonarfix::config::Sonar;

use crate::bake::{BakeError, bake};
use crate::floor::Floor;
use crate::geometry::{Point, Segment, distance};
use crate::neighbours::Neighbours;

/// Nearer than this, ends meet and walls lie on each other, metres: finer than anybody draws.
pub const TOLERANCE: f64 = 1e-3;
/// From one foot of a wall that is tried to the next, metres.
pub const FEET: f64 = 0.05;

/// How bad a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The localizer can use the map, but does not see what was drawn.
    Warning,
    /// The map misleads the localizer.
    Error,
}

/// What is wrong between walls; they are numbered as in the floor, from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Flaw {
    /// The same wall twice.
    Duplicate {
        /// The first of the two.
        of: usize,
    },
    /// Two walls lie on each other for so many metres.
    Overlap {
        /// The first of the two.
        with: usize,
        /// For how long, metres.
        length: f64,
    },
    /// Two walls cut through each other.
    Crossing {
        /// The first of the two.
        with: usize,
        /// Where, metres.
        at: Point,
    },
    /// Between this wall and another in line is a gap that no sonar can see.
    NarrowGap {
        /// The first of the two.
        to: usize,
        /// How wide it is, metres.
        width: f64,
        /// The least width that is wider than the cone at `min_range`, metres.
        least: f64,
    },
    /// No sonar can stand before the wall.
    Unreachable {
        /// The free way that it would need, metres.
        needs: f64,
    },
}

/// A flaw, and the wall that has it: of two, the later.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finding {
    /// The wall.
    pub wall: usize,
    /// What is wrong with it.
    pub flaw: Flaw,
}

impl Finding {
    /// How bad it is.
    #[must_use]
    pub fn severity(&self) -> Severity {
        match self.flaw {
            Flaw::Duplicate { .. } | Flaw::Overlap { .. } => Severity::Error,
            Flaw::Crossing { .. } | Flaw::NarrowGap { .. } | Flaw::Unreachable { .. } => {
                Severity::Warning
            }
        }
    }

    /// The other wall, if there is one.
    #[must_use]
    pub fn other(&self) -> Option<usize> {
        match self.flaw {
            Flaw::Duplicate { of: other }
            | Flaw::Overlap { with: other, .. }
            | Flaw::Crossing { with: other, .. }
            | Flaw::NarrowGap { to: other, .. } => Some(other),
            Flaw::Unreachable { .. } => None,
        }
    }
}

/// What is wrong, and what to do; the walls are named by who shows it.
impl fmt::Display for Flaw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Duplicate { .. } => f.write_str("the same wall twice: delete one"),
            Self::Overlap { length, .. } => write!(
                f,
                "two walls lie on each other for {length:.3} m and would hide each other: join them \
                 (`map simplify` does)"
            ),
            Self::Crossing { at: [x, y], .. } => {
                write!(
                    f,
                    "two walls cross at ({x:.3}, {y:.3}) m: end one there, if that is what is meant"
                )
            }
            Self::NarrowGap { width, least, .. } => write!(
                f,
                "between two walls in line is a gap of {width:.3} m, narrower than the cone even from \
                 the nearest range ({least:.3} m): the sonar hears its edges as a wall, so close it"
            ),
            Self::Unreachable { needs } => write!(
                f,
                "no sonar can measure this wall: nowhere before it are {needs:.3} m free, so it can go"
            ),
        }
    }
}

/// Everything that is wrong with a floor for a sonar, wall by wall.
///
/// # Errors
/// [`BakeError`], if the walls cannot be indexed.
pub fn survey(floor: &Floor, sonar: &Sonar) -> Result<Vec<Finding>, BakeError> {
    let image = bake(&floor.walls())?;
    let walls = Neighbours::new(floor, &image).map_err(BakeError::Refused)?;
    let min_range = f64::from(sonar.min_range.0);
    let narrow = 2.0 * min_range * f64::from(sonar.cone.0).tan();
    let mut findings = Vec::new();
    for (wall, &segment) in walls.segments().iter().enumerate() {
        let mut others: Vec<_> = walls.beside(segment, narrow.max(TOLERANCE)).collect();
        others.sort_unstable_by_key(|&(other, _)| other);
        let earlier = others.into_iter().filter(|&(other, _)| other < wall);
        let pairs = earlier.filter_map(|(other, second)| pair(other, second, segment, narrow));
        findings.extend(pairs.map(|flaw| Finding { wall, flaw }));
        if is_unreachable(&walls, wall, segment, min_range) {
            findings.push(Finding { wall, flaw: Flaw::Unreachable { needs: min_range } });
        }
    }
    // A narrow gap with something in it is none.
    findings.retain(|finding| match finding.flaw {
        Flaw::NarrowGap { to, .. } => is_open(&walls, finding.wall, to),
        _ => true,
    });
    Ok(findings)
}

/// What is wrong between a wall and an earlier one.
fn pair(other: usize, first: Segment, second: Segment, narrow: f64) -> Option<Flaw> {
    let meets = |a, b| distance(a, b) <= TOLERANCE;
    let is_same = meets(first.from, second.from) && meets(first.to, second.to);
    let is_reverse = meets(first.from, second.to) && meets(first.to, second.from);
    if is_same || is_reverse {
        return Some(Flaw::Duplicate { of: other });
    }
    let (long, short) =
        if first.length() < second.length() { (second, first) } else { (first, second) };
    let [from, to] = [short.from, short.to].map(|end| long.place(end));
    if from[1].abs() <= TOLERANCE && to[1].abs() <= TOLERANCE {
        let (start, end) = (from[0].min(to[0]), from[0].max(to[0]));
        let overlap = end.min(long.length()) - start.max(0.0);
        if overlap > TOLERANCE {
            return Some(Flaw::Overlap { with: other, length: overlap });
        }
        let is_narrow = -overlap > TOLERANCE && -overlap < narrow;
        return is_narrow.then_some(Flaw::NarrowGap { to: other, width: -overlap, least: narrow });
    }
    crossing(first, second).map(|at| Flaw::Crossing { with: other, at })
}

/// Where two walls cut through each other, if both go on for more than the tolerance on either side.
fn crossing(first: Segment, second: Segment) -> Option<Point> {
    let parts = |cut: Segment, other: Segment| {
        let [from, to] = [other.from, other.to].map(|end| cut.place(end));
        let is_cut = from[1] * to[1] < 0.0 && from[1].abs() > TOLERANCE && to[1].abs() > TOLERANCE;
        is_cut.then(|| from[1] / (from[1] - to[1]))
    };
    parts(second, first)?;
    let share = parts(first, second)?;
    Some(second.at(share * second.length()))
}

/// Whether nothing touches the gap between two walls in line.
fn is_open(walls: &Neighbours, first: usize, second: usize) -> bool {
    let segment = |wall: usize| walls.segments().get(wall).copied();
    let (Some(a), Some(b)) = (segment(first), segment(second)) else {
        return true;
    };
    let ends =
        [a.from, a.to].into_iter().flat_map(|from| [b.from, b.to].map(|to| Segment { from, to }));
    let Some(gap) = ends.min_by(|x, y| x.length().total_cmp(&y.length())) else {
        return true;
    };
    let is_other = |wall| wall != first && wall != second;
    !walls
        .beside(gap, 0.0)
        .any(|(wall, segment)| is_other(wall) && segment.distance(gap) <= TOLERANCE)
}

/// Whether at none of the wall's feet and on neither side there is a free way of `least` metres.
fn is_unreachable(walls: &Neighbours, wall: usize, segment: Segment, least: f64) -> bool {
    let [tx, ty] = segment.tangent();
    let length = segment.length();
    let beside: Vec<_> = walls
        .beside(segment, least)
        .filter(|&(other, near)| other != wall && near.distance(segment) < least)
        .map(|(_, near)| near)
        .collect();
    let is_free = |foot: f64, side: f64| {
        let [x, y] = segment.at(foot);
        // From just off the wall: what touches it there, or lies on it, does not stand before it.
        let way = |far: f64| [x - side * far * ty, y + side * far * tx];
        let way = Segment { from: way(3.0 * TOLERANCE), to: way(least) };
        beside.iter().all(|other| other.distance(way) > TOLERANCE)
    };
    let feet = std::iter::successors(Some(0.5 * FEET.min(length)), |foot| Some(foot + FEET));
    let mut feet = feet.take_while(|&foot| foot < length);
    // Most walls have nothing beside them but what they end at.
    !beside.is_empty() && !feet.any(|foot| is_free(foot, 1.0) || is_free(foot, -1.0))
}
