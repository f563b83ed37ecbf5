//! An independent implementation of the frame by its description in `docs/link.md`, with its own CRC and COBS.

use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sonarfix_link::message::Message;
use sonarfix_link::{Command, Frame, Receiver, Sender, SessionCommand, Telemetry, VERSION, frame};

use crate::messages::{any_command, any_telemetry};

/// CRC-32, bit by bit.
pub fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    for byte in bytes {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            let carry = crc & 1 == 1;
            crc >>= 1;
            if carry {
                crc ^= 0xedb8_8320;
            }
        }
    }
    !crc
}

/// Consistent overhead byte stuffing: replaces each zero by the distance to the next, and interrupts runs of 254 bytes
/// without one.
fn stuff(body: &[u8]) -> Vec<u8> {
    let mut stuffed = Vec::new();
    for run in body.split(|&byte| byte == 0) {
        let whole = run.len() - run.len() % 254;
        run[..whole].chunks(254).for_each(|chunk| stuffed.extend([&[0xff], chunk].concat()));
        stuffed.push(u8::try_from(run.len() - whole + 1).unwrap());
        stuffed.extend(&run[whole..]);
    }
    stuffed
}

/// A frame on the wire.
pub fn framed(version: u8, kind: u8, sequence: u16, message: &[u8]) -> Vec<u8> {
    let mut body = vec![version, kind];
    body.extend(sequence.to_le_bytes());
    body.extend(message);
    body.extend(crc32(&body).to_le_bytes());
    [&[0], &stuff(&body)[..], &[0]].concat()
}

/// The frame from a sender.
pub fn sent<M: Message>(sequence: u16, message: &M) -> Vec<u8> {
    Sender::starting_at(sequence).frame(message, &mut frame::EMPTY.clone()).to_vec()
}

/// A command in session 5.
pub fn in_session(command: &Command) -> SessionCommand {
    SessionCommand { session: 5, command: *command }
}

/// All frames that a receiver finds.
pub fn received<M: Message>(wire: &[u8]) -> (Vec<Frame<M>>, Receiver<M>) {
    let mut receiver = Receiver::new();
    let frames = wire.iter().filter_map(|&byte| receiver.push(byte)).collect();
    (frames, receiver)
}

fn round_trip<M: Message>(sequence: u16, message: &M) {
    let wire = sent(sequence, message);
    let bytes = postcard::to_stdvec(message);
    assert_eq!(wire, framed(VERSION, M::KIND, sequence, &bytes));
    let (frames, receiver) = received::<M>(&wire);
    assert_eq!(
        (frames.len(), receiver.counters().frames, receiver.counters().skipped()),
        (1, 1, 0)
    );
    assert_eq!(frames[0].sequence, sequence);
    // Compared as bytes, because a NaN does not equal itself.
    assert_eq!(postcard::to_stdvec(&frames[0].message), bytes);
}

/// `postcard::to_stdvec` is behind a feature that the crate does not need.
mod postcard {
    pub fn to_stdvec(message: &impl serde::Serialize) -> Vec<u8> {
        let mut space = [0; 1024];
        ::postcard::to_slice(message, &mut space).unwrap().to_vec()
    }
}
pub use self::postcard::to_stdvec;

proptest! {
    /// Every message is received, and its frame is the documented one.
    #[test]
    fn every_message_is_received(seed in any::<u64>(), sequence in any::<u16>()) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        round_trip(sequence, &any_telemetry(&mut rng));
        round_trip(sequence, &any_command(&mut rng));
    }
}

/// The example of `docs/link.md`, assembled by hand.
#[test]
fn the_documents_example_is_right() {
    const STOP: [u8; 13] = [0x00, 0x04, 0x0b, 0x01, 0x07, 0x07, 0x05, 0x03, 0, 0, 0, 0, 0x00];
    let documents = include_str!("../../../../docs/link.md");
    let wire = sent(7, &in_session(&Command::Stop));
    let hex: Vec<_> = wire.iter().map(|byte| format!("{byte:02x}")).collect();
    assert!(documents.contains(&hex.join(" ")), "{}", hex.join(" "));
    assert_eq!(wire[..8], STOP[..8]);
    assert_eq!(wire[12], STOP[12]);
}

#[test]
fn sequence_numbers_start_at_0_and_never_come_back_to_it() {
    let mut sender = Sender::<Telemetry>::new();
    assert_eq!(sender.next(), 0);
    let mut sender_late = Sender::starting_at(65_535);
    sender_late.frame(&in_session(&Command::Stop), &mut frame::EMPTY.clone());
    assert_eq!(sender_late.next(), 1);
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    sender.frame(&any_telemetry(&mut rng), &mut frame::EMPTY.clone());
    assert_eq!(sender.next(), 1);
}
