//! Periodic deadlines that stay on their grid, however late each is noticed.

use sonarfix::geometry::units::{Duration, Instant};

use crate::time::{after, since};

/// A deadline that was reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Deadline {
    /// When it was due.
    pub due: Instant,
    /// Deadlines that have passed since without being noticed; they are not made up for.
    pub skipped: u64,
}

/// Deadlines at a fixed period.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Schedule {
    next: Instant,
    period: Duration,
}

impl Schedule {
    /// Deadlines every `period`, the first one `period` after `start`.
    pub fn new(start: Instant, period: Duration) -> Self {
        Self { next: after(start, period), period }
    }

    /// The next deadline.
    pub fn next(&self) -> Instant {
        self.next
    }

    /// Keeps the next deadline and continues with another period; the next one is at the latest a
    /// `period` after `now`.
    pub fn continued(&self, now: Instant, period: Duration) -> Self {
        Self { next: self.next.min(after(now, period)), period }
    }

    /// The deadline that `now` has reached, if any. The following ones stay on the grid.
    pub fn take(&mut self, now: Instant) -> Option<Deadline> {
        if now < self.next {
            return None;
        }
        let due = self.next;
        let late = since(now, due).ticks();
        let skipped = late.checked_div(self.period.ticks()).unwrap_or(0);
        let steps = skipped.saturating_add(1);
        let ahead = self.period.ticks().saturating_mul(steps);
        self.next = after(due, Duration::from_ticks(ahead));
        Some(Deadline { due, skipped })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_late_deadline_is_taken_once_and_the_grid_stays() {
        let at = Instant::from_ticks;
        let mut schedule = Schedule::new(at(5), Duration::from_ticks(100));
        assert_eq!(schedule.take(at(104)), None);
        let deadline = |due, skipped| Some(Deadline { due: at(due), skipped });
        assert_eq!(schedule.take(at(105)), deadline(105, 0));
        assert_eq!(schedule.take(at(105)), None);
        assert_eq!(schedule.take(at(304)), deadline(205, 0));
        assert_eq!(schedule.take(at(605)), deadline(305, 3));
        assert_eq!(schedule.take(at(704)), None);
        assert_eq!(schedule.take(at(705)), deadline(705, 0));
    }
}
