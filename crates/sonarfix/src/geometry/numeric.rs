//! Limits of the numbers that the filter computes with, and branch-free comparisons.

/// The largest variance (m², rad², dimensionless): the square of 1,000 km.
pub const MAX_VARIANCE: f32 = 1e12;

/// Whether 0 ≤ `value` ≤ `limit`; false for NaN.
///
/// Compared as integers, the bit patterns of negative numbers and of NaN exceed that of every
/// limit in use.
#[must_use]
pub fn is_within(value: f32, limit: f32) -> bool {
    value.to_bits() <= limit.to_bits()
}

/// Whether a variance is finite, not negative and at most [`MAX_VARIANCE`].
#[must_use]
pub fn is_valid_variance(variance: f32) -> bool {
    is_within(variance, MAX_VARIANCE)
}

/// A variance, or [`MAX_VARIANCE`] if it is larger or not finite.
#[must_use]
pub fn at_most_max_variance(variance: f32) -> f32 {
    if is_valid_variance(variance) { variance } else { MAX_VARIANCE }
}

/// The larger of two numbers, `least` for NaN. `f32::max` treats +0 and −0 differently from build to build.
#[must_use]
pub fn at_least(value: f32, least: f32) -> f32 {
    if value > least { value } else { least }
}

/// The smaller of two numbers, `most` for NaN.
#[must_use]
pub fn at_most(value: f32, most: f32) -> f32 {
    if value < most { value } else { most }
}

/// A number limited to the range between two positive ones; `most` for NaN.
///
/// As in [`positive_part`], integers are compared: positive numbers have the order of their bit patterns.
#[must_use]
#[inline]
pub fn between(value: f32, least: f32, most: f32) -> f32 {
    let [value, least, most] = [value, least, most].map(|number| number.to_bits().cast_signed());
    f32::from_bits(value.max(least).min(most).cast_unsigned())
}

/// The larger of the value and zero.
///
/// Compared as integers, the bit patterns of negative numbers are negative; an integer comparison
/// does not have to move the flags of the floating-point unit.
#[must_use]
pub fn positive_part(value: f32) -> f32 {
    f32::from_bits(value.to_bits().cast_signed().max(0).cast_unsigned())
}
