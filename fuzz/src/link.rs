//! The link's receiver: it counts any input, and receives the frame after it.

use sonarfix::map::image::checksum as crc32;
use sonarfix_link::message::Message;
use sonarfix_link::{Frame, Receiver, Sender, SessionCommand, Telemetry, VERSION, frame};

/// Sends noise, the noise as the content of a frame, a damaged frame, and a valid one, which must be received; for a receiver of either kind.
/// The bytes are a sequence number, a bit to flip, the message's length, the message and the noise.
///
/// # Panics
/// If an invariant is violated.
pub fn link(bytes: &[u8]) {
    let &[low, high, bit, length, ref rest @ ..] = bytes else { return };
    let (message, garbage) = rest.split_at(rest.len().min(length.into()));
    let sequence = u16::from_le_bytes([low, high]);
    hear::<Telemetry>(sequence, bit, message, garbage);
    hear::<SessionCommand>(sequence, bit, message, garbage);
}

fn hear<M: Message>(sequence: u16, bit: u8, message: &[u8], garbage: &[u8]) {
    let mut line = Line::<M>::default();
    line.push(garbage);
    // Terminates the noise, so that the next frame is separate from it.
    line.push(&[0]);
    line.push(&sealed::<M>(sequence, garbage));
    // Missing bytes are zeros. Not all bytes are a valid message.
    let Ok((message, _)) = postcard::take_from_bytes::<M>(&[message, &[0; 256]].concat()) else {
        return;
    };
    let mut buffer = frame::EMPTY;
    let whole = Sender::starting_at(sequence).frame(&message, &mut buffer);
    assert!(!whole.is_empty(), "a message that fits in no frame");
    let mut damaged = whole.to_vec();
    let place = usize::from(bit) % damaged.len();
    damaged[place] ^= 1 << (bit % 8);
    assert!(line.push(&damaged).is_none(), "a damaged frame is received: {damaged:02x?}");

    let heard = line.push(whole).expect("a whole frame is not heard");
    assert_eq!(heard.sequence, sequence);
    // Compared as bytes, because a NaN does not equal itself.
    assert_eq!(spelled(&heard.message), spelled(&message));
}

/// A receiver with its expected counts.
struct Line<M> {
    receiver: Receiver<M>,
    heard: u32,
    /// Non-empty sequences of bytes between zeros.
    ended: u32,
    is_empty: bool,
}

impl<M: Message> Default for Line<M> {
    fn default() -> Self {
        Self { receiver: Receiver::new(), heard: 0, ended: 0, is_empty: true }
    }
}

impl<M: Message> Line<M> {
    /// Passes these bytes to the receiver; returns the frame that the last one completes.
    fn push(&mut self, bytes: &[u8]) -> Option<Frame<M>> {
        let mut last = None;
        for &byte in bytes {
            last = self.receiver.push(byte);
            if byte == 0 {
                self.ended += u32::from(!self.is_empty);
            }
            self.is_empty = byte == 0;
            if let Some(frame) = &last {
                self.heard += 1;
                assert!(byte == 0, "a frame before its end");
                let encoded = spelled(&frame.message);
                let again = postcard::from_bytes::<M>(&encoded).map(|message| spelled(&message));
                assert_eq!(again, Ok(encoded), "encoded again it differs");
            }
        }
        let counters = self.receiver.counters();
        assert_eq!(counters.frames, self.heard, "{counters:?}");
        assert_eq!(counters.frames + counters.skipped(), self.ended, "{counters:?}");
        last
    }
}

/// A frame with these bytes in place of a message.
fn sealed<M: Message>(sequence: u16, content: &[u8]) -> Vec<u8> {
    let [low, high] = sequence.to_le_bytes();
    let mut body = [&[VERSION, M::KIND, low, high], content].concat();
    body.extend(crc32(&body).to_le_bytes());
    [&[0], &stuffed(&body)[..], &[0]].concat()
}

/// Consistent overhead byte stuffing: replaces each zero by the distance to the next.
fn stuffed(body: &[u8]) -> Vec<u8> {
    let mut stuffed = Vec::new();
    for run in body.split(|&byte| byte == 0) {
        let (whole, rest) = run.as_chunks::<254>();
        whole.iter().for_each(|chunk| stuffed.extend([&[0xff], &chunk[..]].concat()));
        // The distance fits: there are fewer than 254 left.
        stuffed.extend([&[rest.len() as u8 + 1], rest].concat());
    }
    stuffed
}

fn spelled<M: Message>(message: &M) -> Vec<u8> {
    let mut space = [0; 1024];
    postcard::to_slice(message, &mut space).expect("a message is short").to_vec()
}
