//! A command is executed once.

use sonarfix_link::message::ImageStatus;
use sonarfix_link::{Ack, Command, CommandResult, Deduplicator, Frame, Telemetry};

use crate::wire::{received, sent};

fn frame(sequence: u16, command: &Command) -> Frame<Command> {
    received(&sent(sequence, command)).0[0]
}

#[test]
fn a_repeat_is_answered_as_before_and_not_done_again() {
    let mut answered = Deduplicator::default();
    let mut done = Vec::new();
    let mut give = |frame: &Frame<Command>| {
        let outcome = CommandResult::Map(ImageStatus::Valid(u32::try_from(done.len()).unwrap()));
        answered.answer(frame, |command| {
            done.push(*command);
            outcome
        })
    };
    let ack = |sequence, number| {
        Telemetry::Ack(Ack { sequence, result: CommandResult::Map(ImageStatus::Valid(number)) })
    };
    let stop = frame(65_000, &Command::Stop);
    assert_eq!(give(&stop), ack(65_000, 0));
    assert_eq!(give(&stop), ack(65_000, 0), "the first answer was lost");
    assert_eq!(give(&stop), ack(65_000, 0), "and the second");
    assert_eq!(give(&frame(65_001, &Command::Stop)), ack(65_001, 1), "meant a second time");
    // Another sender with the same sequence number.
    assert_eq!(give(&frame(65_001, &Command::Start)), ack(65_001, 2));
    assert_eq!(give(&stop), ack(65_000, 3), "only the last is remembered");
    assert_eq!(done, [Command::Stop, Command::Stop, Command::Start, Command::Stop]);
}
