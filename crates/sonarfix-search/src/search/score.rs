//! The likelihood of a ping at a pose: what of the map may answer, nearest first, and what else an
//! echo may come from.
//!
//! Scores are natural logarithms of the likelihood over that of an echo anywhere in the sonar's range.

use heapless::Vec;

use sonarfix::association::reflector::{
    Audibility, Beam, BeamHit, Place, REFLECTORS, Reflector, Reflectors,
};
use sonarfix::config::{RangerParameters, Ranging};
use sonarfix::geometry::elementary::{ln, sqrt};
use sonarfix::geometry::numeric::{at_least, at_most};
use sonarfix::geometry::units::Metres;
use sonarfix::geometry::vector::Vector;
use sonarfix::map::Map;
use sonarfix::sensor::echo::{EchoParameters, LogShares};

/// Deviation of the angle between axis and reflector, as a part of the cone.
const BEAM: f32 = 0.8;
/// Residuals beyond so many deviations are no match.
const MATCH: f32 = 3.0;
/// Logarithms of the probability that a reflector answers, and that it does not.
#[derive(Debug, Clone, Copy)]
struct Audible {
    hit: f32,
    miss: f32,
}

/// Of [`Audibility::probability`].
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

/// The most that sonar and map add to the variance of a score, which then has a deviation of 3.5 cm: with more, no place fits so well
/// that its lead is trusted.
const MOST_NOISE: f32 = 0.035 * 0.035 - Sharpness::FINE * Sharpness::FINE;

/// Density of an echo anywhere, per metre, by which all scores are divided.
const ANYWHERE: f32 = 0.25;
const ONE_OVER_ROOT_TWO_PI: f32 = 0.398_942_3;

impl Sharpness {
    /// Deviations, metres: of candidates, and of placements that were refined once.
    pub const COARSE: f32 = 0.15;
    pub const MEDIUM: f32 = 0.08;
    /// Of a score, without the noise of the sonar and the error of the map.
    const FINE: f32 = 0.02;
    /// The same of an answer: the hand-over is as exact as the nearest pings.
    const SHARP: f32 = 0.015;

    /// Of a ping that was sent so far from the reference that odometry adds a deviation of its own.
    pub fn new(deviation: f32, odometry: f32) -> Self {
        let deviation = sqrt(deviation * deviation + odometry * odometry);
        let peak = ln(ONE_OVER_ROOT_TWO_PI / ANYWHERE / deviation);
        Self { deviation, peak }
    }
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

/// How far what may answer a ping of sound was looked at.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Hearing {
    /// Nearest first.
    found: Vec<Place, REFLECTORS, u8>,
    /// How many of them were looked at.
    heard: u8,
    /// Whether the range is not beyond the wall that the axis meets first.
    is_before: bool,
    /// Logarithm of the probability that none of them has answered.
    missed: f32,
    /// The best of them.
    best: Option<Explanation>,
}

impl Hearing {
    /// How many are looked at in the evaluation that finds them: the fewer, the more were found.
    pub fn at_first(&self) -> usize {
        (REFLECTORS - self.found.len()) / 2
    }
}

/// The sonar in its map.
#[derive(Debug, Clone)]
pub(super) struct EchoModel<'m> {
    pub reflectors: Reflectors<'m>,
    shares: LogShares,
    /// Inverse of the deviation of the angle between the axis and what answers; zero of light, whose axis is exact.
    pub by_beam: f32,
    /// Whether the range is along the axis.
    pub is_light: bool,
    /// Variance of a range at a metre by the noise of the sonar and the error of the map, m², at most [`MOST_NOISE`].
    noise: f32,
}

impl<'m> EchoModel<'m> {
    #[inline(never)]
    pub fn new(map: Map<'m>, sonar: &RangerParameters, echo: &EchoParameters) -> Self {
        let RangerParameters { cone, max_range, ranging, .. } = *sonar;
        let is_light = ranging != Ranging::Sound;
        let of_map = echo.map_accuracy.0 * echo.map_accuracy.0;
        Self {
            reflectors: Reflectors::new(map, sonar),
            shares: echo.log_shares(max_range, ANYWHERE),
            by_beam: if is_light { 0.0 } else { 1.0 / (BEAM * cone.0) },
            is_light,
            noise: at_most(sonar.noise.variance(Metres(1.0)).0 + of_map, MOST_NOISE),
        }
    }

    /// Deviation of the ranges of a placement that is scored, metres.
    pub fn fine(&self) -> f32 {
        sqrt(Sharpness::FINE * Sharpness::FINE + self.noise)
    }

    /// The same of an answer.
    pub fn sharp(&self) -> f32 {
        sqrt(Sharpness::SHARP * Sharpness::SHARP + self.noise)
    }

