//! What a call costs: instructions, exactly and repeatably, and bytes of stack.
//!
//! With `-icount shift=7` QEMU lets 2⁷ = 128 ns of its own time pass with every instruction, and on
//! the MPS2 boards SysTick counts that time at 25 MHz: 3.2 ticks an instruction. What comes out are
//! instructions, not cycles. The memory below the stack pointer is painted before the call; what is
//! no longer paint after it was used.

use core::arch::asm;
use core::hint::black_box;

use cortex_m::Peripherals;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

/// A call that can be measured: one shape for all, so that the empty one costs what every other
/// costs besides its own work.
pub type Call<A, B> = extern "C" fn(&mut A, &B);

/// What calls have cost.
#[derive(Debug, Default, Clone, Copy)]
pub struct Cost {
    /// How many there were.
    pub calls: u32,
    /// Instructions of all.
    pub instructions: u32,
    /// Instructions of the one with most.
    pub most_instructions: u32,
    /// Bytes of stack of the one with most.
    pub most_stack: u32,
}

/// SysTick has 24 bits, which are worth 5.2 million instructions.
const LARGEST: u32 = 0x00FF_FFFF;
const PAINT: u32 = 0xCAFE_D00D;
/// Words of paint: 16 KiB.
const WORDS: usize = 4 * 1024;

/// Measures calls.
pub struct Meter(SYST);

impl Meter {
    /// Starts SysTick.
    #[must_use]
    pub fn start() -> Self {
        // SAFETY: nothing else in these programs touches a core peripheral.
        let mut systick = unsafe { Peripherals::steal() }.SYST;
        systick.set_clock_source(SystClkSource::Core);
        systick.set_reload(LARGEST);
        systick.clear_current();
        systick.enable_counter();
        Self(systick)
    }

    /// Makes a call and adds to `cost` what it cost, without what calling costs.
    pub fn measure<A, B>(&mut self, cost: &mut Cost, call: Call<A, B>, a: &mut A, b: &B) {
        let (empty_ticks, empty_stack) = self.raw(nothing, a, b);
        let (ticks, stack) = self.raw(call, a, b);
        // 128 ns an instruction, 40 ns a tick; rounded.
        let instructions = ((ticks - empty_ticks) * 40 + 64) / 128;
        let stack = stack - empty_stack;
        cost.calls += 1;
        cost.instructions += instructions;
        cost.most_instructions = cost.most_instructions.max(instructions);
        cost.most_stack = cost.most_stack.max(stack);
    }

    /// Ticks of a call, and bytes below the stack pointer that it wrote to.
    #[inline(never)]
    fn raw<A, B>(&mut self, call: Call<A, B>, a: &mut A, b: &B) -> (u32, u32) {
        let call = black_box(call);
        let top: *mut u32;
        // SAFETY: reads a register.
        unsafe { asm!("mov {}, sp", out(reg) top, options(nomem, nostack, preserves_flags)) };
        for word in 1..=WORDS {
            // SAFETY: the stack of these programs has megabytes; below its pointer nothing lives,
            // and no interrupt is enabled that would push there.
            unsafe { top.wrapping_sub(word).write_volatile(PAINT) };
        }
        self.0.clear_current();
        let before = SYST::get_current();
        call(a, b);
        let after = SYST::get_current();
        // SAFETY: as above.
        let is_paint = |word: &usize| unsafe { top.wrapping_sub(*word).read_volatile() } == PAINT;
        let untouched = (1..=WORDS).rev().take_while(is_paint).count();
        let used = (WORDS - untouched) * size_of::<u32>();
        (before.wrapping_sub(after) & LARGEST, u32::try_from(used).unwrap_or(u32::MAX))
    }
}

extern "C" fn nothing<A, B>(_: &mut A, _: &B) {}
