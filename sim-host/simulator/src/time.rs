//! Seconds and microseconds.

/// Seconds as whole microseconds.
#[must_use]
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a run's length is positive and far below 2^63 µs"
)]
pub fn micros(seconds: f64) -> u64 {
    (seconds * 1e6).round() as u64
}

/// Microseconds as seconds.
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "exact below 2^53 µs, 285 years")]
pub fn seconds(micros: u64) -> f64 {
    micros as f64 * 1e-6
}
