//! When a board feeds its watchdog.
//!
//! A watchdog stops the motors of a program that hangs, so its window must be short: at most 250 ms from the last pass of
//! the loop to the reset. A board therefore polls at least every [`POLL_AT_LEAST_EVERY`], and feeds it once in each pass, after
//! the poll and the motor code, if [`Liveness::is_alive`]. A loop that passes and meets no deadline is not fed either.

use sonarfix::geometry::units::{Duration, Instant};

use crate::Polled;
use crate::time::since;

/// The longest time between two polls of a board.
///
/// It leaves the loop 30 ms in the shortest window of any board: that of an STM32 whose oscillator is as fast as its data sheet
/// permits, 82 ms.
pub const POLL_AT_LEAST_EVERY: Duration = Duration::from_ticks(50_000);

/// The longest time without a met deadline: more than the longest encoder period (1 s), the wait for a ping, and the erasure
/// of a sector of flash (at most 0.5 s).
pub const PATIENCE: Duration = Duration::from_ticks(2_000_000);

/// Whether the loop meets its deadlines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Liveness {
    /// When a deadline was last met.
    met: Instant,
}

impl Liveness {
    /// Begins at `now` as if a deadline had been met.
    #[must_use]
    pub const fn new(now: Instant) -> Self {
        Self { met: now }
    }

    /// Whether the watchdog is fed after the poll at `now`: a deadline was met within [`PATIENCE`].
    pub fn is_alive(&mut self, now: Instant, polled: &Polled) -> bool {
        // After a clock that was set back the last deadline would lie in the future.
        if polled.is_on_time || now < self.met {
            self.met = now;
        }
        since(now, self.met) <= PATIENCE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn at(ms: u64) -> Instant {
        Instant::from_ticks(1_000 * ms)
    }

    #[test]
    fn a_loop_without_a_met_deadline_is_not_alive_for_long() {
        let (met, missed) = (Polled { is_on_time: true, ..Polled::default() }, Polled::default());
        let mut liveness = Liveness::new(at(0));
        assert!(liveness.is_alive(at(2_000), &missed));
        assert!(!liveness.is_alive(at(2_001), &missed));
        assert!(liveness.is_alive(at(2_500), &met));
        assert!(liveness.is_alive(at(4_500), &missed));
        assert!(!liveness.is_alive(at(4_501), &missed));
    }

    #[test]
    fn a_clock_that_is_set_back_prolongs_nothing() {
        let missed = Polled::default();
        let mut liveness = Liveness::new(at(1_000_000));
        assert!(liveness.is_alive(at(10), &missed));
        assert!(!liveness.is_alive(at(2_011), &missed));
    }
}
