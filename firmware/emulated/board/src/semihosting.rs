//! Semihosting calls: the host's console, and the end of the program (Arm, *Semihosting*, document 100863; RISC-V uses the
//! same operations).

use core::ffi::CStr;

use crate::processor::semihosting;

/// Operations.
const OPEN: usize = 0x01;
const WRITE0: usize = 0x04;
const WRITE: usize = 0x05;
const READ: usize = 0x06;
const EXIT: usize = 0x18;

/// Modes of `OPEN`: as C's "r" and "w".
const FOR_READING: usize = 0;
const FOR_WRITING: usize = 4;

/// Reasons of `EXIT`: the end of the program, and an error without a description.
const APPLICATION_EXIT: usize = 0x2_0026;
const RUN_TIME_ERROR: usize = 0x2_0023;

/// The console of the host, in one direction.
#[derive(Debug, Clone, Copy)]
pub struct Console(usize);

impl Console {
    /// The host's input.
    #[must_use]
    pub fn input() -> Self {
        Self::open(FOR_READING)
    }

    /// The host's output.
    #[must_use]
    pub fn output() -> Self {
        Self::open(FOR_WRITING)
    }

    fn open(mode: usize) -> Self {
        let name = c":tt";
        let block = [name.as_ptr().expose_provenance(), mode, name.count_bytes()];
        // SAFETY: the name, the mode and the length of the name are what OPEN takes.
        Self(unsafe { semihosting(OPEN, block.as_ptr().expose_provenance()) })
    }

    /// Reads; returns the number of bytes.
    pub fn read(self, bytes: &mut [u8]) -> usize {
        let length = bytes.len();
        let block = [self.0, bytes.as_mut_ptr().expose_provenance(), length];
        // SAFETY: the host writes at most the length of this slice to it.
        length.saturating_sub(unsafe { semihosting(READ, block.as_ptr().expose_provenance()) })
    }

    /// Writes; returns the number of bytes.
    #[must_use]
    pub fn write(self, bytes: &[u8]) -> usize {
        let length = bytes.len();
        let block = [self.0, bytes.as_ptr().expose_provenance(), length];
        // SAFETY: the host reads the length of this slice from it.
        length.saturating_sub(unsafe { semihosting(WRITE, block.as_ptr().expose_provenance()) })
    }
}

/// Writes a text to the host's debug console.
pub fn print(text: &CStr) {
    // SAFETY: WRITE0 reads a string that ends with a zero, as this does.
    unsafe { semihosting(WRITE0, text.as_ptr().expose_provenance()) };
}

/// Asks the emulator to end, with success or failure.
pub fn exit(is_success: bool) {
    let reason = if is_success { APPLICATION_EXIT } else { RUN_TIME_ERROR };
    // SAFETY: the reason is what EXIT takes on a processor of 32 bits.
    unsafe { semihosting(EXIT, reason) };
}
