//! What a program needs to run, measure and report on an emulated Cortex-M: start-up, a meter of
//! instructions and stack, and lines of text for the host over semihosting.
//!
//! It has no panic of its own, so that a program linked with it shows those of what it measures.

#![no_std]

pub use cortex_m_rt::entry;

pub mod meter;
pub mod report;

/// A fault ends the program, where QEMU would otherwise spin for ever.
#[cortex_m_rt::exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    report::fail(c"hard fault")
}

#[panic_handler]
fn panicked(_: &core::panic::PanicInfo) -> ! {
    report::fail(c"panicked")
}
