//! What of the map may answer a ping, nearest first: feet of perpendiculars on walls, concave right-angled
//! corners and, weakly, ends of walls (Kuc and Siegel 1987; Leonard and Durrant-Whyte 1992).
//!
//! The update explains an echo by it that is not the target's, and the search scores a pose by it.
//!
//! # Non-finite policy
//! Poses and walls are finite. Comparisons are written so that a NaN is no reflector.

use heapless::Vec;

use crate::config::RangerParameters;
use crate::geometry::elementary::sqrt;
use crate::geometry::list::{insert_in_order, remove_at};
use crate::geometry::trig::sin_cos;
use crate::geometry::units::Metres;
use crate::geometry::vector::Vector;
use crate::map::{Map, Wall, WallId};

/// Nearest reflectors that are looked at.
pub const REFLECTORS: usize = 6;
/// Beyond this share of the longest range an echo is often missed.
pub const FADES: f32 = 0.8;
/// Two walls touch within this distance, metres.
const TOUCH: f32 = 0.02;
/// Cosine of the angle between two walls up to which they make a corner: 75°.
const SQUARE: f32 = 0.26;
/// Reflectors up to this multiple of the cone away from the axis may answer.
const RIM: f32 = 1.6;

/// A ping placed on the map.
#[derive(Debug, Clone, Copy)]
pub struct Beam {
    /// Where the ranger is.
    pub from: Vector,
    /// Unit vector.
    pub axis: Vector,
    /// The range that was measured.
    pub range: Option<f32>,
}

/// A place on the map that may answer.
#[derive(Debug, Clone, Copy)]
pub struct Reflector {
    /// Metres from the sonar.
    pub distance: f32,
    /// Unit vector from the sonar.
    pub toward: Vector,
    /// The direction of the wall from its end; `None`: the foot of a perpendicular.
    pub arm: Option<Vector>,
    /// The wall that it belongs to.
    pub wall: WallId,
    /// That of the wall's place, if it has one of its own.
    pub accuracy: Option<Metres>,
    part: Part,
    is_central: bool,
}

/// A part of a wall that may answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Foot,
    Start,
    End,
}

/// Where on the map a reflector is, without its geometry: less memory than a [`Reflector`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    wall: WallId,
    part: Part,
}

/// Where a beam of light meets a wall.
#[derive(Debug, Clone, Copy)]
pub struct BeamHit {
    /// Metres along the beam.
    pub distance: f32,
    /// Change of the distance by the position of the ranger, with the opposite sign: the normal over the cosine of the
    /// incidence.
    pub away: Vector,
}

/// How a reflector is heard.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Audibility {
    /// The foot of a perpendicular, in the cone.
    Foot,
    /// A concave corner, in the cone.
    Corner,
    /// One of both at the rim of cone or range.
    Rim,
    /// The end of a wall.
    End,
}

impl Audibility {
    /// Probability that a reflector answers, if a foot in the cone answers with a probability of `foot`.
    /// Chosen, between an HC-SR04 and the NXT's recorded shares.
    #[must_use]
    pub const fn probability(self, foot: f32) -> f32 {
        match self {
            Self::Foot => foot,
            Self::Corner => 0.75,
            Self::Rim => 0.4,
            Self::End => 0.1,
        }
    }
}

/// The sonar in its map.
#[derive(Debug, Clone)]
pub struct Reflectors<'m> {
    /// The map.
    pub map: Map<'m>,
    cos_cone: f32,
    cos_rim: f32,
    /// Longest range of the ranger, metres.
    pub max_range: f32,
}

impl<'m> Reflectors<'m> {
    /// The reflectors of a map as this ranger hears them.
    #[inline(never)]
    #[must_use]
    pub fn new(map: Map<'m>, sonar: &RangerParameters) -> Self {
        let RangerParameters { cone, max_range, .. } = *sonar;
        let cos = |angle| sin_cos(angle).1;
        Self { map, cos_cone: cos(cone), cos_rim: cos(cone * RIM), max_range: max_range.0 }
    }

