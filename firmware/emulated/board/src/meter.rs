//! Measures the cost of a call: instructions, exactly and repeatably, and bytes of stack.
//!
//! With `-icount shift=7` QEMU advances its time by 2⁷ = 128 ns per instruction, and a clock of the processor counts this time.
//! The result is instructions, not cycles. The memory below the stack pointer is painted before the call; words that have
//! changed were used.

use core::hint::black_box;
use core::sync::atomic::{Ordering, compiler_fence};

use crate::processor::{Clock, instructions, stack_pointer};

/// A measurable call. All have the same signature, so that the empty call has the overhead of every other.
pub type Call<A, B> = extern "C" fn(&mut A, &B);

/// The cost of calls.
#[derive(Debug, Default, Clone, Copy)]
pub struct Cost {
    /// Number of calls.
    pub calls: u32,
    /// Instructions of all calls.
    pub instructions: u32,
    /// Instructions of the most expensive call.
    pub most_instructions: u32,
    /// Bytes of stack of the deepest call.
    pub most_stack: u32,
}

const PAINT: u32 = 0xCAFE_D00D;
/// Words of paint: 16 KiB.
const WORDS: usize = 4 * 1024;

/// Measures calls.
pub struct Meter {
    clock: Clock,
    /// Ticks of an empty call in [`Self::count`].
    empty: u32,
    /// The stack pointer at the last counted call.
    top: *const u32,
    /// The address below which [`Self::paint`] has painted.
    painted: *mut u32,
}

impl Meter {
    /// Starts the clock.
    #[must_use]
    pub fn start() -> Self {
        let mut meter = Self {
            clock: Clock::start(),
            empty: 0,
            top: core::ptr::null(),
            painted: core::ptr::null_mut(),
        };
        meter.empty = meter.timed(|| ());
        meter
    }

    /// Makes a call; returns the number of its instructions.
    pub fn count(&mut self, call: impl FnOnce()) -> u32 {
        instructions(self.timed(call).saturating_sub(self.empty))
    }

    /// Starts to watch the stack.
    #[inline(never)]
    pub fn paint(&mut self) {
        self.painted = stack_pointer();
        paint_below(self.painted);
    }

    /// Bytes of stack of the deepest counted call since [`Self::paint`].
    #[must_use]
    pub fn deepest(&self) -> u32 {
        let lowest = self.painted.wrapping_sub(used_below(self.painted)).addr();
        u32::try_from(self.top.addr().saturating_sub(lowest)).unwrap_or(u32::MAX)
    }

    #[inline(never)]
    fn timed(&mut self, call: impl FnOnce()) -> u32 {
        self.top = stack_pointer();
        let before = self.clock.restart();
        compiler_fence(Ordering::SeqCst);
        call();
        compiler_fence(Ordering::SeqCst);
        Clock::since(before)
    }

    /// Makes a call and adds its cost without the overhead of the call to `cost`.
    pub fn measure<A, B>(&mut self, cost: &mut Cost, call: Call<A, B>, a: &mut A, b: &B) {
        let (empty_ticks, empty_stack) = self.raw(nothing, a, b);
        let (ticks, stack) = self.raw(call, a, b);
        let instructions = instructions(ticks - empty_ticks);
        let stack = stack - empty_stack;
        cost.calls += 1;
        cost.instructions += instructions;
        cost.most_instructions = cost.most_instructions.max(instructions);
        cost.most_stack = cost.most_stack.max(stack);
    }

    /// Ticks of a call, and bytes below the stack pointer that it has written.
    #[inline(never)]
    fn raw<A, B>(&mut self, call: Call<A, B>, a: &mut A, b: &B) -> (u32, u32) {
        let call = black_box(call);
        let top = stack_pointer();
        paint_below(top);
        let before = self.clock.restart();
        call(a, b);
        let ticks = Clock::since(before);
        let used = used_below(top) * size_of::<u32>();
        (ticks, u32::try_from(used).unwrap_or(u32::MAX))
    }
}

extern "C" fn nothing<A, B>(_: &mut A, _: &B) {}

/// Paints the memory below the stack pointer.
#[inline(always)]
#[expect(clippy::inline_always, reason = "its own frame would be in the painted memory")]
fn paint_below(top: *mut u32) {
    for word in 1..=WORDS {
        // SAFETY: the stack of these programs has megabytes; nothing is stored below its pointer, and no interrupt is
        // enabled that would push there.
        unsafe { top.wrapping_sub(word).write_volatile(PAINT) };
    }
}

/// Number of words below the stack pointer that have been written.
#[inline(always)]
#[expect(clippy::inline_always, reason = "its own frame would be in the painted memory")]
fn used_below(top: *mut u32) -> usize {
    // SAFETY: as in `paint_below`.
    let is_paint = |word: &usize| unsafe { top.wrapping_sub(*word).read_volatile() } == PAINT;
    WORDS - (1..=WORDS).rev().take_while(is_paint).count()
}
