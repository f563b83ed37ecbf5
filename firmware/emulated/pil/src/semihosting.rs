//! The emulator's standard input and output as a stream of bytes: one semihosting call per transfer, 40 times faster than a
//! UART.

use core::convert::Infallible;

use embedded_io::{ErrorType, Read, Write};
use emulated_board::semihosting;

/// The console of the host.
pub struct Console {
    input: semihosting::Console,
    output: semihosting::Console,
}

impl Console {
    /// Opens the console.
    #[must_use]
    pub fn open() -> Self {
        Self { input: semihosting::Console::input(), output: semihosting::Console::output() }
    }
}

impl ErrorType for Console {
    type Error = Infallible;
}

impl Read for Console {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, Infallible> {
        Ok(self.input.read(bytes))
    }
}

impl Write for Console {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        Ok(self.output.write(bytes))
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
