//! The likelihood of a ping at a pose: what of the map may answer, nearest first, and what else an
//! echo may come from.
//!
//! Reflectors are the feet of perpendiculars on walls, concave right-angled corners and, weakly,
//! ends of walls (Kuc and Siegel 1987). Scores are natural logarithms of the likelihood over that
//! of an echo anywhere in the sonar's range.

use heapless::Vec;

use super::vector::Vector;
use crate::config::Sonar;
use crate::echo::{EchoParameters, LogShares};
use crate::elementary::{ln, sqrt};
use crate::map::{Map, Wall};
use crate::units::Metres;

/// Nearest reflectors that are looked at.
const REFLECTORS: usize = 6;
/// Beyond this share of the longest range an echo is often missed.
const FADES: f32 = 0.8;
/// Deviation of the angle between axis and reflector, as a part of the cone.
const BEAM: f32 = 0.8;
/// Two walls touch within this distance, metres.
const TOUCH: f32 = 0.02;
/// Cosine of the angle between two walls up to which they make a corner: 75°.
const SQUARE: f32 = 0.26;
/// Residuals beyond so many deviations are no match.
const MATCH: f32 = 3.0;
/// Logarithms of the probability that a reflector answers, and that it does not.
#[derive(Debug, Clone, Copy)]
struct Audible {
    hit: f32,
    miss: f32,
}

/// Concave corners (0.75), reflectors at the rim of cone or range (0.4), and ends of walls (0.1).
/// Chosen, between an HC-SR04 and the NXT's recorded shares.
const CORNER: Audible = Audible { hit: -0.288, miss: -1.386 };
const RIM: Audible = Audible { hit: -0.916, miss: -0.511 };
const WEAK: Audible = Audible { hit: -2.303, miss: -0.105 };

/// The lowest score of an echo: a single one does not decide.
const LEAST_ECHO: f32 = -3.5;
/// No echo where nothing answers.
const SILENCE: f32 = 0.7;

/// How sharp ranges are expected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sharpness {
    /// Metres.
    pub deviation: f32,
    /// Logarithm of the normal distribution's peak density over [`ANYWHERE`].
    peak: f32,
}

/// Density of an echo anywhere, per metre, by which all scores are divided.
const ANYWHERE: f32 = 0.25;
const ONE_OVER_ROOT_TWO_PI: f32 = 0.398_942_3;

impl Sharpness {
    /// Deviations, metres: of candidates, of placements that were refined once, and of map, sonar
    /// and odometry nearby together.
    pub const COARSE: f32 = 0.15;
    pub const MEDIUM: f32 = 0.08;
    pub const FINE: f32 = 0.05;

    /// Of a ping that was sent so far from the reference that odometry adds a deviation of its own.
    pub fn new(deviation: f32, odometry: f32) -> Self {
        let deviation = sqrt(deviation * deviation + odometry * odometry);
        let peak = ln(ONE_OVER_ROOT_TWO_PI / ANYWHERE / deviation);
        Self { deviation, peak }
    }
}

/// A ping placed on the map.
#[derive(Debug, Clone, Copy)]
pub(super) struct Beam {
    pub from: Vector,
    /// Unit vector.
    pub axis: Vector,
    pub range: Option<f32>,
}

/// What a range was compared with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Target {
    /// Measured minus expected range, metres.
    pub residual: f32,
    /// Unit vector from the sonar to the reflector.
    pub toward: Vector,
    /// Sine of the angle from the beam's axis to the reflector.
    pub off_axis: f32,
}

/// The best explanation of a ping.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Explanation {
    pub score: f32,
    pub target: Option<Target>,
}

/// The sonar in its map.
#[derive(Debug, Clone)]
pub(super) struct EchoModel<'m> {
    pub map: Map<'m>,
    cos_cone: f32,
    cos_rim: f32,
    pub max_range: f32,
    shares: LogShares,
    /// Inverse of the deviation of the angle between the axis and what answers.
    pub by_beam: f32,
}

#[derive(Debug, Clone, Copy)]
struct Reflector {
    distance: f32,
    toward: Vector,
    /// The direction of the wall from its end; `None`: the foot of a perpendicular.
    arm: Option<Vector>,
    is_central: bool,
}

impl<'m> EchoModel<'m> {
    #[inline(never)]
    pub fn new(map: Map<'m>, sonar: &Sonar, echo: &EchoParameters) -> Self {
        let Sonar { cone, max_range, .. } = *sonar;
        let cos = |angle| crate::trig::sin_cos(angle).1;
        Self {
            map,
            cos_cone: cos(cone),
            cos_rim: cos(cone * 1.6),
            max_range: max_range.0,
            shares: echo.log_shares(max_range, ANYWHERE),
            by_beam: 1.0 / (BEAM * cone.0),
        }
    }

