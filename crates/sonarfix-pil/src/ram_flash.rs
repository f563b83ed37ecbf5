//! A flash in RAM, which the owner of its memory may keep elsewhere.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read,
    check_write,
};

/// Bytes of a sector.
const SECTOR: usize = 2_048;
/// Bytes of all.
pub const CAPACITY: usize = 2 * SECTOR;

/// Two small sectors, in memory of its own or of a caller.
#[derive(Debug)]
pub struct RamFlash<B = [u8; CAPACITY]> {
    bytes: B,
    has_changed: bool,
}

impl Default for RamFlash {
    /// Erased.
    fn default() -> Self {
        Self::new([0xFF; CAPACITY])
    }
}

impl<B> RamFlash<B> {
    /// A flash with these contents.
    pub fn new(bytes: B) -> Self {
        Self { bytes, has_changed: false }
    }

    /// Whether the contents have changed since the last call.
    pub fn take_change(&mut self) -> bool {
        core::mem::take(&mut self.has_changed)
    }
}

/// An operation that violates the rules of NOR flash.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Misused(NorFlashErrorKind);

impl NorFlashError for Misused {
    fn kind(&self) -> NorFlashErrorKind {
        self.0
    }
}

impl<B> ErrorType for RamFlash<B> {
    type Error = Misused;
}

/// `length` bytes from an address on. An address fits into a `usize` on every supported target.
fn range(from: u32, length: usize) -> core::ops::Range<usize> {
    let from = from as usize;
    from..from.saturating_add(length)
}

const BEYOND: Misused = Misused(NorFlashErrorKind::OutOfBounds);

impl<B: AsRef<[u8]>> ReadNorFlash for RamFlash<B> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Misused> {
        check_read(self, offset, bytes.len()).map_err(Misused)?;
        let held = self.bytes.as_ref().get(range(offset, bytes.len())).ok_or(BEYOND)?;
        for (byte, held) in bytes.iter_mut().zip(held) {
            *byte = *held;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.as_ref().len()
    }
}

impl<B: AsRef<[u8]> + AsMut<[u8]>> NorFlash for RamFlash<B> {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Misused> {
        check_erase(self, from, to).map_err(Misused)?;
        let erased =
            self.bytes.as_mut().get_mut(range(from, (to - from) as usize)).ok_or(BEYOND)?;
        erased.fill(0xFF);
        self.has_changed = true;
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Misused> {
        check_write(self, offset, bytes.len()).map_err(Misused)?;
        let written = self.bytes.as_mut().get_mut(range(offset, bytes.len())).ok_or(BEYOND)?;
        for (held, byte) in written.iter_mut().zip(bytes) {
            // Writing clears bits and sets none.
            *held &= byte;
        }
        self.has_changed = true;
        Ok(())
    }
}
