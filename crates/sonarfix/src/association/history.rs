//! What previous pings revealed: the last bearing, the turn rate of the robot, and for each recent wall
//! whether an unmapped object occludes it and when its range was last used.
//!
//! Occlusion is a hidden Markov state of a wall: each ping updates its probability by the
//! [echo model](crate::association::echo), and it returns to the prior with the distance of the foot along the wall
//! and with time.
//!
//! # Non-finite policy
//! Bearing, range and foot come from a finite state. For a wall far beyond any range the square of the
//! distance may be infinite; the probability is then the prior.

use crate::association::clutter::Clutter;
use crate::association::echo::EchoSource;
use crate::association::reliability::{Reliability, Returned};
use crate::config::{Config, MAX_RANGERS, RangerId};
use crate::geometry::numeric::{at_least, between};
use crate::geometry::units::{Instant, Metres, Radians, SquareMetres, seconds};
use crate::map::WallId;
use crate::sensor::echo::{EchoParameters, repetition};
use crate::sensor::timing::PingDuration;

/// Number of walls that are stored; a further one replaces the one that was stored first.
const RECENT_WALLS: usize = 8;
/// Share of the probability before a ping that remains after it: objects return echoes now and then,
/// and at the end of a cupboard one range may be the wall's.
const PERSISTENCE: f32 = 0.8;
/// Limits of the probability: the only wall is measured however often it fails.
const MAX_OCCLUSION: f32 = 0.95;
/// Distance of the foot along the wall that halves the deviation from the prior: half the width of a
/// chair.
const HALVED_WITHIN: Metres = Metres(0.25);
/// Time in seconds that halves the deviation from the prior: people and chairs move.
const HALVED_AFTER: f32 = 5.0;

/// Probability that a ping agrees with a wrong pose, if the last one that agreed was in the same direction: the error may
/// be along the wall.
const AGREES_ALONG: f32 = 0.3;
/// The same in another direction: this, and so much per square metre of the innovation's variance for a wall that happens to
/// be at that range.
const AGREES_ACROSS: f32 = 0.01;
const PER_SQUARE_METRE: f32 = 20.0;
/// Two directions whose cosine exceeds this are the same: 37°.
const SAME_DIRECTION: f32 = 0.8;

/// Time constant of the turn rate, seconds: a single step between two close instants is quantised by
/// whole encoder ticks.
const TURN_RATE_TIME: f32 = 0.05;

/// A wall at the last ping at it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct RecentWall {
    wall: WallId,
    /// Place of the foot along the wall.
    foot: Metres,
    at: Instant,
    /// Probability that it was occluded, less the prior at its range.
    above_prior: f32,
    /// Reading of the odometer when a range of the wall was last used.
    used_at: Option<Metres>,
    /// The latest echo that was probably not the wall's.
    other: Option<OtherEcho>,
}

/// An echo that was probably not that of its wall.
#[derive(Debug, Clone, Copy, PartialEq)]
struct OtherEcho {
    range: Metres,
    /// Reading of the odometer.
    odometer: Metres,
    at: Instant,
    /// The ranger that received it. Another one stands elsewhere, and receives the object's echo at another range.
    ranger: RangerId,
}

impl RecentWall {
    fn above_prior(&self, foot: Metres, now: Instant) -> f32 {
        let distance = (foot - self.foot).0 / HALVED_WITHIN.0;
        let age = now.checked_duration_since(self.at).map_or(0.0, seconds);
        self.above_prior / ((1.0 + distance * distance) * (1.0 + age / HALVED_AFTER))
    }
}

/// A wall seen from a ranger.
#[derive(Debug, Clone, Copy)]
struct WallPoint {
    wall: WallId,
    ranger: RangerId,
    /// Place of the foot along the wall.
    foot: Metres,
    /// Prior probability of occlusion at its range.
    prior: f32,
}

/// What the history holds of one wall.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Entry {
    slot: Option<usize>,
    place: WallPoint,
    used_at: Option<Metres>,
    other: Option<OtherEcho>,
    /// Probability that an unmapped object occludes the wall.
    pub occlusion: f32,
    /// What returned the latest echo that was probably not the wall's.
    pub source: Option<EchoSource>,
    /// Factor on the variance of its place, which is common to the ranges of the wall that were used before.
    pub repetition: f32,
}

