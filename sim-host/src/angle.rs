//! Angles in `f64`, for the PC's side.

use std::f64::consts::{PI, TAU};

/// The same direction in (−π, π].
#[must_use]
pub fn wrap(angle: f64) -> f64 {
    let wrapped = angle.rem_euclid(TAU);
    if wrapped > PI { wrapped - TAU } else { wrapped }
}
