//! A simulated NOR flash whose power can be cut at any step of any write or erase.
//!
//! # What an interrupted operation leaves
//! A cell whose change was interrupted holds its old value, its new value, or a charge
//! near the threshold, which reads randomly as 0 or 1. An erase changes all cells of
//! a sector at once, and many chips first program them all to 0, so every bit of the sector may be
//! old, 0, 1 or unstable. A write changes one word (STM32F405) or one page (flash of the RP2350)
//! at a time: its cleared bits may be 1, 0 or unstable; other bits do not change.
//! A bit stays unstable until it is completely programmed to 0 or erased.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

/// Bytes of a sector.
pub const SECTOR: usize = 2_048;
/// Sectors of the store.
pub const SECTORS: usize = 2;
/// Steps of an erase at which the power can be cut.
pub const ERASE_STEPS: usize = 8;

/// Why an operation failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlashError {
    /// The power was cut during the operation or before it.
    NoPower,
    /// The flash does not support the operation.
    Misused,
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

/// Pseudo-random numbers from a seed (`SplitMix64`).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Random(u64);

impl Random {
    /// The sequence of this seed.
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0xD1B5_4A32_D192_ED03))
    }

    /// The next number.
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    /// A number below `end`.
    pub fn below(&mut self, end: usize) -> usize {
        (self.next() % end as u64) as usize
    }
}

/// Numbers of bits, of 256 of an interrupted operation, that end in each state; the others are unstable.
#[derive(Debug, Clone, Copy)]
struct Mix {
    old: usize,
    zero: usize,
    one: usize,
}

impl Mix {
    /// All of one kind, all but a few of one kind, or any mix.
    fn draw(random: &mut Random) -> Self {
        let most = [256, 252, 240, 128][random.below(4)];
        match random.below(6) {
            0 | 1 => Self { old: most, zero: 0, one: 0 },
            2 => Self { old: 0, zero: most, one: 0 },
            3 => Self { old: 0, zero: 0, one: most },
            4 => Self { old: 0, zero: 0, one: 0 },
            _ => {
                let old = random.below(257);
                let zero = random.below(257 - old);
                Self { old, zero, one: random.below(257 - old - zero) }
            }
        }
    }
}

/// The power supply.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Power {
    On,
    /// It is cut after this number of further steps.
    OnFor(usize),
    Gone,
}

/// A flash of a few small sectors.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SimFlash {
    bytes: Vec<u8>,
    /// Bits that read differently each time.
    unstable: Vec<u8>,
    random: Random,
    /// Bytes that are written at once.
    unit: usize,
    power: Power,
    /// Steps done so far: one for each unit written, [`ERASE_STEPS`] for each sector erased.
    pub steps: usize,
    /// Bytes written so far.
    pub written: usize,
    /// Sectors erased so far.
    pub erased: usize,
    /// Whether writes are ignored, as in an emulator.
    pub is_read_only: bool,
}

impl SimFlash {
    /// An erased flash that writes words.
    pub fn new() -> Self {
        Self::filled(0xFF)
    }

    /// A flash filled with this byte.
    pub fn filled(byte: u8) -> Self {
        Self {
            bytes: vec![byte; SECTOR * SECTORS],
            unstable: vec![0; SECTOR * SECTORS],
            random: Random::new(0),
            unit: 4,
            power: Power::On,
            steps: 0,
            written: 0,
            erased: 0,
            is_read_only: false,
        }
    }

    /// The same with write units of this length.
    pub fn writing(self, unit: usize) -> Self {
        Self { unit, ..self }
    }

    /// Cuts the power after this number of further steps. The seed determines the contents after it, and
    /// the values of unstable bits.
    pub fn cut_after(&mut self, steps: usize, seed: u64) {
        self.power = Power::OnFor(steps);
        self.random = Random::new(seed);
    }

    /// Switches the power on again.
    pub fn power_up(&mut self) {
        self.power = Power::On;
    }

