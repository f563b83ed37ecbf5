//! Processor in the loop over semihosting.
#![no_std]
#![no_main]

use emulated_pil::Memory;
use emulated_pil::semihosting::Console;

// Enough for a map of 4,000 walls.
static MEMORY: Memory<{ 256 * 1024 }> = Memory::new();

/// The program.
#[emulated_board::entry]
fn main() -> ! {
    // SAFETY: the program starts once.
    emulated_pil::run(Console::open(), unsafe { MEMORY.take() })
}
