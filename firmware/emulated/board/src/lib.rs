//! Support for programs on an emulated Cortex-M or RISC-V: start-up, a meter of instructions and stack, and lines of text for
//! the host over semihosting.
//!
//! It contains no panic, so that every panic in a linked program belongs to the measured code.

#![no_std]

#[cfg(target_arch = "arm")]
mod arm;
pub mod meter;
pub mod report;
#[cfg(target_arch = "riscv32")]
mod riscv;
pub mod semihosting;

#[cfg(target_arch = "arm")]
use arm as processor;
#[cfg(target_arch = "riscv32")]
use riscv as processor;

pub use processor::entry;

/// Ends the program at a fault. QEMU would otherwise run forever.
#[cfg(target_arch = "arm")]
#[cortex_m_rt::exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    report::fail(c"hard fault")
}

/// The same on RISC-V.
// SAFETY: riscv-rt calls a function of this name and type.
#[cfg(target_arch = "riscv32")]
#[unsafe(no_mangle)]
extern "C" fn ExceptionHandler(_: &riscv_rt::TrapFrame) -> ! {
    report::fail(c"exception")
}

#[panic_handler]
fn panicked(_: &core::panic::PanicInfo) -> ! {
    report::fail(c"panicked")
}
