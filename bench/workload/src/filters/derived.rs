//! Code generated from the equations, as symforce and similar tools do it; [`code`] is the output of `generate/generate.py`.
//!
//! P is its upper triangle. In the fused filters every sum of a product uses the fused multiply-add of a Cortex-M4F; other
//! processors of the table have none.

#[rustfmt::skip]
mod code;

use crate::Filter;
use crate::model::{Matrix, Range, STATES, Step, Vector};

use code::Triangle;

/// P ← P − K H P.
pub type Plain = Derived<false, false>;
/// The same with fused multiply-add.
pub type PlainFused = Derived<false, true>;
/// Joseph's form.
pub type Stabilised = Derived<true, false>;
/// The same with fused multiply-add.
pub type StabilisedFused = Derived<true, true>;

/// The filter.
pub struct Derived<const STABILISED: bool, const FUSED: bool> {
    state: Vector,
    p: Triangle,
}

impl<const STABILISED: bool, const FUSED: bool> Filter for Derived<STABILISED, FUSED> {
    fn new(state: Vector, variances: Vector) -> Self {
        let mut p = [0.0; 21];
        for (i, variance) in variances.into_iter().enumerate() {
            p[place(i, i)] = variance;
        }
        Self { state, p }
    }

    #[inline]
    fn predict(&mut self, step: &Step) {
        code::predict::<FUSED>(&mut self.state, &mut self.p, step);
    }

    #[inline]
    fn update(&mut self, range: &Range) {
        if STABILISED {
            code::update_stabilised::<FUSED>(&mut self.state, &mut self.p, range);
        } else {
            code::update::<FUSED>(&mut self.state, &mut self.p, range);
        }
    }

    fn state(&self) -> Vector {
        self.state
    }

    fn covariance(&self) -> Matrix {
        core::array::from_fn(|i| core::array::from_fn(|j| self.p[place(i.min(j), i.max(j))]))
    }
}

/// The place of an entry of the upper triangle, row by row.
fn place(row: usize, column: usize) -> usize {
    row * (2 * STATES + 1 - row) / 2 + column - row
}

/// `sum + a b`; if fused and the processor can, with one rounding.
#[inline]
fn fused_add<const FUSED: bool>(sum: f32, a: f32, b: f32) -> f32 {
    if FUSED { hardware::add(sum, a, b) } else { sum + a * b }
}

/// `sum − a b`, likewise.
#[inline]
fn fused_subtract<const FUSED: bool>(sum: f32, a: f32, b: f32) -> f32 {
    if FUSED { hardware::subtract(sum, a, b) } else { sum - a * b }
}

/// The instructions of the floating-point unit of a Cortex-M4F, which `core` has no function for.
#[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
mod hardware {
    use core::arch::asm;

    #[inline]
    pub fn add(mut sum: f32, a: f32, b: f32) -> f32 {
        // SAFETY: it changes the register of `sum` only.
        unsafe {
            asm!("vfma.f32 {0}, {1}, {2}", inout(sreg) sum, in(sreg) a, in(sreg) b,
                options(pure, nomem, nostack, preserves_flags));
        }
        sum
    }

    #[inline]
    pub fn subtract(mut sum: f32, a: f32, b: f32) -> f32 {
        // SAFETY: as above.
        unsafe {
            asm!("vfms.f32 {0}, {1}, {2}", inout(sreg) sum, in(sreg) a, in(sreg) b,
                options(pure, nomem, nostack, preserves_flags));
        }
        sum
    }
}

#[cfg(not(all(target_arch = "arm", target_abi = "eabihf")))]
mod hardware {
    #[inline]
    pub fn add(sum: f32, a: f32, b: f32) -> f32 {
        sum + a * b
    }

    #[inline]
    pub fn subtract(sum: f32, a: f32, b: f32) -> f32 {
        sum - a * b
    }
}
