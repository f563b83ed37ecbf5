//! Where to look: the wall whose range is worth taking now, and the bearing that meets it
//! squarely (`docs/model.md`, eqs. 16 and 18, and "Which walls count").
//!
//! A wall counts if
//! - the foot of the perpendicular from the sonar lies on it, and its range within the sonar's,
//! - the servo can turn to it, or so near that the foot is inside the cone,
//! - nothing stands before it, and nothing nearer inside the cone would answer first.
//!
//! All of it must hold when the position is wrong by its own uncertainty
//! ([`Trust::confidence`](crate::config::Trust::confidence) standard deviations) and the cone when
//! the heading is; where that leaves nothing of the cone, two standard deviations must do.
//!
//! Among those that count the policy chooses: [`Policy::Nearest`] the nearest, and
//! [`Policy::Informative`] the one from which most is expected for the time it takes,
//!
//! ```text
//! score = drop of the variance · probability that the look succeeds / seconds of the look
//! ```
//!
//! Responsibilities, one file each: `viewpoint`, which walls can be measured; `hiding`, what stands
//! before them; `prospect`, what a range is worth; `timing`, how long a look takes; `memory`, what
//! earlier looks said of a wall; this one, the choice.
//!
//! # Non-finite policy
//! The filter's state is finite, and every comparison here is written so that NaN would not
//! count as a wall to look at.

mod hiding;
mod memory;
mod prospect;
mod timing;
mod viewpoint;

use crate::config::Config;
use crate::ekf::Ekf;
use crate::map::{Map, Wall, WallId};
use crate::pose::Heading;
use crate::range::ExpectedRange;
use crate::units::{Duration, Instant, Metres, Radians, SquareMetres};

use hiding::Beam;
use timing::Pacing;

pub use crate::config::Policy;
pub(crate) use memory::{Answer, Memory};
pub(crate) use timing::seconds;
pub(crate) use viewpoint::{LEAST_CONFIDENCE, Unfit, Viewpoint};

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
    /// Why this wall.
    pub why: Reason,
}

/// Why a wall was chosen: what the choice reckoned with.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Reason {
    /// By how much its range is to lower the variance of the position, and of what else has a
    /// weight ([`Weights`](crate::config::Weights)).
    pub gain: SquareMetres,
    /// How likely the look is to succeed: that the wall is in the cone, by the heading's
    /// uncertainty, and that nothing unknown stands before it, by what earlier looks said.
    pub success: f32,
    /// How long the look takes: servo, ranger and sound, or the period between looks.
    pub time: Duration,
    /// How many walls could be measured, before asking what hides them.
    pub candidates: u16,
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

/// By how much another wall must be better for the sonar to turn away from the last one: as much
/// as the estimate's own error may make it seem better. So between equal walls the servo does not
/// hunt, and which of them is looked at does not depend on the error of the estimate, which would
/// bias it (`docs/schedule.md`).
const STAY: f32 = 1.02;

/// The servo may stay where it is if that saves time and the foot is within this share of the cone
/// from the beam.
const NEAR_ENOUGH: f32 = 0.125;

/// How many candidates are kept at a time, best first. What hides them is asked in that order, and
/// if all are hidden, the next so many are sought.
const SHORTLIST: usize = 8;

/// Chooses the wall to look at.
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
    memory: &Memory,
    now: Instant,
) -> Result<Aim, NoAim> {
    let chooser = Chooser::new(config, map, ekf, memory, now);
    Ok(chooser.best(|id, wall| chooser.look(id, wall))?.aim())
}

/// Finds the wall that a beam at `bearing` meets squarely: the nearest that counts.
///
/// # Errors
/// [`NoAim`], by why there is none.
pub(crate) fn at(
    config: &Config,
    map: &Map,
    ekf: &Ekf,
    memory: &Memory,
    now: Instant,
    bearing: Radians,
) -> Result<Aim, NoAim> {
    let chooser = Chooser::new(config, map, ekf, memory, now);
    Ok(chooser.best(|id, wall| chooser.look_at(id, wall, bearing))?.aim())
}

