//! The records of the store.

use serde::{Deserialize, Serialize};
use sonarfix::filter::ekf::{StandardDeviations, StateEstimate};
use sonarfix_hal::config::RobotConfig;
use sonarfix_link::baked;

use super::limit::TRAILER;

/// Keys of the two records. A new layout gets a new key, so that newer firmware
/// never misreads a record of older firmware.
pub(super) const SAVED: u8 = 6;
pub(super) const STORED_CONFIGURATION: u8 = 7;
pub(super) const KEYS: [u8; 2] = [SAVED, STORED_CONFIGURATION];

/// Room for a record: the configuration is the longer one.
pub(super) const LONGEST: usize = baked::LENGTH_MAX + TRAILER;

/// Pose and calibration at the time of the write.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Saved {
    /// How often the robot had been switched on.
    pub run: u32,
    /// Time since it was switched on, seconds. With `run` it gives the age of the record.
    pub seconds: u32,
    /// Checksum of the configuration that the calibration corrects.
    pub configuration: u32,
    /// Whether the robot was parked, so that the pose is valid until the robot is moved.
    pub is_parked: bool,
    /// Pose and calibration.
    pub state: StateEstimate,
    /// Their standard deviations.
    pub deviation: StandardDeviations,
}

/// A configuration that the robot was sent over its link.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StoredConfiguration {
    /// Checksum of the baked configuration that it replaces, zero for none. With another baked
    /// configuration this one is not used.
    pub replaces: u32,
    /// The configuration.
    pub config: RobotConfig,
}