/// What probably returned the echo of a ping at a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Origin {
    Wall,
    /// Something else, at this range.
    Other(Metres),
    /// There was no echo.
    Silence,
}

/// The previous ping of a ranger.
#[derive(Debug, Clone, Copy, PartialEq)]
struct LastPing {
    wall: WallId,
    bearing: Radians,
    range: Metres,
}

/// When and from where a ranger can ping next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slot {
    /// Where its servo stands, or will.
    pub bearing: Option<Radians>,
    /// Seconds until it can ping there: its servo has settled, and the echoes that it hears have decayed.
    pub ready_in: f32,
    /// The wall of its last ping.
    pub wall: Option<WallId>,
}

/// The history of pings.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct History {
    last: [Option<LastPing>; MAX_RANGERS],
    reliability: [Reliability; MAX_RANGERS],
    /// The ranger of the latest ping.
    latest: RangerId,
    /// Radians per second.
    pub turn_rate: f32,
    /// Distance travelled, metres.
    odometer: Metres,
    recent: [Option<RecentWall>; RECENT_WALLS],
    /// The slot that was filled last.
    newest: usize,
    /// How cluttered the place is.
    pub clutter: Clutter,
    /// Derivatives by x and y of the range that was used last.
    used: Option<(f32, f32)>,
}

impl History {
    // ===== Eq. (53) =====
    /// Probability that a ping agrees by chance with a wrong pose, for a range with these derivatives by x and y and an
    /// innovation of this variance.
    pub fn by_chance(&self, (x, y): (f32, f32), variance: SquareMetres) -> f32 {
        let across = AGREES_ACROSS + PER_SQUARE_METRE * variance.0;
        match self.used {
            Some((used_x, used_y))
                if (x * used_x + y * used_y).abs() < SAME_DIRECTION && across < AGREES_ALONG =>
            {
                across
            }
            _ => AGREES_ALONG,
        }
    }

    /// Records the derivatives by x and y of a range that was the wall's.
    pub fn record_used(&mut self, by: (f32, f32)) {
        self.used = Some(by);
    }

    /// Records a turn of the robot over a time in seconds.
    pub fn record_turn(&mut self, turn: Radians, seconds: f32) {
        self.turn_rate = (self.turn_rate * TURN_RATE_TIME + turn.0) / (TURN_RATE_TIME + seconds);
    }

    /// Records a distance travelled.
    pub fn record_distance(&mut self, distance: Metres) {
        self.odometer = self.odometer + distance;
    }

    /// Records where a ranger pointed.
    pub fn record_ping(&mut self, ranger: RangerId, wall: WallId, bearing: Radians, range: Metres) {
        if let Some(last) = self.last.get_mut(ranger.index()) {
            *last = Some(LastPing { wall, bearing, range });
            self.latest = ranger;
        }
    }

    /// Records what a ping of a ranger returned.
    pub fn record_returned(&mut self, ranger: RangerId, returned: &Returned, now: Instant) {
        if let Some(reliability) = self.reliability.get_mut(ranger.index()) {
            reliability.record(returned, now);
        }
    }

    /// Whether a ranger has probably failed, and more probably than another one of the robot.
    pub fn has_failed(&self, ranger: RangerId, config: &Config) -> bool {
        let Some(own) = self.reliability.get(ranger.index()) else { return false };
        let others = self.reliability.iter().zip(config.rangers.iter());
        others.map(|(other, _)| other).any(|other| own.has_failed(other))
    }

    /// Odds that the ranges of a ranger are false, and not the pose or the map; zero of the only one.
    pub fn lying(&self, ranger: RangerId, config: &Config) -> f32 {
        if !config.rangers.are_several() {
            return 0.0;
        }
        let Some(own) = self.reliability.get(ranger.index()) else { return 0.0 };
        let others = self.reliability.iter().zip(config.rangers.iter());
        let others = others.filter(|(_, (other, _))| *other != ranger).map(|(other, _)| other);
        others.map(|other| own.lying_beside(other)).fold(0.0, at_least)
    }

    /// Probability that a ranger of several works, over the largest one, for the choice of a ping; 1 where it is to be tried.
    pub fn works(&self, ranger: RangerId, config: &Config, now: Instant) -> f32 {
        let own = self.reliability.get(ranger.index()).filter(|_| config.rangers.are_several());
        own.filter(|own| own.is_tried(now)).map_or(1.0, Reliability::works)
    }

