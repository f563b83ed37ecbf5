//! Admits a command once, in order, and only in the present session.

use crate::frame::Frame;
use crate::message::{Ack, Command, CommandError, CommandResult, SessionCommand, Telemetry};

/// Decides which commands are executed. `docs/link.md` describes the rules and what they protect against.
///
/// - **A repetition is executed once.** An acknowledgement can be lost like any frame. A sender therefore repeats the same
///   frame until it is acknowledged, and only then sends the next command. A frame with the sequence number and the
///   checksum of the last one is such a repetition: it is acknowledged with the same result.
/// - **An old frame is refused.** A command has the number of the present session, which [`Command::OpenSession`]
///   requests, and a sequence number above those of all commands before it in the session.
/// - **[`Command::Stop`] is always executed**: to stop without need is safe, to refuse a stop is not. So is
///   [`Command::MapChecksum`], which changes nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Session {
    number: Option<u32>,
    last: Option<Last>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Last {
    sequence: u16,
    checksum: u32,
    result: CommandResult,
}

impl Session {
    /// Returns the acknowledgement of a command, which `execute` executes if it is admitted. `next` is the number of the
    /// session that the command may open.
    pub fn answer(
        &mut self,
        frame: &Frame<SessionCommand>,
        next: u32,
        execute: impl FnOnce(&Command) -> CommandResult,
    ) -> Telemetry {
        let Frame { sequence, checksum, message: SessionCommand { session, ref command } } = *frame;
        let repeated =
            self.last.filter(|last| (last.sequence, last.checksum) == (sequence, checksum));
        let is_present =
            self.number == Some(session) && self.last.is_none_or(|last| sequence > last.sequence);
        let result = match (repeated, command) {
            (Some(last), _) => last.result,
            (None, Command::OpenSession) => {
                self.number = Some(next);
                CommandResult::Session(next)
            }
            (None, Command::Stop | Command::MapChecksum) => execute(command),
            (None, command) if is_present => execute(command),
            (None, _) => CommandResult::Refused(CommandError::Session),
        };
        if is_present || *command == Command::OpenSession {
            self.last = Some(Last { sequence, checksum, result });
        }
        Telemetry::Ack(Ack { sequence, result })
    }
}
