//! How messages are carried: over any stream of bytes that loses none.
//!
//! ```text
//! request   length u32 | Request (postcard)
//! reply     length u32 | instructions u32 | Answer (postcard)
//! ```
//!
//! Numbers are little-endian; the length is that of what follows it. This is no link to a robot
//! that drives (`sonarfix-link` is): there is no checksum here and no way back from a lost byte.

use embedded_io::{Read, ReadExactError, Write};
use serde::{Deserialize, Serialize};

use crate::message::{Answer, Request};

/// The longest request, but for [`Request::Begin`], which has a map in it.
pub const REQUEST_MAX: usize = 64;
/// The longest answer.
pub const ANSWER_MAX: usize = 320;
/// Bytes of a length, or of a count.
const WORD: usize = 4;

/// What went wrong on a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LineError<E> {
    /// The other end is gone.
    Closed,
    /// The stream's own error.
    Stream(E),
    /// A message is longer than there is room for.
    TooLong,
    /// The bytes are no message.
    Unreadable,
}

impl<E: core::fmt::Debug> core::fmt::Display for LineError<E> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Closed => f.write_str("the other end is gone"),
            Self::Stream(error) => write!(f, "the line: {error:?}"),
            Self::TooLong => f.write_str("a message is longer than there is room for"),
            Self::Unreadable => f.write_str("what came is no message"),
        }
    }
}

impl<E: core::fmt::Debug> core::error::Error for LineError<E> {}

impl<E> From<ReadExactError<E>> for LineError<E> {
    fn from(error: ReadExactError<E>) -> Self {
        match error {
            ReadExactError::UnexpectedEof => Self::Closed,
            ReadExactError::Other(error) => Self::Stream(error),
        }
    }
}

/// One end of a line.
#[derive(Debug)]
pub struct Line<S>(pub S);

impl<S: Read + Write> Line<S> {
    /// Sends what postcard has made of a request.
    ///
    /// # Errors
    /// [`LineError`].
    pub fn ask(&mut self, request: &[u8]) -> Result<(), LineError<S::Error>> {
        self.send(&[], request)
    }

    /// Takes a request; the bytes that it borrows are in `space`.
    ///
    /// # Errors
    /// [`LineError`].
    pub fn asked<'b>(&mut self, space: &'b mut [u8]) -> Result<Request<'b>, LineError<S::Error>> {
        let bytes = self.take(space)?;
        parse(bytes)
    }

    /// Sends an answer, and what it took.
    ///
    /// # Errors
    /// [`LineError`].
    pub fn reply(&mut self, answer: &Answer, instructions: u32) -> Result<(), LineError<S::Error>> {
        let mut space = [0; ANSWER_MAX];
        let bytes = postcard::to_slice(answer, &mut space).map_err(|_| LineError::TooLong)?;
        self.send(&instructions.to_le_bytes(), bytes)
    }

    /// Takes a reply: what postcard has made of an answer, and what it took.
    ///
    /// # Errors
    /// [`LineError`].
    pub fn replied<'b>(
        &mut self,
        space: &'b mut [u8],
    ) -> Result<(&'b [u8], u32), LineError<S::Error>> {
        let bytes = self.take(space)?;
        let (word, answer) = bytes.split_first_chunk::<WORD>().ok_or(LineError::Unreadable)?;
        Ok((answer, u32::from_le_bytes(*word)))
    }

    fn send(&mut self, head: &[u8], body: &[u8]) -> Result<(), LineError<S::Error>> {
        let length = u32::try_from(head.len() + body.len()).map_err(|_| LineError::TooLong)?;
        for part in [&length.to_le_bytes()[..], head, body] {
            self.0.write_all(part).map_err(LineError::Stream)?;
        }
        self.0.flush().map_err(LineError::Stream)
    }

    fn take<'b>(&mut self, space: &'b mut [u8]) -> Result<&'b [u8], LineError<S::Error>> {
        let mut word = [0; WORD];
        self.0.read_exact(&mut word)?;
        let length = usize::try_from(u32::from_le_bytes(word)).map_err(|_| LineError::TooLong)?;
        let bytes = space.get_mut(..length).ok_or(LineError::TooLong)?;
        self.0.read_exact(bytes)?;
        Ok(bytes)
    }
}

/// A message of these bytes, and of no other.
fn parse<'b, M: Deserialize<'b>, E>(bytes: &'b [u8]) -> Result<M, LineError<E>> {
    match postcard::take_from_bytes(bytes) {
        Ok((message, [])) => Ok(message),
        _ => Err(LineError::Unreadable),
    }
}

/// What postcard makes of a message, in `space`; `None` if there is no room.
pub fn bytes<'b>(message: &impl Serialize, space: &'b mut [u8]) -> Option<&'b [u8]> {
    postcard::to_slice(message, space).ok().map(|bytes| &*bytes)
}

/// The answer that these bytes are.
#[must_use]
pub fn answer(bytes: &[u8]) -> Option<Answer> {
    parse::<Answer, ()>(bytes).ok()
}

/// The request that these bytes are.
#[must_use]
pub fn request(bytes: &[u8]) -> Option<Request<'_>> {
    parse::<Request, ()>(bytes).ok()
}
