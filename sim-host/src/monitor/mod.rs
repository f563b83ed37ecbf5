//! Listens to a robot: what it says, shown, and recorded as a log that can be replayed.
//!
//! | module | what |
//! |---|---|
//! | [`port`] | where the bytes come from |
//! | this one | [`Monitor`]: what was heard last |
//! | [`view`] | the same, to be read |
//! | [`recording`] | the log |
//! | [`request`] | a command, sent until it is answered |

pub mod port;
pub mod recording;
pub mod request;
pub mod view;

use sonarfix::localizer::Fix;
use sonarfix_link::message::{Loop, Telemetry};
use sonarfix_link::{Counters, Estimate, Gaps, Hello, Look, Receiver};

use crate::statistics::FixCounts;

/// What a robot has said.
#[derive(Debug, Default)]
pub struct Monitor {
    receiver: Receiver<Telemetry>,
    gaps: Gaps,
    hello: Option<Hello>,
    estimate: Option<Estimate>,
    look: Option<Look>,
    fixes: FixCounts,
    state: Option<Loop>,
}

/// A message, and how many were lost since the one before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Said {
    /// How many.
    pub lost: u32,
    /// The message.
    pub telemetry: Telemetry,
}

impl Monitor {
    /// Takes a byte from the robot; gives the message that it completes.
    pub fn push(&mut self, byte: u8) -> Option<Said> {
        let frame = self.receiver.push(byte)?;
        let lost = self.gaps.take(frame.sequence);
        match frame.message {
            Telemetry::Hello(hello) => self.hello = Some(hello),
            Telemetry::Began(estimate) => {
                self.estimate = Some(estimate);
                self.look = None;
                self.fixes = FixCounts::default();
            }
            Telemetry::Estimate(estimate) => self.estimate = Some(estimate),
            Telemetry::Look(look) => {
                let fixes = &mut self.fixes;
                *match look.fix {
                    Fix::Accepted(_) | Fix::Weakened(_) => &mut fixes.accepted,
                    Fix::Gated(_) => &mut fixes.gated,
                    Fix::Refused(_) => &mut fixes.refused,
                } += 1;
                self.look = Some(look);
            }
            Telemetry::Loop(state) => self.state = Some(state),
            Telemetry::Step(_) | Telemetry::Skip(_) | Telemetry::Ack(_) => {}
        }
        Some(Said { lost, telemetry: frame.message })
    }

    /// What became of the bytes.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.receiver.counters()
    }

    /// The frames that were lost.
    #[must_use]
    pub fn gaps(&self) -> Gaps {
        self.gaps
    }

    /// The last estimate.
    #[must_use]
    pub fn estimate(&self) -> Option<&Estimate> {
        self.estimate.as_ref()
    }
}
