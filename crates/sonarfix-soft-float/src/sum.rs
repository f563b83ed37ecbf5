//! Sums, and differences as sums.

use crate::format::{
    FRACTION_BITS, INFINITY, INVALID, LEAST_NORMAL, NOT_FINITE, QUIET, SIGN, exponent, fraction,
    round, shift_right,
};

/// The leading bit of a significand, above seven bits for rounding and below one for the carry.
const LEADING: u32 = 1 << 30;

/// The sum of two numbers, all given as their bits.
#[inline(always)]
#[expect(clippy::inline_always, reason = "each caller is a routine that consists of this one")]
pub fn add(a: u32, b: u32) -> u32 {
    if a << 1 < b << 1 { ordered(b, a) } else { ordered(a, b) }
}

/// The sum, where b is not greater than a apart from the signs.
#[inline(always)]
#[expect(clippy::inline_always, reason = "a call would cost more than the exchange of a and b")]
fn ordered(a: u32, b: u32) -> u32 {
    let (exponent_a, exponent_b) = (exponent(a), exponent(b));
    // The sum cannot become too large, nor the difference subnormal by one place.
    if exponent_a >= NOT_FINITE - 1 || exponent_b <= 1 {
        return special(a, b);
    }
    let shift = exponent_a - exponent_b;
    if shift >= 32 {
        return a;
    }
    // Sign and exponent. The leading bit of the significand adds one.
    let upper = (a >> FRACTION_BITS << FRACTION_BITS).wrapping_sub(LEAST_NORMAL);
    let significand_a = (a << 8 | SIGN) >> 1;
    let significand_b = ((b << 8 | SIGN) >> 1) >> shift;
    // What is lost of b decides in no case but a tie.
    if (a ^ b) & SIGN == 0 {
        let sum = significand_a + significand_b;
        if sum & SIGN == 0 {
            let rounded = sum + 0x40;
            to_even(upper.wrapping_add(rounded >> 7), rounded << 25, shift, a, b)
        } else {
            let rounded = sum + 0x80;
            let upper = upper.wrapping_add(LEAST_NORMAL);
            to_even(upper.wrapping_add(rounded >> 8), rounded << 24, shift, a, b)
        }
    } else {
        let difference = significand_a - significand_b;
        if difference >= LEADING {
            let rounded = difference + 0x40;
            to_even(upper.wrapping_add(rounded >> 7), rounded << 25, shift, a, b)
        } else if difference >= LEADING >> 1 {
            let rounded = difference + 0x20;
            let upper = upper.wrapping_sub(LEAST_NORMAL);
            to_even(upper.wrapping_add(rounded >> 6), rounded << 26, shift, a, b)
        } else {
            cancelled(a, difference)
        }
    }
}

/// What was rounded upwards at a half, and was a tie if nothing of b was lost.
#[inline(always)]
#[expect(clippy::inline_always, reason = "a call would cost more than the function")]
fn to_even(rounded: u32, lost: u32, shift: u32, a: u32, b: u32) -> u32 {
    if lost != 0 {
        rounded
    } else if shift <= 7 {
        rounded & !1
    } else {
        special(a, b)
    }
}

/// The difference of numbers with the same or neighbouring exponents, which is exact if it lost two leading bits. Its sign and exponent are
/// those of a.
#[inline(never)]
fn cancelled(a: u32, difference: u32) -> u32 {
    if difference == 0 {
        return 0;
    }
    // The leading bit adds one.
    let (mut e, mut s) = (exponent(a).cast_signed() - 1, difference);
    while s < LEADING >> 3 {
        s <<= 4;
        e -= 4;
    }
    while s < LEADING {
        s <<= 1;
        e -= 1;
    }
    if e < 0 {
        // Subnormal; no bit that is shifted out is one.
        s >>= -e;
        e = 0;
    }
    (a & SIGN) | ((e.cast_unsigned() << FRACTION_BITS) + (s >> 7))
}

/// The sum of any two numbers, where b is not greater than a apart from the signs.
#[cold]
#[inline(never)]
fn special(a: u32, b: u32) -> u32 {
    let (size_a, size_b) = (a & !SIGN, b & !SIGN);
    if size_b == 0 && size_a <= INFINITY {
        // The sum of zeros is negative if both are.
        return if size_a == 0 { a & b } else { a };
    }
    if size_a > INFINITY {
        return size_a | QUIET;
    }
    if size_a == INFINITY {
        return if a ^ b == SIGN { INVALID } else { a };
    }
    let ((exponent_a, significand_a), (exponent_b, significand_b)) =
        (fields(size_a), fields(size_b));
    let significand_b = shift_right(significand_b, exponent_a - exponent_b);
    let mut s = if (a ^ b) & SIGN == 0 {
        significand_a + significand_b
    } else {
        significand_a - significand_b
    };
    if s == 0 {
        return 0;
    }
    let mut e = exponent_a.cast_signed() + 1;
    while s & SIGN == 0 {
        s <<= 1;
        e -= 1;
    }
    round(a & SIGN, e, s)
}

/// Exponent and significand; a subnormal number has the exponent of the least normal one.
const fn fields(x: u32) -> (u32, u32) {
    match exponent(x) {
        0 => (1, fraction(x) << 7),
        e => (e, (fraction(x) | LEAST_NORMAL) << 7),
    }
}
