//! Non-volatile storage of calibration, last pose and configuration, in two or more sectors of flash.
//!
//! Responsibilities, one file each:
//! - this one: [`Store`], which writes and reads the records;
//! - `record`: the records, [`Saved`] and [`StoredConfiguration`]; `error`: [`StoreError`];
//! - `journal`: the layout in flash, which survives power cuts;
//! - [`SavePolicy`]: when records are written;
//! - [`WriteLimit`]: how often records are written, whatever commands arrive;
//! - `resume`: which part of a record is valid after a restart.
//!
//! A power cut at any step of a write, or of the erase that sometimes precedes it, leaves the old or the new record of
//! each kind. Every later start reads the same one, and the next record can be written
//! (`tests/app/power_cut.rs`).
//!
//! # Non-finite policy
//! A record with NaN, infinity or a negative deviation is not resumed from.

mod error;
mod journal;
mod limit;
mod record;
mod resume;
mod save_policy;

use core::ops::Range;
use sonarfix::geometry::units::Instant;
use sonarfix_hal::config::RobotConfig;
use sonarfix_link::message::FlashStatus;

use embedded_storage::nor_flash::NorFlash;
use serde::Serialize;
use serde::de::DeserializeOwned;

pub use error::StoreError;
use journal::Journal;
pub use limit::WriteLimit;
use limit::{TRAILER, Trailer};
use record::{LONGEST, SAVED, STORED_CONFIGURATION};
pub use record::{Saved, StoredConfiguration};
pub use resume::{MAX_HEADING_DEVIATION, MAX_POSITION_DEVIATION, Resumed};
pub use save_policy::SavePolicy;

/// The records in flash.
///
/// A write blocks until the flash has finished: 2 ms for a record, and the erase of a sector once in
/// some hundred records (`docs/firmware.md`).
pub struct Store<F: NorFlash> {
    journal: Journal<F>,
    limit: WriteLimit,
    /// Writes of this run that have failed.
    failures: u32,
}

impl<F: NorFlash> Store<F> {
    /// A store in this region of the flash, in the flash's own addresses. It reads nothing yet.
    ///
    /// # Errors
    /// [`StoreError::Region`] if it is not two or more whole sectors.
    pub fn new(flash: F, region: Range<u32>) -> Result<Self, StoreError> {
        let limit = WriteLimit::new(Instant::from_ticks(0));
        Journal::new(flash, region).map(|journal| Self { journal, limit, failures: 0 })
    }

    /// Searches the region, and copies the records to another sector if a power cut may have damaged
    /// them. The other functions call it if it has not been called before.
    ///
    /// # Errors
    /// [`StoreError::Corrupt`] if the region held no store; it holds an empty one now.
    /// [`StoreError::Flash`], [`StoreError::NotWritten`].
    pub fn open(&mut self) -> Result<(), StoreError> {
        self.journal.open()
    }

    /// The last record; `None` if there is none.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn load(&mut self) -> Result<Option<Saved>, StoreError> {
        self.read(SAVED)
    }

    /// Writes a record, and reads it back.
    ///
    /// # Errors
    /// [`StoreError`]; the record before still counts.
    pub fn save(&mut self, saved: &Saved) -> Result<(), StoreError> {
        self.write(SAVED, saved)
    }

    /// The configuration that the robot was sent; `None` if there is none.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn load_config(&mut self) -> Result<Option<StoredConfiguration>, StoreError> {
        self.read(STORED_CONFIGURATION)
    }

    /// Writes a configuration that the robot was sent, and reads it back. A configuration that is stored
    /// already is not written again.
    ///
    /// # Errors
    /// [`StoreError`]; the record before still counts.
    pub fn save_config(&mut self, kept: &StoredConfiguration) -> Result<(), StoreError> {
        self.save_replacement(kept.replaces, &kept.config)
    }

    /// As [`Self::save_config`], without a copy of the configuration on the stack.
    pub(crate) fn save_replacement(
        &mut self,
        replaces: u32,
        config: &RobotConfig,
    ) -> Result<(), StoreError> {
        let mut buffer = [0; LONGEST];
        // The bytes of a `StoredConfiguration`.
        let bytes = postcard::to_slice(&(replaces, config), &mut buffer);
        let bytes = bytes.map_err(|_| StoreError::NotWritten)?;
        let length = bytes.len();
        if self.holds(STORED_CONFIGURATION, bytes) {
            return Ok(());
        }
        self.write_buffer(STORED_CONFIGURATION, &mut buffer, length)
    }

    /// How often records may be written.
    pub fn limit(&mut self) -> &mut WriteLimit {
        &mut self.limit
    }

    /// When a write is permitted next, if `reserve` are to remain after it.
    pub(crate) fn next_write(&self, reserve: u8) -> Instant {
        self.limit.next(reserve)
    }

    /// The number of all writes, those of earlier runs included, and of those of this run that have failed.
    #[must_use]
    pub fn status(&self) -> FlashStatus {
        FlashStatus { writes: self.limit.total(), failures: self.failures }
    }

    /// Whether the newest record of this key has these bytes.
    #[inline(never)]
    fn holds(&mut self, key: u8, bytes: &[u8]) -> bool {
        let mut buffer = [0; LONGEST];
        let found = self.journal.read(key, &mut buffer);
        matches!(found, Ok(Some(found)) if split(found).is_some_and(|(found, _)| found == bytes))
    }

    #[inline(never)]
    fn read<T: DeserializeOwned>(&mut self, key: u8) -> Result<Option<T>, StoreError> {
        let mut buffer = [0; LONGEST];
        let Some(bytes) = self.journal.read(key, &mut buffer)? else { return Ok(None) };
        let (bytes, trailer) = split(bytes).ok_or(StoreError::Layout)?;
        self.limit.resume(*trailer);
        postcard::from_bytes(bytes).map(Some).map_err(|_| StoreError::Layout)
    }

    #[inline(never)]
    fn write<T: Serialize>(&mut self, key: u8, record: &T) -> Result<(), StoreError> {
        let mut buffer = [0; LONGEST];
        let bytes = postcard::to_slice(record, &mut buffer).map_err(|_| StoreError::NotWritten)?;
        let length = bytes.len();
        self.write_buffer(key, &mut buffer, length)
    }

    /// Writes the first `length` bytes of a buffer as a record, with the end that every record has.
    fn write_buffer(
        &mut self,
        key: u8,
        buffer: &mut [u8; LONGEST],
        length: usize,
    ) -> Result<(), StoreError> {
        let end = length.saturating_add(TRAILER);
        let free = buffer.get_mut(length..).ok_or(StoreError::NotWritten)?;
        let trailer: &mut Trailer = free.first_chunk_mut().ok_or(StoreError::NotWritten)?;
        *trailer = self.limit.count();
        let record = buffer.get(..end).ok_or(StoreError::NotWritten)?;
        let written = self.journal.write(key, record);
        self.failures = self.failures.saturating_add(u32::from(written.is_err()));
        written
    }

    /// The flash.
    #[must_use]
    pub fn flash(&self) -> &F {
        self.journal.flash()
    }

    /// The flash, to be changed by a test.
    pub fn flash_mut(&mut self) -> &mut F {
        self.journal.flash_mut()
    }

    /// Returns the flash.
    pub fn release(self) -> F {
        self.journal.release()
    }
}

/// The bytes of a record, and its end.
fn split(record: &[u8]) -> Option<(&[u8], &Trailer)> {
    record.split_last_chunk()
}
