//! Processor in the loop on an emulated board: the common part of its programs.

#![no_std]

pub mod semihosting;
pub mod uart;

use core::cell::UnsafeCell;

use embedded_io::{Read, Write};
use emulated_board::meter::Meter as Board;
use emulated_board::report;
use sonarfix_pil::{Line, Meter, serve};

/// Memory that a program takes once.
pub struct Memory<const BYTES: usize>(UnsafeCell<[u8; BYTES]>);

// SAFETY: these programs have one thread and no interrupt.
unsafe impl<const BYTES: usize> Sync for Memory<BYTES> {}

impl<const BYTES: usize> Memory<BYTES> {
    /// Zeros.
    #[must_use]
    pub const fn new() -> Self {
        Self(UnsafeCell::new([0; BYTES]))
    }

    /// The memory.
    ///
    /// # Safety
    /// It is taken once.
    #[must_use]
    #[expect(clippy::mut_from_ref, reason = "the caller takes it once")]
    pub unsafe fn take(&'static self) -> &'static mut [u8] {
        // SAFETY: by the caller, this is the only reference.
        unsafe { &mut *self.0.get() }
    }
}

impl<const BYTES: usize> Default for Memory<BYTES> {
    fn default() -> Self {
        Self::new()
    }
}

/// The board's meter of instructions and stack.
struct Counter(Board);

impl Meter for Counter {
    fn measure(&mut self, call: impl FnOnce()) -> u32 {
        self.0.count(call)
    }

    fn watch_stack(&mut self) {
        self.0.paint();
    }

    fn deepest(&self) -> u32 {
        self.0.deepest()
    }
}

/// Executes requests until the line is closed, then ends the program.
pub fn run(stream: impl Read + Write, memory: &mut [u8]) -> ! {
    let mut meter = Counter(Board::start());
    match serve(&mut Line(stream), &mut meter, memory) {
        Err(sonarfix_pil::LineError::Closed) => report::done(),
        Err(_) | Ok(_) => report::fail(c"the line delivered no message"),
    }
}
