//! Whether the time of a poll can be right.
//!
//! A counter that is extended in software may be read torn, in the middle of a carry: one reading is then wrong by 2¹⁶ or 2³² of
//! its counts, and the next one is right. A clock that was set, or a board that slept, stays at its new time. The time of a poll
//! that leaps is therefore not used until the next poll confirms it.

use sonarfix::geometry::units::{Duration, Instant};

use crate::time::since;

/// The longest time between two polls that is not a leap: an erase of the largest sector of flash takes 2 to 4 s.
const LEAP_AHEAD: Duration = Duration::from_ticks(10_000_000);
/// The longest step back that the clock makes up for by itself; [`Robot`](sonarfix_hal::robot::Robot) waits for it.
const LEAP_BACK: Duration = Duration::from_ticks(500_000);
/// The longest time between a leap and the poll that confirms it.
const CONFIRMED_WITHIN: Duration = Duration::from_ticks(500_000);

/// What the time of a poll is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Reading {
    /// That of a clock that runs, or has leapt ahead.
    Usual,
    /// A leap that no other poll has confirmed.
    Unconfirmed,
    /// Another leap instead of a confirmation.
    Erratic,
    /// The clock has been set back.
    SetBack,
}

/// The times of the latest polls.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clock {
    latest: Instant,
    leapt_to: Option<Instant>,
}

impl Clock {
    pub fn new(now: Instant) -> Self {
        Self { latest: now, leapt_to: None }
    }

    /// Takes the time of a poll.
    pub fn read(&mut self, now: Instant) -> Reading {
        let is_back = since(self.latest, now) > LEAP_BACK;
        if !is_back && since(now, self.latest) <= LEAP_AHEAD {
            self.latest = self.latest.max(now);
            self.leapt_to = None;
            return Reading::Usual;
        }
        let is_confirmed = self
            .leapt_to
            .is_some_and(|leapt_to| now >= leapt_to && since(now, leapt_to) <= CONFIRMED_WITHIN);
        if !is_confirmed {
            let is_first = self.leapt_to.replace(now).is_none();
            return if is_first { Reading::Unconfirmed } else { Reading::Erratic };
        }
        *self = Self::new(now);
        if is_back { Reading::SetBack } else { Reading::Usual }
    }
}
