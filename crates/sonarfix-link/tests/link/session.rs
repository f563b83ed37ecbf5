//! A command is executed once, in order, and only in the present session.

use sonarfix_link::message::{CommandError, ImageStatus};
use sonarfix_link::{Ack, Command, CommandResult, Frame, Session, SessionCommand, Telemetry};

use crate::wire::{received, sent};

fn frame(session: u32, sequence: u16, command: &Command) -> Frame<SessionCommand> {
    received(&sent(sequence, &SessionCommand { session, command: *command })).0[0]
}

/// A robot that numbers the commands it executes, and its sessions from 100.
#[derive(Default)]
struct Robot {
    session: Session,
    executed: Vec<Command>,
    opened: u32,
}

impl Robot {
    fn receive(&mut self, frame: &Frame<SessionCommand>) -> CommandResult {
        let Self { session, executed, opened } = self;
        let answer = session.answer(frame, 100 + *opened, |command| {
            executed.push(*command);
            numbered(executed.len())
        });
        *opened += 1;
        let ack = if let Telemetry::Ack(ack) = answer { Some(ack) } else { None };
        let Ack { sequence, result } = ack.unwrap();
        assert_eq!(sequence, frame.sequence);
        result
    }

    /// Opens a session by a frame with this sequence number.
    fn open(&mut self, sequence: u16) -> u32 {
        let result = self.receive(&frame(0, sequence, &Command::OpenSession));
        let number = if let CommandResult::Session(number) = result { Some(number) } else { None };
        number.unwrap()
    }
}

fn numbered(number: usize) -> CommandResult {
    CommandResult::Map(ImageStatus::Valid(u32::try_from(number).unwrap()))
}

const OLD: CommandResult = CommandResult::Refused(CommandError::Session);

#[test]
fn a_repetition_has_the_same_answer_and_is_not_executed_again() {
    let mut robot = Robot::default();
    let session = robot.open(7);
    assert_eq!(robot.open(7), session, "the first answer was lost");
    let reset = frame(session, 8, &Command::ResetCalibration);
    for _ in 0..3 {
        assert_eq!(robot.receive(&reset), numbered(1));
    }
    assert_eq!(robot.receive(&frame(session, 9, &Command::ResetCalibration)), numbered(2));
    assert_eq!(robot.receive(&reset), OLD);
    assert_eq!(robot.executed, [Command::ResetCalibration; 2]);
}

#[test]
fn old_frames_are_refused() {
    let mut robot = Robot::default();
    let start = frame(0, 8, &Command::Start);
    assert_eq!(robot.receive(&start), OLD, "there is no session");
    let first = robot.open(7);
    let start = frame(first, 8, &Command::Start);
    assert_eq!(robot.receive(&start), numbered(1));
    assert_eq!(robot.receive(&frame(first, 9, &Command::Stop)), numbered(2));
    assert_eq!(robot.receive(&start), OLD, "earlier in the same session");
    // All frames once more.
    assert_ne!(robot.open(7), first);
    assert_eq!(robot.receive(&start), OLD, "of an earlier session");
    // A refused frame displaces nothing.
    let second = robot.open(60_000);
    let last = frame(second, 65_535, &Command::Start);
    assert_eq!(robot.receive(&last), numbered(3));
    assert_eq!(robot.receive(&start), OLD);
    assert_eq!(robot.receive(&last), numbered(3));
    assert_eq!(robot.receive(&frame(second, 1, &Command::Start)), OLD, "the session is used up");
    assert_eq!(robot.executed, [Command::Start, Command::Stop, Command::Start]);
}

/// A stop is never refused, and an old one ends no session.
#[test]
fn a_stop_is_always_executed() {
    let mut robot = Robot::default();
    assert_eq!(robot.receive(&frame(0, 3, &Command::Stop)), numbered(1));
    let session = robot.open(7);
    assert_eq!(robot.receive(&frame(session, 8, &Command::Start)), numbered(2));
    assert_eq!(robot.receive(&frame(0, 60_000, &Command::Stop)), numbered(3));
    assert_eq!(robot.receive(&frame(session, 5, &Command::Stop)), numbered(4));
    assert_eq!(robot.receive(&frame(session, 9, &Command::Start)), numbered(5));
}