    /// Overwrites one byte, which simulates damage.
    pub fn damage(&mut self, at: usize, to: u8) {
        self.bytes[at] = to;
    }

    /// Counts one step; `false` if the power is cut in it.
    fn step(&mut self) -> Result<bool, FlashError> {
        self.steps += 1;
        match self.power {
            Power::On => return Ok(true),
            Power::OnFor(0) => self.power = Power::Gone,
            Power::OnFor(steps) => {
                self.power = Power::OnFor(steps - 1);
                return Ok(true);
            }
            Power::Gone => return Err(FlashError::NoPower),
        }
        Ok(false)
    }

    /// Writes bytes within one unit, which only clears bits, as NOR flash does. A cut leaves
    /// at least one changing bit unstable, because single unstable bits are the hardest case.
    fn write_unit(&mut self, from: usize, bytes: &[u8]) -> Result<(), FlashError> {
        if !self.step()? {
            let mix = Mix { one: 0, ..Mix::draw(&mut self.random) };
            let weak = self.random.below(8 * bytes.len());
            for (index, byte) in bytes.iter().enumerate() {
                let at = from + index;
                let changing = !byte & (self.bytes[at] | self.unstable[at]);
                self.tear(at, changing, mix);
                let weak = if weak / 8 == index { 1 << (weak % 8) } else { 0 };
                self.unstable[at] |= changing & weak;
            }
            return Err(FlashError::NoPower);
        }
        for (at, byte) in (from..).zip(bytes) {
            self.bytes[at] &= byte;
            self.unstable[at] &= byte;
        }
        self.written += bytes.len();
        Ok(())
    }

    fn erase_sector(&mut self, from: usize) -> Result<(), FlashError> {
        for _ in 0..ERASE_STEPS {
            if !self.step()? {
                let mix = Mix::draw(&mut self.random);
                (from..from + SECTOR).for_each(|at| self.tear(at, 0xFF, mix));
                return Err(FlashError::NoPower);
            }
        }
        self.bytes[from..from + SECTOR].fill(0xFF);
        self.unstable[from..from + SECTOR].fill(0);
        self.erased += 1;
        Ok(())
    }

    /// Leaves these bits of a byte in a random state.
    fn tear(&mut self, at: usize, bits: u8, mix: Mix) {
        for bit in (0..8).map(|bit| 1 << bit).filter(|bit| bits & bit != 0) {
            let drawn = self.random.below(256);
            if drawn < mix.old {
                continue;
            }
            self.unstable[at] &= !bit;
            if drawn < mix.old + mix.zero {
                self.bytes[at] &= !bit;
            } else if drawn < mix.old + mix.zero + mix.one {
                self.bytes[at] |= bit;
            } else {
                self.unstable[at] |= bit;
            }
        }
    }
}

impl ErrorType for SimFlash {
    type Error = FlashError;
}

impl ReadNorFlash for SimFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        let from = offset as usize;
        if self.power == Power::Gone || from + bytes.len() > self.bytes.len() {
            return Err(FlashError::Misused);
        }
        for (at, byte) in (from..).zip(bytes) {
            let unstable = self.unstable[at];
            let noise = if unstable == 0 { 0 } else { self.random.next() as u8 };
            *byte = (self.bytes[at] & !unstable) | (noise & unstable);
        }
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
        (from..to).step_by(SECTOR).try_for_each(|from| self.erase_sector(from))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        let (from, end) = (offset as usize, offset as usize + bytes.len());
        let is_whole = |at: usize| at.is_multiple_of(Self::WRITE_SIZE);
        if !is_whole(from) || !is_whole(end) || end > self.bytes.len() {
            return Err(FlashError::Misused);
        }
        if self.is_read_only {
            return Ok(());
        }
        let mut rest = bytes;
        let mut at = from;
        while !rest.is_empty() {
            let room = self.unit - at % self.unit;
            let (unit, after) = rest.split_at(room.min(rest.len()));
            self.write_unit(at, unit)?;
            at += unit.len();
            rest = after;
        }
        Ok(())
    }
}
