//! The planner: the ranger and the wall to measure next, and the bearing of the servo that is square to it
//! (`docs/model.md`, eqs. 21 and 22).
//!
//! Candidates are the walls that can be measured (module `visibility`) and that the servo
//! reaches. Among them the policy chooses: [`Policy::Nearest`] the nearest, and
//! [`Policy::Informative`] the one with the largest expected gain per time,
//!
//! ```text
//! score = decrease of the variance · probability of success / seconds of the ping
//! ```
//!
//! | module | contents |
//! |---|---|
//! | `choice` | the choice, which a loop makes in slices |
//! | `gain` | expected decrease of the variance |
//! | `light` | beams of a time-of-flight ranger |
//! | `ranking` | order of the candidates |
//! | this one | candidates and scores |
//!
//! # Non-finite policy
//! The state of the filter is finite. Comparisons are written so that a candidate whose numbers are
//! NaN is not chosen.

mod choice;
mod gain;
mod light;
mod ranking;

use core::marker::PhantomData;

use crate::association::visibility::{Beam, Sight, Viewpoint};
use crate::config::{Config, MAX_RANGERS, RangerId, RangerParameters};
use crate::filter::ekf::Ekf;
use crate::geometry::pose::Heading;
use crate::geometry::units::{Duration, Instant, Metres, Radians, SquareMetres, seconds};
use crate::map::{Map, Wall, WallId};
use crate::sensor::range::ExpectedRange;

use crate::association::history::{History, Slot};
use crate::sensor::timing::PingDuration;
use gain::expected_gain;

pub use crate::config::Policy;
pub use choice::Choice;

/// One ping of one ranger at one wall.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Aim {
    /// The wall.
    pub wall: WallId,
    /// Bearing of the servo, relative to the robot's heading.
    pub bearing: Radians,
    /// The range expected now. A fix computes its own at the pose of the echo.
    pub range: Metres,
    /// The numbers behind the choice.
    pub why: Reason,
    /// The ranger that pings.
    pub ranger: RangerId,
}

impl Aim {
    /// What the policy maximizes over all rangers: the expected decrease of the variance per time, or the nearness.
    #[must_use]
    pub fn score(&self, policy: Policy) -> f32 {
        let Reason { gain, success, time, .. } = self.why;
        score(policy, gain, success, self.range, seconds(time))
    }
}

/// The numbers behind the choice of a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Reason {
    /// Expected decrease of the variance of the position, and of the other weighted states
    /// ([`Weights`](crate::config::Weights)).
    pub gain: SquareMetres,
    /// Probability of success: the ranger works, the foot lies on the wall, its range is within the limits of the sonar and
    /// the beam is square, given the uncertainty of the estimate, and no unmapped object occludes the
    /// wall, given earlier pings.
    pub success: f32,
    /// Duration of the ping: servo, ranger and flight of sound, or the period of the schedule.
    pub time: Duration,
    /// Number of walls that can be measured, before the test for occlusion.
    pub candidates: u16,
}

/// Reason for which there is no wall to measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum NoAim {
    /// No wall can be measured.
    NoWall,
}

impl core::fmt::Display for NoAim {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::NoWall => "no wall can be measured from here",
        })
    }
}

impl core::error::Error for NoAim {}

/// Factor by which the score of another wall must exceed that of the last one: about what the error of
/// the estimate may add to a score. The servo then does not alternate between equal walls, and the
/// choice between them does not depend on the error of the estimate, which would bias it
/// (`docs/schedule.md`).
const HYSTERESIS: f32 = 1.02;

/// Share of the cone within which the servo stays where it is if that saves time.
const DEAD_BAND: f32 = 0.125;

/// The robot in its map, for the choice of a ping.
#[derive(Clone, Copy)]
pub(crate) struct Situation<'a> {
    pub config: &'a Config,
    pub map: &'a Map<'a>,
    pub ekf: &'a Ekf,
    pub history: &'a History,
    pub now: Instant,
    pub policy: Policy,
}

/// Where the servo of a ranger stands, and when it can ping.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Standing {
    /// The bearing to which its servo is commanded; `None` before the first command.
    pub bearing: Option<Radians>,
    /// Time until it can ping there: its servo has settled, and the echoes of earlier pings that it
    /// [hears](RangerParameters::hears) have decayed.
    pub ready_in: Duration,
}

