//! Reads lines of any length in bounded memory.

use std::io::{self, BufRead};

use sonarfix_files::Checksum;

use crate::log::Malformed;

/// The longest line that is read: 1 MiB, a scan of a hundred thousand beams.
pub const LONGEST: usize = 1 << 20;

/// Begins the comment with the checksum of the lines since the one before it. A log with checksums has an [`END`].
pub const CHECKSUM: &str = "# checksum ";
/// The last line of a log with checksums.
pub const END: &str = "# end";

/// The most bytes that are skipped, of one line or of all lines that are not text. Beyond it the input is no log, and may
/// have no end.
const MOST_SKIPPED: u64 = sonarfix_map::MAX_FILE_BYTES;

/// Reads lines, and counts them.
#[derive(Debug)]
pub struct Lines<R> {
    reader: R,
    number: u64,
    line: Vec<u8>,
    /// Bytes of all lines that are no text, or too long.
    skipped: u64,
    /// Of the lines since the last checksum.
    sum: Checksum,
    /// Whether an end must follow.
    is_open: bool,
}

impl<R: BufRead> Lines<R> {
    /// Reads from the start of a file.
    pub fn of(reader: R) -> Self {
        Self {
            reader,
            number: 0,
            line: Vec::new(),
            skipped: 0,
            sum: Checksum::default(),
            is_open: false,
        }
    }

    /// The number of the line read last, from 1.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// The next line, without its end; `None` after the last.
    ///
    /// # Errors
    /// Errors of the reader; [`io::ErrorKind::FileTooLarge`] if more than 256 MiB are skipped. A line that is not text is no
    /// error here: it is returned as [`Malformed`], as are a wrong checksum and a missing end.
    #[expect(clippy::should_implement_trait, reason = "the line is lent until the next one")]
    pub fn next(&mut self) -> io::Result<Option<Result<&str, Malformed>>> {
        let Some(end) = self.read_line()? else {
            let is_torn = std::mem::take(&mut self.is_open);
            self.number += u64::from(is_torn);
            return Ok(is_torn.then_some(Err(Malformed::NoEnd)));
        };
        self.number += 1;
        if std::str::from_utf8(&self.line).is_err() {
            self.skip(self.line.len() as u64)?;
        }
        let is_whole = self.check();
        Ok(Some(match end {
            End::Torn => Err(Malformed::Torn),
            End::TooLong => Err(Malformed::TooLong),
            End::Newline if !is_whole => Err(Malformed::Changed),
            End::Newline => std::str::from_utf8(&self.line).map_err(|_| Malformed::NotText),
        }))
    }

    /// Adds the line to the checksum of its block; false if it is the checksum of other lines.
    fn check(&mut self) -> bool {
        let line = self.line.as_slice();
        if let Some(sum) = line.strip_prefix(CHECKSUM.as_bytes()) {
            self.is_open = true;
            return sum == std::mem::take(&mut self.sum).to_string().as_bytes();
        }
        self.is_open &= line != END.as_bytes();
        self.sum.add(line);
        self.sum.add(b"\n");
        true
    }

    /// Counts skipped bytes.
    fn skip(&mut self, bytes: u64) -> io::Result<()> {
        self.skipped = self.skipped.saturating_add(bytes);
        if self.skipped > MOST_SKIPPED {
            let reason =
                format!("more than {} MiB of it are not lines of text", MOST_SKIPPED >> 20);
            return Err(io::Error::new(io::ErrorKind::FileTooLarge, reason));
        }
        Ok(())
    }

    fn read_line(&mut self) -> io::Result<Option<End>> {
        self.line.clear();
        let mut length = 0_usize;
        loop {
            let available = match self.reader.fill_buf() {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                other => other?,
            };
            if available.is_empty() {
                return Ok((length > 0).then_some(End::Torn));
            }
            let newline = available.iter().position(|&byte| byte == b'\n');
            let here = newline.unwrap_or(available.len());
            length = length.saturating_add(here);
            if length <= LONGEST {
                self.line.extend(available.iter().take(here));
            }
            // A skipped part counts as a line, in case the file ends within it.
            let consumed = here + usize::from(newline.is_some());
            self.reader.consume(consumed);
            if length > LONGEST {
                self.skip(here as u64)?;
            }
            if newline.is_some() {
                return Ok(Some(if length <= LONGEST { End::Newline } else { End::TooLong }));
            }
        }
    }
}

