//! Processor in the loop over semihosting.
#![no_std]
#![no_main]

use bench_pil::semihosting::Console;

#[bench_board::entry]
fn main() -> ! {
    // A map of 4,000 walls and more.
    static mut MEMORY: [u8; 256 * 1024] = [0; 256 * 1024];
    bench_pil::run(Console::open(), MEMORY)
}
