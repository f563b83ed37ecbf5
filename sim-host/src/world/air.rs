//! The air that the sound really crosses.

/// Speed of sound, m/s, in dry air of so many degrees Celsius: 331.3 + 0.606 T, as in
/// `docs/model.md`, but here it is the truth.
#[must_use]
pub fn speed_of_sound(celsius: f64) -> f64 {
    331.3 + 0.606 * celsius
}
