//! The emulator's standard input and output as a stream of bytes: one semihosting call per transfer, 40 times faster than a
//! UART.

use core::convert::Infallible;

use embedded_io::{ErrorType, Read, Write};

/// The console of the host.
pub struct Console {
    input: usize,
    output: usize,
}

/// Modes of `SYS_OPEN`, by ARM's specification: as C's "r" and "w".
const READ: usize = 0;
const WRITE: usize = 4;

impl Console {
    /// Opens the console.
    #[must_use]
    pub fn open() -> Self {
        let open = |mode: usize| {
            let name = c":tt";
            // SAFETY: the name and its length are what SYS_OPEN takes, in a block of three words.
            unsafe { cortex_m_semihosting::syscall!(OPEN, name.as_ptr(), mode, 3) }
        };
        Self { input: open(READ), output: open(WRITE) }
    }
}

impl ErrorType for Console {
    type Error = Infallible;
}

impl Read for Console {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, Infallible> {
        let length = bytes.len();
        // SAFETY: the host writes at most the length of this slice to it.
        let missing =
            unsafe { cortex_m_semihosting::syscall!(READ, self.input, bytes.as_mut_ptr(), length) };
        Ok(length.saturating_sub(missing))
    }
}

impl Write for Console {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        let length = bytes.len();
        // SAFETY: the host reads the length of this slice from it.
        let missing =
            unsafe { cortex_m_semihosting::syscall!(WRITE, self.output, bytes.as_ptr(), length) };
        Ok(length.saturating_sub(missing))
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
