//! When a fault is active.

/// A fault with its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Timed<T> {
    pub what: T,
    /// Start, µs.
    pub from: u64,
    /// End, µs.
    pub to: u64,
}

impl<T> Timed<T> {
    /// Whether it is on at a time, µs.
    pub fn is_on(&self, now: u64) -> bool {
        (self.from..self.to).contains(&now)
    }
}
