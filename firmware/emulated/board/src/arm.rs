//! The Cortex-M of ARM's MPS2 boards: start-up, clock, stack pointer, semihosting.

use core::arch::asm;

use cortex_m::Peripherals;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
pub use cortex_m_rt::entry;
use cortex_m_semihosting::syscall1;
// The arithmetic of every program on an ARMv6-M, also of the peers in `bench`.
use sonarfix_soft_float as _;

/// SysTick has 24 bits, which correspond to 5.2 million instructions.
const LARGEST: u32 = 0x00FF_FFFF;

/// SysTick, which counts QEMU's time at 25 MHz, 3.2 ticks per instruction (at 20 MHz, 2.56 ticks, on the board with a
/// Cortex-M33).
pub struct Clock(SYST);

impl Clock {
    pub fn start() -> Self {
        // SAFETY: nothing else in these programs uses a core peripheral.
        let mut systick = unsafe { Peripherals::steal() }.SYST;
        systick.set_clock_source(SystClkSource::Core);
        systick.set_reload(LARGEST);
        systick.clear_current();
        systick.enable_counter();
        Self(systick)
    }

    /// Starts a measurement.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "a call would be measured")]
    pub fn restart(&mut self) -> u32 {
        self.0.clear_current();
        SYST::get_current()
    }

    /// Ticks since the start of a measurement.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "a call would be measured")]
    pub fn since(before: u32) -> u32 {
        before.wrapping_sub(SYST::get_current()) & LARGEST
    }
}

/// Period of the board's SysTick, nanoseconds.
const TICK: u32 = include!(concat!(env!("OUT_DIR"), "/tick.rs"));

/// 128 ns an instruction; rounded.
pub fn instructions(ticks: u32) -> u32 {
    // A period is a multiple of ten nanoseconds; 2²⁴ periods in units of ten nanoseconds fit into 32 bits.
    (ticks * (TICK / 10) * 5 + 32) / 64
}

#[inline(always)]
#[expect(clippy::inline_always, reason = "its own frame would be in the painted memory")]
pub fn stack_pointer() -> *mut u32 {
    let top;
    // SAFETY: reads a register.
    unsafe { asm!("mov {}, sp", out(reg) top, options(nomem, nostack, preserves_flags)) };
    top
}

/// A semihosting call.
///
/// # Safety
/// The argument is valid for the operation, by ARM's specification.
pub unsafe fn semihosting(operation: usize, argument: usize) -> usize {
    // SAFETY: by the caller.
    unsafe { syscall1(operation, argument) }
}

pub fn wait() {
    cortex_m::asm::wfi();
}
