//! Processor in the loop over semihosting.
#![no_std]
#![no_main]

use emulated_pil::semihosting::Console;

#[emulated_board::entry]
fn main() -> ! {
    // Enough for a map of 4,000 walls.
    static mut MEMORY: [u8; 256 * 1024] = [0; 256 * 1024];
    emulated_pil::run(Console::open(), MEMORY)
}
