//! A recording that shows where it is torn.
//!
//! After every 32 lines follows a comment with their checksum, and after the last ones the end. A reader
//! ([`Lines`](sonarfix_replay::lines::Lines)) reports a block with another checksum, and a recording without its end.

use std::fmt::Debug;
use std::io::{self, Write};

use sonarfix_files::Checksum;
use sonarfix_replay::lines::{CHECKSUM, END};

/// Lines with one checksum: at full telemetry those of about a second.
const BLOCK: u32 = 32;

/// What the lines of a recording are written to.
pub trait Output: Write + Debug + Send {
    /// Keeps what was written, after the last line.
    ///
    /// # Errors
    /// If it cannot be written.
    fn end(self: Box<Self>) -> io::Result<()>;
}

/// A recording being written, line by line.
#[derive(Debug)]
pub struct Sealed {
    out: Box<dyn Output>,
    sum: Checksum,
    lines: u32,
}

impl Sealed {
    /// Begins a recording.
    #[must_use]
    pub fn new(out: Box<dyn Output>) -> Self {
        Self { out, sum: Checksum::default(), lines: 0 }
    }

    /// Ends the recording.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn end(mut self) -> io::Result<()> {
        self.close_block()?;
        writeln!(self.out, "{END}")?;
        self.out.end()
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
