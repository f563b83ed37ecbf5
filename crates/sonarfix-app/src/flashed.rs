//! Map and configuration as they lie in flash: baked on a PC, written beside the program, and
//! checked once, at the start.

use sonarfix::config::Config;
use sonarfix::map::{Map, MapError, image};
use sonarfix_link::baked::{self, BakedError};
use sonarfix_link::message;

/// What a robot found in its flash.
#[derive(Debug, Clone, Copy)]
pub struct Flashed<'m> {
    /// The map, and its checksum.
    pub map: Result<(Map<'m>, u32), MapError>,
    /// The configuration, and its checksum.
    pub config: Result<(Config, u32), BakedError>,
}

impl<'m> Flashed<'m> {
    /// Reads both regions. What follows a baked map or configuration in its region does not
    /// matter.
    #[must_use]
    pub fn read(map: &'m [u8], config: &[u8]) -> Self {
        Self {
            map: read_map(map),
            config: baked::read(config).map(|config| (config, baked::checksum(&config))),
        }
    }

    /// What is told of the map.
    #[must_use]
    pub fn map_state(&self) -> message::Flashed {
        match self.map {
            Ok((_, checksum)) => message::Flashed::Valid(checksum),
            Err(MapError::NotAMap) => message::Flashed::Missing,
            Err(_) => message::Flashed::Corrupt,
        }
    }

    /// What is told of the configuration.
    #[must_use]
    pub fn config_state(&self) -> message::Flashed {
        match self.config {
            Ok((_, checksum)) => message::Flashed::Valid(checksum),
            Err(BakedError::Missing) => message::Flashed::Missing,
            Err(_) => message::Flashed::Corrupt,
        }
    }
}

fn read_map(region: &[u8]) -> Result<(Map<'_>, u32), MapError> {
    let length = image::length(region)?;
    let image = region.get(..length).ok_or(MapError::Length)?;
    let seal = image.last_chunk().ok_or(MapError::Length)?;
    Map::read(image).map(|map| (map, u32::from_le_bytes(*seal)))
}
