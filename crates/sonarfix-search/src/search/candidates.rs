//! Pose candidates: pairs of lines against pairs of walls, and one line along every wall.

use super::lines::Line;
use super::window::Bend;
use sonarfix::geometry::units::Metres;
use sonarfix::geometry::vector::Vector;
use sonarfix::map::{Map, Wall, WallId};

/// Two normals fit together within this cosine: 14°.
const SAME_ANGLE: f32 = 0.97;
/// Length of the difference of two unit vectors at that angle, rounded up.
const SAME_ANGLE_CHORD: f32 = 0.245;
/// The sine of the least angle between two lines of a pair: 30°.
const LEAST_ANGLE: f32 = 0.5;
/// A line need not lie on its wall with all of its stretch, but with half of it, less this, metres.
const SLACK: f32 = 0.15;
/// What rounding adds to a distance between two walls, metres.
const ROUNDING: f32 = 0.01;
/// Walls that one step compares.
const WALLS_A_STEP: u16 = 16;
/// Steps along a wall, metres.
pub(super) const STEP: f32 = 0.3;

/// The odometry frame placed on the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Placement {
    /// Where the frame's origin lies.
    pub at: Vector,
    /// Cosine and sine of its rotation.
    pub rotation: Vector,
    /// How the odometry's heading errs.
    pub bend: Bend,
}

/// A wall seen from one of its sides.
#[derive(Clone, Copy)]
struct Side {
    /// Unit vector from the robot to the wall.
    toward: Vector,
    offset: f32,
    /// Both ends along `toward.left()`.
    stretch: (f32, f32),
}

impl Side {
    fn new(wall: &Wall, is_left: bool) -> Self {
        let normal = Vector::new(wall.a(), wall.b());
        let toward = if is_left { normal.times(-1.0) } else { normal };
        let along = toward.left();
        let (from, to) = (along.dot(wall.from().into()), along.dot(wall.to().into()));
        let stretch = if from < to { (from, to) } else { (to, from) };
        Self { toward, offset: toward.dot(wall.from().into()), stretch }
    }

    /// Whether a line's stretch, shifted along the wall, lies on it.
    fn holds(&self, line: &Line, shift: f32) -> bool {
        let (from, to) = (line.stretch.0 + shift, line.stretch.1 + shift);
        let begin = if from > self.stretch.0 { from } else { self.stretch.0 };
        let end = if to < self.stretch.1 { to } else { self.stretch.1 };
        end - begin >= 0.5 * (to - from) - SLACK
    }
}

/// What a generator found in one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Generated {
    Candidate(Placement),
    Nothing,
    Done,
}

/// All placements of two lines on two walls.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Pairs {
    wall: u32,
    is_left: bool,
    /// How many of the walls near the first were compared.
    compared: u16,
}

/// Whether two lines determine a position.
pub(super) fn make_a_pair(one: &Line, other: &Line) -> bool {
    one.normal.dot(other.normal.left()).abs() > LEAST_ANGLE
}

impl Pairs {
    /// Compares a few walls and stops at the first candidate.
    pub fn next(&mut self, map: &Map, first: &Line, second: &Line, bend: Bend) -> Generated {
        let Some(wall) = map.wall(WallId(self.wall)) else { return Generated::Done };
        let side = Side::new(&wall, self.is_left);
        let rotation =
            Vector::new(first.normal.dot(side.toward), first.normal.left().dot(side.toward));
        let (from, to) = (Vector::from(wall.from()), Vector::from(wall.to()));
        let middle = from.plus(to).times(0.5);
        let reach = 0.5 * wall.length().0 + gap(first, second);
        let before = self.compared;
        let near =
            map.near(middle.into(), Metres(reach)).skip(before.into()).take(WALLS_A_STEP.into());
        for (id, other) in near {
            self.compared = self.compared.saturating_add(1);
            if id == WallId(self.wall) {
                continue;
            }
            if let Some(placement) = place(&side, first, rotation, &other, second) {
                return Generated::Candidate(Placement { bend, ..placement });
            }
        }
        if self.compared - before == WALLS_A_STEP {
            return Generated::Nothing;
        }
        self.compared = 0;
        self.wall += u32::from(self.is_left);
        self.is_left = !self.is_left;
        Generated::Nothing
    }
}