    /// Collects the reflectors in the cone up to `reach`, nearest first, into an empty list, because one that is returned is
    /// copied. Returns how far the axis is free.
    #[inline(never)]
    pub fn collect(
        &self,
        beam: &Beam,
        reach: f32,
        margin: f32,
        found: &mut Vec<Reflector, REFLECTORS>,
    ) -> f32 {
        let mut free = f32::INFINITY;
        let range = beam.range.unwrap_or(f32::INFINITY);
        for (id, wall) in self.map.near(beam.from.into(), Metres(reach)) {
            let view = View::new(&wall, beam);
            if let Some(hit) = view.hit()
                && hit < free
            {
                free = hit;
            }
            if let Some(foot) = view.foot(self.cos_rim)
                && foot.distance <= reach
            {
                insert(found, self.foot(&foot, (id, &wall)));
            }
            for (part, to_end, arm) in view.ends() {
                let ahead = to_end.dot(beam.axis);
                let square = to_end.length_squared();
                if ahead <= 0.0
                    || square > reach * reach
                    || ahead * ahead < self.cos_rim * self.cos_rim * square
                    || square < 1e-6
                {
                    continue;
                }
                // An edge that cannot be the echo hardly matters.
                let juts_out = to_end.dot(arm) >= 0.0;
                if juts_out && (sqrt(square) - range).abs() > margin {
                    continue;
                }
                insert(found, self.end((part, to_end, arm), beam, (id, &wall)));
            }
        }
        free
    }

    /// The reflector at a place that was found in this beam, the same bits.
    #[inline(never)]
    #[must_use]
    pub fn at(&self, beam: &Beam, Place { wall: id, part }: Place) -> Option<Reflector> {
        let wall = self.map.wall(id)?;
        let view = View::new(&wall, beam);
        if part == Part::Foot {
            return view.foot(self.cos_rim).map(|foot| self.foot(&foot, (id, &wall)));
        }
        let mut ends = view.ends().into_iter();
        ends.find(|(end, ..)| *end == part).map(|end| self.end(end, beam, (id, &wall)))
    }

    fn foot(&self, foot: &Foot, (id, wall): (WallId, &Wall)) -> Reflector {
        Reflector {
            distance: foot.distance,
            toward: foot.toward,
            arm: None,
            wall: id,
            accuracy: wall.accuracy(),
            part: Part::Foot,
            is_central: foot.cosine >= self.cos_cone,
        }
    }

    #[inline(never)]
    fn end(&self, (part, to_end, arm): End, beam: &Beam, (id, wall): (WallId, &Wall)) -> Reflector {
        let distance = sqrt(to_end.length_squared());
        Reflector {
            distance,
            toward: to_end.times(1.0 / distance),
            arm: Some(arm),
            wall: id,
            accuracy: wall.accuracy(),
            part,
            is_central: to_end.dot(beam.axis) >= self.cos_cone * distance,
        }
    }

    /// The wall that a beam of light meets first.
    #[must_use]
    pub fn lit(&self, beam: &Beam) -> Option<BeamHit> {
        let mut first: Option<BeamHit> = None;
        for (_, wall) in self.map.near(beam.from.into(), Metres(self.max_range)) {
            let tangent = Vector::new(wall.b(), -wall.a());
            let normal = tangent.left();
            let to_start = Vector::from(wall.from()).minus(beam.from);
            let by_approach = 1.0 / normal.dot(beam.axis);
            let distance = to_start.dot(normal) * by_approach;
            let along = distance * beam.axis.dot(tangent) - to_start.dot(tangent);
            let is_met = distance > 0.0 && along >= 0.0 && along <= wall.length().0;
            if is_met && first.is_none_or(|first| distance < first.distance) {
                first = Some(BeamHit { distance, away: normal.times(by_approach) });
            }
        }
        first.filter(|first| first.distance <= self.max_range)
    }

