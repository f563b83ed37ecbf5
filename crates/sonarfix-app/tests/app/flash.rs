//! A simulated NOR flash whose power can be cut at any byte.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

/// Bytes of a sector.
pub const SECTOR: usize = 256;
/// Sectors of the store.
pub const SECTORS: usize = 2;

/// Why an operation failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlashError {
    /// The power went in the middle of it, or is gone.
    NoPower,
    /// It asked for what this flash cannot do.
    Misused,
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

/// What a byte that was being written or erased as the power went holds afterwards.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Torn {
    /// What it held before.
    Untouched,
    /// Some of its bits have changed.
    Half,
    /// What it was to hold.
    Done,
}

/// A flash of a few small sectors.
#[derive(Debug, Clone)]
pub struct SimFlash {
    bytes: Vec<u8>,
    /// Bytes that may still be written or erased before the power goes.
    power: Option<usize>,
    torn: Torn,
    /// Bytes written or erased so far.
    pub spent: usize,
    /// Sectors erased so far.
    pub erased: usize,
    /// Whether writes are ignored, as by the flash of an emulator.
    pub is_read_only: bool,
}

impl SimFlash {
    /// A flash as it leaves the factory.
    pub fn new() -> Self {
        Self::filled(0xFF)
    }

    /// A flash in which every byte is this.
    pub fn filled(byte: u8) -> Self {
        Self {
            bytes: vec![byte; SECTOR * SECTORS],
            power: None,
            torn: Torn::Done,
            spent: 0,
            erased: 0,
            is_read_only: false,
        }
    }

    /// Lets the power go after so many more bytes; the byte after them is left torn.
    pub fn cut_after(&mut self, bytes: usize, torn: Torn) {
        (self.power, self.torn) = (Some(bytes), torn);
    }

    /// Overwrites one byte, as no flash would of its own.
    pub fn damage(&mut self, at: usize, to: u8) {
        self.bytes[at] = to;
    }

    /// Switches the power on again.
    pub fn power_up(&mut self) {
        self.power = None;
    }

    /// Changes one byte, if the power lasts.
    fn change(&mut self, at: usize, to: u8) -> Result<(), FlashError> {
        let byte = &mut self.bytes[at];
        match &mut self.power {
            Some(0) => {
                *byte = match self.torn {
                    Torn::Untouched => *byte,
                    // Half of the bits that differ have gone over.
                    Torn::Half => *byte ^ ((*byte ^ to) & 0x55),
                    Torn::Done => to,
                };
                self.torn = Torn::Untouched;
                return Err(FlashError::NoPower);
            }
            Some(left) => *left -= 1,
            None => {}
        }
        *byte = to;
        self.spent += 1;
        Ok(())
    }
}

impl ErrorType for SimFlash {
    type Error = FlashError;
}

impl ReadNorFlash for SimFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        let from = offset as usize;
        let read = self.bytes.get(from..from + bytes.len()).ok_or(FlashError::Misused)?;
        bytes.copy_from_slice(read);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for SimFlash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        let (from, to) = (from as usize, to as usize);
        if !from.is_multiple_of(SECTOR) || !to.is_multiple_of(SECTOR) || to > self.bytes.len() {
            return Err(FlashError::Misused);
        }
        if self.is_read_only {
            return Ok(());
        }
        self.erased += (to - from) / SECTOR;
        (from..to).try_for_each(|at| self.change(at, 0xFF))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        let from = offset as usize;
        if !from.is_multiple_of(Self::WRITE_SIZE) || !bytes.len().is_multiple_of(Self::WRITE_SIZE) {
            return Err(FlashError::Misused);
        }
        if self.is_read_only {
            return Ok(());
        }
        // Writing only clears bits; that is what NOR flash is.
        (from..).zip(bytes).try_for_each(|(at, byte)| self.change(at, self.bytes[at] & byte))
    }
}
