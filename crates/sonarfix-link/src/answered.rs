//! That a command is done once, however often it is sent.

use crate::frame::Frame;
use crate::message::{Ack, Command, Outcome, Telemetry};

/// Remembers the last command and its answer.
///
/// An answer can be lost like any frame, so whoever sends a command sends the very same frame
/// again until the answer comes, and only then the next. A frame with the sequence number and
/// the checksum of the last one is such a repeat: it is answered as before, and not done again.
/// Two commands of the same words that are both meant have different numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Answered {
    last: Option<Last>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Last {
    sequence: u16,
    checksum: u32,
    outcome: Outcome,
}

impl Answered {
    /// The answer to a command, which `act` does, unless it is a repeat.
    pub fn answer(
        &mut self,
        frame: &Frame<Command>,
        act: impl FnOnce(&Command) -> Outcome,
    ) -> Telemetry {
        let Frame { sequence, checksum, ref message } = *frame;
        let repeat =
            self.last.filter(|last| (last.sequence, last.checksum) == (sequence, checksum));
        let outcome = repeat.map_or_else(|| act(message), |last| last.outcome);
        self.last = Some(Last { sequence, checksum, outcome });
        Telemetry::Ack(Ack { sequence, outcome })
    }
}
