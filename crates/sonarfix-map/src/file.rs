//! Files on the disk.

use std::path::Path;

use crate::error::FileError;

/// What errors call the file at a path.
pub(crate) fn name(path: &Path) -> String {
    path.display().to_string()
}

/// The text of a file.
pub(crate) fn read(path: &Path) -> Result<String, FileError> {
    std::fs::read_to_string(path)
        .map_err(|error| FileError::of_file(&name(path), format!("cannot be read: {error}")))
}
