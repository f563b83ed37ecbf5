//! The true air temperature and speed of sound.

/// Speed of sound, m/s, in dry air at a temperature in °C: 331.3 + 0.606 T, as in `docs/model.md`.
#[must_use]
pub fn speed_of_sound(celsius: f64) -> f64 {
    331.3 + 0.606 * celsius
}
