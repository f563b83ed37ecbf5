//! Processor in the loop over a UART: slower, and with less of the host in it.
#![no_std]
#![no_main]

use bench_pil::uart::Uart;

#[bench_board::entry]
fn main() -> ! {
    static mut MEMORY: [u8; 16 * 1024] = [0; 16 * 1024];
    bench_pil::run(Uart::open(), MEMORY)
}
