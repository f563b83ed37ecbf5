//! Finds the frames in a stream of bytes.
//!
//! Everything other than a complete frame of this version and kind with a valid checksum is counted and skipped. The
//! receiver resynchronizes at the next delimiter.

use core::marker::PhantomData;

use cobs::{DecodeResult, DecoderState};
use postcard::Deserializer;
use sonarfix::map::image::checksum as crc32;

use crate::counters::ReceiverCounters;
use crate::frame::{BODY_MAX, CHECKSUM, Frame, HEADER, VERSION};
use crate::message::Message;

/// Finds the frames of one kind of message.
#[derive(Debug)]
pub struct Receiver<M> {
    cobs: DecoderState,
    /// The bytes decoded since the last delimiter.
    body: [u8; BODY_MAX],
    /// Their number; `None` if there were more than fit.
    length: Option<usize>,
    counters: ReceiverCounters,
    message: PhantomData<M>,
}

/// Why the bytes between two delimiters are not a frame.
enum Skipped {
    Corrupt,
    Foreign,
}

impl<M: Message> Default for Receiver<M> {
    fn default() -> Self {
        Self::new()
    }
}

impl<M: Message> Receiver<M> {
    /// A receiver that has received nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            cobs: DecoderState::Idle,
            body: [0; BODY_MAX],
            length: Some(0),
            counters: ReceiverCounters::ZERO,
            message: PhantomData,
        }
    }

    /// Takes one byte; returns the frame that it completes.
    ///
    /// # Panics
    /// Never.
    pub fn push(&mut self, byte: u8) -> Option<Frame<M>> {
        let end = match self.cobs.feed(byte) {
            Ok(DecodeResult::NoData) => return None,
            Ok(DecodeResult::DataContinue(decoded)) => {
                self.store(decoded);
                return None;
            }
            Ok(DecodeResult::DataComplete) => Ok(()),
            // A premature zero. It may be the delimiter before a frame, which is not lost.
            Err(_) => Err(Skipped::Corrupt),
        };
        let Some(length) = self.length.replace(0) else {
            increment(&mut self.counters.too_long);
            return None;
        };
        let body = self.body.get(..length).unwrap_or_default();
        let checked = end.and_then(|()| checked::<M>(body));
        let frame = checked.as_ref().ok().and_then(decoded);
        increment(match (&checked, &frame) {
            (Ok(_), Some(_)) => &mut self.counters.frames,
            (Ok(_), None) => &mut self.counters.undecodable,
            (Err(Skipped::Corrupt), _) => &mut self.counters.corrupt,
            (Err(Skipped::Foreign), _) => &mut self.counters.foreign,
        });
        frame
    }

    /// The numbers of frames read and skipped.
    #[must_use]
    pub fn counters(&self) -> ReceiverCounters {
        self.counters
    }

    fn store(&mut self, decoded: u8) {
        self.length = self.length.and_then(|length| {
            *self.body.get_mut(length)? = decoded;
            Some(length + 1)
        });
    }
}

fn increment(counter: &mut u32) {
    *counter = counter.saturating_add(1);
}

/// Checks the bytes between two delimiters. The checksum is verified before any other field is used.
fn checked<M: Message>(body: &[u8]) -> Result<Frame<&[u8]>, Skipped> {
    let (content, checksum) = body.split_last_chunk::<CHECKSUM>().ok_or(Skipped::Corrupt)?;
    let checksum = u32::from_le_bytes(*checksum);
    let (header, message) = content.split_first_chunk::<HEADER>().ok_or(Skipped::Corrupt)?;
    if crc32(content) != checksum {
        return Err(Skipped::Corrupt);
    }
    let [version, kind, low, high] = *header;
    if version != VERSION || kind != M::KIND {
        return Err(Skipped::Foreign);
    }
    Ok(Frame { sequence: u16::from_le_bytes([low, high]), checksum, message })
}

/// The frame, if its bytes are those of a message and nothing else. A message can be as large as a configuration: it is decoded in place.
#[inline]
fn decoded<M: Message>(frame: &Frame<&[u8]>) -> Option<Frame<M>> {
    let Frame { sequence, checksum, message: bytes } = *frame;
    let mut deserializer = Deserializer::from_bytes(bytes);
    let message = M::deserialize(&mut deserializer);
    let is_whole = matches!(deserializer.finalize(), Ok([]));
    match message {
        Ok(message) if is_whole => Some(Frame { sequence, checksum, message }),
        _ => Some(Frame { sequence, checksum, message: M::substitute(bytes)? }),
    }
}
