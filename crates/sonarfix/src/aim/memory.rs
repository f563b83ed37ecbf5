//! What aiming remembers from look to look: where the sonar pointed, how the robot turns, and
//! which walls did not answer as they should.
//!
//! A wall that keeps failing has something before it that the map does not know. It is believed
//! less from thereabouts, and believed again as the robot passes on and time goes by.
//!
//! # Non-finite policy
//! Bearing, range and foot come from a finite state. A wall far beyond any reach is believed in full:
//! the square of its way may be infinite, and a doubt divided by that is none.

use crate::map::WallId;
use crate::units::{Instant, Metres, Radians};

use super::timing::seconds;

/// How many failing walls are remembered; one more takes the place of the most believed.
const FAILURES: usize = 8;
/// What is left of the belief in a wall after a range that is not its own.
const AFTER_WRONG: f32 = 0.2;
/// And after no echo, which is more often chance (a sonar misses some), or a range that may be its
/// own.
const AFTER_DOUBTFUL: f32 = 0.5;
/// What is left of the doubt after a range of its own: at the end of a cupboard one may be right by
/// chance, or half of it an echo off the edge.
const AFTER_RIGHT: f32 = 0.3;
/// A doubt below this is none.
const NEGLIGIBLE: f32 = 0.05;
/// The least that is left: a wall that is the only one is looked at, however often it fails.
const LEAST: f32 = 0.02;
/// How far along the wall the foot must move for the doubt to be halved: half the width of a
/// chair.
const HALVED_WITHIN: Metres = Metres(0.25);
/// The time in which it is halved if the foot stays: people and chairs move on.
const HALVED_AFTER: f32 = 5.0;

/// Time over which the turn rate is averaged, seconds: a single step between two close instants
/// counts in whole encoder ticks.
const TURNING: f32 = 0.05;

/// A wall's bad answer.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Failure {
    wall: WallId,
    /// Where the foot was.
    foot: Metres,
    at: Instant,
    /// One less the belief that was left then.
    doubt: f32,
}

impl Failure {
    fn doubt_at(&self, foot: Metres, now: Instant) -> f32 {
        let away = (foot - self.foot).0 / HALVED_WITHIN.0;
        let since = now.checked_duration_since(self.at).map_or(0.0, seconds);
        self.doubt / ((1.0 + away * away) * (1.0 + since / HALVED_AFTER))
    }
}

/// The look before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Last {
    pub wall: WallId,
    pub bearing: Radians,
    pub range: Metres,
}

/// How a look ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Answer {
    /// The wall's own range.
    Right,
    /// Another.
    Wrong,
    /// None, or one that may be another's.
    Doubtful,
    /// One that says nothing of what stands before the wall.
    Unknown,
}

/// The memory.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Memory {
    pub(super) last: Option<Last>,
    /// Radians per second.
    pub(super) turn_rate: f32,
    failures: [Option<Failure>; FAILURES],
}

impl Memory {
    /// The robot turned, over so many seconds.
    pub fn turned(&mut self, turn: Radians, seconds: f32) {
        self.turn_rate = (self.turn_rate * TURNING + turn.0) / (TURNING + seconds);
    }

    /// A look is over: at a wall whose foot is at `foot`, with the sonar at `bearing`.
    pub fn looked(
        &mut self,
        (wall, foot): (WallId, Metres),
        (bearing, range): (Radians, Metres),
        answer: Answer,
        now: Instant,
    ) {
        self.last = Some(Last { wall, bearing, range });
        let before = self.belief(wall, foot, now);
        let doubt = match answer {
            Answer::Unknown => return,
            Answer::Right => AFTER_RIGHT * (1.0 - before),
            Answer::Wrong => 1.0 - AFTER_WRONG * before,
            Answer::Doubtful => 1.0 - AFTER_DOUBTFUL * before,
        };
        let most = 1.0 - LEAST;
        let doubt = if doubt < most { doubt } else { most };
        self.forget(wall);
        if doubt > NEGLIGIBLE
            && let Some(slot) = self.least_doubted(now)
        {
            *slot = Some(Failure { wall, foot, at: now, doubt });
        }
    }

    /// How much a wall is believed to answer, its foot at `foot`: 1 if nothing speaks against it.
    pub fn belief(&self, wall: WallId, foot: Metres, now: Instant) -> f32 {
        let failure = self.failures.iter().flatten().find(|failure| failure.wall == wall);
        1.0 - failure.map_or(0.0, |failure| failure.doubt_at(foot, now))
    }

    fn forget(&mut self, wall: WallId) {
        for slot in &mut self.failures {
            if slot.is_some_and(|failure| failure.wall == wall) {
                *slot = None;
            }
        }
    }

    /// A free slot, or the one whose failure matters least by now.
    fn least_doubted(&mut self, now: Instant) -> Option<&mut Option<Failure>> {
        let doubt = |slot: &Option<Failure>| {
            slot.map_or(-1.0, |failure| failure.doubt_at(failure.foot, now))
        };
        self.failures.iter_mut().reduce(|a, b| if doubt(b) < doubt(a) { b } else { a })
    }
}
