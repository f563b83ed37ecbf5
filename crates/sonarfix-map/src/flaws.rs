//! Finds contradictions between walls, each of which is valid.
//!
//! | finding | severity | when |
//! |---|---|---|
//! | duplicate | error | two walls have the same ends, in either order |
//! | overlap | error | two walls coincide for more than [`TOLERANCE`] |
//! | crossing | warning | two walls cross; an end on another wall is not a crossing |
//! | narrow gap | warning | a gap between collinear walls, narrower than the cone at `min_range` |
//! | unreachable | warning | no foot, [`FEET`] apart, has `min_range` of free space before the wall |
//!
//! With an error the localizer may not measure a wall: of two that coincide each may occlude the other.

use std::fmt;

use sonarfix::config::RangerParameters;

use crate::bake::{BakeError, bake};
use crate::floor::Floor;
use crate::geometry::{Point, Segment, distance};
use crate::neighbours::Neighbours;

/// The distance at which ends meet and walls coincide, metres: finer than any drawing.
pub const TOLERANCE: f64 = 1e-3;
/// Distance between the tested feet of a wall, metres.
pub const FEET: f64 = 0.05;

/// Severity of a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The localizer can use the map, but not all of it.
    Warning,
    /// The map misleads the localizer.
    Error,
}

/// A contradiction between walls, which are numbered as in the floor, from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Flaw {
    /// The same wall twice.
    Duplicate {
        /// The first of the two.
        of: usize,
    },
    /// Two walls coincide.
    Overlap {
        /// The first of the two.
        with: usize,
        /// Length of the common part, metres.
        length: f64,
    },
    /// Two walls cross.
    Crossing {
        /// The first of the two.
        with: usize,
        /// The crossing, metres.
        at: Point,
    },
    /// The gap between this wall and a collinear one is too narrow for a sonar.
    NarrowGap {
        /// The first of the two.
        to: usize,
        /// Width of the gap, metres.
        width: f64,
        /// Width of the cone at `min_range`, metres.
        least: f64,
    },
    /// No sonar can be placed before the wall.
    Unreachable {
        /// The free distance that it needs, metres.
        needs: f64,
    },
}

/// A flaw and its wall: of two walls, the later one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finding {
    /// The wall.
    pub wall: usize,
    /// The flaw.
    pub flaw: Flaw,
}

impl Finding {
    /// Its severity.
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

/// The problem and the remedy, without the names of the walls.
impl fmt::Display for Flaw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Duplicate { .. } => f.write_str("the same wall twice: delete one"),
            Self::Overlap { length, .. } => write!(
                f,
                "two walls coincide for {length:.3} m and occlude each other: join them \
                 (`map simplify` does)"
            ),
            Self::Crossing { at: [x, y], .. } => {
                write!(
                    f,
                    "two walls cross at ({x:.3}, {y:.3}) m: end one there, if that is intended"
                )
            }
            Self::NarrowGap { width, least, .. } => write!(
                f,
                "the gap of {width:.3} m between two collinear walls is narrower than the cone at \
                 the nearest range ({least:.3} m): the sonar measures its edges as a wall, so close it"
            ),
            Self::Unreachable { needs } => write!(
                f,
                "no sonar can measure this wall: no place before it has {needs:.3} m of free space; remove it"
            ),
        }
    }
}

/// Finds all flaws of a floor, wall by wall.
///
/// # Errors
/// [`BakeError`], if the walls cannot be indexed.
pub fn flaws(floor: &Floor, sonar: &RangerParameters) -> Result<Vec<Finding>, BakeError> {
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
    // A gap that contains another wall does not count.
    findings.retain(|finding| match finding.flaw {
        Flaw::NarrowGap { to, .. } => is_open(&walls, finding.wall, to),
        _ => true,
    });
    Ok(findings)
}

/// Finds the flaws between a wall and an earlier one.
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

/// The crossing of two walls, if both continue for more than the tolerance on either side.
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

/// Whether nothing touches the gap between two collinear walls.
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

/// Whether no foot of the wall has `least` metres of free space, on either side.
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
        // Starts just off the wall, to skip walls that touch it or coincide with it.
        let point = |far: f64| [x - side * far * ty, y + side * far * tx];
        let free = Segment { from: point(3.0 * TOLERANCE), to: point(least) };
        beside.iter().all(|other| other.distance(free) > TOLERANCE)
    };
    let feet = std::iter::successors(Some(0.5 * FEET.min(length)), |foot| Some(foot + FEET));
    let mut feet = feet.take_while(|&foot| foot < length);
    // Most walls have no neighbours except at their ends.
    !beside.is_empty() && !feet.any(|foot| is_free(foot, 1.0) || is_free(foot, -1.0))
}
