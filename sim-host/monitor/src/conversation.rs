//! Sends the commands of a session, one after the other: repeats each until the robot acknowledges it.
//!
//! It reads neither port nor clock: bytes to send are returned, acknowledgements and the time are arguments. So a program that
//! shows telemetry can send commands beside it.

use std::collections::VecDeque;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use sonarfix_link::message::{Ack, CommandError};
use sonarfix_link::{Command, CommandResult, Sender, SessionCommand, frame};

/// Number of attempts.
pub const ATTEMPTS: u32 = 10;
/// Timeout of an attempt.
const TIMEOUT: Duration = Duration::from_millis(300);
/// The most commands that wait.
const MOST_WAITING: usize = 16;

/// What became of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The robot has answered.
    Answered(CommandResult),
    /// No answer after [`ATTEMPTS`] attempts.
    Silence,
}

/// What [`Conversation::poll`] asks for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Due {
    /// Nothing.
    Nothing,
    /// To send these bytes.
    Send(Vec<u8>),
    /// Nothing; a command has ended.
    End(Outcome),
}

/// A command that was sent and not acknowledged.
#[derive(Debug, Clone)]
struct Sent {
    bytes: Vec<u8>,
    sequence: u16,
    /// Whether it opens the session that the first waiting command needs.
    is_opening: bool,
    attempts: u32,
    at: Option<Instant>,
}

/// The commands to one robot.
#[derive(Debug)]
pub struct Conversation {
    sender: Sender<SessionCommand>,
    session: Option<u32>,
    waiting: VecDeque<Command>,
    sent: Option<Sent>,
}

impl Default for Conversation {
    fn default() -> Self {
        Self {
            sender: Sender::starting_at(first_sequence()),
            session: None,
            waiting: VecDeque::new(),
            sent: None,
        }
    }
}

impl Conversation {
    /// Adds a command; whether there was room for it.
    pub fn add(&mut self, command: Command) -> bool {
        let has_room = self.waiting.len() < MOST_WAITING;
        if has_room {
            self.waiting.push_back(command);
        }
        has_room
    }

    /// The frame to send now, if one is due, or the outcome of a command that was given up.
    pub fn poll(&mut self, now: Instant) -> Due {
        if self.sent.is_none() {
            self.prepare();
        }
        let Some(sent) = &mut self.sent else {
            return Due::Nothing;
        };
        if sent.at.is_some_and(|at| now.saturating_duration_since(at) < TIMEOUT) {
            return Due::Nothing;
        }
        if sent.attempts < ATTEMPTS {
            sent.at = Some(now);
            sent.attempts += 1;
            return Due::Send(sent.bytes.clone());
        }
        self.sent = None;
        self.session = None;
        self.waiting.pop_front();
        Due::End(Outcome::Silence)
    }

    /// Takes an acknowledgement; the outcome of the command that it ends.
    pub fn take(&mut self, ack: &Ack) -> Option<Outcome> {
        let sent = self.sent.take_if(|sent| sent.sequence == ack.sequence)?;
        match (sent.is_opening, ack.result) {
            (true, CommandResult::Session(number)) => {
                self.session = Some(number);
                return None;
            }
            // Another program has opened a session since: open one again, once per command.
            (false, CommandResult::Refused(CommandError::Session)) => self.session = None,
            _ => {}
        }
        self.waiting.pop_front();
        Some(Outcome::Answered(ack.result))
    }

    /// The frame of the first waiting command, or of the session that it needs.
    fn prepare(&mut self) {
        let Some(command) = self.waiting.front() else { return };
        let (message, is_opening) = match self.session {
            Some(session) => (SessionCommand { session, command: *command }, false),
            None => (SessionCommand { session: 0, command: Command::OpenSession }, true),
        };
        let sequence = self.sender.next();
        let mut buffer = frame::EMPTY;
        let bytes = self.sender.frame(&message, &mut buffer).to_vec();
        self.sent = Some(Sent { bytes, sequence, is_opening, attempts: 0, at: None });
    }
}

/// First sequence number of this process; it differs from that of the previous process, except in
/// one of 32,768 cases.
fn first_sequence() -> u16 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u16::try_from(now.as_micros() % (1 << 15)).unwrap_or(0)
}
