//! What a robot remembers while it is off: its calibration and its last pose, in two or more
//! sectors of flash.
//!
//! Responsibilities, one file each:
//! - this one: [`Saved`], the record, and [`Store`], which writes and finds it;
//! - [`Habit`]: when it is written;
//! - `resume`: what is still true of it when the robot is switched on again.
//!
//! Records are appended (`sequential-storage`: checksums, wear levelling); the newest whole one
//! counts. A power cut at any byte of a write, or of the erasing that now and then goes before
//! it, leaves the old record or the new one (`tests/power_cut.rs`).
//!
//! # Non-finite policy
//! A record with NaN, infinity or a negative deviation is not resumed from.

mod flash;
mod habit;
mod resume;

use core::ops::Range;

use embedded_storage::nor_flash::NorFlash;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage, SerializationError, Value};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sonarfix::config::Config;
use sonarfix::ekf::State;
use sonarfix_link::baked;

use flash::{AtOnce, at_once};
pub use habit::Habit;
pub use resume::Resumed;

/// Keys of the two records. Another layout gets another key, so that a robot with newer firmware
/// never misreads what an older one wrote.
const SAVED: u8 = 1;
const KEPT: u8 = 2;

/// Room for a record with its key: the configuration is the longer one.
const LONGEST: usize = baked::LENGTH_MAX;

/// What a robot knew when it was written.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Saved {
    /// How often the robot had been switched on.
    pub run: u32,
    /// How long it had been on, seconds: with `run`, the age of the record.
    pub seconds: u32,
    /// Checksum of the configuration that the calibration corrects.
    pub configuration: u32,
    /// Whether the robot was parked, so that the pose holds until somebody moves it.
    pub is_parked: bool,
    /// Pose and calibration.
    pub state: State,
    /// Their standard deviations.
    pub deviation: State,
}

/// A configuration that the robot was sent over its link.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Kept {
    /// Checksum of the baked configuration that it replaces, zero for none: once another is
    /// baked, that one counts.
    pub replaces: u32,
    /// The configuration.
    pub config: Config,
}

/// A record as postcard writes it.
struct Record<T>(T);

impl<'b, T: Serialize + DeserializeOwned> Value<'b> for Record<T> {
    fn serialize_into(&self, buffer: &mut [u8]) -> Result<usize, SerializationError> {
        let bytes = postcard::to_slice(&self.0, buffer);
        bytes.map(|bytes| bytes.len()).map_err(|_| SerializationError::BufferTooSmall)
    }

    fn deserialize_from(buffer: &'b [u8]) -> Result<(Self, usize), SerializationError> {
        let record = postcard::from_bytes(buffer);
        let record = record.map_err(|_| SerializationError::InvalidFormat)?;
        Ok((Self(record), buffer.len()))
    }
}

/// Why the store could not be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StoreError {
    /// The region is not two or more whole sectors.
    Region,
    /// The flash failed to read, write or erase.
    Flash,
    /// What lies in the region is not a store.
    Corrupt,
    /// What was written does not read back.
    NotWritten,
}

impl core::fmt::Display for StoreError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Region => "the store's region is not two or more whole sectors of flash",
            Self::Flash => "the flash failed to read, write or erase",
            Self::Corrupt => "what lies in the store's region is not a store",
            Self::NotWritten => "what was written to flash does not read back",
        })
    }
}

impl core::error::Error for StoreError {}

impl<E> From<sequential_storage::Error<E>> for StoreError {
    fn from(error: sequential_storage::Error<E>) -> Self {
        match error {
            sequential_storage::Error::Storage { .. } => Self::Flash,
            _ => Self::Corrupt,
        }
    }
}

/// The region is searched a few times a minute at most: memory for a cache would be wasted.
type NoCache = Cache<Uncached, Uncached, Uncached, u8>;

/// The record's place in flash.
///
/// A write takes as long as the flash does: 2 ms for a record, and a sector's erasing once in
/// some hundred records (`docs/firmware.md`).
pub struct Store<F: NorFlash> {
    map: MapStorage<u8, AtOnce<F>, NoCache>,
}

impl<F: NorFlash> Store<F> {
    /// A store in this region of the flash, in the flash's own addresses.
    ///
    /// # Errors
    /// [`StoreError::Region`] if it is not two or more whole sectors.
    pub fn new(flash: F, region: Range<u32>) -> Result<Self, StoreError> {
        let config = MapConfig::try_new(region).map_err(|_| StoreError::Region)?;
        Ok(Self { map: MapStorage::new(AtOnce(flash), config, Cache::new_uncached()) })
    }

    /// What the robot knew when it was last written; `None` from a store that never held it.
    ///
    /// # Errors
    /// [`StoreError`]; what is no store should be [formatted](Self::format).
    pub fn load(&mut self) -> Result<Option<Saved>, StoreError> {
        self.read(SAVED)
    }

    /// Writes what the robot knows, and reads it back.
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
    pub fn load_config(&mut self) -> Result<Option<Kept>, StoreError> {
        self.read(KEPT)
    }

    /// Writes a configuration that the robot was sent, and reads it back.
    ///
    /// # Errors
    /// [`StoreError`]; the record before still counts.
    pub fn save_config(&mut self, kept: &Kept) -> Result<(), StoreError> {
        self.write(KEPT, kept)
    }

    #[inline(never)]
    fn read<T: Serialize + DeserializeOwned>(&mut self, key: u8) -> Result<Option<T>, StoreError> {
        let mut buffer = [0; LONGEST];
        let found = at_once(self.map.fetch_item(&mut buffer, &key)).ok_or(StoreError::Flash)?;
        Ok(found?.map(|Record(record)| record))
    }

    /// Two calls one after the other, whose large frames do not lie on the stack together.
    fn write<T>(&mut self, key: u8, record: &T) -> Result<(), StoreError>
    where
        T: PartialEq + Copy + Serialize + DeserializeOwned,
    {
        self.append(key, record)?;
        let is_there = self.read::<T>(key)?.is_some_and(|found| found == *record);
        if is_there { Ok(()) } else { Err(StoreError::NotWritten) }
    }

    #[inline(never)]
    fn append<T>(&mut self, key: u8, record: &T) -> Result<(), StoreError>
    where
        T: Copy + Serialize + DeserializeOwned,
    {
        let mut buffer = [0; LONGEST];
        let written = at_once(self.map.store_item(&mut buffer, &key, &Record(*record)));
        Ok(written.ok_or(StoreError::Flash)??)
    }

    /// Erases everything: for a region that holds no store.
    ///
    /// # Errors
    /// [`StoreError::Flash`].
    pub fn format(&mut self) -> Result<(), StoreError> {
        at_once(self.map.erase_all()).ok_or(StoreError::Flash)?.map_err(|_| StoreError::Flash)
    }

    /// Gives the flash back.
    pub fn release(self) -> F {
        self.map.destroy().0.0
    }
}
