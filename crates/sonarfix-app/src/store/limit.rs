//! How often the flash may be written, whatever commands arrive.
//!
//! A token bucket of [`BURST`] writes, which gains one every [`PERIOD`]. A write that finds it empty is
//! postponed; the newest state is written later. The worst rate of commands therefore wears the flash like
//! one write a minute (`docs/firmware.md` computes the years).
//!
//! One write is kept in reserve while the stored record is *parked*, for the record that must
//! replace it before the robot drives.

use sonarfix::geometry::units::{Duration, Instant};

use crate::time::{after, since};

/// The most writes in a row.
pub const BURST: u8 = 8;
/// Time in which one more is gained.
pub const PERIOD: Duration = Duration::from_ticks(60_000_000);

/// The bucket.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WriteLimit {
    writes: u8,
    /// When the last write was gained, or the bucket was full.
    since: Instant,
}

impl WriteLimit {
    /// A full bucket.
    #[must_use]
    pub fn new(now: Instant) -> Self {
        Self { writes: BURST, since: now }
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
