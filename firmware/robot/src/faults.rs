//! The end of a program on a Cortex-M by a fault.

/// Defines the exceptions of a Cortex-M that end the program, each by a call of this function, which does not return.
///
/// A panic ends in a hard fault, as does an overflow of the stack, which is below all variables.
#[macro_export]
macro_rules! restart_after_faults {
    ($restart:path) => {
        /// The end of the program by a panic, another fault or an overflow of the stack.
        #[cortex_m_rt::exception(trampoline = false)]
        #[allow(unsafe_code, reason = "the vector table calls it; it does nothing that is unsafe")]
        unsafe fn HardFault() -> ! {
            $restart()
        }

        /// The end of the program by an interrupt that nothing handles.
        #[cortex_m_rt::exception]
        #[allow(
            unsafe_code,
            reason = "the vector table calls it; the macro makes a second function, which is not unsafe"
        )]
        unsafe fn DefaultHandler(_number: i16) -> ! {
            $restart()
        }
    };
}
