//! Products, sums and differences of `f32` in software, for a processor without FPU, without a product of 64 bits and without an
//! instruction that counts leading zeros: ARMv6-M (Cortex-M0 and M0+).
//!
//! The results are those of IEEE 754-2019 to the bit (section 4.3.1: rounding to nearest, ties to even), with subnormal numbers, signed zeros
//! and infinities. A result that is not a number is quiet.
//!
//! In a program for an ARMv6-M
//!
//! ```
//! use sonarfix_soft_float as _;
//! ```
//!
//! replaces the routines of the compiler's library, which all operators of `f32` call: `__aeabi_fmul`, `__aeabi_fadd` and
//! `__aeabi_fsub` (Arm, *Run-time ABI for the Arm Architecture*, IHI 0043). That library defines them weakly, so that the linker
//! takes these. On any other processor the line has no effect.
//!
//! Each operation has a path for normal numbers of usual size, and a slow one for all others and for the ties of sums that lose bits.
//!
//! | module | |
//! |---|---|
//! | `product` | products |
//! | `sum` | sums and differences |
//! | `format` | fields of a number, and rounding |
//! | `symbols` | the names that the compiler calls, on an ARMv6-M only |
//!
//! `no_std`, no allocation, no panic, no clock, no global. `unsafe` are the attributes in `symbols` alone.

#![no_std]

mod format;
mod product;
mod sum;
#[cfg(armv6m)]
mod symbols;

/// The product, rounded to nearest, ties to even. Never panics.
///
/// ```
/// let tiny = f32::from_bits(3);
/// assert_eq!(sonarfix_soft_float::multiply(tiny, 0.5).to_bits(), 2);
/// ```
#[must_use]
pub fn multiply(a: f32, b: f32) -> f32 {
    f32::from_bits(product::multiply(a.to_bits(), b.to_bits()))
}

/// The sum, rounded to nearest, ties to even. Never panics.
///
/// ```
/// // Half of the last place of one is a tie, which goes to the even neighbour.
/// let half = f32::EPSILON / 2.0;
/// assert_eq!(sonarfix_soft_float::add(1.0, half).to_bits(), 1.0_f32.to_bits());
/// ```
#[must_use]
pub fn add(a: f32, b: f32) -> f32 {
    f32::from_bits(sum::add(a.to_bits(), b.to_bits()))
}

/// The difference a − b, rounded to nearest, ties to even. Never panics.
///
/// ```
/// assert_eq!(sonarfix_soft_float::subtract(1.0, 1.0).to_bits(), 0);
/// ```
#[must_use]
pub fn subtract(a: f32, b: f32) -> f32 {
    f32::from_bits(sum::add(a.to_bits(), b.to_bits() ^ format::SIGN))
}
