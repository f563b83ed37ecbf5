//! Where to look: the wall whose range is worth taking now, and the bearing that meets it
//! squarely (`docs/model.md`, eq. 16 and "Which walls count").
//!
//! A wall counts if
//! - the foot of the perpendicular from the sonar lies on it, and its range within the sonar's,
//! - the servo can turn to it,
//! - nothing stands before it, and nothing nearer inside the cone would answer first.
//!
//! The first holds when the position is wrong by its own uncertainty
//! ([`Trust::confidence`](crate::config::Trust::confidence) standard deviations), the cone when the
//! heading is; where that leaves nothing of the cone, two standard deviations must do.
//!
//! # Non-finite policy
//! The filter's state is finite, and every comparison here is written so that NaN would not
//! count as a wall to look at.

use crate::config::{Config, Sonar};
use crate::ekf::{Ekf, PositionCovariance};
use crate::map::{Map, Wall, WallId};
use crate::pose::{Heading, Point};
use crate::range::ExpectedRange;
use crate::units::{Metres, Radians};

pub use crate::config::Policy;

/// One look of the sonar at one wall.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Aim {
    /// The wall.
    pub wall: WallId,
    /// Where the servo is to point, relative to the robot's heading.
    pub bearing: Radians,
    /// The range to expect now. A fix computes its own, at the pose it is taken from.
    pub range: Metres,
}

/// Why there is nothing to look at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum NoAim {
    /// The heading is less certain than the cone is wide: no echo could be told to be square.
    HeadingUncertain,
    /// No wall counts.
    NoWall,
}

impl core::fmt::Display for NoAim {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::HeadingUncertain => "the heading is less certain than the cone is wide",
            Self::NoWall => "no wall can be measured from here",
        })
    }
}

impl core::error::Error for NoAim {}

/// Standard deviations of the heading that must lie inside the cone for a look to be worth it,
/// however much confidence is asked for. 19 looks of 20 are square then, and the gate is there for
/// the other; not to look has no way back. (A first turn of 180° with a track width known to 3 %
/// leaves 5°, and three times that is more than most cones.)
pub(crate) const LEAST_CONFIDENCE: f32 = 2.0;
/// The share of the cone in which a beam counts as square then.
const LEAST_CLEAR: f32 = 0.25;

/// Why a wall cannot be measured, apart from what stands before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unfit {
    FootOffWall,
    OutOfRange,
}

/// The filter's belief, as far as aiming needs it: computed once for all walls.
pub(crate) struct Viewpoint<'a> {
    ekf: &'a Ekf,
    sonar: &'a Sonar,
    /// Where the sonar is, by the estimate.
    position: Point,
    heading: Heading,
    /// What of the cone is left when the heading is wrong by its uncertainty; not positive if the
    /// heading is too uncertain to look.
    clear_cone: Radians,
    /// The cone, widened by the heading's uncertainty: what may answer.
    wide_cone: Radians,
    confidence_squared: f32,
    covariance: PositionCovariance,
}

impl<'a> Viewpoint<'a> {
    pub fn new(config: &'a Config, ekf: &'a Ekf) -> Self {
        let sonar = &config.sonar;
        let confidence = config.trust.confidence;
        let pose = ekf.state().pose();
        let sigma = Radians(ekf.deviation().heading);
        let doubt = sigma * confidence;
        let clear = sonar.cone - doubt;
        let is_bearable = sigma * LEAST_CONFIDENCE < sonar.cone;
        let least = sonar.cone * if is_bearable { LEAST_CLEAR } else { 0.0 };
        Self {
            ekf,
            sonar,
            position: pose.to_map(sonar.mount),
            heading: pose.heading,
            clear_cone: if clear > least { clear } else { least },
            wide_cone: sonar.cone + doubt,
            confidence_squared: confidence * confidence,
            covariance: ekf.position_covariance(),
        }
    }

