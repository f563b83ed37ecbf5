//! Arithmetic of instants that cannot panic: `fugit`'s operators do on overflow, these saturate.
//!
//! # Non-finite policy
//! Times are integers.

use sonarfix::geometry::units::{Duration, Instant};

/// An instant that is not reached. Not the greatest one: `fugit` compares instants as those of a counter that wraps around, by
/// which the greatest is before the first.
pub(crate) const NEVER: Instant = Instant::from_ticks(u64::MAX / 4);

/// An instant that has passed.
pub(crate) const AT_ONCE: Instant = Instant::from_ticks(0);

/// The time from `then` to `now`; zero if `then` is later.
pub(crate) fn since(now: Instant, then: Instant) -> Duration {
    now.checked_duration_since(then).unwrap_or(Duration::from_ticks(0))
}

/// The instant `span` after `instant`; an instant that is not reached on overflow.
pub(crate) fn after(instant: Instant, span: Duration) -> Instant {
    instant.checked_add_duration(span).unwrap_or(NEVER)
}

/// The instant `span` before `instant`, which may be one before the clock's zero: instants wrap around.
pub(crate) fn before(instant: Instant, span: Duration) -> Instant {
    instant.checked_sub_duration(span).unwrap_or(instant)
}

/// Microseconds as a float. Exact below 16 s, which no time of flight, pulse or servo turn reaches.
#[expect(clippy::cast_precision_loss, reason = "exact for the spans it is used on")]
pub(crate) fn micros(span: Duration) -> f32 {
    span.ticks() as f32
}
