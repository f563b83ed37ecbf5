//! A recording that shows where it is torn.
//!
//! After every 32 lines follows a comment with their checksum, and after the last ones the end. A reader
//! ([`Lines`](sonarfix_replay::lines::Lines)) reports a block with another checksum, and a recording without its end.

use std::fs::{self, File, OpenOptions};
use std::io::{self, LineWriter, Write};
use std::path::Path;

use sonarfix_files::Checksum;
use sonarfix_replay::lines::{CHECKSUM, END};

/// Lines with one checksum: at full telemetry those of about a second.
const BLOCK: u32 = 32;

/// A recording being written, line by line.
#[derive(Debug)]
pub struct Sealed {
    out: LineWriter<File>,
    sum: Checksum,
    lines: u32,
}

impl Sealed {
    /// Begins a recording. A file is replaced only if `is_forced`; a device or a pipe is written to.
    ///
    /// # Errors
    /// If the file cannot be written, exists ([`io::ErrorKind::AlreadyExists`]), or another program writes it.
    pub fn create(path: &Path, is_forced: bool) -> io::Result<Self> {
        let is_device = fs::metadata(path).is_ok_and(|file| !file.is_file());
        let is_old_kept = !is_forced && !is_device;
        let mut options = OpenOptions::new();
        let file = options.write(true).create(true).create_new(is_old_kept).open(path)?;
        sonarfix_files::lock(&file)?;
        if !is_device {
            file.set_len(0)?;
        }
        Ok(Self { out: LineWriter::new(file), sum: Checksum::default(), lines: 0 })
    }

    /// Ends the recording, on the disk.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn end(mut self) -> io::Result<()> {
        self.close_block()?;
        writeln!(self.out, "{END}")?;
        self.out.flush()?;
        // A device has nothing to wait for.
        let _ = self.out.get_ref().sync_all();
        Ok(())
    }

    fn close_block(&mut self) -> io::Result<()> {
        writeln!(self.out, "{CHECKSUM}{}", self.sum)?;
        (self.sum, self.lines) = (Checksum::default(), 0);
        Ok(())
    }
}

impl Write for Sealed {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.out.write(bytes)?;
        let written = bytes.get(..count).unwrap_or_default();
        self.sum.add(written);
        if written.ends_with(b"\n") {
            self.lines += 1;
            if self.lines >= BLOCK {
                self.close_block()?;
            }
        }
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}
