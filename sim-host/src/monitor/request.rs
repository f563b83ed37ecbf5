//! A command, sent until it is answered.

use std::ops::ControlFlow;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use anyhow::Context;
use sonarfix_link::{Command, Outcome, Receiver, Sender, Telemetry, frame};

use crate::monitor::port::Port;

/// How often it is sent.
const ATTEMPTS: u32 = 10;
/// How long each waits for its answer.
const PATIENCE: Duration = Duration::from_millis(300);

/// Sends a command, again and again until the robot answers; it does it once
/// ([`Answered`](sonarfix_link::Answered)).
///
/// # Errors
/// The port's, or that no answer came.
pub fn ask(port: &mut Port, command: &Command) -> anyhow::Result<Outcome> {
    let sequence = somewhere();
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
                    return Ok(ControlFlow::Break(Some(ack.outcome)));
                }
            }
            let is_late = sent.elapsed() > PATIENCE;
            Ok(if is_late { ControlFlow::Break(None) } else { ControlFlow::Continue(()) })
        })?;
        if let Some(outcome) = answer.context("the port was closed before an answer came")? {
            return Ok(outcome);
        }
    }
    let heard = receiver.counters();
    anyhow::bail!(
        "no answer after {ATTEMPTS} attempts ({} frames heard, {} skipped, {} of them foreign): \
         is the robot on, and its version of the link this one?",
        heard.frames,
        heard.skipped(),
        heard.foreign,
    )
}

/// Where the count of this run begins: another number than the run before had, but for one in
/// 65,535.
fn somewhere() -> u16 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u16::try_from(now.as_micros() % u128::from(u16::MAX)).unwrap_or(0).saturating_add(1)
}
