//! Processor in the loop over a UART: slower than semihosting, but with a peripheral and its driver.
#![no_std]
#![no_main]

use emulated_pil::uart::Uart;

#[emulated_board::entry]
fn main() -> ! {
    static mut MEMORY: [u8; 16 * 1024] = [0; 16 * 1024];
    emulated_pil::run(Uart::open(), MEMORY)
}
