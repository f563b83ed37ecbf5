//! The frame around a message.
//!
//! ```text
//! 00  COBS( version u8 | kind u8 | sequence u16 | message (postcard) | CRC-32 u32 )  00
//! ```
//!
//! Numbers are little-endian. COBS removes all zeros from the content, so a zero always delimits a frame. The zero
//! after a frame completes it at once. The zero before it terminates line noise received since the previous frame,
//! which would otherwise corrupt this one. Empty frames are ignored.

use core::marker::PhantomData;

use sonarfix::map::image::Crc32;

use crate::message::Message;

/// The version of the frame's content. It is raised whenever the bytes of any message change (`docs/link.md`).
/// The encoding around the content never changes.
pub const VERSION: u8 = 11;
/// The longest message, in bytes. A test encodes the largest value of each.
pub const MESSAGE_MAX: usize = 784;
/// The longest message of a robot, in bytes. The same test encodes them.
pub const TELEMETRY_MAX: usize = 112;
/// Bytes before the message: version, kind, sequence number.
pub(crate) const HEADER: usize = 4;
/// Bytes after it.
pub(crate) const CHECKSUM: usize = 4;
/// The longest frame before COBS.
pub(crate) const BODY_MAX: usize = HEADER + MESSAGE_MAX + CHECKSUM;
/// The longest frame after COBS, with its delimiters.
pub const FRAME_MAX: usize = cobs::max_encoding_length(BODY_MAX) + 2;
/// The longest frame of a robot.
pub const TELEMETRY_FRAME_MAX: usize =
    cobs::max_encoding_length(HEADER + TELEMETRY_MAX + CHECKSUM) + 2;

/// A buffer for any frame of a [`Sender`].
pub type Buffer = [u8; FRAME_MAX];
/// The initial value of a buffer.
pub const EMPTY: Buffer = [0; FRAME_MAX];

/// A received message.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Frame<M> {
    /// The sender's sequence number.
    pub sequence: u16,
    /// The frame's CRC-32. Frames with equal checksum and sequence number are the same frame.
    pub checksum: u32,
    /// The content.
    pub message: M,
}

/// Encodes messages into numbered frames.
///
/// The first frame after a start has the sequence number 0, which is not used again: 65,535 is followed by 1. A
/// receiver can therefore distinguish a restarted sender from lost frames.
#[derive(Debug, Clone)]
pub struct Sender<M> {
    next: u16,
    message: PhantomData<M>,
}

impl<M: Message> Default for Sender<M> {
    fn default() -> Self {
        Self::new()
    }
}

impl<M: Message> Sender<M> {
    /// A sender that has just started.
    #[must_use]
    pub const fn new() -> Self {
        Self::starting_at(0)
    }

    /// A sender whose first frame has this sequence number. A sender of commands starts at an arbitrary number, so
    /// that it does not repeat the last number of a previous sender ([`Session`](crate::Session)).
    #[must_use]
    pub const fn starting_at(sequence: u16) -> Self {
        Self { next: sequence, message: PhantomData }
    }

    /// The sequence number of the next frame.
    #[must_use]
    pub fn next(&self) -> u16 {
        self.next
    }

    /// Uses a sequence number up, for a message that is dropped: the receiver counts it as lost.
    pub fn skip(&mut self) {
        self.next = self.next.checked_add(1).unwrap_or(1);
    }

    /// Encodes the next message into `buffer`; returns the frame with its delimiters. Every message fits into a [`Buffer`], those
    /// of a robot into [`TELEMETRY_FRAME_MAX`] bytes (a test encodes the largest value of each); of one that did not, the frame
    /// would be empty.
    ///
    /// # Panics
    /// Never.
    pub fn frame<'b>(&mut self, message: &M, buffer: &'b mut [u8]) -> &'b [u8] {
        let sequence = self.next;
        self.skip();
        encode(sequence, message, buffer).unwrap_or_default()
    }
}

fn encode<'b, M: Message>(sequence: u16, message: &M, buffer: &'b mut [u8]) -> Option<&'b [u8]> {
    let [low, high] = sequence.to_le_bytes();
    let mut encoder = Encoder::new(buffer);
    encoder.push(&[VERSION, M::KIND, low, high]);
    let length = postcard::serialize_with_flavor(message, encoder).ok()?;
    buffer.get(..length)
}

/// Encodes a frame in one pass: every byte of the content enters the checksum and the COBS encoding at once.
///
/// COBS replaces each zero by the distance to the next one. The place of that distance, `code`, is reserved when a group
/// begins and filled when it ends: at a zero, or after 254 bytes without one.
struct Encoder<'b> {
    buffer: &'b mut [u8],
    /// Index of the next byte; beyond the buffer after an overflow.
    next: usize,
    /// Index of the code of the present group.
    code: usize,
    checksum: Crc32,
}

/// The longest group of COBS, its code included.
const GROUP: usize = 255;

impl<'b> Encoder<'b> {
    /// An encoder that has written the delimiter before the frame.
    fn new(buffer: &'b mut [u8]) -> Self {
        if let Some(delimiter) = buffer.first_mut() {
            *delimiter = 0;
        }
        Self { buffer, next: 2, code: 1, checksum: Crc32::default() }
    }

    /// Takes bytes of the content. A message has dozens of places that write a number: inlined, this would take much
    /// flash.
    #[inline(never)]
    fn push(&mut self, bytes: &[u8]) {
        // Local copies stay in registers.
        let Self { mut next, mut code, mut checksum, .. } = *self;
        for &byte in bytes {
            checksum = checksum.with(byte);
            if byte != 0 {
                if let Some(place) = self.buffer.get_mut(next) {
                    *place = byte;
                }
                next += 1;
                if next - code != GROUP {
                    continue;
                }
            }
            // The group ends: the distance from its code to the next one, at most 255.
            if let Some(place) = self.buffer.get_mut(code) {
                [*place, ..] = (next - code).to_le_bytes();
            }
            code = next;
            next += 1;
        }
        (self.next, self.code, self.checksum) = (next, code, checksum);
    }
}

impl postcard::ser_flavors::Flavor for Encoder<'_> {
    type Output = usize;

    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        self.push(&[byte]);
        Ok(())
    }

    fn try_extend(&mut self, bytes: &[u8]) -> postcard::Result<()> {
        self.push(bytes);
        Ok(())
    }

    /// Appends the checksum and the delimiter; returns the length.
    fn finalize(mut self) -> postcard::Result<usize> {
        self.push(&self.checksum.value().to_le_bytes());
        // The last group ends as before a zero. The place reserved for the code of another group is that of the delimiter.
        self.push(&[0]);
        self.next = self.code;
        if let Some(place) = self.buffer.get_mut(self.next) {
            *place = 0;
        }
        self.next += 1;
        if self.next > self.buffer.len() {
            return Err(postcard::Error::SerializeBufferFull);
        }
        Ok(self.next)
    }
}
