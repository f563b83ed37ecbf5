//! Square root, exponential and logarithm in `f32`, with the same bits on every target.
//!
//! The functions of `libm` round correctly and handle every bit pattern, which makes them several times as
//! expensive. The errors of these are far below those of the models that use them. Each argument has a domain; outside it the result is unspecified, but nothing panics.
//!
//! # Non-finite policy
//! The callers pass finite arguments from a valid filter.

/// Magic number of the first approximation of 1/√x (Lomont, *Fast inverse square root*, 2003).
const INVERSE_ROOT: u32 = 0x5f37_5a86;

/// 1/√x of a normal positive number, within 5e-6 of itself; of zero a large finite number.
#[inline]
#[must_use]
pub fn inverse_sqrt(x: f32) -> f32 {
    let half = 0.5 * x;
    let y = f32::from_bits(INVERSE_ROOT.wrapping_sub(x.to_bits() >> 1));
    // Newton's iteration; the relative error is 2e-3, then 5e-6.
    let y = y * (1.5 - half * y * y);
    y * (1.5 - half * y * y)
}

/// √x of zero or of a normal positive number, within 5e-6 of itself.
#[inline]
#[must_use]
pub fn sqrt(x: f32) -> f32 {
    x * inverse_sqrt(x)
}

/// The exponent below which the result of [`exp`] is zero.
const LEAST_EXPONENT: f32 = -87.0;
/// 1.5·2²³: the spacing of `f32` at this value is 1.
const SHIFT: f32 = 12_582_912.0;
/// Exponent bias of `f32`.
const BIAS: u32 = 127;
/// Number of bits of the mantissa of `f32`.
const MANTISSA: u32 = 23;

/// eˣ of −∞ ≤ x ≤ 87, within 2e-5 of itself; zero below −87.
// Copies of it and of ln are a per cent of the smallest firmware.
#[inline(never)]
#[must_use]
pub fn exp(x: f32) -> f32 {
    // Does not hold for NaN.
    let is_in_domain = x >= LEAST_EXPONENT;
    if !is_in_domain {
        return 0.0;
    }
    let t = x * core::f32::consts::LOG2_E;
    let shifted = t + SHIFT;
    let r = t - (shifted - SHIFT);
    // 2ʳ on ±½: minimax polynomial, relative error 3e-6.
    let p = (((9.582_68e-3 * r + 5.590_627e-2) * r + 2.402_41e-1) * r + 6.931_242e-1) * r + 1.0;
    // The integer is in the lowest bits of the shifted number.
    p * f32::from_bits(shifted.to_bits().wrapping_add(BIAS) << MANTISSA)
}

/// Bits of √½: the mantissa is reduced to between √½ and √2.
const ROOT_HALF: u32 = 0x3f35_04f3;

/// ln x of a normal positive number, within 1e-5.
#[inline(never)]
#[must_use]
pub fn ln(x: f32) -> f32 {
    let above = x.to_bits().wrapping_sub(ROOT_HALF);
    let exponent = above.cast_signed() >> MANTISSA;
    let mantissa = f32::from_bits((above & 0x007f_ffff).wrapping_add(ROOT_HALF));
    // ln m = 2 artanh s with s = (m − 1)/(m + 1), |s| ≤ 0.172.
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let s2 = s * s;
    let series = ((2.0 / 5.0 * s2 + 2.0 / 3.0) * s2 + 2.0) * s;
    #[expect(clippy::cast_precision_loss, reason = "at most 8 bits")]
    let n = exponent as f32;
    n * core::f32::consts::LN_2 + series
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn roots_are_within_their_bound(x in 1e-30_f32..1e30) {
            let exact = f64::from(x).sqrt();
            prop_assert!((f64::from(sqrt(x)) / exact - 1.0).abs() < 5e-6);
            prop_assert!((f64::from(inverse_sqrt(x)) * exact - 1.0).abs() < 5e-6);
        }

        #[test]
        fn exponentials_are_within_their_bound(x in -87.0_f32..87.0) {
            prop_assert!((f64::from(exp(x)) / f64::from(x).exp() - 1.0).abs() < 2e-5);
        }

        #[test]
        fn logarithms_are_within_their_bound(exponent in -37.0_f32..38.0) {
            let x = 10.0_f32.powf(exponent);
            let exact = f64::from(x).ln();
            prop_assert!((f64::from(ln(x)) - exact).abs() < 1e-5);
        }
    }

    #[test]
    fn limits_are_exact() {
        assert!(sqrt(0.0).to_bits() == 0 && ln(1.0).to_bits() == 0);
        assert!((exp(0.0) - 1.0).to_bits() == 0);
        for x in [-87.1, -1e9, f32::NEG_INFINITY, f32::NAN] {
            assert_eq!(exp(x).to_bits(), 0, "{x}");
        }
    }
}
