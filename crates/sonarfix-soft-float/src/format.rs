//! The fields of a number in 32 bits (IEEE 754-2019, section 3.4), and rounding.

/// The sign.
pub const SIGN: u32 = 1 << 31;
/// Width of the fraction: the exponent is above it.
pub const FRACTION_BITS: u32 = 23;
/// The least normal number. In a significand, the leading bit, which a normal number does not contain.
pub const LEAST_NORMAL: u32 = 1 << FRACTION_BITS;
/// The exponent of what is no finite number.
pub const NOT_FINITE: u32 = 255;
/// Infinity. What is greater, without the sign, is not a number.
pub const INFINITY: u32 = NOT_FINITE << FRACTION_BITS;
/// The bit by which a number that is not a number is quiet.
pub const QUIET: u32 = 1 << 22;
/// The result of an invalid operation.
pub const INVALID: u32 = INFINITY | QUIET;

/// The biased exponent.
#[inline(always)]
#[expect(clippy::inline_always, reason = "a call would cost more than the function")]
pub const fn exponent(x: u32) -> u32 {
    x << 1 >> (FRACTION_BITS + 1)
}

/// The bits below the exponent.
pub const fn fraction(x: u32) -> u32 {
    x & (LEAST_NORMAL - 1)
}

/// Rounds the number s·2^(e − 158): e is the biased exponent of its leading bit 31. Bits below bit 0 of the exact s must be
/// contained in bit 0.
#[inline(never)]
pub fn round(sign: u32, e: i32, s: u32) -> u32 {
    if e >= NOT_FINITE.cast_signed() {
        return sign | INFINITY;
    }
    // The leading bit of a normal number adds one to its exponent.
    let (e, s) = match u32::try_from(e - 1) {
        Ok(e) => (e, s),
        Err(_) => (0, shift_right(s, (1 - e).cast_unsigned())),
    };
    let nearest = (s >> 8) + (s >> 7 & 1);
    let is_tie = s & 0xFF == 0x80;
    sign | ((e << FRACTION_BITS) + (nearest & !u32::from(is_tie)))
}

/// Shifts right; bit 0 becomes one if a bit that is lost is one.
pub const fn shift_right(s: u32, by: u32) -> u32 {
    let kept = s.unbounded_shr(by);
    let is_exact = kept.unbounded_shl(by) == s;
    if is_exact { kept } else { kept | 1 }
}