/// What every candidate is weighed with.
struct Chooser<'a> {
    config: &'a Config,
    map: &'a Map<'a>,
    ekf: &'a Ekf,
    memory: &'a Memory,
    now: Instant,
    view: Viewpoint<'a>,
    pacing: Pacing,
}

/// A look at a wall that can be measured, if nothing hides it.
struct Look {
    expected: ExpectedRange,
    bearing: Radians,
    gain: SquareMetres,
    success: f32,
    seconds: f32,
    score: f32,
}

/// Where the servo is to point for a wall.
struct Pointing {
    bearing: Radians,
    /// How far off the perpendicular that will be at the ping.
    off: Radians,
    /// Seconds until the ping.
    until_ping: f32,
}

impl<'a> Chooser<'a> {
    fn new(
        config: &'a Config,
        map: &'a Map<'a>,
        ekf: &'a Ekf,
        memory: &'a Memory,
        now: Instant,
    ) -> Self {
        let view = Viewpoint::new(config, ekf);
        let pacing = Pacing::new(&config.sonar.timing);
        Self { config, map, ekf, memory, now, view, pacing }
    }

    /// The best look that nothing hides.
    fn best(&self, look: impl Fn(WallId, &Wall) -> Option<Look>) -> Result<Pick, NoAim> {
        if !self.view.can_be_square() {
            return Err(NoAim::HeadingUncertain);
        }
        let mut after = None;
        loop {
            let (shortlist, candidates) = self.shortlist(&look, after);
            for ranked in shortlist.iter().flatten() {
                let look = self.map.wall(ranked.wall).and_then(|wall| look(ranked.wall, &wall));
                if let Some(look) = look.filter(|look| !self.is_hidden(ranked.wall, look)) {
                    return Ok(Pick { wall: ranked.wall, look, candidates });
                }
            }
            // Fewer than there is room for: there are no more.
            after = *shortlist.last().ok_or(NoAim::NoWall)?;
            if after.is_none() {
                return Err(NoAim::NoWall);
            }
        }
    }

    /// The best candidates that rank after one, and how many there are in all.
    fn shortlist(
        &self,
        look: impl Fn(WallId, &Wall) -> Option<Look>,
        after: Option<Ranked>,
    ) -> ([Option<Ranked>; SHORTLIST], u16) {
        let mut shortlist = [None; SHORTLIST];
        let mut candidates = 0_u16;
        for (wall, segment) in self.map.near(self.view.position, self.config.sonar.max_range) {
            let Some(look) = look(wall, &segment) else {
                continue;
            };
            candidates = candidates.saturating_add(1);
            let ranked = Ranked { wall, score: look.score };
            if after.is_none_or(|after| after.is_before(ranked)) {
                ranked.insert(&mut shortlist);
            }
        }
        (shortlist, candidates)
    }

    /// A look at a wall with the servo turned to it.
    fn look(&self, id: WallId, wall: &Wall) -> Option<Look> {
        let expected = self.view.expect(wall).ok()?;
        let pointing = self.point(&expected);
        if !self.view.is_square(pointing.off) {
            return None;
        }
        let mut look = self.weigh(id, wall, expected, &pointing);
        look.score = match self.config.policy {
            Policy::Nearest => look.success / look.expected.range.0,
            Policy::Informative => look.gain.0 * look.success / look.seconds,
        };
        if self.memory.last.is_some_and(|last| last.wall == id) {
            look.score *= STAY;
        }
        Some(look)
    }

    /// A look at a wall along a bearing that somebody else chose: the nearest is the best.
    fn look_at(&self, id: WallId, wall: &Wall, bearing: Radians) -> Option<Look> {
        let expected = self.view.expect(wall).ok()?;
        let off = expected.direction.from(self.view.heading.turned(bearing));
        if !self.view.is_square(off) {
            return None;
        }
        let score = 1.0 / expected.range.0;
        let pointing = Pointing { bearing, off, until_ping: 0.0 };
        Some(Look { score, ..self.weigh(id, wall, expected, &pointing) })
    }