    /// The score of a ping, with or without an echo, where the map has no wall.
    pub fn nothing(&self, has_echo: bool) -> f32 {
        if has_echo {
            at_least(self.shares.before, LEAST_ECHO)
        } else {
            at_least(SILENCE, self.shares.silence)
        }
    }

    // ===== Eq. (31): p(z) over the density of an echo anywhere =====
    /// Finds what may answer a ping of sound.
    #[inline(never)]
    pub fn listen(&self, beam: &Beam, sharpness: Sharpness) -> Hearing {
        let margin = MATCH * sharpness.deviation;
        let reach = beam.range.map_or(self.reflectors.max_range, |range| range + margin);
        let mut reflectors = Vec::new();
        let free = self.reflectors.collect(beam, reach, margin, &mut reflectors);
        let mut found = Vec::new();
        for reflector in &reflectors {
            // There is room: both lists hold as many.
            let _ = found.push(reflector.place());
        }
        Hearing {
            found,
            heard: 0,
            is_before: beam.range.is_some_and(|range| range < free + margin),
            missed: 0.0,
            best: None,
        }
    }

    /// Looks at so many of those that were found, nearest first; the score of the ping when no other one matters.
    #[inline(never)]
    pub fn hear(
        &self,
        hearing: &mut Hearing,
        (beam, sharpness): (&Beam, Sharpness),
        most: usize,
    ) -> Option<Explanation> {
        let mut left = most;
        while let Some(&place) = hearing.found.get(usize::from(hearing.heard)) {
            left = left.checked_sub(1)?;
            hearing.heard += 1;
            let Some(reflector) = self.reflectors.at(beam, place) else { continue };
            let Some(audible) = self.audible(beam, &reflector) else { continue };
            if let Some(range) = beam.range {
                let residual = range - reflector.distance;
                let ratio = residual / sharpness.deviation;
                if ratio.abs() <= MATCH {
                    let off_axis = beam.axis.left().dot(reflector.toward);
                    let aside = off_axis * self.by_beam;
                    let score = audible.hit + hearing.missed + sharpness.peak
                        - 0.5 * (ratio * ratio + aside * aside);
                    if hearing.best.is_none_or(|best| score > best.score) {
                        let toward = reflector.toward;
                        let target = Some(Target { residual, toward, off_axis });
                        hearing.best = Some(Explanation { score, target });
                    }
                }
                if residual < 0.0 {
                    break;
                }
            }
            hearing.missed += audible.miss;
            if hearing.missed < LEAST_ECHO - sharpness.peak {
                break;
            }
        }
        Some(self.end_hearing(hearing, beam))
    }

    /// The best of what was heard and what else an echo, or none, may come from.
    fn end_hearing(&self, hearing: &Hearing, beam: &Beam) -> Explanation {
        let missed = hearing.missed;
        let other = if beam.range.is_some() {
            let shares = &self.shares;
            let clutter = if hearing.is_before { shares.before } else { shares.behind };
            at_least(clutter + missed, LEAST_ECHO)
        } else {
            at_least(SILENCE + missed, self.shares.silence)
        };
        let best = hearing.best.filter(|best| best.score > other);
        best.unwrap_or(Explanation { score: other, target: None })
    }

    /// Scores a ping of light, which only the wall that the axis meets first can answer.
    #[inline(never)]
    pub fn explain_lit(&self, beam: &Beam, sharpness: Sharpness) -> Explanation {
        let met = self.reflectors.lit(beam);
        let Some(range) = beam.range else {
            let missed = if met.is_some() { self.shares.misses } else { 0.0 };
            let score = at_least(SILENCE + missed, self.shares.silence);
            return Explanation { score, target: None };
        };
        let Some(BeamHit { distance, away }) = met else {
            return Explanation { score: at_least(self.shares.before, LEAST_ECHO), target: None };
        };
        // The deviation is across the wall: a place that is wrong by it changes an oblique range by more.
        let residual = range - distance;
        let ratio = residual / (sharpness.deviation * sqrt(away.length_squared()));
        let clutter = if residual < 0.0 { self.shares.before } else { self.shares.behind };
        let other = at_least(clutter + self.shares.misses, LEAST_ECHO);
        let score = self.shares.answers + sharpness.peak - 0.5 * ratio * ratio;
        // False for NaN.
        if ratio.abs() <= MATCH && score > other {
            let target = Some(Target { residual, toward: away, off_axis: 0.0 });
            return Explanation { score, target };
        }
        Explanation { score: other, target: None }
    }

    /// How well a reflector is heard, `None` if a wall hides it.
    fn audible(&self, beam: &Beam, reflector: &Reflector) -> Option<Audible> {
        Some(match self.reflectors.heard(beam, reflector)? {
            Audibility::End => WEAK,
            Audibility::Rim => RIM,
            Audibility::Corner => CORNER,
            Audibility::Foot => Audible { hit: self.shares.answers, miss: self.shares.misses },
        })
    }
}

#[cfg(test)]
mod tests;
