//! A command, repeated until it is acknowledged.

use std::ops::ControlFlow;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use anyhow::Context;
use sonarfix_link::{Command, CommandResult, Receiver, Sender, Telemetry, frame};

use crate::port::Port;

/// Number of attempts.
const ATTEMPTS: u32 = 10;
/// Timeout of an attempt.
const TIMEOUT: Duration = Duration::from_millis(300);

/// Sends a command repeatedly until the robot acknowledges it; the robot executes it once
/// ([`Deduplicator`](sonarfix_link::Deduplicator)).
///
/// # Errors
/// Errors of the port, or if there is no answer.
pub fn ask(port: &mut Port, command: &Command) -> anyhow::Result<CommandResult> {
    let sequence = first_sequence();
    let mut buffer = frame::EMPTY;
    let frame = Sender::starting_at(sequence).frame(command, &mut buffer);
    let mut receiver = Receiver::<Telemetry>::new();
    for _ in 0..ATTEMPTS {
        port.send(frame)?;
        let sent = Instant::now();
        let answer = port.read(|bytes| {
            for &byte in bytes {
                if let Some(Telemetry::Ack(ack)) = receiver.push(byte).map(|frame| frame.message)
                    && ack.sequence == sequence
                {
                    return Ok(ControlFlow::Break(Some(ack.result)));
                }
            }
            let is_timeout = sent.elapsed() > TIMEOUT;
            Ok(if is_timeout { ControlFlow::Break(None) } else { ControlFlow::Continue(()) })
        })?;
        if let Some(outcome) = answer.context("the port was closed before an answer came")? {
            return Ok(outcome);
        }
    }
    let counters = receiver.counters();
    anyhow::bail!(
        "no answer after {ATTEMPTS} attempts ({} frames received, {} skipped, {} of them foreign): \
         is the robot on, with the same version of the link?",
        counters.frames,
        counters.skipped(),
        counters.foreign,
    )
}

/// First sequence number of this process; it differs from that of the previous process, except in
/// one of 65,535 cases.
fn first_sequence() -> u16 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u16::try_from(now.as_micros() % u128::from(u16::MAX)).unwrap_or(0).saturating_add(1)
}
