//! How often the flash may be written, whatever commands arrive.
//!
//! A token bucket of [`BURST`] writes, which gains one every [`PERIOD`]. A write that finds it empty is
//! postponed; the newest state is written later. The worst rate of commands therefore wears the flash like
//! one write a minute (`docs/firmware.md` computes the years).
//!
//! One write is kept in reserve while the stored record is *parked*, for the record that must
//! replace it before the robot drives.
//!
//! Each record ends with the writes that were left after it and the number of all writes ([`Trailer`]), so that a robot that is
//! reset again and again does not begin with a full bucket each time.

use sonarfix::geometry::units::{Duration, Instant};

use crate::time::{after, since};

/// The most writes in a row: those of two hours. A robot that is switched on and off for short drives has used them up after
/// some fifty drives, and then stores its pose only after a minute of driving.
pub const BURST: u8 = 120;
/// Time in which one more is gained.
pub const PERIOD: Duration = Duration::from_ticks(60_000_000);

/// Length of a [`Trailer`], bytes.
pub const TRAILER: usize = 5;
/// The end of a record: the writes that are left, and the number of all writes as a little-endian `u32`.
pub type Trailer = [u8; TRAILER];

/// The bucket.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WriteLimit {
    writes: u8,
    /// When the last write was gained, or the bucket was full.
    since: Instant,
    /// The number of all writes, those of earlier runs included.
    total: u32,
}

impl WriteLimit {
    /// A full bucket.
    #[must_use]
    pub fn new(now: Instant) -> Self {
        Self { writes: BURST, since: now, total: 0 }
    }

    /// Continues from a record that was written in an earlier run: with no more writes than it left.
    pub fn resume(&mut self, trailer: Trailer) {
        let [writes, total @ ..] = trailer;
        self.writes = self.writes.min(writes);
        self.total = self.total.max(u32::from_le_bytes(total));
    }

    /// Counts a write, whether it succeeds or not, and returns the end of its record.
    pub fn count(&mut self) -> Trailer {
        self.total = self.total.saturating_add(1);
        let [a, b, c, d] = self.total.to_le_bytes();
        [self.writes, a, b, c, d]
    }

    /// The number of all writes, those of earlier runs included.
    #[must_use]
    pub fn total(&self) -> u32 {
        self.total
    }

    /// Continues after the clock was set to `now`.
    pub fn set_clock(&mut self, now: Instant) {
        self.since = now;
    }

    /// Takes one write, if `reserve` remain after it.
    pub fn take(&mut self, now: Instant, reserve: u8) -> bool {
        while self.writes < BURST && since(now, self.since) >= PERIOD {
            self.writes += 1;
            self.since = after(self.since, PERIOD);
        }
        if self.writes == BURST {
            self.since = now;
        }
        let is_permitted = self.writes > reserve;
        self.writes = self.writes.saturating_sub(u8::from(is_permitted));
        is_permitted
    }

    /// When a write is permitted next, if `reserve` are to remain after it.
    #[must_use]
    pub fn next(&self, reserve: u8) -> Instant {
        if self.writes > reserve { Instant::from_ticks(0) } else { after(self.since, PERIOD) }
    }
}
