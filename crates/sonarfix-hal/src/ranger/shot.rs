//! A ranger that makes one range at a time: when it was started, and when it may be started again.

use sonarfix::geometry::units::{Duration, Instant};

use crate::time::{after, since};

/// The range in flight, and the pause after it.
#[derive(Debug)]
pub(super) struct Shot {
    /// Least time from start to start.
    pub cycle: Duration,
    started: Option<Instant>,
    in_flight: bool,
}

impl Shot {
    /// Before the first start.
    pub const fn new(cycle: Duration) -> Self {
        Self { cycle, started: None, in_flight: false }
    }

    /// When the next one may be started.
    pub fn ready_at(&self) -> Instant {
        self.started.map_or(Instant::from_ticks(0), |at| after(at, self.cycle))
    }

    /// Whether the next one may be started at `now`. One that is no longer polled blocks it no longer than `give_up`.
    pub fn may_start(&self, now: Instant, give_up: Duration) -> bool {
        let age = since(now, self.started.unwrap_or(now));
        !(self.in_flight && age < give_up) && now >= self.ready_at()
    }

    /// One was started.
    pub fn start(&mut self, now: Instant) {
        self.started = Some(now);
        self.in_flight = true;
    }

    /// When the range in flight was started.
    pub fn in_flight_since(&self) -> Option<Instant> {
        self.started.filter(|_| self.in_flight)
    }

    /// The clock was set back to `now`: the last one counts as started now.
    pub fn set_clock(&mut self, now: Instant) {
        self.started = self.started.map(|_| now);
    }

    /// The range in flight has ended.
    pub fn end(&mut self) {
        self.in_flight = false;
    }
}

/// A timeout of so many macro periods of the laser, as ST's rangers store it: one more than mantissa · 2^exponent.
pub(super) const fn encoded(periods: u32) -> u16 {
    let (mut mantissa, mut exponent) = (periods.saturating_sub(1), 0_u16);
    while mantissa > 0xFF {
        mantissa >>= 1;
        exponent += 1;
    }
    #[expect(clippy::cast_possible_truncation, reason = "at most 0xFF")]
    let mantissa = mantissa as u16;
    exponent << 8 | mantissa
}