    /// How a reflector is heard, `None` if a wall hides it.
    #[must_use]
    pub fn heard(&self, beam: &Beam, reflector: &Reflector) -> Option<Audibility> {
        let at = beam.from.plus(reflector.toward.times(reflector.distance));
        let mut is_corner = false;
        for (_, wall) in self.map.near(beam.from.into(), Metres(reflector.distance)) {
            let (from, tangent) = (Vector::from(wall.from()), Vector::new(wall.b(), -wall.a()));
            let (there, here) = (at.minus(from), beam.from.minus(from));
            let (off_there, off_here) = (there.dot(tangent.left()), here.dot(tangent.left()));
            let along = there.dot(tangent);
            let length = wall.length().0;
            if off_there.abs() <= TOUCH {
                if let Some(arm) = reflector.arm
                    && along >= -TOUCH
                    && along <= length + TOUCH
                    && tangent.dot(arm).abs() < SQUARE
                    && reflector.toward.dot(arm) < 0.0
                {
                    // Inside the angle of the two walls, wherever the other one leads.
                    let back = -reflector.toward.dot(tangent);
                    is_corner |= if along <= TOUCH {
                        back > 0.0
                    } else if along >= length - TOUCH {
                        back < 0.0
                    } else {
                        true
                    };
                }
            } else if (off_there > 0.0) != (off_here > 0.0) {
                let share = off_here / (off_here - off_there);
                let crossing = here.dot(tangent) * (1.0 - share) + along * share;
                if crossing >= 0.0 && crossing <= length {
                    return None;
                }
            }
        }
        let fades = reflector.distance > FADES * self.max_range;
        let is_weak = reflector.arm.is_some() && !is_corner;
        Some(if is_weak {
            Audibility::End
        } else if fades || !reflector.is_central {
            Audibility::Rim
        } else if is_corner {
            Audibility::Corner
        } else {
            Audibility::Foot
        })
    }
}

/// Inserts by distance; the farthest drops out of a full list. An end that two walls share
/// appears once. What is in the list does not depend on the order of the walls.
fn insert(into: &mut Vec<Reflector, REFLECTORS>, reflector: Reflector) {
    if let Some(arm) = reflector.arm {
        let is_same_end = |other: &Reflector| {
            other.arm.is_some()
                && (other.distance - reflector.distance).abs() < TOUCH
                && other.toward.dot(reflector.toward) > 0.999
        };
        // Both walls compute the same end, each with its own rounding: that of the first direction stays.
        if let Some(at) = into.iter().position(is_same_end) {
            let known = into.get(at).and_then(|known| known.arm);
            if !known.is_some_and(|known| is_before(arm, known)) {
                return;
            }
            remove_at(into, at);
        }
    }
    insert_in_order(into, reflector, Reflector::is_before);
}

impl Reflector {
    /// Where on the map it is.
    #[must_use]
    pub fn place(&self) -> Place {
        Place { wall: self.wall, part: self.part }
    }

    /// Whether this one is nearer, or as near and first by its direction.
    fn is_before(&self, other: &Self) -> bool {
        self.distance < other.distance
            || (self.distance <= other.distance && is_before(self.toward, other.toward))
    }
}

/// An order of directions.
fn is_before(one: Vector, other: Vector) -> bool {
    one.x < other.x || (one.x <= other.x && one.y < other.y)
}

/// A wall in the frame of a beam's origin.
struct View {
    /// From the sonar to the wall's start.
    to_start: Vector,
    tangent: Vector,
    length: f32,
    /// The foot's place along the wall, and the signed distance to its line, positive along the
    /// normal to the left of the tangent.
    along: f32,
    ahead: f32,
    axis: Vector,
}

struct Foot {
    distance: f32,
    toward: Vector,
    cosine: f32,
}

/// An end of a wall: from the sonar to it, and the direction of the wall from there.
type End = (Part, Vector, Vector);

impl View {
    fn new(wall: &Wall, beam: &Beam) -> Self {
        let tangent = Vector::new(wall.b(), -wall.a());
        let to_start = Vector::from(wall.from()).minus(beam.from);
        Self {
            to_start,
            tangent,
            length: wall.length().0,
            along: -to_start.dot(tangent),
            ahead: to_start.dot(tangent.left()),
            axis: beam.axis,
        }
    }

    fn foot(&self, cos_rim: f32) -> Option<Foot> {
        if !(self.along >= 0.0 && self.along <= self.length) {
            return None;
        }
        let normal = self.tangent.left();
        let toward = if self.ahead < 0.0 { normal.times(-1.0) } else { normal };
        let cosine = toward.dot(self.axis);
        (cosine >= cos_rim).then_some(Foot { distance: self.ahead.abs(), toward, cosine })
    }

    /// Distance at which the axis meets the wall.
    fn hit(&self) -> Option<f32> {
        let approach = self.axis.dot(self.tangent.left());
        let distance = self.ahead / approach;
        let along = self.along + distance * self.axis.dot(self.tangent);
        (distance > 0.0 && along >= 0.0 && along <= self.length).then_some(distance)
    }

    fn ends(&self) -> [End; 2] {
        let to_end = self.to_start.plus(self.tangent.times(self.length));
        [(Part::Start, self.to_start, self.tangent), (Part::End, to_end, self.tangent.times(-1.0))]
    }
}

#[cfg(test)]
mod tests;
