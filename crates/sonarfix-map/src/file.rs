//! Files on the disk.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
use std::sync::OnceLock;

use crate::error::FileError;

/// The largest file that is read: a baked map of the most walls has half of it. A device without an
/// end is no file.
pub const MAX_FILE_BYTES: u64 = 256 * 1024 * 1024;

/// The largest text that is read whole: a hundred times that of a large map.
const MAX_TEXT_BYTES: u64 = 64 * 1024 * 1024;

/// The name of a file in error messages.
pub(crate) fn name(path: &Path) -> String {
    path.display().to_string()
}

/// The text of a file.
pub(crate) fn read(path: &Path) -> Result<String, FileError> {
    read_text(path)
        .map_err(|error| FileError::of_file(&name(path), format!("cannot be read: {error}")))
}

/// The bytes of a file.
pub(crate) fn bytes(path: &Path) -> Result<Vec<u8>, FileError> {
    read_bytes(path)
        .map_err(|error| FileError::of_file(&name(path), format!("cannot be read: {error}")))
}

/// The bytes of a file of at most [`MAX_FILE_BYTES`].
///
/// # Errors
/// Those of the file system; [`io::ErrorKind::FileTooLarge`].
pub fn read_bytes(path: &Path) -> io::Result<Vec<u8>> {
    read_at_most(path, MAX_FILE_BYTES)
}

static OBSERVER: OnceLock<fn(&Path)> = OnceLock::new();

/// From now on calls a function with the name of each file that is read: the first function that is given.
pub fn on_read(observer: fn(&Path)) {
    let _ = OBSERVER.set(observer);
}

fn read_at_most(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        let reason = format!("it has more than {} MiB", most / (1024 * 1024));
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, reason));
    }
    if let Some(observer) = OBSERVER.get() {
        observer(path);
    }
    Ok(bytes)
}

/// The text of a file of at most 64 MiB.
///
/// # Errors
/// Those of [`read_bytes`]; [`io::ErrorKind::InvalidData`] if it is not UTF-8.
pub fn read_text(path: &Path) -> io::Result<String> {
    String::from_utf8(read_at_most(path, MAX_TEXT_BYTES)?)
        .map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "it is no text in UTF-8"))
}
