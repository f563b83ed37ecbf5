//! Dots on the time line, a period apart, whatever the delay with which each is noticed.

use sonarfix::units::{Duration, Instant};

use crate::time::{after, since};

/// A dot that was reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Dot {
    /// When it should have been noticed.
    pub due: Instant,
    /// Dots that have gone by since without being noticed; they are not made up for.
    pub skipped: u64,
}

/// The dots.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Schedule {
    next: Instant,
    period: Duration,
}

impl Schedule {
    /// Dots every `period`, the first one `period` after `start`.
    pub fn new(start: Instant, period: Duration) -> Self {
        Self { next: after(start, period), period }
    }

    pub fn next(&self) -> Instant {
        self.next
    }

    /// The dot that `now` has reached, if any. The next stays on the grid.
    pub fn take(&mut self, now: Instant) -> Option<Dot> {
        if now < self.next {
            return None;
        }
        let due = self.next;
        let late = since(now, due).ticks();
        let skipped = late.checked_div(self.period.ticks()).unwrap_or(0);
        let steps = skipped.saturating_add(1);
        let ahead = self.period.ticks().saturating_mul(steps);
        self.next = after(due, Duration::from_ticks(ahead));
        Some(Dot { due, skipped })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_late_dot_is_taken_once_and_the_grid_stays() {
        let at = Instant::from_ticks;
        let mut schedule = Schedule::new(at(5), Duration::from_ticks(100));
        assert_eq!(schedule.take(at(104)), None);
        let dot = |due, skipped| Some(Dot { due: at(due), skipped });
        assert_eq!(schedule.take(at(105)), dot(105, 0));
        assert_eq!(schedule.take(at(105)), None);
        assert_eq!(schedule.take(at(304)), dot(205, 0));
        assert_eq!(schedule.take(at(605)), dot(305, 3));
        assert_eq!(schedule.take(at(704)), None);
        assert_eq!(schedule.take(at(705)), dot(705, 0));
    }
}
