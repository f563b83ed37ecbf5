//! Products.

use crate::format::{
    FRACTION_BITS, INFINITY, INVALID, LEAST_NORMAL, QUIET, SIGN, exponent, fraction, round,
};

/// The leading bit of a significand in its upper 8 bits.
const LEADING: u32 = LEAST_NORMAL >> 16;

/// The product of two numbers, all given as their bits.
///
/// Both exponents are in the middle of their range for nearly every product, so that the result can be neither too large nor
/// subnormal.
#[inline(always)]
#[expect(clippy::inline_always, reason = "each caller is a routine that consists of this one")]
pub fn multiply(a: u32, b: u32) -> u32 {
    // Sign and exponent. The sum of both has the sign of the product in the bit that becomes the sign.
    let (upper_a, upper_b) = (a >> FRACTION_BITS, b >> FRACTION_BITS);
    if !is_usual(upper_a) || !is_usual(upper_b) {
        return special(a, b);
    }
    // The bias counts once, and the leading bit of the significand adds one.
    let upper = (upper_a + upper_b - 128) << FRACTION_BITS;
    let (product, low) = significand(a, b);
    // The greatest product of significands is so far below 2³² that rounding does not overflow.
    if product >> 31 == 0 {
        let rounded = product + 0x40;
        to_even(upper.wrapping_add(rounded >> 7), rounded << 25, low)
    } else {
        let rounded = product + 0x80;
        to_even(upper.wrapping_add((rounded >> 8) + LEAST_NORMAL), rounded << 24, low)
    }
}

/// True for an exponent from −63 to 63, given with the sign above it.
#[inline(always)]
#[expect(clippy::inline_always, reason = "a call would cost more than the function")]
const fn is_usual(upper: u32) -> bool {
    (upper & 0xFF).wrapping_sub(64) < 127
}

/// What was rounded upwards at a half, and was a tie if nothing else was lost.
#[inline(always)]
#[expect(clippy::inline_always, reason = "a call would cost more than the function")]
const fn to_even(rounded: u32, lost: u32, low: u32) -> u32 {
    if lost == 0 && low << 16 == 0 { rounded & !1 } else { rounded }
}

/// The product of two significands of 24 bits without its lowest 16 bits; and a number that has these as its lowest ones.
#[inline(always)]
#[expect(clippy::inline_always, reason = "a call would cost more than the function")]
const fn significand(a: u32, b: u32) -> (u32, u32) {
    // 8 upper bits and 16 lower ones each: the compiler takes two of the four products in one.
    let (upper_a, upper_b) = (a >> 16 & 0xFF | LEADING, b >> 16 & 0xFF | LEADING);
    let (lower_a, lower_b) = (a & 0xFFFF, b & 0xFFFF);
    let low = lower_a * lower_b;
    (((upper_a * upper_b) << 16) + upper_a * lower_b + upper_b * lower_a + (low >> 16), low)
}

/// The product of any two numbers.
#[cold]
#[inline(never)]
fn special(a: u32, b: u32) -> u32 {
    let sign = (a ^ b) & SIGN;
    let (size_a, size_b) = (a & !SIGN, b & !SIGN);
    if size_a > INFINITY {
        return a | QUIET;
    }
    if size_b > INFINITY {
        return b | QUIET;
    }
    let is_zero = size_a == 0 || size_b == 0;
    if size_a == INFINITY || size_b == INFINITY {
        return if is_zero { INVALID } else { sign | INFINITY };
    }
    if is_zero {
        return sign;
    }
    let ((exponent_a, a), (exponent_b, b)) = (normalized(size_a), normalized(size_b));
    let (product, low) = significand(a, b);
    let product = product | u32::from(low << 16 != 0);
    // Bit 31 is worth two of the product of the leading bits, 2³⁰.
    let exponent = exponent_a + exponent_b - 126;
    if product >> 31 == 0 {
        round(sign, exponent - 1, product << 1)
    } else {
        round(sign, exponent, product)
    }
}

/// Exponent and significand of a number that is neither zero nor negative: a subnormal one gets an exponent below one.
fn normalized(x: u32) -> (i32, u32) {
    let (mut e, mut s) = (exponent(x).cast_signed(), fraction(x));
    if e == 0 {
        e = 1;
        while s < LEAST_NORMAL {
            s <<= 1;
            e -= 1;
        }
    }
    (e, s)
}
