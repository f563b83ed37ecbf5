//! Files that are written whole or not at all.
//!
//! An [`Output`] is written into a file beside its place (`.NAME.part`) and renamed when it is complete and on the disk. After a
//! failure, Ctrl-C or a loss of power its place holds the old file, whole, or nothing. A second program that writes the same
//! file is refused. What a killed program leaves of its `.NAME.part`, the next one overwrites.

mod checksum;

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, BufWriter, ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use anyhow::Context;
use tempfile::TempPath;

pub use checksum::Checksum;

static OBSERVER: OnceLock<fn(&Path)> = OnceLock::new();

/// From now on calls a function with the name of each file that is whole: the first function that is given.
pub fn on_written(observer: fn(&Path)) {
    let _ = OBSERVER.set(observer);
}

/// A file that is being written. Dropping it without [`Self::finish`] leaves the old one.
#[derive(Debug)]
pub struct Output {
    file: BufWriter<File>,
    /// None for a device or a pipe, which is written directly.
    place: Option<Place>,
}

/// Where the bytes are until they are whole, and where they go.
#[derive(Debug)]
struct Place {
    part: TempPath,
    to: PathBuf,
}

impl Output {
    /// Begins to write a file. A device or a pipe (`/dev/stdout`) is written directly.
    ///
    /// # Errors
    /// If the file cannot be written, or another program is writing it ([`ErrorKind::ResourceBusy`]).
    pub fn create(path: &Path) -> io::Result<Self> {
        let old = fs::metadata(path).ok();
        if old.as_ref().is_some_and(|old| !old.is_file()) {
            let file = OpenOptions::new().write(true).open(path)?;
            return Ok(Self { file: BufWriter::new(file), place: None });
        }
        let mut to = path.to_owned();
        if old.is_some() {
            // A file that may not be written is not replaced either, and a link stays one.
            OpenOptions::new().append(true).open(path)?;
            to = fs::canonicalize(path)?;
        }
        let part = part_of(&to)?;
        let file = locked(&part)?;
        let place = Place { part: TempPath::try_from_path(part)?, to };
        file.set_len(0)?;
        if let Some(old) = old {
            file.set_permissions(old.permissions())?;
        }
        Ok(Self { file: BufWriter::new(file), place: Some(place) })
    }

