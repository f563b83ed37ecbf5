//! A file that is a map, or a scenario with one in it.

use std::path::Path;

use crate::document::Document;
use crate::error::FileError;
use crate::file;
use crate::floor::Floor;
use crate::scenario::Scenario;

/// What a file says of a place.
#[derive(Debug, Clone, PartialEq)]
pub enum Place {
    /// Its walls.
    Map(Floor),
    /// Its walls, and who drives there.
    Scenario(Box<Scenario>),
}

impl Place {
    /// Reads a map file or a scenario file; one with a `path` is a scenario.
    ///
    /// # Errors
    /// [`FileError`] with the first thing that is wrong.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let (text, name) = (file::read(path)?, file::name(path));
        if Document::parse(&text, &name)?.has("path") {
            let base = path.parent().unwrap_or(Path::new(""));
            return Ok(Self::Scenario(Box::new(Scenario::parse(&text, &name, base)?)));
        }
        Ok(Self::Map(Floor::parse(&text, &name)?))
    }
}
