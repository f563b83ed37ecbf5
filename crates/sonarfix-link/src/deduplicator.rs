//! Executes a repeated command once.

use crate::frame::Frame;
use crate::message::{Ack, Command, CommandResult, Telemetry};

/// Stores the last command's frame and its result.
///
/// An acknowledgement can be lost like any frame. A sender therefore repeats the same frame until it is acknowledged,
/// and only then sends the next command. A frame with the sequence number and the checksum of the last one is
/// such a repetition: it is acknowledged with the same result and not executed again. Two equal commands
/// that are both intended have different sequence numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Deduplicator {
    last: Option<Last>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Last {
    sequence: u16,
    checksum: u32,
    result: CommandResult,
}

impl Deduplicator {
    /// Returns the acknowledgement of a command, which `execute` executes unless it is a repetition.
    pub fn answer(
        &mut self,
        frame: &Frame<Command>,
        execute: impl FnOnce(&Command) -> CommandResult,
    ) -> Telemetry {
        let Frame { sequence, checksum, ref message } = *frame;
        let repeated =
            self.last.filter(|last| (last.sequence, last.checksum) == (sequence, checksum));
        let result = repeated.map_or_else(|| execute(message), |last| last.result);
        self.last = Some(Last { sequence, checksum, result });
        Telemetry::Ack(Ack { sequence, result })
    }
}
