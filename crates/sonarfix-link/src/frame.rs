//! Frames: how a message is sent.
//!
//! ```text
//! 00  COBS( version u8 | kind u8 | sequence u16 | message (postcard) | CRC-32 u32 )  00
//! ```
//!
//! Numbers are little-endian. COBS leaves no zero inside, so a zero is always an end. There is
//! one on both sides: the one behind completes the frame at once, the one before it ends whatever
//! garbage the line has picked up, which then costs that frame nothing. What stands between two
//! zeros and is empty is ignored.

use core::marker::PhantomData;

use sonarfix::map::image::checksum as crc32;

use crate::VERSION;
use crate::message::Message;

/// The longest message, in bytes. A test makes the largest of each.
pub const MESSAGE_MAX: usize = 164;
/// What stands before the message: version, kind, sequence.
pub(crate) const HEADER: usize = 4;
/// What stands behind it.
pub(crate) const CHECKSUM: usize = 4;
/// The longest frame before COBS.
pub(crate) const BODY_MAX: usize = HEADER + MESSAGE_MAX + CHECKSUM;
/// The longest frame on the wire.
pub const FRAME_MAX: usize = cobs::max_encoding_length(BODY_MAX) + 2;

/// Where a [`Sender`] puts a frame.
pub type Buffer = [u8; FRAME_MAX];
/// A buffer to begin with.
pub const EMPTY: Buffer = [0; FRAME_MAX];

/// A message that came in.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Frame<M> {
    /// Its number in the sender's count.
    pub sequence: u16,
    /// The frame's CRC-32: two frames that agree in it and in the sequence are the same.
    pub checksum: u32,
    /// What it says.
    pub message: M,
}

/// Numbers messages and makes frames of them.
///
/// The first frame after a start has the sequence number 0, and no later one has: after 65,535
/// comes 1. So a receiver can tell a sender that has started anew from frames that were lost.
#[derive(Debug, Clone)]
pub struct Sender<M> {
    next: u16,
    says: PhantomData<M>,
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

    /// A sender whose first frame has this sequence number. One that sends commands starts
    /// anywhere, so that it does not repeat the number of the sender before it
    /// ([`Answered`](crate::Answered)).
    #[must_use]
    pub const fn starting_at(sequence: u16) -> Self {
        Self { next: sequence, says: PhantomData }
    }

    /// The sequence number of the next frame.
    #[must_use]
    pub fn next(&self) -> u16 {
        self.next
    }

    /// The frame of the next message, zeros included, in `buffer`. Every message fits (a test
    /// makes the largest of each); of one that did not, nothing would be sent.
    ///
    /// # Panics
    /// Never.
    pub fn frame<'b>(&mut self, message: &M, buffer: &'b mut Buffer) -> &'b [u8] {
        let sequence = self.next;
        self.next = sequence.checked_add(1).unwrap_or(1);
        encode(sequence, message, buffer).unwrap_or_default()
    }
}

fn encode<'b, M: Message>(sequence: u16, message: &M, buffer: &'b mut Buffer) -> Option<&'b [u8]> {
    let mut body = [0; BODY_MAX];
    let (header, rest) = body.split_first_chunk_mut::<HEADER>()?;
    let [low, high] = sequence.to_le_bytes();
    *header = [VERSION, M::KIND, low, high];
    let (message_space, _) = rest.split_at_mut_checked(MESSAGE_MAX)?;
    let end = HEADER + postcard::to_slice(message, message_space).ok()?.len();
    let checksum = crc32(body.get(..end)?);
    body.get_mut(end..end + CHECKSUM)?.copy_from_slice(&checksum.to_le_bytes());

    let (first, rest) = buffer.split_first_mut()?;
    *first = 0;
    let length = cobs::try_encode(body.get(..end + CHECKSUM)?, rest).ok()?;
    *rest.get_mut(length)? = 0;
    buffer.get(..length + 2)
}
