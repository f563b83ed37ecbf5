//! A simulated NOR flash that fails. Unstable bits are tested with `sonarfix-app`.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::case::Fault;

/// Bytes of a sector, of which there are two.
const SECTOR: usize = SIZE as usize / 2;
/// Bytes of the store.
pub const SIZE: u32 = 2 * 2_048;
/// Time that an access takes when the flash is slow, µs.
const SLOW: u64 = 50_000;

/// An operation failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FlashFailed;

impl NorFlashError for FlashFailed {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

/// The flash.
#[derive(Debug)]
pub struct Flash {
    bytes: Vec<u8>,
    pub fault: Fault,
    /// Words that are written until the power is cut.
    until_cut: Option<u16>,
    has_power: bool,
    /// How long its operations have taken since this was last read, µs.
    pub took: u64,
    random: ChaCha8Rng,
}

impl Flash {
    /// An erased one.
    pub fn new(seed: u64) -> Self {
        Self {
            bytes: vec![0xFF; SIZE as usize],
            fault: Fault::None,
            until_cut: None,
            has_power: true,
            took: 0,
            random: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    /// Cuts the power in the write or erase after so many words.
    pub fn cut_after(&mut self, words: u16) {
        self.until_cut = Some(words);
    }

    /// Switches the power on again.
    pub fn power_up(&mut self) {
        (self.until_cut, self.has_power) = (None, true);
    }

    /// Whether an access works; a slow one takes long.
    fn access(&mut self) -> Result<(), FlashFailed> {
        if self.fault == Fault::Hanging {
            self.took += SLOW;
        }
        let works = self.has_power && self.fault != Fault::Dead;
        if works { Ok(()) } else { Err(FlashFailed) }
    }

    /// Whether the power lasts for another word.
    fn word(&mut self) -> bool {
        match &mut self.until_cut {
            Some(0) => self.has_power = false,
            Some(words) => *words -= 1,
            None => {}
        }
        self.has_power
    }

    fn part(&mut self, from: u32, length: usize) -> Result<&mut [u8], FlashFailed> {
        let from = from as usize;
        self.bytes.get_mut(from..from + length).ok_or(FlashFailed)
    }
}

impl ErrorType for Flash {
    type Error = FlashFailed;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashFailed> {
        self.access()?;
        bytes.copy_from_slice(self.part(offset, bytes.len())?);
        if self.fault == Fault::Lying
            && let Some(byte) = bytes.first_mut()
        {
            *byte ^= 1 << self.random.random_range(0..8);
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashFailed> {
        self.access()?;
        match self.fault {
            // It is full for ever.
            Fault::Silent => return Err(FlashFailed),
            Fault::Frozen => return Ok(()),
            _ => {}
        }
        let is_whole = self.word();
        let noise = self.random.next_u64().to_le_bytes();
        let sector = self.part(from, (to - from) as usize)?;
        sector.fill(0xFF);
        if !is_whole {
            sector.iter_mut().zip(noise.iter().cycle()).for_each(|(byte, noise)| *byte &= noise);
        }
        if is_whole { Ok(()) } else { Err(FlashFailed) }
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashFailed> {
        self.access()?;
        if self.fault == Fault::Frozen {
            return Ok(());
        }
        for (at, word) in (offset..).step_by(4).zip(bytes.chunks(4)) {
            let is_whole = self.word();
            let stuck = self.fault == Fault::Stuck;
            let noise = self.random.next_u64().to_le_bytes();
            for ((cell, byte), noise) in self.part(at, word.len())?.iter_mut().zip(word).zip(noise)
            {
                *cell &= if is_whole { *byte } else { *byte | noise };
                // A worn bit.
                *cell &= if stuck { !0x10 } else { !0 };
            }
            if !is_whole {
                return Err(FlashFailed);
            }
        }
        Ok(())
    }
}
