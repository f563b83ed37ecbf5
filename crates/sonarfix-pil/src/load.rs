//! The load on the link of a loop session: the same bytes on the microcontroller and on the PC.

use serde::{Deserialize, Serialize};
use sonarfix::localizer::{Localizer, Start};
use sonarfix_link::{Command, CommandResult, Sender, SessionCommand, frame};

/// What arrives over the link.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Load {
    /// Nothing; telemetry is sent.
    #[default]
    Quiet,
    /// Random bytes at the rate of the line.
    Garbage,
    /// Valid commands at the rate of the line.
    Commands,
    /// Random bytes without an end: more than a poll reads.
    Saturated,
    /// Nothing, and what is sent is lost.
    Unplugged,
}

/// Bytes in a millisecond at 115,200 baud, rounded up.
const BYTES: usize = 12;
/// A pattern of commands repeats after so many milliseconds: as many bytes as the line has room for.
const PATTERN: u32 = 12;
/// Time between two poses, in milliseconds. A new pose aborts the ping in flight.
const POSES: u32 = 5_004;
/// Frames of a session; another one begins before the sequence numbers are used up.
const SESSION: u16 = 60_000;

/// The bytes that arrive from one poll to the next, a millisecond later.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Traffic {
    /// What arrives.
    pub load: Load,
    session: u32,
    sequence: u16,
    polls: u32,
    random: u32,
    frame: [u8; frame::FRAME_MAX],
}

impl Traffic {
    /// Traffic in this session of commands, whose last command had this number.
    pub fn new(load: Load, session: u32, sequence: u16) -> Self {
        let frame = frame::EMPTY;
        Self { load, session, sequence, polls: 0, random: 0x2545_F491, frame }
    }

    /// The bytes that arrive before the next poll.
    pub fn next(&mut self, localizer: Option<&Localizer>) -> &[u8] {
        self.polls = self.polls.wrapping_add(1);
        match self.load {
            Load::Quiet | Load::Unplugged => &[],
            Load::Garbage => self.garbage(BYTES),
            Load::Saturated => self.garbage(frame::FRAME_MAX),
            Load::Commands => match self.command(localizer) {
                Some(command) => self.framed(&command),
                None => &[],
            },
        }
    }

    fn garbage(&mut self, count: usize) -> &[u8] {
        let (garbage, _) = self.frame.split_at_mut(count.min(frame::FRAME_MAX));
        for byte in garbage.iter_mut() {
            // Marsaglia's xorshift.
            self.random ^= self.random << 13;
            self.random ^= self.random >> 17;
            self.random ^= self.random << 5;
            [*byte, ..] = self.random.to_le_bytes();
        }
        garbage
    }

    fn command(&self, localizer: Option<&Localizer>) -> Option<Command> {
        if self.sequence >= SESSION {
            return Some(Command::OpenSession);
        }
        match (self.polls % PATTERN, localizer) {
            (0, Some(localizer)) if self.polls.is_multiple_of(POSES) => {
                let deviation = localizer.filter().standard_deviations();
                Some(Command::SetPose(Start {
                    pose: localizer.pose(),
                    position_deviation: deviation.x,
                    heading_deviation: deviation.heading,
                }))
            }
            (0 | 4 | 6 | 8, _) => Some(Command::MapChecksum),
            (10, _) => Some(Command::Start),
            _ => None,
        }
    }

    fn framed(&mut self, command: &Command) -> &[u8] {
        self.sequence = match *command {
            Command::OpenSession => 1,
            _ => self.sequence.saturating_add(1),
        };
        let command = SessionCommand { session: self.session, command: *command };
        Sender::starting_at(self.sequence).frame(&command, &mut self.frame)
    }

    /// Takes the answer to a command.
    pub fn answered(&mut self, result: Option<CommandResult>) {
        if let Some(CommandResult::Session(session)) = result {
            self.session = session;
        }
    }
}
