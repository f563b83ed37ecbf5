//! A command, repeated until it is acknowledged, and a motion, renewed until it is over.

use std::ops::ControlFlow;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use anyhow::Context;
use sonarfix_hal::robot::AbsoluteResult;
use sonarfix_link::{Command, CommandResult, Motion, Receiver, ReceiverCounters, Telemetry};

use sonarfix_telemetry::conversation::{ATTEMPTS, Conversation, Due, Outcome};

use crate::port::Port;

/// A conversation of this process: its first sequence number differs from that of the process before, except in one of 32,768
/// cases.
#[must_use]
pub fn conversation() -> Conversation {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    Conversation::new(u16::try_from(now.as_micros() % (1 << 15)).unwrap_or(0))
}

/// Opens a session and sends a command in it, each repeatedly until the robot acknowledges it; the robot executes it
/// once ([`Session`](sonarfix_link::Session)).
///
/// # Errors
/// Errors of the port, or if there is no answer.
pub fn ask(port: &mut Port, command: &Command) -> anyhow::Result<CommandResult> {
    ask_and_watch(port, command, |_| {})
}

/// How long the localizer's response to a measurement is waited for after the acknowledgement: some encoder samples.
const PATIENCE: Duration = Duration::from_secs(2);

/// Sends a heading, position or pose as [`ask`] does; returns the localizer's response, too, if it arrives.
///
/// # Errors
/// As [`ask`].
pub fn ask_absolute(
    port: &mut Port,
    command: &Command,
) -> anyhow::Result<(CommandResult, Option<AbsoluteResult>)> {
    let mut responses = Responses(Receiver::new());
    let mut response = None;
    let result = ask_and_watch(port, command, |byte| response = responses.take(byte).or(response))?;
    if result != CommandResult::Done || response.is_some() {
        return Ok((result, response));
    }
    let since = Instant::now();
    let response = port.read(|bytes| {
        let response = bytes.iter().filter_map(|&byte| responses.take(byte)).last();
        let is_over = response.is_some() || since.elapsed() > PATIENCE;
        Ok(if is_over { ControlFlow::Break(response) } else { ControlFlow::Continue(()) })
    })?;
    Ok((result, response.flatten()))
}

/// The localizer's responses to absolute measurements.
struct Responses(Receiver<Telemetry>);

impl Responses {
    fn take(&mut self, byte: u8) -> Option<AbsoluteResult> {
        match self.0.push(byte)?.message {
            Telemetry::Absolute(result) => Some(result),
            _ => None,
        }
    }
}

/// As [`ask`]; `watch` takes every byte that arrives meanwhile.
///
/// # Errors
/// As [`ask`].
pub fn ask_and_watch(
    port: &mut Port,
    command: &Command,
    mut watch: impl FnMut(u8),
) -> anyhow::Result<CommandResult> {
    let (mut conversation, began) = (conversation(), Instant::now());
    let mut receiver = Receiver::<Telemetry>::new();
    conversation.add(*command);
    let mut due = conversation.poll(began.elapsed());
    loop {
        match due {
            Due::Send(bytes) => port.send(&bytes)?,
            Due::End(Outcome::Answered(result)) => return Ok(result),
            Due::End(Outcome::Silence | Outcome::Driven(_)) => break,
            Due::Nothing => {}
        }
        let next = port.read(|bytes| -> anyhow::Result<ControlFlow<Due>> {
            let answers = bytes.iter().filter_map(|&byte| {
                watch(byte);
                match receiver.push(byte)?.message {
                    Telemetry::Ack(ack) => conversation.take(&ack),
                    _ => None,
                }
            });
            let due = answers.last().map_or_else(|| conversation.poll(began.elapsed()), Due::End);
            let is_nothing = due == Due::Nothing;
            Ok(if is_nothing { ControlFlow::Continue(()) } else { ControlFlow::Break(due) })
        })?;
        due = next.context("the port was closed before an answer came")?;
    }
    Err(silence(receiver.counters()))
}

/// What a program that drives does next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Control {
    /// The motion before stays.
    Keep,
    /// The robot drives with this motion.
    Drive(Motion),
    /// The robot stands, and the program ends.
    Stop,
}

/// Drives with this motion, which is renewed until `is_over`; then the robot stands. Returns how it ended: `Done`, or the
/// refusal.
///
/// # Errors
/// As [`ask`].
pub fn drive(
    port: &mut Port,
    motion: Motion,
    mut is_over: impl FnMut() -> bool,
) -> anyhow::Result<CommandResult> {
    let mut has_begun = false;
    steer(port, |_| {
        if is_over() {
            Control::Stop
        } else if std::mem::replace(&mut has_begun, true) {
            Control::Keep
        } else {
            Control::Drive(motion)
        }
    })
}

/// Drives as `control` decides, with each message of the robot, and without one at least every 100 ms. A motion is renewed until
/// another one. Returns how it ended: `Done`, or the refusal of a motion.
///
/// # Errors
/// As [`ask`].
pub fn steer(
    port: &mut Port,
    mut control: impl FnMut(Option<&Telemetry>) -> Control,
) -> anyhow::Result<CommandResult> {
    let (mut conversation, began) = (conversation(), Instant::now());
    let mut receiver = Receiver::<Telemetry>::new();
    let mut is_stopping = false;
    let mut received = Vec::new();
    loop {
        for message in received.drain(..).map(Some).chain([None]) {
            match (is_stopping, control(message.as_ref())) {
                (true, _) | (_, Control::Keep) => {}
                (false, Control::Drive(motion)) => conversation.drive(Some(motion)),
                (false, Control::Stop) => {
                    is_stopping = true;
                    conversation.drive(Some(Motion::default()));
                }
            }
        }
        let mut due = conversation.poll(began.elapsed());
        if due == Due::Nothing {
            let answer = port.read(|bytes| {
                let messages = bytes.iter().filter_map(|&byte| receiver.push(byte));
                received.extend(messages.map(|frame| frame.message));
                let answers = received.iter().filter_map(|message| match message {
                    Telemetry::Ack(ack) => conversation.take(ack),
                    _ => None,
                });
                Ok(ControlFlow::Break(answers.last()))
            })?;
            let answer = answer.context("the port was closed while the robot drives")?;
            due = answer.map_or(Due::Nothing, Due::End);
        }
        match due {
            Due::Send(bytes) => port.send(&bytes)?,
            Due::End(Outcome::Driven(Some(CommandResult::Done))) if !is_stopping => {}
            Due::End(Outcome::Driven(Some(result))) => return Ok(result),
            Due::End(_) => return Err(silence(receiver.counters())),
            Due::Nothing => {}
        }
    }
}

fn silence(counters: ReceiverCounters) -> anyhow::Error {
    anyhow::anyhow!(
        "no answer after {ATTEMPTS} attempts ({} frames received, {} skipped, {} of them foreign): \
         is the robot on, with the same version of the link?",
        counters.frames,
        counters.skipped(),
        counters.foreign,
    )
}
