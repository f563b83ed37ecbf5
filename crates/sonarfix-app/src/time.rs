//! Arithmetic of instants that cannot panic: `fugit`'s operators do on overflow, these saturate.

use sonarfix::geometry::units::{Duration, Instant};

/// An instant that is not reached. `fugit` compares instants as those of a counter that wraps around.
pub(crate) const NEVER: Instant = Instant::from_ticks(u64::MAX / 4);

/// The time from `then` to `now`; zero if `then` is in the future.
pub(crate) fn since(now: Instant, then: Instant) -> Duration {
    now.checked_duration_since(then).unwrap_or(Duration::from_ticks(0))
}

/// The instant `span` after `instant`; [`NEVER`] on overflow.
pub(crate) fn after(instant: Instant, span: Duration) -> Instant {
    instant.checked_add_duration(span).unwrap_or(NEVER)
}

/// The instant `span` before `instant`, which may be one before the clock's zero: instants wrap around.
pub(crate) fn before(instant: Instant, span: Duration) -> Instant {
    instant.checked_sub_duration(span).unwrap_or(instant)
}
