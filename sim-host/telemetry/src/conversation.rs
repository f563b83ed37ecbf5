//! Sends the commands of a session, one after the other: repeats each until the robot acknowledges it.
//!
//! It reads neither port nor clock: bytes to send are returned, acknowledgements and the time are arguments. So a program that
//! shows telemetry can send commands beside it. The time is that since any fixed moment.

use std::collections::VecDeque;
use std::time::Duration;

use sonarfix_link::message::{Ack, CommandError};
use sonarfix_link::{Command, CommandResult, Motion, Sender, SessionCommand, frame};

/// Number of attempts.
pub const ATTEMPTS: u32 = 10;
/// Timeout of an attempt.
const TIMEOUT: Duration = Duration::from_millis(300);
/// A motion is renewed this long after it was sent. A robot stops after [`Motion::LASTS`].
const RENEWAL: Duration = Duration::from_millis(100);
/// A motion without an answer is replaced by a new frame after this time: a repeated one would not renew it.
const OVERDUE: Duration = Duration::from_millis(200);
/// The most commands that wait.
const MOST_WAITING: usize = 16;

/// What became of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The robot has answered.
    Answered(CommandResult),
    /// No answer after [`ATTEMPTS`] attempts.
    Silence,
    /// The answer to a motion ([`Conversation::drive`]). `None`: no answer to [`ATTEMPTS`] frames; the motion has ended.
    Driven(Option<CommandResult>),
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
    kind: Kind,
    attempts: u32,
    at: Option<Duration>,
}

/// What a frame is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// It opens the session that what follows needs.
    Opening,
    /// The first waiting command.
    Command,
    /// The motion.
    Motion,
}

/// A motion that is renewed.
#[derive(Debug, Clone, Copy)]
struct Renewed {
    motion: Motion,
    /// When it was sent last.
    at: Option<Duration>,
    /// Frames since the last answer.
    unanswered: u32,
}

/// The commands to one robot.
#[derive(Debug)]
pub struct Conversation {
    sender: Sender<SessionCommand>,
    session: Option<u32>,
    waiting: VecDeque<Command>,
    motion: Option<Renewed>,
    sent: Option<Sent>,
}

impl Conversation {
    /// A conversation whose first frame has this sequence number. It should differ from that of the program before: a robot takes a
    /// frame with the number of the last one for its repetition.
    #[must_use]
    pub fn new(first_sequence: u16) -> Self {
        Self {
            sender: Sender::starting_at(first_sequence),
            session: None,
            waiting: VecDeque::new(),
            motion: None,
            sent: None,
        }
    }

    /// Adds a command; whether there was room for it.
    pub fn add(&mut self, command: Command) -> bool {
        let has_room = self.waiting.len() < MOST_WAITING;
        if has_room {
            self.waiting.push_back(command);
        }
        has_room
    }

    /// Drives with this motion, which is renewed until another call; `None` renews it no more, and the robot stops by itself.
    /// The waiting commands are sent first.
    pub fn drive(&mut self, motion: Option<Motion>) {
        let unanswered = self.motion.map_or(0, |renewed| renewed.unanswered);
        self.motion = motion.map(|motion| Renewed { motion, at: None, unanswered });
        // The frame of another motion is not repeated.
        self.sent.take_if(|sent| sent.kind == Kind::Motion);
    }

    /// The frame to send now, if one is due, or the outcome of a command that was given up.
    pub fn poll(&mut self, now: Duration) -> Due {
        if self.is_motion_due(now, OVERDUE) {
            if self.motion.is_some_and(|renewed| renewed.unanswered >= ATTEMPTS) {
                return self.end_motion();
            }
            self.sent.take_if(|sent| sent.kind == Kind::Motion);
        }
        if self.sent.is_none() {
            self.prepare(now);
        }
        let Some(sent) = &mut self.sent else {
            return Due::Nothing;
        };
        if sent.at.is_some_and(|at| now.saturating_sub(at) < TIMEOUT) {
            return Due::Nothing;
        }
        if sent.attempts < ATTEMPTS {
            sent.at = Some(now);
            sent.attempts += 1;
            return Due::Send(sent.bytes.clone());
        }
        self.give_up()
    }

    /// Ends what was sent last without an answer.
    fn give_up(&mut self) -> Due {
        self.sent = None;
        self.session = None;
        if self.waiting.pop_front().is_some() {
            return Due::End(Outcome::Silence);
        }
        self.end_motion()
    }

    /// Ends a motion that is not answered.
    fn end_motion(&mut self) -> Due {
        self.drive(None);
        self.session = None;
        Due::End(Outcome::Driven(None))
    }

    fn is_motion_due(&self, now: Duration, after: Duration) -> bool {
        let is_due = |at| now.saturating_sub(at) >= after;
        self.motion.is_some_and(|renewed| renewed.at.is_none_or(is_due))
    }

    /// Takes an acknowledgement; the outcome of the command that it ends.
    pub fn take(&mut self, ack: &Ack) -> Option<Outcome> {
        let sent = self.sent.take_if(|sent| sent.sequence == ack.sequence)?;
        let is_ended = ack.result == CommandResult::Refused(CommandError::Session);
        match (sent.kind, ack.result) {
            (Kind::Opening, CommandResult::Session(number)) => {
                self.session = Some(number);
                return None;
            }
            // Another program has opened a session since: open one again, once per command.
            (Kind::Command, _) if is_ended => self.session = None,
            (Kind::Motion, result) => return self.driven(result, is_ended),
            _ => {}
        }
        let is_command = self.waiting.pop_front().is_some();
        Some(if is_command {
            Outcome::Answered(ack.result)
        } else {
            Outcome::Driven(Some(ack.result))
        })
    }

    /// The answer to the motion. In a session that has ended, it is sent in another one at once.
    fn driven(&mut self, result: CommandResult, is_ended: bool) -> Option<Outcome> {
        let renewed = self.motion.as_mut()?;
        if is_ended {
            self.session = None;
            renewed.at = None;
            return None;
        }
        renewed.unanswered = 0;
        Some(Outcome::Driven(Some(result)))
    }

    /// The frame of the first waiting command, else of the motion if it is due, or of the session that they need.
    fn prepare(&mut self, now: Duration) {
        let is_due = self.is_motion_due(now, RENEWAL);
        let (command, kind) = match (self.waiting.front(), self.motion) {
            (Some(command), _) => (*command, Kind::Command),
            (None, Some(Renewed { motion, .. })) if is_due => {
                (Command::Drive(motion), Kind::Motion)
            }
            _ => return,
        };
        let (message, kind) = match self.session {
            Some(session) => (SessionCommand { session, command }, kind),
            None => (SessionCommand { session: 0, command: Command::OpenSession }, Kind::Opening),
        };
        if let (Kind::Motion, Some(renewed)) = (kind, &mut self.motion) {
            renewed.at = Some(now);
            renewed.unanswered += 1;
        }
        let sequence = self.sender.next();
        let mut buffer = frame::EMPTY;
        let bytes = self.sender.frame(&message, &mut buffer).to_vec();
        self.sent = Some(Sent { bytes, sequence, kind, attempts: 0, at: None });
    }
}