    /// Whether a ranger is not to be tried at `now`, because it has failed.
    pub fn rests(&self, ranger: RangerId, config: &Config, now: Instant) -> bool {
        let is_tried = self.reliability.get(ranger.index()).is_some_and(|it| it.is_tried(now));
        is_tried && self.has_failed(ranger, config)
    }

    fn last_of(&self, ranger: RangerId) -> Option<LastPing> {
        *self.last.get(ranger.index())?
    }

    /// The slot of a ranger if the echo of the latest ping, of whichever ranger, has just arrived.
    pub fn slot(&self, ranger: RangerId, config: &Config, duration: &PingDuration) -> Slot {
        let own = self.last_of(ranger);
        let rest = |latest: LastPing| {
            if self.latest == ranger {
                return duration.rest_after(latest.range);
            }
            let sonars = config.rangers.get(ranger).zip(config.rangers.get(self.latest));
            let heard = sonars.filter(|(sonar, latest)| sonar.hears(latest));
            heard.map_or(0.0, |(_, other)| PingDuration::new(other).rest_after(latest.range))
        };
        Slot {
            bearing: own.map(|last| last.bearing),
            ready_in: self.last_of(self.latest).map_or(0.0, rest),
            wall: own.map(|last| last.wall),
        }
    }

    /// [`Entry::repetition`] of a wall.
    pub fn repetition(&self, wall: WallId) -> f32 {
        let recent = self.recent.iter().flatten().find(|recent| recent.wall == wall);
        let used_at = recent.and_then(|recent| recent.used_at);
        used_at.map_or(1.0, |used_at| repetition(self.odometer - used_at))
    }

    /// What is known of a wall with its foot at `foot` and at `range`.
    #[inline]
    pub fn entry(
        &self,
        parameters: &EchoParameters,
        ranger: RangerId,
        wall: WallId,
        foot: Metres,
        range: Metres,
        now: Instant,
    ) -> Entry {
        let prior = self.clutter.prior_occlusion(parameters, range);
        let place = WallPoint { wall, ranger, foot, prior };
        let is_same =
            |slot: &Option<RecentWall>| matches!(slot, Some(recent) if recent.wall == wall);
        let slot = self.recent.iter().position(is_same);
        let Some(recent) = slot.and_then(|slot| self.recent.get(slot)?.as_ref()) else {
            return Entry {
                slot: None,
                place,
                occlusion: prior,
                used_at: None,
                other: None,
                source: None,
                repetition: 1.0,
            };
        };
        let occlusion = between(prior + recent.above_prior(foot, now), 0.0, MAX_OCCLUSION);
        let since = recent.used_at.map(|used_at| self.odometer - used_at);
        let repetition = since.map_or(1.0, repetition);
        let own = recent.other.filter(|other| other.ranger == ranger);
        let source = own.map(|other| EchoSource {
            range: other.range,
            travelled: self.odometer - other.odometer,
            age: now.checked_duration_since(other.at).map_or(0.0, seconds),
        });
        let RecentWall { used_at, other, .. } = *recent;
        Entry { slot, place, used_at, other, occlusion, source, repetition }
    }

    /// Records that the wall of this entry is occluded with a probability of `occluded`, and what
    /// returned the echo.
    pub fn record_echo(&mut self, entry: &Entry, occluded: f32, echo: Origin, now: Instant) {
        let WallPoint { wall, ranger, foot, prior } = entry.place;
        let persistent = PERSISTENCE * entry.occlusion;
        let occluded = between(occluded, persistent, MAX_OCCLUSION);
        let (used_at, other) = match echo {
            Origin::Wall => (Some(self.odometer), entry.other),
            // An echo from elsewhere does not displace a source that is still near.
            Origin::Other(range) if entry.source.is_some_and(|source| source.hides(range)) => {
                (entry.used_at, entry.other)
            }
            Origin::Other(range) => {
                let other = OtherEcho { range, odometer: self.odometer, at: now, ranger };
                (entry.used_at, Some(other))
            }
            Origin::Silence => (entry.used_at, entry.other),
        };
        let slot = entry.slot.unwrap_or_else(|| {
            self.newest = (self.newest + 1) % RECENT_WALLS;
            self.newest
        });
        if let Some(slot) = self.recent.get_mut(slot) {
            *slot = Some(RecentWall {
                wall,
                foot,
                at: now,
                above_prior: occluded - prior,
                used_at,
                other,
            });
        }
    }
}
