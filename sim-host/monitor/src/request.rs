//! A command, repeated until it is acknowledged.

use std::ops::ControlFlow;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use anyhow::Context;
use sonarfix_link::{Command, CommandResult, Receiver, Sender, SessionCommand, Telemetry, frame};

use crate::port::Port;

/// Number of attempts.
const ATTEMPTS: u32 = 10;
/// Timeout of an attempt.
const TIMEOUT: Duration = Duration::from_millis(300);

/// Opens a session and sends a command in it, each repeatedly until the robot acknowledges it; the robot executes it
/// once ([`Session`](sonarfix_link::Session)).
///
/// # Errors
/// Errors of the port, or if there is no answer.
pub fn ask(port: &mut Port, command: &Command) -> anyhow::Result<CommandResult> {
    ask_and_watch(port, command, |_| {})
}

/// The same; `watch` takes every byte that arrives meanwhile.
///
/// # Errors
/// As [`ask`].
pub fn ask_and_watch(
    port: &mut Port,
    command: &Command,
    mut watch: impl FnMut(u8),
) -> anyhow::Result<CommandResult> {
    let mut sender = Sender::starting_at(first_sequence());
    let mut receiver = Receiver::new();
    let open = SessionCommand { session: 0, command: Command::OpenSession };
    match send(port, &mut sender, &mut receiver, &open, &mut watch)? {
        CommandResult::Session(session) => {
            let command = SessionCommand { session, command: *command };
            send(port, &mut sender, &mut receiver, &command, &mut watch)
        }
        other => Ok(other),
    }
}

/// Sends a frame repeatedly until it is acknowledged.
fn send(
    port: &mut Port,
    sender: &mut Sender<SessionCommand>,
    receiver: &mut Receiver<Telemetry>,
    command: &SessionCommand,
    watch: &mut impl FnMut(u8),
) -> anyhow::Result<CommandResult> {
    let sequence = sender.next();
    let mut buffer = frame::EMPTY;
    let frame = sender.frame(command, &mut buffer);
    for _ in 0..ATTEMPTS {
        port.send(frame)?;
        let sent = Instant::now();
        let answer = port.read(|bytes| {
            let mut answer = None;
            for &byte in bytes {
                watch(byte);
                match receiver.push(byte).map(|frame| frame.message) {
                    Some(Telemetry::Ack(ack)) if ack.sequence == sequence => {
                        answer = Some(ack.result)
                    }
                    _ => {}
                }
            }
            let is_over = answer.is_some() || sent.elapsed() > TIMEOUT;
            Ok(if is_over { ControlFlow::Break(answer) } else { ControlFlow::Continue(()) })
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
/// one of 32,768 cases.
fn first_sequence() -> u16 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u16::try_from(now.as_micros() % (1 << 15)).unwrap_or(0)
}