enum End {
    Newline,
    TooLong,
    Torn,
}

#[cfg(test)]
mod tests {
    use std::io::BufReader;

    use super::*;

    fn all(text: &[u8], buffer: usize) -> Vec<Result<String, Malformed>> {
        let mut lines = Lines::of(BufReader::with_capacity(buffer, text));
        let mut all = Vec::new();
        while let Some(line) = lines.next().unwrap() {
            all.push(line.map(str::to_owned));
        }
        assert_eq!(lines.number(), all.len() as u64);
        assert!(lines.line.capacity() <= 2 * LONGEST, "memory is bounded");
        all
    }

    #[test]
    fn lines_are_whole_with_any_buffer() {
        for buffer in [1, 2, 3, 100] {
            let lines = all(b"one\n\nthr\xc3\xa9e\r\n\xff\nfive", buffer);
            let expected = [
                Ok("one".to_owned()),
                Ok(String::new()),
                Ok("thrée\r".to_owned()),
                Err(Malformed::NotText),
                Err(Malformed::Torn),
            ];
            assert_eq!(lines, expected);
        }
    }

    /// A log with checksums is whole only with its end, and unchanged.
    #[test]
    fn a_torn_log_is_found() {
        let block = |text: &str| format!("{text}{CHECKSUM}{}\n", Checksum::of(text));
        let log = block("one\ntwo\n") + &block("three\n") + END + "\n";
        let found = |text: &str| all(text.as_bytes(), 7).into_iter().filter_map(Result::err);
        assert_eq!(found(&log).count(), 0);
        for end in 1..log.len() {
            let is_open = log[..end].contains(CHECKSUM);
            assert!(found(&log[..end]).count() > 0 || !is_open || end == log.len() - 1, "{end}");
        }
        assert!(found(&log.replace("two", "too")).eq([Malformed::Changed]));
        assert!(found(&log.replace("three\n", "")).eq([Malformed::Changed]));
    }

    #[test]
    fn a_line_without_an_end_is_an_error() {
        let mut lines = Lines::of(BufReader::with_capacity(1 << 20, io::repeat(0)));
        assert_eq!(lines.next().unwrap_err().kind(), io::ErrorKind::FileTooLarge);
    }

    #[test]
    fn endless_lines_that_are_not_text_are_an_error() {
        let mut bytes = vec![0xff; 100_000];
        bytes.push(b'\n');
        let mut lines = Lines::of(BufReader::new(Repeated { bytes, at: 0 }));
        let error = loop {
            match lines.next() {
                Ok(line) => assert!(line.unwrap().is_err()),
                Err(error) => break error,
            }
        };
        assert_eq!(error.kind(), io::ErrorKind::FileTooLarge);
        assert!(lines.number() > 2000, "many such lines are read before");
    }

    /// The same bytes for ever.
    struct Repeated {
        bytes: Vec<u8>,
        at: usize,
    }

    impl io::Read for Repeated {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            let rest = &self.bytes[self.at..];
            let count = rest.len().min(buffer.len());
            buffer[..count].copy_from_slice(&rest[..count]);
            self.at = (self.at + count) % self.bytes.len();
            Ok(count)
        }
    }

    #[test]
    fn an_overlong_line_is_skipped_and_not_stored() {
        let mut text = vec![b'x'; 3 * LONGEST];
        text.extend(b"\nnext\n");
        let lines = all(&text, 1 << 13);
        assert_eq!(lines, [Err(Malformed::TooLong), Ok("next".to_owned())]);
        let mut longest = vec![b'x'; LONGEST];
        longest.push(b'\n');
        assert!(all(&longest, 1 << 13)[0].is_ok());
    }
}