    /// Variance of the sonar's position along the direction (x, y), m².
    fn variance_along(&self, x: f32, y: f32) -> f32 {
        let p = &self.covariance;
        p.xx * x * x + 2.0 * p.xy * x * y + p.yy * y * y
    }

    /// Whether `slack` metres are left even if what has this variance is wrong by its
    /// uncertainty.
    fn holds(&self, slack: f32, variance: f32) -> bool {
        slack > 0.0 && slack * slack >= self.confidence_squared * variance
    }

    /// The range expected of a wall, if its foot and its range are certain enough.
    pub fn expect(&self, wall: &Wall) -> Result<ExpectedRange, Unfit> {
        let expected = ExpectedRange::new(wall, self.sonar.mount, &self.ekf.state());
        let along = wall.along(self.position).0;
        let to_end = smaller(along, wall.length().0 - along);
        if !self.holds(to_end, self.variance_along(wall.b(), -wall.a())) {
            return Err(Unfit::FootOffWall);
        }
        let sonar = self.sonar;
        let range = expected.range;
        let to_limit = smaller((range - sonar.min_range).0, (sonar.max_range - range).0);
        if !self.holds(to_limit, self.variance_along(wall.a(), wall.b())) {
            return Err(Unfit::OutOfRange);
        }
        Ok(expected)
    }

    /// Whether a beam at `bearing` meets the expected wall squarely enough, heading uncertainty
    /// included.
    pub fn is_square(&self, bearing: Radians, expected: &ExpectedRange) -> bool {
        let beam = self.heading.turned(bearing);
        expected.direction.from(beam).abs() <= self.clear_cone
    }

    /// The bearing that meets the expected wall squarely, if the servo reaches it.
    fn bearing(&self, expected: &ExpectedRange) -> Option<Radians> {
        let bearing = expected.direction.from(self.heading);
        let (rightmost, leftmost) = self.sonar.servo;
        (bearing >= rightmost && bearing <= leftmost).then_some(bearing)
    }

    /// Whether any wall of the map would keep the echo of `target` from being the first: by
    /// standing before its foot, or by answering from nearer inside the cone.
    fn is_hidden(&self, map: &Map, target: WallId, expected: &ExpectedRange) -> bool {
        let view = View::new(self.position, expected, self.wide_cone);
        map.near(self.position, Metres(view.distance))
            .any(|(id, wall)| id != target && view.is_disturbed_by(&wall))
    }
}

/// The sonar's view along one direction: the frame in which hiding is decided.
struct View {
    origin: Point,
    /// Unit vector along the beam.
    axis: (f32, f32),
    distance: f32,
    tangent_of_cone: f32,
}

impl View {
    fn new(origin: Point, expected: &ExpectedRange, cone: Radians) -> Self {
        let (sin, cos) = crate::trig::sin_cos(expected.direction.radians());
        // Beyond 75° the tangent runs away; no sonar's cone is that wide.
        let limit = Radians::from_degrees(75.0);
        let cone = if cone < limit { cone } else { limit };
        let (cone_sin, cone_cos) = crate::trig::sin_cos(cone);
        Self {
            origin,
            axis: (cos, sin),
            distance: expected.by_range_scale,
            tangent_of_cone: cone_sin / cone_cos,
        }
    }

    /// A point's distance along the beam and to the left of it.
    fn place(&self, point: Point) -> (f32, f32) {
        let (dx, dy) = ((point.x - self.origin.x).0, (point.y - self.origin.y).0);
        let (cos, sin) = self.axis;
        (cos * dx + sin * dy, cos * dy - sin * dx)
    }

    fn is_disturbed_by(&self, wall: &Wall) -> bool {
        let (from, to) = (self.place(wall.from()), self.place(wall.to()));
        self.crosses_beam(from, to)
            || self.answers_first(from)
            || self.answers_first(to)
            || self.has_nearer_foot(wall)
    }

