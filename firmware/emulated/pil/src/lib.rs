//! Processor in the loop on an emulated board: the common part of its programs.

#![no_std]

pub mod semihosting;
pub mod uart;

use embedded_io::{Read, Write};
use emulated_board::meter::Meter as Board;
use emulated_board::report;
use sonarfix_pil::{Line, Meter, serve};

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
