//! A robot at the link while it is measured, and the person who presses Enter.

use std::io::stdin;
use std::ops::ControlFlow;
use std::sync::mpsc::{Receiver as Presses, TryRecvError, channel};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Context;
use sonarfix::geometry::units::Radians;
use sonarfix_link::{Command, CommandResult, Receiver, Telemetry};
use sonarfix_monitor::port::Port;
use sonarfix_monitor::request;
use sonarfix_terminal::progress::bar;

use super::corner::{self, SweptPing};
use super::wheel::Edges;

/// The robot shows its devices for a minute; it is asked again in time.
const ASK_AGAIN: Duration = Duration::from_secs(30);
/// Longest time of the pings at a bearing.
const SILENCE: Duration = Duration::from_secs(10);
/// Pings at a bearing in each pass.
const PINGS: usize = 4;

/// The robot.
pub struct Robot {
    port: Port,
    receiver: Receiver<Telemetry>,
    /// A message for each Enter.
    presses: Presses<()>,
}

impl Robot {
    /// A robot at a port.
    pub fn new(port: Port) -> Self {
        let (sender, presses) = channel();
        thread::spawn(move || {
            for line in stdin().lines() {
                if line.is_err() || sender.send(()).is_err() {
                    break;
                }
            }
        });
        Self { port, receiver: Receiver::new(), presses }
    }

    /// Sends a command.
    pub fn command(&mut self, command: &Command) -> anyhow::Result<()> {
        match request::ask(&mut self.port, command)? {
            CommandResult::Refused(reason) => anyhow::bail!("the robot refuses: {reason}"),
            _ => Ok(()),
        }
    }

    /// The edges of the right and the left encoder until Enter, and the reading after it.
    pub fn edges(&mut self) -> anyhow::Result<[i64; 2]> {
        let mut edges = [Edges::default(); 2];
        let mut is_last = false;
        loop {
            self.command(&Command::ShowDevices)?;
            let asked = Instant::now();
            let Self { port, receiver, presses } = self;
            let is_over = port.read(|bytes| {
                for frame in bytes.iter().filter_map(|&byte| receiver.push(byte)) {
                    let Telemetry::Devices(readings) = frame.message else { continue };
                    for (edges, reading) in edges.iter_mut().zip([readings.right, readings.left]) {
                        edges.take(&reading);
                    }
                    if is_last {
                        return Ok(ControlFlow::Break(true));
                    }
                    is_last = is_pressed(presses)?;
                }
                let is_due = asked.elapsed() > ASK_AGAIN;
                Ok(if is_due { ControlFlow::Break(false) } else { ControlFlow::Continue(()) })
            })?;
            if is_over.context(CLOSED)? {
                return Ok(edges.map(|edges| edges.count));
            }
        }
    }

    /// The pings of some passes between the limits of the servo, to the left and back in turn.
    pub fn sweep(&mut self, limits: [f64; 2], passes: u32) -> anyhow::Result<Vec<SweptPing>> {
        self.presses.recv().context(NO_INPUT)?;
        let mut bearings = corner::pass(limits);
        let progress = bar(Some(u64::from(passes) * bearings.len() as u64));
        let mut pings = Vec::new();
        let mut moved = 1.0;
        for _ in 0..passes {
            for &bearing in &bearings {
                pings.extend(self.pings(bearing, moved)?);
                progress.inc(1);
            }
            bearings.reverse();
            moved = -moved;
        }
        progress.finish_and_clear();
        Ok(pings)
    }

    /// The pings at a bearing.
    fn pings(&mut self, bearing: f64, moved: f64) -> anyhow::Result<Vec<SweptPing>> {
        #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
        self.command(&Command::Point(Radians(bearing as f32)))?;
        let mut pings = Vec::new();
        let asked = Instant::now();
        let Self { port, receiver, .. } = self;
        let end = port.read(|bytes| {
            for frame in bytes.iter().filter_map(|&byte| receiver.push(byte)) {
                let Telemetry::Sweep(sweep) = frame.message else { continue };
                let reached = f64::from(sweep.bearing.0);
                // A ping that began before the command has the bearing before.
                if (reached - bearing).abs() < 0.5 * corner::STEP {
                    let range = sweep.outcome.ok().map(|echo| f64::from(echo.range.0));
                    pings.push(SweptPing { bearing: reached, moved, range });
                }
            }
            anyhow::ensure!(asked.elapsed() < SILENCE, "the robot sends no pings");
            let is_over = pings.len() >= PINGS;
            Ok(if is_over { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
        });
        end?.context(CLOSED)?;
        Ok(pings)
    }
}

const CLOSED: &str = "the port was closed";
const NO_INPUT: &str = "the standard input has ended before Enter was pressed";

fn is_pressed(presses: &Presses<()>) -> anyhow::Result<bool> {
    match presses.try_recv() {
        Ok(()) => Ok(true),
        Err(TryRecvError::Empty) => Ok(false),
        Err(error @ TryRecvError::Disconnected) => Err(error).context(NO_INPUT),
    }
}
