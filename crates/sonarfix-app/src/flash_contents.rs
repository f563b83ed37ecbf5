//! Map and configuration in flash: baked on a PC, written beside the program, and checked once at the start.

use sonarfix::map::{Map, MapError, image};
use sonarfix_hal::config::RobotConfig;
use sonarfix_link::baked::{self, BakedError};
use sonarfix_link::message::ImageStatus;

/// The contents of a robot's flash.
#[derive(Debug, Clone, Copy)]
pub struct FlashContents<'m> {
    /// The map, and its checksum.
    pub map: Result<(Map<'m>, u32), MapError>,
    /// The configuration, and its checksum.
    pub config: Result<(RobotConfig, u32), BakedError>,
}

impl<'m> FlashContents<'m> {
    /// Reads both regions. Bytes after an image in its region are ignored.
    #[must_use]
    pub fn read(map: &'m [u8], config: &[u8]) -> Self {
        Self {
            map: read_map(map),
            config: baked::read(config).map(|config| (config, baked::checksum(&config))),
        }
    }
}

/// The status of a map, for telemetry.
pub(crate) fn map_status(map: &Result<(Map<'_>, u32), MapError>) -> ImageStatus {
    match map {
        Ok((_, checksum)) => ImageStatus::Valid(*checksum),
        Err(MapError::NotAMap) => ImageStatus::Missing,
        Err(_) => ImageStatus::Corrupt,
    }
}

/// The status of a configuration with this checksum, for telemetry.
pub(crate) fn status(checksum: Result<u32, BakedError>) -> ImageStatus {
    match checksum {
        Ok(checksum) => ImageStatus::Valid(checksum),
        Err(BakedError::Missing) => ImageStatus::Missing,
        Err(BakedError::Version(found)) => ImageStatus::Version(found),
        Err(_) => ImageStatus::Corrupt,
    }
}

fn read_map(region: &[u8]) -> Result<(Map<'_>, u32), MapError> {
    let length = image::length(region)?;
    let image = region.get(..length).ok_or(MapError::Length)?;
    let seal = image.last_chunk().ok_or(MapError::Length)?;
    Map::read(image).map(|map| (map, u32::from_le_bytes(*seal)))
}
