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
/// The largest odds: two explained echoes bring them below [`FAILED`].
const MOST_ODDS: f32 = 1_000.0;
/// The odds above which a ranger counts as failed: a probability of 99 %.
const FAILED: f32 = 99.0;
/// The time after which a failed ranger is tried again: at one ping a second one in 25 is lost to it.
const PROBE_PERIOD: Duration = Duration::from_ticks(25_000_000);
/// Probability that a silent ranger returns an echo: cross-talk of another one.
const ECHO_OF_SILENT: f32 = 0.06;
/// Probability that a ranger with false ranges returns one that is not too long or too short.
const ECHO_OF_FALSE: f32 = 0.7;
/// The least probability of what a ranger that works returns: of people that stand around the robot.
const LEAST_SHARE: f32 = 0.05;

/// What a ping returned, as the likelihoods of a ranger that works, a silent one and one with false ranges.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Returned {
    works: f32,
    silent: f32,
    false_range: f32,
    is_explained: bool,
}

impl Returned {
    /// An echo, with its density for a ranger that works, and that of any range, 1/m.
    pub fn echo(works: f32, anywhere: f32, is_explained: bool) -> Self {
        Self {
            works: at_least(works, LEAST_SHARE * anywhere),
            silent: ECHO_OF_SILENT * anywhere,
            false_range: ECHO_OF_FALSE * anywhere,
            is_explained,
        }
    }

    /// No echo, with its probability for a ranger that works.
    pub fn silence(works: f32) -> Self {
        Self {
            works: at_least(works, LEAST_SHARE),
            silent: 1.0 - ECHO_OF_SILENT,
            false_range: 1.0 - ECHO_OF_FALSE,
            is_explained: false,
        }
    }
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
    /// Takes what a ping returned.
    pub fn record(&mut self, returned: &Returned, now: Instant) {
        let updated = |odds: f32, failed: f32| {
            at_most(at_least(odds * failed / returned.works, LEAST_ODDS), MOST_ODDS)
        };
        self.silent = updated(self.silent, returned.silent);
        self.false_ranges = updated(self.false_ranges, returned.false_range);
        if !returned.is_explained {
            self.missed = now;
        }
    }

    /// The odds that its ranges are false. Where those of another one do not fit either, the pose is wrong or the map, unless
    /// this one has failed before.
    pub fn lying_beside(&self, other: &Self) -> f32 {
        if self.has_failed(other) {
            return self.failed();
        }
        self.false_ranges * LEAST_ODDS / other.failed()
    }

    /// The odds of its more probable failure.
    fn failed(&self) -> f32 {
        at_least(self.silent, self.false_ranges)
    }

    /// Probability that it works, over the largest one.
    pub fn works(&self) -> f32 {
        (1.0 + LEAST_ODDS) / (1.0 + self.failed())
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

    /// One over the difference of the limits of the sonar, 1/m.
    const ANYWHERE: f32 = 0.25;

    /// The echo of the target, with a density of a deviation of some centimetres.
    fn explained(density: f32) -> Returned {
        Returned::echo(density, ANYWHERE, true)
    }

    /// Bayes' rule by hand: no echo is 0.94 of a silent ranger and 0.3 of one with false ranges.
    #[test]
    fn no_echo_multiplies_the_odds_by_the_ratio_of_its_probabilities() {
        let mut ranger = Reliability::default();
        for (works, silent, false_ranges) in [(0.1, 0.094, 0.03), (0.5, 0.17672, 0.018)] {
            ranger.record(&Returned::silence(works), at(1));
            assert!((ranger.silent / silent - 1.0).abs() < 1e-5, "{ranger:?}");
            assert!((ranger.false_ranges / false_ranges - 1.0).abs() < 1e-5, "{ranger:?}");
        }
        // However improbable no echo is, the odds grow by no more than a factor of 1/0.05.
        ranger.record(&Returned::silence(0.0), at(1));
        assert!((ranger.silent / (0.17672 * 0.94 / 0.05) - 1.0).abs() < 1e-5, "{ranger:?}");
        assert_eq!(ranger.missed, at(1));
    }

    proptest! {
        /// A ranger that returns nothing, or nothing that fits, is noticed within twelve pings at walls that answer; one that
        /// works again within five.
        #[test]
        fn a_failure_and_its_end_are_noticed(
            density in 4.0_f32..100.0, missed in 0.02_f32..0.1, is_silent in any::<bool>(), before in 0_usize..50,
        ) {
            let wrong =
                if is_silent { Returned::silence(missed) } else { Returned::echo(missed * ANYWHERE, ANYWHERE, false) };
            let mut ranger = Reliability::default();
            for _ in 0..before {
                ranger.record(&explained(density), at(1));
                prop_assert!(!ranger.has_failed(&Reliability::default()));
            }
            let works = ranger.works();
            let noticed = (1..=12).find(|_| { ranger.record(&wrong, at(2)); ranger.has_failed(&Reliability::default()) });
            prop_assert!(noticed.is_some_and(|pings| pings >= 2), "{noticed:?}");
            prop_assert!(works > 0.98 && ranger.works() < 0.02);
            prop_assert!(ranger.is_tried(at(2)) && ranger.is_tried(at(26)) && !ranger.is_tried(at(27)));
            prop_assert!(!ranger.has_failed(&ranger), "none is better than itself");
            let works = (1..=5).find(|_| { ranger.record(&explained(density), at(28)); !ranger.has_failed(&Reliability::default()) });
            prop_assert!(works.is_some());
        }

        /// Half of the pings may be unexplained, as among furniture, without a failure.
        #[test]
        fn furniture_is_no_failure(density in 4.0_f32..100.0, missed in 0.05_f32..0.2, pings in 1_usize..200) {
            let unexplained = Returned::echo(missed * ANYWHERE, ANYWHERE, false);
            let mut ranger = Reliability::default();
            for ping in 0..pings {
                let returned = if ping % 2 == 0 { unexplained } else { explained(density) };
                ranger.record(&returned, at(1));
                prop_assert!(!ranger.has_failed(&Reliability::default()), "{ping}");
            }
        }
    }
}
