//! Damaged, truncated, repeated and foreign frames.

use sonarfix_link::message::Message;
use sonarfix_link::{Command, Gaps, ReceiverCounters, SessionCommand, Telemetry, VERSION};

use crate::messages::{COMMANDS, Counting, TELEMETRY, command, telemetry};
use crate::wire::{framed, in_session, received, sent, to_stdvec};

fn telemetry_example(kind: u32) -> Telemetry {
    telemetry(kind, &mut Counting { next: 0, variant: 0 })
}

fn command_example(kind: u32) -> SessionCommand {
    command(kind, &mut Counting { next: 0, variant: 0 })
}

/// The number of frames received from a damaged frame, followed by a valid one, which must be received.
fn through<M: Message + PartialEq + core::fmt::Debug>(damaged: &[u8], message: &M) -> usize {
    let wire = [damaged, &sent(9, message)].concat();
    let (frames, receiver) = received::<M>(&wire);
    let last = frames.last().unwrap();
    assert_eq!((last.sequence, &last.message), (9, message), "{damaged:02x?}");
    assert_eq!(receiver.counters().frames as usize, frames.len());
    frames.len() - 1
}

fn no_flip_is_accepted<M: Message + PartialEq + core::fmt::Debug>(message: &M) {
    let wire = sent(8, message);
    for bit in 0..8 * wire.len() {
        let mut flipped = wire.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(through(&flipped, message), 0, "bit {bit} of {wire:02x?}");
    }
}

#[test]
fn every_flipped_bit_costs_that_frame_and_no_other() {
    (0..TELEMETRY).for_each(|kind| no_flip_is_accepted(&telemetry_example(kind)));
    (0..COMMANDS).for_each(|kind| no_flip_is_accepted(&command_example(kind)));
}

#[test]
fn every_cut_costs_that_frame_and_no_other() {
    for kind in 0..TELEMETRY {
        let message = telemetry_example(kind);
        let wire = sent(8, &message);
        for length in 0..wire.len() - 1 {
            assert_eq!(through(&wire[..length], &message), 0, "{length} of {wire:02x?}");
        }
        // Without its own, the delimiter before the next frame terminates it.
        assert_eq!(through(&wire[..wire.len() - 1], &message), 1);
        for start in 2..wire.len() {
            assert_eq!(through(&wire[start..], &message), 0, "from {start} of {wire:02x?}");
        }
    }
}

#[test]
fn garbage_before_a_frame_costs_nothing() {
    for byte in 1..=u8::MAX {
        for length in 1..300 {
            let (frames, receiver) = received::<SessionCommand>(
                &[vec![byte; length], sent(3, &in_session(&Command::Stop))].concat(),
            );
            assert_eq!(frames.len(), 1, "{length} times {byte}");
            let skipped = receiver.counters();
            assert_eq!((skipped.frames, skipped.skipped()), (1, 1), "{length} times {byte}");
        }
    }
}

#[test]
fn skipped_frames_are_counted_by_reason() {
    let message = to_stdvec(&in_session(&Command::Stop));
    let count = |wire: &[u8]| {
        let (frames, receiver) = received::<SessionCommand>(wire);
        assert!(frames.is_empty(), "{wire:02x?}");
        receiver.counters()
    };
    let none = ReceiverCounters::default();
    let (ours, theirs) = (SessionCommand::KIND, Telemetry::KIND);
    assert_eq!(count(&[0; 100]), none, "empty frames are no frames");
    assert_eq!(count(&[0, 5, 1, 0]), ReceiverCounters { corrupt: 1, ..none });
    assert_eq!(count(&[0, 1, 1, 0]), ReceiverCounters { corrupt: 1, ..none }, "too short");
    assert_eq!(
        count(&[&[0], &[1; 900][..], &[0]].concat()),
        ReceiverCounters { too_long: 1, ..none }
    );
    let foreign = ReceiverCounters { foreign: 1, ..none };
    assert_eq!(count(&framed(VERSION + 1, ours, 0, &message)), foreign);
    assert_eq!(count(&framed(VERSION, theirs, 0, &message)), foreign);
    assert_eq!(count(&framed(VERSION, 7, 0, &message)), foreign);
    assert_eq!(count(&sent(0, &telemetry_example(0))), foreign);
    let undecodable = ReceiverCounters { undecodable: 1, ..none };
    assert_eq!(count(&framed(VERSION, ours, 0, &[1, 9])), undecodable, "no such command");
    assert_eq!(count(&framed(VERSION, ours, 0, &[])), undecodable, "nothing");
    assert_eq!(count(&framed(VERSION, ours, 0, &[&message[..], &[0]].concat())), undecodable);
    let pose = to_stdvec(&command_example(0));
    assert_eq!(
        count(&framed(VERSION, ours, 0, &pose[..pose.len() - 1])),
        undecodable,
        "half of it"
    );
}

#[test]
fn a_repeated_frame_is_read_twice() {
    let wire = sent(5, &in_session(&Command::Start));
    let (frames, _) = received::<SessionCommand>(&[&wire[..], &wire].concat());
    assert_eq!(frames.len(), 2);
    assert_eq!(frames[0], frames[1]);
}

#[test]
fn gaps_are_the_frames_that_are_missing() {
    let lost = |sequences: &[u16]| {
        let mut gaps = Gaps::default();
        let each: Vec<_> = sequences.iter().map(|&sequence| gaps.take(sequence)).collect();
        assert_eq!(gaps.lost(), each.iter().sum());
        (gaps.lost(), gaps.restarts())
    };
    assert_eq!(lost(&[0, 1, 2, 3]), (0, 0));
    assert_eq!(lost(&[41, 44, 45, 47]), (3, 0));
    assert_eq!(lost(&[65_534, 65_535, 1, 2]), (0, 0));
    assert_eq!(lost(&[65_534, 2]), (2, 0), "65,535 and 1: none has the number 0 again");
    assert_eq!(lost(&[7, 7, 7, 8]), (0, 0), "a repeat is no loss");
    assert_eq!(lost(&[500, 0, 1]), (0, 1), "it has restarted");
    assert_eq!(lost(&[0, 2]), (1, 0));
}