    /// Scores a ping; one call is one evaluation.
    pub fn explain(&self, beam: &Beam, sharpness: Sharpness) -> Explanation {
        let margin = MATCH * sharpness.deviation;
        let reach = beam.range.map_or(self.max_range, |range| range + margin);
        let (reflectors, free) = self.reflectors(beam, reach, margin);
        let mut missed = 0.0;
        let mut best: Option<Explanation> = None;
        for reflector in &reflectors {
            let Some(audible) = self.audible(beam, reflector) else { continue };
            if let Some(range) = beam.range {
                let residual = range - reflector.distance;
                let ratio = residual / sharpness.deviation;
                if ratio.abs() <= MATCH {
                    let off_axis = beam.axis.left().dot(reflector.toward);
                    let aside = off_axis * self.by_beam;
                    let score = audible.hit + missed + sharpness.peak
                        - 0.5 * (ratio * ratio + aside * aside);
                    if best.is_none_or(|best| score > best.score) {
                        let toward = reflector.toward;
                        let target = Some(Target { residual, toward, off_axis });
                        best = Some(Explanation { score, target });
                    }
                }
                if residual < 0.0 {
                    break;
                }
            }
            missed += audible.miss;
            if missed < LEAST_ECHO - sharpness.peak {
                break;
            }
        }
        let other = match beam.range {
            None => at_least(SILENCE + missed, self.shares.silence),
            Some(range) => {
                let is_before = range < free + margin;
                let clutter = if is_before { self.shares.before } else { self.shares.behind };
                at_least(clutter + missed, LEAST_ECHO)
            }
        };
        match best {
            Some(best) if best.score > other => best,
            _ => Explanation { score: other, target: None },
        }
    }

    /// The reflectors in the cone up to `reach`, nearest first, and how far the axis is free.
    fn reflectors(
        &self,
        beam: &Beam,
        reach: f32,
        margin: f32,
    ) -> (Vec<Reflector, REFLECTORS>, f32) {
        let mut found: Vec<Reflector, REFLECTORS> = Vec::new();
        let mut free = f32::INFINITY;
        let range = beam.range.unwrap_or(f32::INFINITY);
        for (_, wall) in self.map.near(beam.from.into(), Metres(reach)) {
            let view = View::new(&wall, beam);
            if let Some(hit) = view.hit()
                && hit < free
            {
                free = hit;
            }
            if let Some(foot) = view.foot(self.cos_rim)
                && foot.distance <= reach
            {
                insert(
                    &mut found,
                    Reflector { is_central: foot.cosine >= self.cos_cone, ..foot.reflector() },
                );
            }
            for (to_end, arm) in view.ends() {
                let ahead = to_end.dot(beam.axis);
                let square = to_end.length_squared();
                if ahead <= 0.0
                    || square > reach * reach
                    || ahead * ahead < self.cos_rim * self.cos_rim * square
                    || square < 1e-6
                {
                    continue;
                }
                let distance = sqrt(square);
                // An edge that cannot be the echo hardly matters.
                let juts_out = to_end.dot(arm) >= 0.0;
                if juts_out && (distance - range).abs() > margin {
                    continue;
                }
                let is_central = ahead >= self.cos_cone * distance;
                let toward = to_end.times(1.0 / distance);
                insert(&mut found, Reflector { distance, toward, arm: Some(arm), is_central });
            }
        }
        (found, free)
    }

    /// How well a reflector is heard, `None` if a wall hides it.
    fn audible(&self, beam: &Beam, reflector: &Reflector) -> Option<Audible> {
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
            WEAK
        } else if fades || !reflector.is_central {
            RIM
        } else if is_corner {
            CORNER
        } else {
            Audible { hit: self.shares.answers, miss: self.shares.misses }
        })
    }
}

fn at_least(value: f32, least: f32) -> f32 {
    if value > least { value } else { least }
}

/// Inserts by distance; the farthest drops out of a full list. An end that two walls share
/// appears once.
fn insert(into: &mut Vec<Reflector, REFLECTORS>, reflector: Reflector) {
    let is_known = reflector.arm.is_some()
        && into.iter().any(|other| {
            other.arm.is_some()
                && (other.distance - reflector.distance).abs() < TOUCH
                && other.toward.dot(reflector.toward) > 0.999
        });
    if is_known {
        return;
    }
    if into.is_full() {
        match into.last() {
            Some(last) if last.distance > reflector.distance => {
                into.pop();
            }
            _ => return,
        }
    }
    let at = into.iter().position(|other| other.distance > reflector.distance);
    // There is room: it was made above.
    let _ = into.insert(at.unwrap_or(into.len()), reflector);
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

impl Foot {
    fn reflector(&self) -> Reflector {
        Reflector { distance: self.distance, toward: self.toward, arm: None, is_central: true }
    }
}

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

    /// Both ends, each with the direction of the wall from there.
    fn ends(&self) -> [(Vector, Vector); 2] {
        let to_end = self.to_start.plus(self.tangent.times(self.length));
        [(self.to_start, self.tangent), (to_end, self.tangent.times(-1.0))]
    }
}