/// Everything that the scores of the candidates depend on.
struct Planner<'a, P> {
    config: &'a Config,
    map: &'a Map<'a>,
    ekf: &'a Ekf,
    history: &'a History,
    now: Instant,
    policy: Policy,
    ranger: RangerId,
    sonar: &'a RangerParameters,
    /// The bearing, if the planner does not choose it. A field in both cases: what does not depend on the rule is then the same code,
    /// which the compiler merges.
    along: Radians,
    rule: PhantomData<P>,
    slot: Slot,
    /// Probability that the ranger works.
    works: f32,
    view: Viewpoint<'a>,
    duration: PingDuration,
}

/// A wall that can be measured unless it is occluded.
struct Candidate {
    expected: ExpectedRange,
    bearing: Radians,
    gain: SquareMetres,
    success: f32,
    seconds: f32,
    score: f32,
}

/// Bearing of the servo for a wall.
struct Pointing {
    bearing: Radians,
    /// Angle between beam and perpendicular at the ping.
    off: Radians,
    /// Seconds until the ping.
    until_ping: f32,
}

/// What determines the bearing of a ping.
trait BearingRule {
    /// Whether the planner chooses it.
    const CHOOSES: bool;
}

/// The planner, by the policy.
struct ByPolicy;

/// Whatever has turned the servo.
struct Along;

impl BearingRule for ByPolicy {
    const CHOOSES: bool = true;
}

impl BearingRule for Along {
    const CHOOSES: bool = false;
}