    /// Whether the wall between two placed points cuts the beam before it reaches its target.
    fn crosses_beam(&self, from: (f32, f32), to: (f32, f32)) -> bool {
        let opposite_sides = (from.1 <= 0.0) != (to.1 <= 0.0);
        if !opposite_sides {
            return false;
        }
        let crossing = from.0 + (to.0 - from.0) * (from.1 / (from.1 - to.1));
        crossing > 0.0 && crossing < self.distance
    }

    /// Whether something at this place is inside the cone and nearer than the target.
    fn answers_first(&self, place: (f32, f32)) -> bool {
        let (ahead, aside) = place;
        let inside = ahead > 0.0 && aside.abs() <= self.tangent_of_cone * ahead;
        inside && ahead * ahead + aside * aside < self.distance * self.distance
    }

    fn has_nearer_foot(&self, wall: &Wall) -> bool {
        let along = wall.along(self.origin).0;
        if !(along >= 0.0 && along <= wall.length().0) {
            return false;
        }
        let signed = wall.signed_distance(self.origin).0;
        let foot =
            Point::new(self.origin.x.0 - signed * wall.a(), self.origin.y.0 - signed * wall.b());
        self.answers_first(self.place(foot))
    }
}

/// Chooses the wall to look at: not the one to `spare`, if there is another.
///
/// # Errors
/// [`NoAim`], by why there is none.
///
/// # Panics
/// Never.
pub(crate) fn choose(
    config: &Config,
    map: &Map,
    ekf: &Ekf,
    spare: Option<WallId>,
) -> Result<Aim, NoAim> {
    let noise = config.sonar.noise;
    let choose = |spare: Option<WallId>| {
        best(config, map, ekf, |id, view, expected| {
            view.bearing(expected)?;
            if spare == Some(id) {
                return None;
            }
            Some(match config.policy {
                Policy::Nearest => -expected.range.0,
                Policy::Informative => {
                    ekf.position_gain(expected, noise.variance(expected.range)).0
                }
            })
        })
    };
    match choose(spare) {
        Err(NoAim::NoWall) if spare.is_some() => choose(None),
        found => found,
    }
}

/// Finds the wall that a beam at `bearing` meets squarely: the nearest that counts.
///
/// # Errors
/// [`NoAim`], by why there is none.
pub(crate) fn at(config: &Config, map: &Map, ekf: &Ekf, bearing: Radians) -> Result<Aim, NoAim> {
    let aim = best(config, map, ekf, |_, view, expected| {
        view.is_square(bearing, expected).then_some(-expected.range.0)
    })?;
    Ok(Aim { bearing, ..aim })
}

/// The wall that counts with the highest score.
fn best(
    config: &Config,
    map: &Map,
    ekf: &Ekf,
    score: impl Fn(WallId, &Viewpoint, &ExpectedRange) -> Option<f32>,
) -> Result<Aim, NoAim> {
    let view = Viewpoint::new(config, ekf);
    let square_is_certain = view.clear_cone > Radians(0.0);
    if !square_is_certain {
        return Err(NoAim::HeadingUncertain);
    }
    let mut best: Option<(f32, Aim)> = None;
    for (id, wall) in map.near(view.position, config.sonar.max_range) {
        let Ok(expected) = view.expect(&wall) else {
            continue;
        };
        let Some(score) = score(id, &view, &expected) else {
            continue;
        };
        let improves = best.is_none_or(|(highest, _)| score > highest);
        // Hiding costs a look at every wall, so it is asked last.
        if improves && !view.is_hidden(map, id, &expected) {
            let bearing = expected.direction.from(view.heading);
            best = Some((score, Aim { wall: id, bearing, range: expected.range }));
        }
    }
    best.map(|(_, aim)| aim).ok_or(NoAim::NoWall)
}

/// `f32::min` treats +0 and −0 differently from build to build; a comparison does not.
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}
