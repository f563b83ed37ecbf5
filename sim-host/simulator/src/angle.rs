//! Angles in `f64`.

use std::f64::consts::{PI, TAU};

/// The equivalent angle in (−π, π].
#[must_use]
pub fn wrap(angle: f64) -> f64 {
    // Within a turn the remainder is the angle itself, without the division.
    let rest = if angle.abs() < TAU { angle } else { angle % TAU };
    let wrapped = if rest < 0.0 { rest + TAU } else { rest };
    if wrapped > PI { wrapped - TAU } else { wrapped }
}
