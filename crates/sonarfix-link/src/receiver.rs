//! The receiver: finds frames in whatever comes in, byte by byte.
//!
//! Whatever is not a whole frame of this version and kind, with the right checksum, is counted
//! and skipped; the next frame is found in any case.

use core::marker::PhantomData;

use cobs::{DecodeResult, DecoderState};
use serde::{Deserialize, Serialize};
use sonarfix::map::image::checksum as crc32;

use crate::VERSION;
use crate::frame::{BODY_MAX, CHECKSUM, Frame, HEADER};
use crate::message::Message;

/// What became of what came in. The counts stay at their ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    /// Frames that were read.
    pub frames: u32,
    /// Garbage, damaged and cut frames: no COBS, too short, or not of the checksum they claim.
    pub corrupt: u32,
    /// Longer than any frame.
    pub too_long: u32,
    /// Whole frames of another version or kind.
    pub foreign: u32,
    /// Whole frames of this version and kind that hold no message: a bug of the sender's.
    pub undecodable: u32,
}

impl Counters {
    /// How many were not read.
    #[must_use]
    pub fn skipped(&self) -> u32 {
        [self.corrupt, self.too_long, self.foreign, self.undecodable]
            .into_iter()
            .fold(0, u32::saturating_add)
    }
}

/// Finds the frames of one kind of message.
#[derive(Debug)]
pub struct Receiver<M> {
    cobs: DecoderState,
    /// What has been decoded since the last zero.
    body: [u8; BODY_MAX],
    /// How much of it there is; `None` if there was more than fits.
    length: Option<usize>,
    counters: Counters,
    hears: PhantomData<M>,
}

/// Why what stands between two zeros is no frame.
enum Skipped {
    Corrupt,
    Foreign,
    Undecodable,
}

impl<M: Message> Default for Receiver<M> {
    fn default() -> Self {
        Self::new()
    }
}

impl<M: Message> Receiver<M> {
    /// A receiver that has heard nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            cobs: DecoderState::Idle,
            body: [0; BODY_MAX],
            length: Some(0),
            counters: COUNTERS,
            hears: PhantomData,
        }
    }

    /// Takes a byte; gives the frame that it completes.
    ///
    /// # Panics
    /// Never.
    pub fn push(&mut self, byte: u8) -> Option<Frame<M>> {
        let end = match self.cobs.feed(byte) {
            Ok(DecodeResult::NoData) => return None,
            Ok(DecodeResult::DataContinue(decoded)) => {
                self.keep(decoded);
                return None;
            }
            Ok(DecodeResult::DataComplete) => Ok(()),
            // The zero came too early. It may be the one before a frame: nothing else is lost.
            Err(_) => Err(Skipped::Corrupt),
        };
        let Some(length) = self.length.replace(0) else {
            count(&mut self.counters.too_long);
            return None;
        };
        let body = self.body.get(..length).unwrap_or_default();
        match end.and_then(|()| read(body)) {
            Ok(frame) => {
                count(&mut self.counters.frames);
                Some(frame)
            }
            Err(Skipped::Corrupt) => {
                count(&mut self.counters.corrupt);
                None
            }
            Err(Skipped::Foreign) => {
                count(&mut self.counters.foreign);
                None
            }
            Err(Skipped::Undecodable) => {
                count(&mut self.counters.undecodable);
                None
            }
        }
    }

    /// What became of what came in.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.counters
    }

    fn keep(&mut self, decoded: u8) {
        self.length = self.length.and_then(|length| {
            *self.body.get_mut(length)? = decoded;
            Some(length + 1)
        });
    }
}

const COUNTERS: Counters =
    Counters { frames: 0, corrupt: 0, too_long: 0, foreign: 0, undecodable: 0 };

fn count(counter: &mut u32) {
    *counter = counter.saturating_add(1);
}

/// Reads what stood between two zeros. The checksum comes first: nothing is believed without it.
fn read<M: Message>(body: &[u8]) -> Result<Frame<M>, Skipped> {
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
    match postcard::take_from_bytes(message) {
        Ok((message, [])) => {
            Ok(Frame { sequence: u16::from_le_bytes([low, high]), checksum, message })
        }
        _ => Err(Skipped::Undecodable),
    }
}

/// Counts the frames of one sender that were lost, by the gaps in their sequence numbers.
///
/// Beside the receiver and not in it, because only telemetry is one sender's: commands may come
/// from several, each with numbers of its own.
///
/// ```
/// use sonarfix_link::Gaps;
/// let mut gaps = Gaps::default();
/// for sequence in [65_533, 65_535, 1, 2] {
///     gaps.take(sequence);
/// }
/// assert_eq!(gaps.lost(), 1);
/// gaps.take(0); // the sender has started anew
/// assert_eq!((gaps.lost(), gaps.restarts()), (1, 1));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Gaps {
    last: Option<u16>,
    lost: u32,
    restarts: u32,
}

impl Gaps {
    /// Takes note of a frame; gives the number of those lost before it.
    pub fn take(&mut self, sequence: u16) -> u32 {
        let lost = match self.last.replace(sequence) {
            None => 0,
            Some(_) if sequence == 0 => {
                count(&mut self.restarts);
                0
            }
            Some(last) => between(last, sequence),
        };
        self.lost = self.lost.saturating_add(lost);
        lost
    }

    /// How many frames were lost in all.
    #[must_use]
    pub fn lost(&self) -> u32 {
        self.lost
    }

    /// How often the sender has started anew.
    #[must_use]
    pub fn restarts(&self) -> u32 {
        self.restarts
    }
}

/// How many sequence numbers lie between two: they go from 1 to 65,535 and on to 1.
fn between(last: u16, sequence: u16) -> u32 {
    const PERIOD: u32 = u16::MAX as u32;
    let ahead = (u32::from(sequence) + PERIOD - u32::from(last)) % PERIOD;
    ahead.saturating_sub(1)
}
