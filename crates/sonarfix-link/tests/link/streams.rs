//! Random streams of frames and line noise. `SONARFIX_STREAMS=1000000` runs a million.

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sonarfix_link::message::Message;
use sonarfix_link::{Command, Frame, SessionCommand, Telemetry, VERSION};

use crate::messages::{any_command, any_telemetry};
use crate::wire::{framed, in_session, received, sent, to_stdvec};

/// The default number of streams of each kind.
const STREAMS: u64 = 20_000;

fn streams() -> u64 {
    let asked = std::env::var("SONARFIX_STREAMS").ok();
    asked.map_or(STREAMS, |count| count.parse().unwrap())
}

/// A stream, and the frames in it that must be received.
#[derive(Default)]
struct Stream {
    wire: Vec<u8>,
    whole: Vec<(u16, Vec<u8>)>,
    /// Frames, whole or not, and pieces of noise.
    pieces: u64,
}

impl Stream {
    fn of<M: Message>(rng: &mut ChaCha8Rng, any: fn(&mut ChaCha8Rng) -> M) -> Self {
        let mut stream = Self::default();
        for _ in 0..rng.random_range(1..12) {
            stream.piece(rng, any);
        }
        // This frame must be received, whatever precedes it.
        let last = any(rng);
        stream.whole_frame(rng, &last);
        stream
    }

    fn whole_frame<M: Message>(&mut self, rng: &mut ChaCha8Rng, message: &M) {
        let sequence = rng.random();
        self.wire.extend(sent(sequence, message));
        self.whole.push((sequence, to_stdvec(message)));
        self.pieces += 1;
    }

    fn piece<M: Message>(&mut self, rng: &mut ChaCha8Rng, any: fn(&mut ChaCha8Rng) -> M) {
        let message = any(rng);
        let frame = sent(rng.random(), &message);
        match rng.random_range(0..9) {
            0 | 1 => return self.whole_frame(rng, &message),
            2 => self.wire.extend(garbage(rng)),
            3 => self.wire.extend(damaged(rng, frame)),
            // Enough is missing that the following bytes cannot complete it by chance.
            4 => self.wire.extend(&frame[..rng.random_range(0..frame.len() - 5)]),
            5 => self.wire.extend(&frame[rng.random_range(6..frame.len())..]),
            6 => {
                let (version, kind) =
                    if rng.random() { (VERSION ^ 0x10, M::KIND) } else { (VERSION, M::KIND ^ 1) };
                self.wire.extend(framed(version, kind, rng.random(), &to_stdvec(&message)));
            }
            7 => {
                // One byte more than the message has.
                let longer = [to_stdvec(&message), vec![rng.random()]].concat();
                self.wire.extend(framed(VERSION, M::KIND, rng.random(), &longer));
            }
            _ => {
                let length = rng.random_range(100..400);
                self.wire.extend((0..length).map(|_| rng.random_range(1..=u8::MAX)));
            }
        }
        self.pieces += 1;
    }
}

/// Random bytes, with an increased probability of delimiters.
fn garbage(rng: &mut ChaCha8Rng) -> Vec<u8> {
    let length = rng.random_range(1..60);
    let byte = |rng: &mut ChaCha8Rng| if rng.random_ratio(1, 8) { 0 } else { rng.random() };
    (0..length).map(|_| byte(rng)).collect()
}

/// A frame with one to four flipped bits.
fn damaged(rng: &mut ChaCha8Rng, mut frame: Vec<u8>) -> Vec<u8> {
    let whole = frame.clone();
    while frame == whole {
        for _ in 0..rng.random_range(1..5) {
            let bit = rng.random_range(0..8 * frame.len());
            frame[bit / 8] ^= 1 << (bit % 8);
        }
    }
    frame
}

fn found<M: Message>(frames: &[Frame<M>]) -> Vec<(u16, Vec<u8>)> {
    frames.iter().map(|frame| (frame.sequence, to_stdvec(&frame.message))).collect()
}

fn check<M: Message>(any: fn(&mut ChaCha8Rng) -> M) {
    let mut pieces = 0;
    for seed in 0..streams() {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let stream = Stream::of(&mut rng, any);
        let (frames, receiver) = received::<M>(&stream.wire);
        assert_eq!(found(&frames), stream.whole, "seed {seed}: {:02x?}", stream.wire);
        assert_eq!(receiver.counters().frames as usize, frames.len());
        pieces += stream.pieces;
    }
    println!("{pieces} frames and pieces of noise in {} streams", streams());
}

#[test]
fn only_whole_frames_are_found_in_telemetry() {
    check::<Telemetry>(any_telemetry);
}

#[test]
fn only_whole_frames_are_found_in_commands() {
    check::<SessionCommand>(any_command);
}

#[test]
fn random_bytes_yield_no_frame_and_hide_none() {
    for seed in 0..streams() {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut bytes = vec![0; rng.random_range(0..300)];
        rng.fill_bytes(&mut bytes);
        bytes.extend(sent(1, &in_session(&Command::MapChecksum)));
        let (frames, _) = received::<SessionCommand>(&bytes);
        let commands: Vec<_> = frames.iter().map(|frame| frame.message).collect();
        assert_eq!(commands, [in_session(&Command::MapChecksum)], "seed {seed}");
    }
}
