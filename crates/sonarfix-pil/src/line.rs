//! Transfers messages over a lossless stream of bytes.
//!
//! ```text
//! request   length u32 | Request (postcard)
//! reply     length u32 | instructions u32 | Answer (postcard)
//! ```
//!
//! Numbers are little-endian; the length counts the bytes that follow it. There is no checksum, and no
//! resynchronization after a lost byte: the link to a driving robot is `sonarfix-link`.

use embedded_io::{Read, ReadExactError, Write};
use serde::{Deserialize, Serialize};

use crate::message::{Answer, Request};

/// The longest request, except [`Request::Begin`], which contains a map.
pub const REQUEST_MAX: usize = 64;
/// The longest answer.
pub const ANSWER_MAX: usize = 320;
/// Bytes of a length, or of a count.
const WORD: usize = 4;

/// An error of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum LineError<E> {
    /// The other end has closed the stream.
    Closed,
    /// The stream's own error.
    Stream(E),
    /// A message is longer than its buffer.
    TooLong,
    /// The bytes are not a message.
    Unreadable,
}

impl<E: core::fmt::Debug> core::fmt::Display for LineError<E> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Closed => f.write_str("the other end has closed the stream"),
            Self::Stream(error) => write!(f, "the line: {error:?}"),
            Self::TooLong => f.write_str("a message is longer than its buffer"),
            Self::Unreadable => f.write_str("the received bytes are not a message"),
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
    /// Sends an encoded request.
    ///
    /// # Errors
    /// [`LineError`].
    pub fn send_request(&mut self, request: &[u8]) -> Result<(), LineError<S::Error>> {
        self.send(&[], request)
    }

    /// Receives a request, which borrows from `space`.
    ///
    /// # Errors
    /// [`LineError`].
    pub fn receive_request<'b>(
        &mut self,
        space: &'b mut [u8],
    ) -> Result<Request<'b>, LineError<S::Error>> {
        let bytes = self.receive(space)?;
        decode(bytes)
    }

    /// Sends an answer and the number of its instructions.
    ///
    /// # Errors
    /// [`LineError`].
    pub fn send_reply(
        &mut self,
        answer: &Answer,
        instructions: u32,
    ) -> Result<(), LineError<S::Error>> {
        let mut space = [0; ANSWER_MAX];
        let bytes = postcard::to_slice(answer, &mut space).map_err(|_| LineError::TooLong)?;
        self.send(&instructions.to_le_bytes(), bytes)
    }

    /// Receives a reply: an encoded answer and the number of its instructions.
    ///
    /// # Errors
    /// [`LineError`].
    pub fn receive_reply<'b>(
        &mut self,
        space: &'b mut [u8],
    ) -> Result<(&'b [u8], u32), LineError<S::Error>> {
        let bytes = self.receive(space)?;
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

    fn receive<'b>(&mut self, space: &'b mut [u8]) -> Result<&'b [u8], LineError<S::Error>> {
        let mut word = [0; WORD];
        self.0.read_exact(&mut word)?;
        let length = usize::try_from(u32::from_le_bytes(word)).map_err(|_| LineError::TooLong)?;
        let bytes = space.get_mut(..length).ok_or(LineError::TooLong)?;
        self.0.read_exact(bytes)?;
        Ok(bytes)
    }
}

/// Decodes a message, which must use all bytes.
fn decode<'b, M: Deserialize<'b>, E>(bytes: &'b [u8]) -> Result<M, LineError<E>> {
    match postcard::take_from_bytes(bytes) {
        Ok((message, [])) => Ok(message),
        _ => Err(LineError::Unreadable),
    }
}

/// Encodes a message into `space`; `None` if it does not fit.
pub fn encode<'b>(message: &impl Serialize, space: &'b mut [u8]) -> Option<&'b [u8]> {
    postcard::to_slice(message, space).ok().map(|bytes| &*bytes)
}

/// Decodes an answer.
#[must_use]
pub fn decode_answer(bytes: &[u8]) -> Option<Answer> {
    decode::<Answer, ()>(bytes).ok()
}

/// Decodes a request.
#[must_use]
pub fn decode_request(bytes: &[u8]) -> Option<Request<'_>> {
    decode::<Request, ()>(bytes).ok()
}
