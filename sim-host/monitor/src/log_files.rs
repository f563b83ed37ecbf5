//! The logs of a recording as files.

use std::fs::{self, File, OpenOptions};
use std::io::{self, LineWriter, Write};
use std::path::{Path, PathBuf};

use sonarfix_telemetry::recording::Logs;
use sonarfix_telemetry::sealed::Output;

/// The first log has the given path, further ones a number in the name.
#[derive(Debug)]
pub struct LogFiles {
    path: PathBuf,
    is_forced: bool,
}

impl LogFiles {
    /// Files that exist are replaced only if `is_forced`; a device or a pipe is written to.
    #[must_use]
    pub fn new(path: PathBuf, is_forced: bool) -> Self {
        Self { path, is_forced }
    }

    fn numbered(&self, number: u32) -> PathBuf {
        let mut path = self.path.clone();
        if number > 1 {
            let stem = self.path.file_stem().unwrap_or_default().to_string_lossy();
            path.set_file_name(format!("{stem}-{number}"));
            if let Some(extension) = self.path.extension() {
                path.set_extension(extension);
            }
        }
        path
    }
}

impl Logs for LogFiles {
    fn name(&self) -> String {
        self.path.display().to_string()
    }

    /// Fails as well if another program writes the file.
    fn create(&mut self, number: u32) -> io::Result<Box<dyn Output>> {
        Ok(Box::new(LogFile::create(&self.numbered(number), self.is_forced)?))
    }
}

/// A file whose lines are on the disk at once.
#[derive(Debug)]
struct LogFile(LineWriter<File>);

impl LogFile {
    fn create(path: &Path, is_forced: bool) -> io::Result<Self> {
        let is_device = fs::metadata(path).is_ok_and(|file| !file.is_file());
        let is_old_kept = !is_forced && !is_device;
        let mut options = OpenOptions::new();
        let file = options.write(true).create(true).create_new(is_old_kept).open(path)?;
        sonarfix_files::lock(&file)?;
        if !is_device {
            file.set_len(0)?;
        }
        Ok(Self(LineWriter::new(file)))
    }
}

impl Write for LogFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

impl Output for LogFile {
    fn end(mut self: Box<Self>) -> io::Result<()> {
        self.flush()?;
        // A device has nothing to wait for.
        let _ = self.0.get_ref().sync_all();
        Ok(())
    }
}
