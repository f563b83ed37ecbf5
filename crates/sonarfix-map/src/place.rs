//! A file that is a map, or a scenario that contains one.

use std::path::Path;

use crate::document::Document;
use crate::error::FileError;
use crate::file;
use crate::floor::Floor;
use crate::scenario::Scenario;

/// The content of such a file.
#[derive(Debug, Clone, PartialEq)]
pub enum Place {
    /// The walls.
    Map(Floor),
    /// The walls, and the robot.
    Scenario(Box<Scenario>),
}

impl Place {
    /// Reads a map file or a scenario file; one with a `path` is a scenario.
    ///
    /// # Errors
    /// [`FileError`] with the first error.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let (text, name) = (file::read(path)?, file::name(path));
        if Document::parse(&text, &name)?.has("path") {
            let base = path.parent().unwrap_or(Path::new(""));
            return Ok(Self::Scenario(Box::new(Scenario::parse(&text, &name, base)?)));
        }
        Ok(Self::Map(Floor::parse(&text, &name)?))
    }
}