    fn weigh(&self, id: WallId, wall: &Wall, expected: ExpectedRange, pointing: &Pointing) -> Look {
        let range = expected.range;
        let prospect = self.ekf.prospect(&expected, self.config.sonar.noise.variance(range));
        let foot = wall.along(self.view.position);
        let belief = self.memory.belief(id, foot, self.now);
        Look {
            bearing: pointing.bearing,
            gain: prospect::gain(&prospect, self.config.weights),
            success: belief * self.view.share_inside(pointing.off),
            seconds: self.pacing.look(pointing.until_ping, range),
            score: 0.0,
            expected,
        }
    }

    /// Where to send the servo: where it stands, if that is near enough and saves time, or square
    /// to the wall at the time of the ping, when the robot will have turned on; if that is beyond
    /// its travel, to the end of it.
    fn point(&self, expected: &ExpectedRange) -> Pointing {
        let (ahead, rest) = self
            .memory
            .last
            .map_or((Radians(0.0), 0.0), |last| (last.bearing, self.pacing.rest_after(last.range)));
        let bearing_after = |time: f32| expected.direction.from(self.heading_after(time));
        let now = self.reach(bearing_after(0.0));
        let turn = self.pacing.turn(now - ahead);
        let until_ping = if turn > rest { turn } else { rest };
        let staying_off = bearing_after(rest) - ahead;
        let is_faster =
            self.pacing.look(rest, expected.range) < self.pacing.look(until_ping, expected.range);
        if is_faster && staying_off.abs() <= self.config.sonar.cone * NEAR_ENOUGH {
            return Pointing { bearing: ahead, off: staying_off, until_ping: rest };
        }
        let square = bearing_after(until_ping);
        let bearing = self.reach(square);
        let off = Heading::new(square).from(Heading::new(bearing));
        Pointing { bearing, off, until_ping }
    }

    /// Where the robot will look if it turns on as it does.
    fn heading_after(&self, seconds: f32) -> Heading {
        self.view.heading.turned(Radians(self.memory.turn_rate * seconds))
    }

    /// The nearest bearing that the servo reaches.
    fn reach(&self, bearing: Radians) -> Radians {
        let (right, left) = self.config.sonar.servo;
        if bearing >= right && bearing <= left {
            return bearing;
        }
        let beyond = |limit: Radians| Heading::new(bearing).from(Heading::new(limit)).abs();
        if beyond(right) < beyond(left) { right } else { left }
    }

    /// Whether any wall of the map would keep the echo from being the first.
    fn is_hidden(&self, target: WallId, look: &Look) -> bool {
        let beam = Beam::new(&self.view, &look.expected);
        self.map
            .near(self.view.position, beam.reach())
            .any(|(id, wall)| id != target && beam.is_disturbed_by(&wall))
    }
}

/// The look that was chosen.
struct Pick {
    wall: WallId,
    look: Look,
    candidates: u16,
}

impl Pick {
    fn aim(&self) -> Aim {
        let look = &self.look;
        let why = Reason {
            gain: look.gain,
            success: look.success,
            time: timing::span(look.seconds),
            candidates: self.candidates,
        };
        Aim { wall: self.wall, bearing: look.bearing, range: look.expected.range, why }
    }
}

/// A candidate's place among the others: the higher its score the better, and of two equal ones
/// the first in the map.
#[derive(Clone, Copy)]
struct Ranked {
    wall: WallId,
    score: f32,
}

impl Ranked {
    fn is_before(self, other: Self) -> bool {
        self.score > other.score || (self.score >= other.score && self.wall < other.wall)
    }

    /// Takes its place in a list that is in order; the last falls out of a full one.
    fn insert(mut self, list: &mut [Option<Self>]) {
        for slot in list {
            match slot {
                Some(held) if self.is_before(*held) => core::mem::swap(held, &mut self),
                Some(_) => {}
                None => {
                    *slot = Some(self);
                    return;
                }
            }
        }
    }
}