/// An upper bound of the distance between two walls on which these lines lie: each wall comes within [`SLACK`] of the middle of
/// its line, because it holds half of the stretch, less that. The rotations onto both walls differ by the tolerance of their angle.
fn gap(one: &Line, other: &Line) -> f32 {
    let middle = |line: &Line| {
        let along = 0.5 * (line.stretch.0 + line.stretch.1);
        line.normal.times(line.offset).plus(line.normal.left().times(along))
    };
    let (one, other) = (middle(one), middle(other));
    let (from, to) = (one.length_squared(), other.length_squared());
    let nearer = if from < to { from } else { to };
    libm::sqrtf(other.minus(one).length_squared())
        + SAME_ANGLE_CHORD * libm::sqrtf(nearer)
        + 2.0 * SLACK
        + ROUNDING
}

// ===== Eq. (35): two lines on two walls =====
/// The placement of two lines on two walls, if both stretches lie on their walls.
fn place(
    side: &Side,
    first: &Line,
    rotation: Vector,
    other: &Wall,
    second: &Line,
) -> Option<Placement> {
    let predicted = second.normal.turned(rotation);
    let along_normal = predicted.dot(Vector::new(other.a(), other.b()));
    if along_normal.abs() < SAME_ANGLE {
        return None;
    }
    let other = Side::new(other, along_normal < 0.0);
    // The mean of both rotations, by the lines' support.
    let by_second =
        Vector::new(second.normal.dot(other.toward), second.normal.left().dot(other.toward));
    let rotation =
        rotation.times(f32::from(first.support)).plus(by_second.times(f32::from(second.support)));
    let rotation = rotation.times(1.0 / libm::sqrtf(rotation.length_squared()));
    let cross = side.toward.x * other.toward.y - side.toward.y * other.toward.x;
    let (p, q) = (side.offset - first.offset, other.offset - second.offset);
    let at = Vector::new(
        (p * other.toward.y - q * side.toward.y) / cross,
        (q * side.toward.x - p * other.toward.x) / cross,
    );
    let fits = side.holds(first, side.toward.left().dot(at))
        && other.holds(second, other.toward.left().dot(at));
    fits.then_some(Placement { at, rotation, bend: Bend::NONE })
}

/// One line along every wall, in steps.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct AlongWalls {
    wall: u32,
    is_left: bool,
    step: u16,
}

impl AlongWalls {
    pub fn next(&mut self, map: &Map, line: &Line, bend: Bend) -> Generated {
        let Some(wall) = map.wall(WallId(self.wall)) else { return Generated::Done };
        let side = Side::new(&wall, self.is_left);
        let rotation =
            Vector::new(line.normal.dot(side.toward), line.normal.left().dot(side.toward));
        let half = 0.5 * (line.stretch.1 - line.stretch.0);
        // The line's middle from half of its stretch before the wall's end to as much beyond.
        let inset = if half < 0.5 * wall.length().0 { half } else { 0.5 * wall.length().0 };
        let middle = side.stretch.0 + inset + STEP * f32::from(self.step);
        let next = self.step.checked_add(1);
        // A wall of more steps than can be counted is left after these.
        let (false, Some(next)) = (middle > side.stretch.1 - inset + STEP, next) else {
            self.step = 0;
            self.wall += u32::from(self.is_left);
            self.is_left = !self.is_left;
            return Generated::Nothing;
        };
        self.step = next;
        let foot = line
            .normal
            .times(line.offset)
            .plus(line.normal.left().times(0.5 * (line.stretch.0 + line.stretch.1)));
        let on_wall = side.toward.times(side.offset).plus(side.toward.left().times(middle));
        let at = on_wall.minus(foot.turned(rotation));
        Generated::Candidate(Placement { at, rotation, bend })
    }
}

#[cfg(test)]
mod tests;
