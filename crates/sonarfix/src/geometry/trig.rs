//! Sine and cosine in `f32`, with the same bits on every target.
//!
//! `libm::sincosf` computes in `f64`, which a Cortex-M4F emulates in software: about 2,100
//! instructions, several times a prediction of the filter. This implementation reduces the angle to
//! ±π/4 with π/2 split in three parts (Cody and Waite), and evaluates the minimax polynomials of Cephes
//! (`sinf.c`, S. L. Moshier).
//!
//! # Non-finite policy
//! Sine and cosine of NaN and of infinity are NaN.

use crate::geometry::units::Radians;

/// Largest |angle| for which the error bound holds; a wrapped heading plus a bearing is far below it.
///
/// A larger angle is wrapped first, with 2π as an `f32`. The relative error of that 2π is 2.8e-8, less
/// than the rounding error of the angle (6e-8), so the wrapping adds no significant error.
pub const RANGE: Radians = Radians(100.0);

/// π/2 in three parts. The first two have at most 11 significant bits, so that their products with a
/// quadrant number are exact.
const HALF_PI_HIGH: f32 = 1.570_312_5;
const HALF_PI_MIDDLE: f32 = 4.837_513e-4;
const HALF_PI_LOW: f32 = 7.549_79e-8;

/// 1.5·2²³: the spacing of `f32` at this value is 1.
const SHIFT: f32 = 12_582_912.0;

/// Sine and cosine of an angle, within 1e-7 of the true values for |angle| ≤ [`RANGE`]
/// (measured: 7.7e-8).
///
/// # Panics
/// Never.
///
/// ```
/// use sonarfix::geometry::trig::sin_cos;
/// use sonarfix::geometry::units::Radians;
/// let (sin, cos) = sin_cos(Radians::from_degrees(30.0));
/// assert!((sin - 0.5).abs() < 1e-7 && (cos - 0.866_025_4).abs() < 1e-7);
/// ```
#[must_use]
pub fn sin_cos(angle: Radians) -> (f32, f32) {
    sin_cos_within(if angle.abs() <= RANGE { angle.0 } else { less_turns(angle.0) })
}

/// A huge angle less its whole turns.
#[cold]
#[inline(never)]
fn less_turns(angle: f32) -> f32 {
    libm::remainderf(angle, core::f32::consts::TAU)
}

/// Sine and cosine of |x| ≤ [`RANGE`].
#[inline]
#[must_use]
pub fn sin_cos_within(x: f32) -> (f32, f32) {
    // Rounds to the nearest integer, which is then in the lowest bits.
    let shifted = x * core::f32::consts::FRAC_2_PI + SHIFT;
    let quadrant = shifted.to_bits();
    let q = shifted - SHIFT;
    let r = ((x - q * HALF_PI_HIGH) - q * HALF_PI_MIDDLE) - q * HALF_PI_LOW;
    let r2 = r * r;
    let sin = ((-1.951_529_6e-4 * r2 + 8.332_161e-3) * r2 - 1.666_665_5e-1) * r2 * r + r;
    let cos =
        ((2.443_315_7e-5 * r2 - 1.388_731_6e-3) * r2 + 4.166_664_6e-2) * r2 * r2 - 0.5 * r2 + 1.0;
    let (s, c) = if quadrant & 1 == 0 { (sin, cos) } else { (cos, sin) };
    let sign = |v: f32, bit: u32| f32::from_bits(v.to_bits() ^ ((bit & 2) << 30));
    (sign(s, quadrant), sign(c, quadrant.wrapping_add(1)))
}

/// Tangent of π/8: beyond it the arctangent is that of the difference to π/4.
const TAN_EIGHTH: f32 = 0.414_213_57;

/// The angle of the vector (x, y) from the x axis, in [−π, π], within 3e-7. Polynomial of Cephes'
/// `atanf.c`; of the zero vector NaN.
#[inline]
#[must_use]
pub fn atan2(y: f32, x: f32) -> f32 {
    use core::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};
    let (ax, ay) = (x.abs(), y.abs());
    let is_steep = ay > ax;
    let (low, high) = if is_steep { (ax, ay) } else { (ay, ax) };
    let (t, base) = if low > high * TAN_EIGHTH {
        ((low - high) / (low + high), FRAC_PI_4)
    } else {
        (low / high, 0.0)
    };
    let t2 = t * t;
    let series = ((8.053_744e-2 * t2 - 1.387_768_6e-1) * t2 + 1.997_771_1e-1) * t2 - 3.333_295e-1;
    let angle = base + (series * t2 * t + t);
    let angle = if is_steep { FRAC_PI_2 - angle } else { angle };
    let angle = if x < 0.0 { PI - angle } else { angle };
    angle.copysign(y)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn arctangents_are_within_their_bound(angle in -3.1_f64..3.1, length in 1e-3_f64..1e3) {
            #[expect(clippy::cast_possible_truncation, reason = "f32 is under test")]
            let (x, y) = ((length * angle.cos()) as f32, (length * angle.sin()) as f32);
            let exact = f64::from(y).atan2(f64::from(x));
            prop_assert!((f64::from(atan2(y, x)) - exact).abs() < 3e-7);
        }
    }

    #[test]
    fn arctangents_of_the_axes_are_exact() {
        use core::f32::consts::{FRAC_PI_2, PI};
        let axes =
            [(0.0, 1.0, 0.0), (1.0, 0.0, FRAC_PI_2), (0.0, -1.0, PI), (-1.0, 0.0, -FRAC_PI_2)];
        for (y, x, angle) in axes {
            assert_eq!(atan2(y, x).to_bits(), f32::to_bits(angle), "{y} {x}");
        }
    }
}
