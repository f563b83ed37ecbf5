//! Support for programs on an emulated Cortex-M: start-up, a meter of instructions and stack, and lines of text for the host
//! over semihosting.
//!
//! It contains no panic, so that every panic in a linked program belongs to the measured code.

#![no_std]

pub use cortex_m_rt::entry;

pub mod meter;
pub mod report;

/// Ends the program at a fault. QEMU would otherwise run forever.
#[cortex_m_rt::exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    report::fail(c"hard fault")
}

#[panic_handler]
fn panicked(_: &core::panic::PanicInfo) -> ! {
    report::fail(c"panicked")
}