    /// Puts the written bytes into their place, on the disk.
    ///
    /// # Errors
    /// If they cannot be written; the old file is then whole.
    pub fn finish(self) -> io::Result<()> {
        let file = self.file.into_inner().map_err(io::IntoInnerError::into_error)?;
        let Some(Place { part, to }) = self.place else { return Ok(()) };
        file.sync_all()?;
        part.persist(&to)?;
        sync_folder(&to);
        if let Some(observer) = OBSERVER.get() {
            observer(&to);
        }
        Ok(())
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for Output {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

/// Writes a file.
///
/// # Errors
/// If it cannot be written, with its name; the old file is then whole.
pub fn write(path: &Path, bytes: impl AsRef<[u8]>) -> anyhow::Result<()> {
    write_with(path, |out| Ok(out.write_all(bytes.as_ref())?))
}

/// Writes a file by a function.
///
/// # Errors
/// If it cannot be written, with its name, or the function fails; the old file is then whole.
pub fn write_with(
    path: &Path,
    write: impl FnOnce(&mut Output) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let written = || {
        let mut out = Output::create(path)?;
        write(&mut out)?;
        anyhow::Ok(out.finish()?)
    };
    written().with_context(|| format!("cannot write {}", path.display()))
}

/// Makes sure that no other program writes an open file, as long as it is open.
///
/// # Errors
/// [`ErrorKind::ResourceBusy`] if one does.
pub fn lock(file: &File) -> io::Result<()> {
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(busy()),
        // A file system without locks: nothing can be known.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(()),
    }
}

fn busy() -> io::Error {
    io::Error::new(ErrorKind::ResourceBusy, "another program is writing it")
}

/// The file beside a file in which it grows.
fn part_of(to: &Path) -> io::Result<PathBuf> {
    let name = to.file_name().ok_or(ErrorKind::InvalidFilename)?;
    let mut part = std::ffi::OsString::from(".");
    part.push(name);
    part.push(".part");
    Ok(to.with_file_name(part))
}

/// Opens the file that grows, for this program alone.
fn locked(part: &Path) -> io::Result<File> {
    let file = OpenOptions::new().write(true).create(true).truncate(false).open(part)?;
    lock(&file)?;
    // Another program may have renamed or removed it between the two calls.
    if is_at(&file, part) { Ok(file) } else { Err(busy()) }
}

#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let identity = |data: io::Result<fs::Metadata>| data.map(|data| (data.dev(), data.ino())).ok();
    identity(file.metadata()) == identity(fs::metadata(path))
}

#[cfg(not(unix))]
fn is_at(_: &File, path: &Path) -> bool {
    path.exists()
}

/// Writes the entry of a file in its folder to the disk, where the system can.
fn sync_folder(of: &Path) {
    if cfg!(unix) {
        let folder = of.parent().filter(|folder| !folder.as_os_str().is_empty());
        let _ = File::open(folder.unwrap_or(Path::new("."))).and_then(|folder| folder.sync_all());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place() -> (tempfile::TempDir, PathBuf) {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("map.toml");
        fs::write(&file, "old").unwrap();
        (dir, file)
    }

    fn names(dir: &tempfile::TempDir) -> Vec<String> {
        let names = fs::read_dir(dir.path()).unwrap();
        names.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn a_file_is_old_until_it_is_finished() {
        let (dir, file) = place();
        let mut out = Output::create(&file).unwrap();
        let text = vec![b'x'; 100_000];
        out.write_all(&text).unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"old");
        out.finish().unwrap();
        assert_eq!(fs::read(&file).unwrap(), text);
        assert_eq!(names(&dir), ["map.toml"]);
    }

    #[test]
    fn a_failure_leaves_the_old_file_and_nothing_else() {
        let (dir, file) = place();
        let failed = write_with(&file, |out| {
            out.write_all(&vec![b'x'; 100_000])?;
            anyhow::bail!("the disk is full")
        });
        assert!(format!("{:#}", failed.unwrap_err()).contains("map.toml: the disk is full"));
        assert_eq!(fs::read(&file).unwrap(), b"old");
        assert_eq!(names(&dir), ["map.toml"]);
    }

    #[test]
    fn a_second_writer_is_refused() {
        let (_dir, file) = place();
        let mut first = Output::create(&file).unwrap();
        first.write_all(b"first").unwrap();
        let second = Output::create(&file).unwrap_err();
        assert_eq!(second.kind(), ErrorKind::ResourceBusy);
        first.finish().unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"first");
        write(&file, "third").unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"third");
    }

    #[test]
    fn what_a_killed_program_has_left_is_overwritten() {
        let (dir, file) = place();
        fs::write(dir.path().join(".map.toml.part"), "a longer rest").unwrap();
        write(&file, "new").unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"new");
        assert_eq!(names(&dir), ["map.toml"]);
    }

    /// A link leads to the new file, a file of the user alone stays so, and one that may not be written is refused.
    #[cfg(unix)]
    #[test]
    fn links_and_permissions_stay() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let (dir, file) = place();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o600)).unwrap();
        let link = dir.path().join("link");
        symlink(&file, &link).unwrap();
        write(&link, "new").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&file).unwrap(), b"new");
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o600);
    }

    /// A device is not replaced by a file.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_device_is_written_directly() {
        let full = Path::new("/dev/full");
        assert!(write(full, "x").is_err());
        assert!(!fs::metadata(full).unwrap().is_file());
        write(Path::new("/dev/null"), "x").unwrap();
    }
}
