//! A motion in a conversation: when it is sent, renewed and given up.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test should stop")]

use std::time::Duration;

use sonarfix::geometry::units::{MetresPerSecond, RadiansPerSecond};
use sonarfix_link::message::{Ack, CommandError};
use sonarfix_link::{Command, CommandResult, Motion, Receiver, SessionCommand};
use sonarfix_telemetry::conversation::{ATTEMPTS, Conversation, Due, Outcome};

const AHEAD: Motion = Motion { speed: MetresPerSecond(0.2), turn: RadiansPerSecond(0.0) };
const LEFT: Motion = Motion { speed: MetresPerSecond(0.0), turn: RadiansPerSecond(1.0) };
const DONE: CommandResult = CommandResult::Done;

/// A conversation with a robot that the test is, at a time of the test.
struct Talk {
    conversation: Conversation,
    millis: u64,
}

impl Talk {
    fn new() -> Self {
        Self { conversation: Conversation::new(0), millis: 0 }
    }

    fn poll(&mut self) -> Due {
        self.conversation.poll(Duration::from_millis(self.millis))
    }

    /// The frame that is sent now.
    fn sent(&mut self) -> (u16, Command) {
        let Due::Send(bytes) = self.poll() else { panic!("nothing is sent at {}", self.millis) };
        let mut receiver = Receiver::<SessionCommand>::new();
        let frame = bytes.into_iter().filter_map(|byte| receiver.push(byte)).last().unwrap();
        (frame.sequence, frame.message.command)
    }

    fn answer(&mut self, sequence: u16, result: CommandResult) -> Option<Outcome> {
        self.conversation.take(&Ack { sequence, result })
    }

    /// Sends what is due, and answers it.
    fn exchange(&mut self, result: CommandResult) -> (Command, Option<Outcome>) {
        let (sequence, command) = self.sent();
        (command, self.answer(sequence, result))
    }

    /// A conversation in an open session.
    fn in_session() -> Self {
        let mut talk = Self::new();
        talk.conversation.drive(Some(AHEAD));
        assert_eq!(talk.exchange(CommandResult::Session(5)), (Command::OpenSession, None));
        talk
    }
}

const DRIVEN: Option<Outcome> = Some(Outcome::Driven(Some(DONE)));

#[test]
fn a_motion_is_renewed_in_new_frames_faster_than_the_robot_stops() {
    let mut talk = Talk::in_session();
    let mut last = talk.sent();
    for _ in 0..50 {
        assert_eq!(last.1, Command::Drive(AHEAD));
        assert_eq!(talk.answer(last.0, DONE), DRIVEN);
        let since = talk.millis;
        while talk.poll() == Due::Nothing {
            talk.millis += 1;
        }
        assert!(1_000 * (talk.millis - since) < Motion::LASTS.to_micros() / 2);
        // The poll above took it; the next is one period later.
        talk.millis += 200;
        let next = talk.sent();
        assert!(next.0 > last.0, "a repeated frame does not renew");
        last = next;
    }
}

#[test]
fn a_new_motion_is_sent_at_once_and_the_old_one_never_again() {
    let mut talk = Talk::in_session();
    let (old, command) = talk.sent();
    assert_eq!(command, Command::Drive(AHEAD));
    talk.conversation.drive(Some(LEFT));
    let (new, command) = talk.sent();
    assert_eq!(command, Command::Drive(LEFT));
    assert_eq!(talk.answer(old, DONE), None);
    assert_eq!(talk.answer(new, DONE), DRIVEN);
    talk.conversation.drive(None);
    talk.millis += 10_000;
    assert_eq!(talk.poll(), Due::Nothing);
}

/// A lost frame must not reach the robot late, when the motion has been taken back.
#[test]
fn a_motion_that_was_taken_back_is_not_repeated() {
    let mut talk = Talk::in_session();
    let _ = talk.sent();
    talk.conversation.drive(None);
    for _ in 0..100 {
        talk.millis += 100;
        assert_eq!(talk.poll(), Due::Nothing);
    }
}

#[test]
fn a_motion_without_answers_ends_and_says_so() {
    let mut talk = Talk::in_session();
    for _ in 0..ATTEMPTS {
        assert_eq!(talk.sent().1, Command::Drive(AHEAD));
        talk.millis += 199;
        assert_eq!(talk.poll(), Due::Nothing);
        talk.millis += 1;
    }
    assert_eq!(talk.poll(), Due::End(Outcome::Driven(None)));
    talk.millis += 10_000;
    assert_eq!(talk.poll(), Due::Nothing);
    // A robot that does not even open a session.
    let mut talk = Talk::new();
    talk.conversation.drive(Some(AHEAD));
    for _ in 0..ATTEMPTS {
        assert_eq!(talk.sent().1, Command::OpenSession);
        talk.millis += 300;
    }
    assert_eq!(talk.poll(), Due::End(Outcome::Driven(None)));
}

#[test]
fn a_command_goes_before_the_motion_and_has_its_own_answer() {
    let mut talk = Talk::in_session();
    assert_eq!(talk.exchange(DONE), (Command::Drive(AHEAD), DRIVEN));
    assert!(talk.conversation.add(Command::Stop));
    talk.millis += 150;
    assert_eq!(talk.exchange(DONE), (Command::Stop, Some(Outcome::Answered(DONE))));
    let waiting = CommandResult::Refused(CommandError::Waiting);
    let refused = Some(Outcome::Driven(Some(waiting)));
    assert_eq!(talk.exchange(waiting), (Command::Drive(AHEAD), refused));
}

#[test]
fn a_motion_goes_on_in_a_new_session_if_another_program_has_opened_one() {
    let mut talk = Talk::in_session();
    let ended = CommandResult::Refused(CommandError::Session);
    assert_eq!(talk.exchange(ended), (Command::Drive(AHEAD), None));
    assert_eq!(talk.exchange(CommandResult::Session(6)), (Command::OpenSession, None));
    assert_eq!(talk.exchange(DONE), (Command::Drive(AHEAD), DRIVEN));
}
