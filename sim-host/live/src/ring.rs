//! The latest events, for any number of readers, in bounded memory.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use sonarfix_telemetry::feed::Events;

/// Most bytes of events: about a quarter of an hour at ten ticks a second.
pub const CAPACITY: usize = 8 << 20;

/// Most events of one [`Batch`].
const MOST_AT_ONCE: usize = 512;

/// Events in order, numbered from 0. At the capacity the oldest are dropped; a reader that was too slow learns how many it has
/// missed.
#[derive(Debug, Default)]
pub struct Ring {
    events: Mutex<Kept>,
    arrived: Condvar,
}

#[derive(Debug, Default)]
struct Kept {
    lines: VecDeque<Arc<str>>,
    bytes: usize,
    /// Number of the first line.
    first: u64,
    is_closed: bool,
}

/// The next events of a reader.
#[derive(Debug, Default)]
pub struct Batch {
    /// How many events were dropped before these.
    pub missed: u64,
    /// The events; empty after a time-out and at the end.
    pub lines: Vec<Arc<str>>,
    /// The number of the event after these.
    pub next: u64,
    /// Whether there will be no more.
    pub is_end: bool,
}

impl Events for Ring {
    fn push(&self, line: &str) {
        let mut events = self.lock();
        events.bytes += line.len();
        events.lines.push_back(line.into());
        while events.bytes > CAPACITY {
            let Some(oldest) = events.lines.pop_front() else { break };
            events.bytes -= oldest.len();
            events.first += 1;
        }
        drop(events);
        self.arrived.notify_all();
    }

    fn close(&self) {
        self.lock().is_closed = true;
        self.arrived.notify_all();
    }
}

impl Ring {
    /// The bytes of all events.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.lock().bytes
    }

    /// The events from number `from` on; waits for one.
    #[must_use]
    pub fn next(&self, from: u64, patience: Duration) -> Batch {
        let events = self.lock();
        let is_waiting =
            |events: &mut Kept| !events.is_closed && from >= events.first + events.count();
        let waited = self.arrived.wait_timeout_while(events, patience, is_waiting);
        let (events, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let start = from.max(events.first);
        let skipped = usize::try_from(start - events.first).unwrap_or(usize::MAX);
        let lines: Vec<_> = events.lines.iter().skip(skipped).take(MOST_AT_ONCE).cloned().collect();
        let next = start + lines.len() as u64;
        let is_end = events.is_closed && next >= events.first + events.count();
        Batch { missed: start - from, lines, next, is_end }
    }

    fn lock(&self) -> MutexGuard<'_, Kept> {
        // An event is complete or absent, also after a panic of another thread.
        self.events.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Kept {
    fn count(&self) -> u64 {
        self.lines.len() as u64
    }
}
