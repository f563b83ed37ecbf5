//! Angles in `f64`.

use std::f64::consts::{PI, TAU};

/// The equivalent angle in (−π, π].
#[must_use]
pub fn wrap(angle: f64) -> f64 {
    let wrapped = angle.rem_euclid(TAU);
    if wrapped > PI { wrapped - TAU } else { wrapped }
}
