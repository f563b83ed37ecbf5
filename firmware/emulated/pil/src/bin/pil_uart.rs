//! Processor in the loop over a UART: slower than semihosting, but with a peripheral and its driver.
#![no_std]
#![no_main]

use emulated_pil::Memory;
use emulated_pil::uart::Uart;

static MEMORY: Memory<{ 16 * 1024 }> = Memory::new();

/// The program.
#[emulated_board::entry]
fn main() -> ! {
    // SAFETY: the program starts once.
    emulated_pil::run(Uart::open(), unsafe { MEMORY.take() })
}