impl<P: BearingRule> Planner<'_, P> {
    /// The bearing, if the planner does not choose it.
    fn given_bearing(&self) -> Option<Radians> {
        (!P::CHOOSES).then_some(self.along)
    }

    /// A wall as a candidate, if it can be measured: with the servo turned to it, or along the bearing that it has.
    #[inline(never)]
    fn by_sound(&self, id: WallId, wall: &Wall) -> Option<Candidate> {
        let (expected, on_wall) = self.view.expected_range(wall).ok()?;
        let (pointing, is_seen) = if let Some(bearing) = self.given_bearing() {
            let off = self.view.off_square(&expected, bearing);
            (Pointing { bearing, off, until_ping: 0.0 }, self.view.may_answer(off))
        } else {
            let pointing = self.point(&expected);
            let is_square = self.view.is_square(pointing.off);
            (pointing, is_square)
        };
        if !is_seen {
            return None;
        }
        let sight = self.heard(wall, (expected, on_wall), pointing.off);
        let mut candidate = self.candidate(id, &sight, &pointing);
        candidate.score = if P::CHOOSES {
            self.score_of(&candidate, id, self.policy)
        } else {
            // The nearest that may answer is the best.
            1.0 / candidate.expected.range.0
        };
        Some(candidate)
    }

    /// The score of a candidate that the policy chooses.
    fn score_of(&self, candidate: &Candidate, id: WallId, policy: Policy) -> f32 {
        let Candidate { gain, success, ref expected, seconds, .. } = *candidate;
        let score = score(policy, gain, success, expected.range, seconds);
        if self.slot.wall == Some(id) { score * HYSTERESIS } else { score }
    }

    /// A wall that a sonar measures along a bearing.
    #[inline]
    fn heard(&self, wall: &Wall, (expected, on_wall): (ExpectedRange, f32), off: Radians) -> Sight {
        Sight {
            on_wall,
            square: self.view.probability_of_square(off),
            noise: self.sonar.noise.variance(expected.range).0,
            of_map: self.config.echo.map_variance(wall.accuracy()),
            place: wall.along(self.view.position()),
            off,
            expected,
        }
    }

    /// Everything but the score.
    #[expect(
        clippy::inline_always,
        reason = "200 instructions of an aim: it is called for each wall"
    )]
    #[inline(always)]
    fn candidate(&self, id: WallId, sight: &Sight, pointing: &Pointing) -> Candidate {
        let Sight { expected, on_wall, square, place, .. } = *sight;
        let works = if MAX_RANGERS > 1 { self.works } else { 1.0 };
        let range = expected.range;
        let echo = &self.config.echo;
        let entry = self.history.entry(echo, self.ranger, id, place, range, self.now);
        let of_map = sight.of_map * entry.repetition;
        let noise = SquareMetres(sight.noise + of_map + self.config.mount_noise(self.ranger));
        let ahead = self.view.ahead_of(self.ranger);
        let prediction = self.ekf.predict_measurement(&expected, ahead);
        let weights = self.config.weights;
        let wheels = weights.are_set().then(|| self.ekf.cross_covariance_of_wheels(&prediction));
        Candidate {
            bearing: pointing.bearing,
            gain: expected_gain(&prediction, wheels, noise, weights),
            success: works * (1.0 - entry.occlusion) * on_wall * square,
            seconds: self.duration.ping(pointing.until_ping, range),
            score: 0.0,
            expected,
        }
    }

    /// The bearing of the servo for a wall: where the servo stands, if the beam is then nearly square
    /// and the ping earlier; otherwise square to the wall at the time of the ping, when the robot has
    /// turned further; if that is beyond the travel of the servo, its limit.
    fn point(&self, expected: &ExpectedRange) -> Pointing {
        let (current, rest) = self.standing();
        let bearing_after = |time: f32| expected.direction.from(self.heading_after(time));
        let target = self.reachable(bearing_after(0.0));
        let turn = self.duration.turn(target - current);
        let until_ping = if turn > rest { turn } else { rest };
        let range = expected.range;
        // Most walls are far from where the servo stands, and most servos turn for longer than the ranger rests.
        let is_faster = || self.duration.ping(rest, range) < self.duration.ping(until_ping, range);
        let off_without_turn = bearing_after(rest) - current;
        if off_without_turn.abs() <= self.sonar.cone * DEAD_BAND && is_faster() {
            return Pointing { bearing: current, off: off_without_turn, until_ping: rest };
        }
        let square = bearing_after(until_ping);
        let bearing = self.reachable(square);
        let off = turn_to(square, bearing);
        Pointing { bearing, off, until_ping }
    }

    /// Where the servo stands, and the seconds until the ranger can ping there.
    fn standing(&self) -> (Radians, f32) {
        // The last bearing may be outside the travel of the servo if it was not planned.
        let current = self.slot.bearing.map_or(Radians(0.0), |bearing| self.reachable(bearing));
        (current, self.slot.ready_in)
    }

    /// The heading after a time in seconds at the present turn rate.
    fn heading_after(&self, seconds: f32) -> Heading {
        self.view.heading.turned(Radians(self.history.turn_rate * seconds))
    }

    /// The nearest bearing within the travel of the servo.
    fn reachable(&self, bearing: Radians) -> Radians {
        let (right, left) = self.sonar.servo;
        if bearing >= right && bearing <= left {
            return bearing;
        }
        if turn_to(bearing, right).abs() < turn_to(bearing, left).abs() { right } else { left }
    }
}

/// The smallest turn to a bearing from another one. Not inlined, because it is needed at several places.
#[inline(never)]
fn turn_to(to: Radians, from: Radians) -> Radians {
    Heading::new(to).from(Heading::new(from))
}

// ===== Eq. (22): score =====
fn score(policy: Policy, gain: SquareMetres, success: f32, range: Metres, seconds: f32) -> f32 {
    if policy.is_informative() { gain.0 * success / seconds } else { success / range.0 }
}

impl Candidate {
    /// Whether another wall of the map than its own returns an earlier echo.
    #[inline(never)]
    fn is_occluded(&self, own: WallId, view: &Viewpoint, map: &Map<'_>) -> bool {
        let beam = Beam::new(view, &self.expected);
        map.near(view.position(), beam.reach())
            .any(|(id, wall)| id != own && beam.is_occluded_by(&wall))
    }

    fn aim(&self, ranger: RangerId, wall: WallId, candidates: u16) -> Aim {
        let why = Reason {
            gain: self.gain,
            success: self.success,
            time: crate::sensor::timing::duration(self.seconds),
            candidates,
        };
        Aim { wall, bearing: self.bearing, range: self.expected.range, why, ranger }
    }
}
