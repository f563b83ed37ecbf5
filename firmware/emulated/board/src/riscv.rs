//! The 32-bit RISC-V of QEMU's `virt` board: start-up, clock, stack pointer, semihosting.

use core::arch::asm;

pub use riscv_rt::entry;

/// The counter `minstret`, which shows QEMU's time in nanoseconds: 128 per instruction. Its low word lasts 33.5 million
/// instructions.
pub struct Clock;

impl Clock {
    pub fn start() -> Self {
        Self
    }

    /// Starts a measurement.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "a call would be measured")]
    #[expect(clippy::unused_self, reason = "the other processor has a timer to start")]
    pub fn restart(&mut self) -> u32 {
        counter()
    }

    /// Ticks since the start of a measurement.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "a call would be measured")]
    pub fn since(before: u32) -> u32 {
        counter().wrapping_sub(before)
    }
}

#[inline(always)]
#[expect(clippy::inline_always, reason = "a call would be measured")]
fn counter() -> u32 {
    let count;
    // SAFETY: reads a register.
    unsafe { asm!("csrr {}, minstret", out(reg) count, options(nomem, nostack)) };
    count
}

/// 128 ns an instruction; rounded.
pub fn instructions(ticks: u32) -> u32 {
    ticks.saturating_add(64) / 128
}

#[inline(always)]
#[expect(clippy::inline_always, reason = "its own frame would be in the painted memory")]
pub fn stack_pointer() -> *mut u32 {
    let top;
    // SAFETY: reads a register.
    unsafe { asm!("mv {}, sp", out(reg) top, options(nomem, nostack, preserves_flags)) };
    top
}

/// A semihosting call: the three instructions of the RISC-V semihosting specification, which are not compressed and lie in one
/// page.
///
/// # Safety
/// The argument is valid for the operation, by ARM's specification.
#[inline(never)]
pub unsafe fn semihosting(operation: usize, argument: usize) -> usize {
    let result;
    // SAFETY: by the caller.
    unsafe {
        asm!(
            ".balign 16",
            ".option push",
            ".option norvc",
            "slli x0, x0, 0x1f",
            "ebreak",
            "srai x0, x0, 7",
            ".option pop",
            inlateout("a0") operation => result,
            in("a1") argument,
            options(nostack)
        );
    }
    result
}

pub fn wait() {
    // SAFETY: waits for an interrupt; none is enabled.
    unsafe { asm!("wfi", options(nomem, nostack)) };
}
