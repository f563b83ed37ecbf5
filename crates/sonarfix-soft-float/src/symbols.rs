//! The names that the compiler calls for the operators of `f32` (Arm, *Run-time ABI for the Arm Architecture*, IHI 0043, section 4.1.2).

#![expect(
    unsafe_code,
    reason = "a routine of the compiler is replaced by its name, which needs `no_mangle`; the functions are safe, and have \
              the arguments and the meaning that the ABI gives these names"
)]

use crate::format::SIGN;
use crate::{product, sum};

#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_fmul(a: u32, b: u32) -> u32 {
    product::multiply(a, b)
}

#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_fadd(a: u32, b: u32) -> u32 {
    sum::add(a, b)
}

#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_fsub(a: u32, b: u32) -> u32 {
    __aeabi_fadd(a, b ^ SIGN)
}
