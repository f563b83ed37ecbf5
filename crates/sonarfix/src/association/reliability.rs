//! Whether a ranger works: the odds that it has failed, from what its pings returned.
//!
//! A ranger works, or it is silent (dead, or its line is stuck), or it returns ranges of nothing. Each ping multiplies the odds of
//! either failure by its likelihood ratio. A robot with several rangers measures with those that work, and tries a failed one
//! every [`PROBE_PERIOD`], and again at once if its echo is explained.
//!
//! # Non-finite policy
//! The odds are limited, and each likelihood is at least [`LEAST_SHARE`], so that the quotients are finite.

use crate::geometry::numeric::{at_least, at_most};
use crate::geometry::units::{Duration, Instant};

/// The odds of a failure before the first ping, and the least ones: the ranger can fail at any time.
const LEAST_ODDS: f32 = 0.01;
/// The largest odds of silence: four explained echoes end them.
const MOST_SILENT: f32 = 1_000.0;
/// The largest odds of false ranges. A flat object before the wall looks alike, so that they stay below those of silence.
const MOST_FALSE: f32 = 200.0;
/// The odds above which a ranger counts as failed: a probability of 99 %.
const FAILED: f32 = 99.0;
/// The time after which a failed ranger is tried again: at one ping a second one in 25 is lost to it.
const PROBE_PERIOD: Duration = Duration::from_ticks(25_000_000);
/// What a silent ranger returns, by its shares. An echo may be cross-talk of another one.
const OF_SILENT: Shares = Shares { silent: 0.94, unexplained: 0.05, explained: 0.01 };
/// What a ranger with false ranges returns. A range may fit by chance.
const OF_FALSE: Shares = Shares { silent: 0.05, unexplained: 0.85, explained: 0.1 };
/// The least share of what a ranger that works returns: of people that stand around the robot.
const LEAST_SHARE: f32 = 0.05;

/// Probabilities of what a ping returns.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shares {
    /// No echo.
    pub silent: f32,
    /// An echo that is not of the target.
    pub unexplained: f32,
    /// The echo of the target, or again of an object that returned one before.
    pub explained: f32,
}

impl Shares {
    /// Of a ranger that works, whose target answers with the probability `explained` and is silent with `silent`.
    pub fn working(explained: f32, silent: f32) -> Self {
        Self { explained, silent, unexplained: 1.0 - explained - silent }
    }

    fn of(&self, returned: Returned) -> f32 {
        match returned {
            Returned::Silence => self.silent,
            Returned::Unexplained => self.unexplained,
            Returned::Explained => self.explained,
        }
    }
}

/// What a ping returned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Returned {
    Silence,
    Unexplained,
    Explained,
}

/// The reliability of one ranger.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reliability {
    /// Odds that it is silent.
    silent: f32,
    /// Odds that its ranges are false.
    false_ranges: f32,
    /// The time of its latest ping that was not explained.
    missed: Instant,
}

impl Default for Reliability {
    fn default() -> Self {
        let missed = Instant::from_ticks(0);
        Self { silent: LEAST_ODDS, false_ranges: LEAST_ODDS, missed }
    }
}

impl Reliability {
    /// Takes what a ping returned, which a ranger that works returns with these shares.
    pub fn record(&mut self, returned: Returned, working: &Shares, now: Instant) {
        let works = at_least(working.of(returned), LEAST_SHARE);
        let updated = |odds: f32, failed: &Shares, most: f32| {
            at_most(at_least(odds * failed.of(returned) / works, LEAST_ODDS), most)
        };
        self.silent = updated(self.silent, &OF_SILENT, MOST_SILENT);
        self.false_ranges = updated(self.false_ranges, &OF_FALSE, MOST_FALSE);
        if returned != Returned::Explained {
            self.missed = now;
        }
    }

    /// The odds that its ranges are false. Where those of another one do not fit either, the pose is wrong or the map.
    pub fn lying_beside(&self, other: &Self) -> f32 {
        self.false_ranges * LEAST_ODDS / other.failed()
    }

    /// The odds of its more probable failure.
    fn failed(&self) -> f32 {
        at_least(self.silent, self.false_ranges)
    }

    /// Whether it has probably failed, and more probably than another one.
    pub fn has_failed(&self, other: &Self) -> bool {
        self.failed() > FAILED && self.failed() > other.failed()
    }

    /// Whether its latest unexplained ping was so short ago that a failed one is not tried at `now`.
    pub fn is_tried(&self, now: Instant) -> bool {
        let since = now.checked_duration_since(self.missed);
        since.is_none_or(|since| since < PROBE_PERIOD)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn at(seconds: u64) -> Instant {
        Instant::from_ticks(1_000_000 * seconds)
    }

    proptest! {
        /// A ranger that returns nothing, or nothing that fits, is noticed within twelve pings at walls that answer; one that
        /// works again within five.
        #[test]
        fn a_failure_and_its_end_are_noticed(
            explained in 0.75_f32..0.9, silent in 0.02_f32..0.08, is_silent in any::<bool>(), before in 0_usize..50,
        ) {
            let working = Shares::working(explained, silent);
            let wrong = if is_silent { Returned::Silence } else { Returned::Unexplained };
            let mut ranger = Reliability::default();
            for _ in 0..before {
                ranger.record(Returned::Explained, &working, at(1));
                prop_assert!(!ranger.has_failed(&Reliability::default()));
            }
            let noticed = (1..=12).find(|_| { ranger.record(wrong, &working, at(2)); ranger.has_failed(&Reliability::default()) });
            prop_assert!(noticed.is_some_and(|pings| pings >= 2), "{noticed:?}");
            prop_assert!(ranger.is_tried(at(2)) && ranger.is_tried(at(26)) && !ranger.is_tried(at(27)));
            prop_assert!(!ranger.has_failed(&ranger), "none is better than itself");
            let works = (1..=5).find(|_| { ranger.record(Returned::Explained, &working, at(28)); !ranger.has_failed(&Reliability::default()) });
            prop_assert!(works.is_some());
        }

        /// Half of the pings may be unexplained, as among furniture, without a failure.
        #[test]
        fn furniture_is_no_failure(explained in 0.6_f32..0.8, pings in 1_usize..200) {
            let working = Shares::working(explained, 0.08);
            let mut ranger = Reliability::default();
            for ping in 0..pings {
                let returned = if ping % 2 == 0 { Returned::Unexplained } else { Returned::Explained };
                ranger.record(returned, &working, at(1));
                prop_assert!(!ranger.has_failed(&Reliability::default()), "{ping}");
            }
        }
    }
}
