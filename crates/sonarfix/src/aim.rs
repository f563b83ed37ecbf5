//! The planner: the wall to measure next, and the bearing of the servo that is square to it
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
//! | `gain` | expected decrease of the variance |
//! | `history` | occlusion of recent walls, last bearing, turn rate |
//! | `ranking` | order of the candidates |
//! | `timing` | duration of a ping |
//! | this one | candidates, scores and the choice |
//!
//! # Non-finite policy
//! The state of the filter is finite. Comparisons are written so that a candidate whose numbers are
//! NaN is not chosen.

mod gain;
mod history;
mod ranking;
mod timing;

use crate::config::Config;
use crate::ekf::Ekf;
use crate::map::{Map, Wall, WallId};
use crate::pose::Heading;
use crate::range::ExpectedRange;
use crate::units::{Duration, Instant, Metres, Radians, SquareMetres};
use crate::visibility::{Beam, Viewpoint};

use gain::expected_gain;
use ranking::Ranked;
use timing::PingDuration;

pub use crate::config::Policy;
pub(crate) use history::{History, Origin};

/// One ping at one wall.
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
}

/// The numbers behind the choice of a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Reason {
    /// Expected decrease of the variance of the position, and of the other weighted states
    /// ([`Weights`](crate::config::Weights)).
    pub gain: SquareMetres,
    /// Probability of success: the foot lies on the wall, its range is within the limits of the sonar and
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

/// Number of candidates that are kept at a time, best first. They are tested for occlusion in that
/// order; if all are occluded, the next ones are searched.
const SHORTLIST: usize = 8;

/// Chooses the wall to measure.
///
/// # Errors
/// [`NoAim`] if there is none.
///
/// # Panics
/// Never.
pub(crate) fn choose(
    config: &Config,
    map: &Map,
    ekf: &Ekf,
    history: &History,
    now: Instant,
) -> Result<Aim, NoAim> {
    let planner = Planner::new(config, map, ekf, history, now);
    planner.best(|id, wall| planner.by_policy(id, wall)).or_else(|_| {
        let planner = planner.without_margins();
        planner.best(|id, wall| planner.by_policy(id, wall))
    })
}

/// Finds the nearest wall to which a beam at `bearing` is square.
///
/// # Errors
/// [`NoAim`] if there is none.
pub(crate) fn at(
    config: &Config,
    map: &Map,
    ekf: &Ekf,
    history: &History,
    now: Instant,
    bearing: Radians,
) -> Result<Aim, NoAim> {
    let planner = Planner::new(config, map, ekf, history, now);
    planner.best(|id, wall| planner.at_bearing(id, wall, bearing)).or_else(|_| {
        let planner = planner.without_margins();
        planner.best(|id, wall| planner.at_bearing(id, wall, bearing))
    })
}

/// Everything that the scores of the candidates depend on.
struct Planner<'a> {
    config: &'a Config,
    map: &'a Map<'a>,
    ekf: &'a Ekf,
    history: &'a History,
    now: Instant,
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

impl<'a> Planner<'a> {
    fn new(
        config: &'a Config,
        map: &'a Map<'a>,
        ekf: &'a Ekf,
        history: &'a History,
        now: Instant,
    ) -> Self {
        let view = Viewpoint::new(config, ekf);
        let duration = PingDuration::new(&config.sonar.timing);
        Self { config, map, ekf, history, now, view, duration }
    }

    /// The same planner without the margins for the uncertainty of the estimate.
    fn without_margins(self) -> Self {
        Self { view: self.view.without_margins(), ..self }
    }

    /// The best candidate that is not occluded. `candidate` scores a wall, if it can be measured.
    fn best(&self, candidate: impl Fn(WallId, &Wall) -> Option<Candidate>) -> Result<Aim, NoAim> {
        let mut after = None;
        loop {
            let (shortlist, count) = self.shortlist(&candidate, after);
            for ranked in shortlist.iter().flatten() {
                let best =
                    self.map.wall(ranked.wall).and_then(|wall| candidate(ranked.wall, &wall));
                if let Some(best) = best.filter(|best| !self.is_occluded(ranked.wall, best)) {
                    return Ok(best.aim(ranked.wall, count));
                }
            }
            // The list is not full: there are no more candidates.
            after = *shortlist.last().ok_or(NoAim::NoWall)?;
            if after.is_none() {
                return Err(NoAim::NoWall);
            }
        }
    }

    /// The best candidates that rank after `after`, and the number of all candidates.
    fn shortlist(
        &self,
        candidate: impl Fn(WallId, &Wall) -> Option<Candidate>,
        after: Option<Ranked>,
    ) -> ([Option<Ranked>; SHORTLIST], u16) {
        let mut shortlist = [None; SHORTLIST];
        let mut count = 0_u16;
        for (wall, segment) in self.map.near(self.view.position(), self.config.sonar.max_range) {
            let Some(candidate) = candidate(wall, &segment) else {
                continue;
            };
            count = count.saturating_add(1);
            let ranked = Ranked { wall, score: candidate.score };
            if after.is_none_or(|after| after.is_before(ranked)) {
                ranked.insert(&mut shortlist);
            }
        }
        (shortlist, count)
    }

