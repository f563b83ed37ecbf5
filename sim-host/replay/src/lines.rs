//! Reads lines of any length in bounded memory.

use std::io::{self, BufRead};

use crate::log::Malformed;

/// The longest line that is read: 1 MiB, a scan of a hundred thousand beams.
pub const LONGEST: usize = 1 << 20;

/// The longest line that is skipped. Beyond it the input has no lines, and may have no end.
const LONGEST_SKIPPED: u64 = sonarfix_map::MAX_FILE_BYTES;

/// Reads lines, and counts them.
#[derive(Debug)]
pub struct Lines<R> {
    reader: R,
    number: u64,
    line: Vec<u8>,
}

impl<R: BufRead> Lines<R> {
    /// Reads from the start of a file.
    pub fn of(reader: R) -> Self {
        Self { reader, number: 0, line: Vec::new() }
    }

    /// The number of the line read last, from 1.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// The next line, without its end; `None` after the last.
    ///
    /// # Errors
    /// Errors of the reader; [`io::ErrorKind::FileTooLarge`] for a line that is too long to be skipped. A line that is not text is no error here: it is returned as
    /// [`Malformed`].
    #[expect(clippy::should_implement_trait, reason = "the line is lent until the next one")]
    pub fn next(&mut self) -> io::Result<Option<Result<&str, Malformed>>> {
        let Some(end) = self.read_line()? else {
            return Ok(None);
        };
        self.number += 1;
        Ok(Some(match end {
            End::Torn => Err(Malformed::Torn),
            End::TooLong => Err(Malformed::TooLong),
            End::Newline => std::str::from_utf8(&self.line).map_err(|_| Malformed::NotText),
        }))
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
            if length as u64 > LONGEST_SKIPPED {
                let reason = format!("a line has more than {} MiB", LONGEST_SKIPPED >> 20);
                return Err(io::Error::new(io::ErrorKind::FileTooLarge, reason));
            }
            // A skipped part counts as a line, in case the file ends within it.
            let consumed = here + usize::from(newline.is_some());
            self.reader.consume(consumed);
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

    #[test]
    fn a_line_without_an_end_is_an_error() {
        let mut lines = Lines::of(BufReader::with_capacity(1 << 20, io::repeat(0)));
        assert_eq!(lines.next().unwrap_err().kind(), io::ErrorKind::FileTooLarge);
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