    // ===== Eq. (22): score =====
    /// A wall with the servo turned to it.
    fn by_policy(&self, id: WallId, wall: &Wall) -> Option<Candidate> {
        let (expected, on_wall) = self.view.expected_range(wall).ok()?;
        let pointing = self.point(&expected);
        if !self.view.is_square(pointing.off) {
            return None;
        }
        let mut candidate = self.candidate(id, wall, (expected, on_wall), &pointing);
        candidate.score = match self.config.policy {
            Policy::Nearest => candidate.success / candidate.expected.range.0,
            Policy::Informative => candidate.gain.0 * candidate.success / candidate.seconds,
        };
        if self.history.last.is_some_and(|last| last.wall == id) {
            candidate.score *= HYSTERESIS;
        }
        Some(candidate)
    }

    /// A wall along a bearing that the planner does not choose: the nearest is the best.
    fn at_bearing(&self, id: WallId, wall: &Wall, bearing: Radians) -> Option<Candidate> {
        let (expected, on_wall) = self.view.expected_range(wall).ok()?;
        let off = self.view.off_square(&expected, bearing);
        if !self.view.is_square(off) {
            return None;
        }
        let score = 1.0 / expected.range.0;
        let pointing = Pointing { bearing, off, until_ping: 0.0 };
        Some(Candidate { score, ..self.candidate(id, wall, (expected, on_wall), &pointing) })
    }

    /// Everything but the score.
    fn candidate(
        &self,
        id: WallId,
        wall: &Wall,
        (expected, on_wall): (ExpectedRange, f32),
        pointing: &Pointing,
    ) -> Candidate {
        let range = expected.range;
        let echo = &self.config.echo;
        let foot = wall.along(self.view.position());
        let entry = self.history.entry(echo, id, foot, range, self.now);
        let map_variance = echo.map_variance(entry.travelled);
        let noise = SquareMetres(self.config.sonar.noise.variance(range).0 + map_variance);
        let prediction = self.ekf.predict_measurement(&expected);
        let wheels = self.ekf.cross_covariance_of_wheels(&expected);
        Candidate {
            bearing: pointing.bearing,
            gain: expected_gain(&prediction, wheels, noise, self.config.weights),
            success: (1.0 - entry.occlusion)
                * on_wall
                * self.view.probability_of_square(pointing.off),
            seconds: self.duration.ping(pointing.until_ping, range),
            score: 0.0,
            expected,
        }
    }

    /// The bearing of the servo for a wall: where the servo stands, if the beam is then nearly square
    /// and the ping earlier; otherwise square to the wall at the time of the ping, when the robot has
    /// turned further; if that is beyond the travel of the servo, its limit.
    fn point(&self, expected: &ExpectedRange) -> Pointing {
        // The last bearing may be outside the travel of the servo if it was not planned.
        let last = self.history.last;
        let (current, rest) = last.map_or((Radians(0.0), 0.0), |last| {
            (self.reachable(last.bearing), self.duration.rest_after(last.range))
        });
        let bearing_after = |time: f32| expected.direction.from(self.heading_after(time));
        let target = self.reachable(bearing_after(0.0));
        let turn = self.duration.turn(target - current);
        let until_ping = if turn > rest { turn } else { rest };
        let off_without_turn = bearing_after(rest) - current;
        let range = expected.range;
        let is_faster = self.duration.ping(rest, range) < self.duration.ping(until_ping, range);
        if is_faster && off_without_turn.abs() <= self.config.sonar.cone * DEAD_BAND {
            return Pointing { bearing: current, off: off_without_turn, until_ping: rest };
        }
        let square = bearing_after(until_ping);
        let bearing = self.reachable(square);
        let off = Heading::new(square).from(Heading::new(bearing));
        Pointing { bearing, off, until_ping }
    }

    /// The heading after a time in seconds at the present turn rate.
    fn heading_after(&self, seconds: f32) -> Heading {
        self.view.heading.turned(Radians(self.history.turn_rate * seconds))
    }

    /// The nearest bearing within the travel of the servo.
    fn reachable(&self, bearing: Radians) -> Radians {
        let (right, left) = self.config.sonar.servo;
        if bearing >= right && bearing <= left {
            return bearing;
        }
        let beyond = |limit: Radians| Heading::new(bearing).from(Heading::new(limit)).abs();
        if beyond(right) < beyond(left) { right } else { left }
    }

    /// Whether another wall of the map returns an earlier echo.
    fn is_occluded(&self, target: WallId, candidate: &Candidate) -> bool {
        let beam = Beam::new(&self.view, &candidate.expected);
        self.map
            .near(self.view.position(), beam.reach())
            .any(|(id, wall)| id != target && beam.is_occluded_by(&wall))
    }
}

impl Candidate {
    fn aim(&self, wall: WallId, candidates: u16) -> Aim {
        let why = Reason {
            gain: self.gain,
            success: self.success,
            time: timing::duration(self.seconds),
            candidates,
        };
        Aim { wall, bearing: self.bearing, range: self.expected.range, why }
    }
}
