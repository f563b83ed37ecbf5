//! Telemetry as a log that `sonarfix replay` reads (`docs/formats.md`, "Logs").
//!
//! The log has all inputs of the localizer, so a replay reproduces its estimates bit for bit if no
//! frame was lost. A log has one start; when the robot restarts, a new log begins.

use std::fmt::Debug;
use std::io::{self, ErrorKind, Write};

use sonarfix::config::RangerId;
use sonarfix::geometry::units::Instant;
use sonarfix::localizer::AbsoluteFix;
use sonarfix::sensor::absolute::{AbsoluteMeasurement, PoseNoise, PositionNoise};
use sonarfix::sensor::gyro::TurnReading;
use sonarfix_hal::robot::AbsoluteResult;
use sonarfix_link::message::{ModeChanged, Odometry, SkippedPing, Sweep};
use sonarfix_link::{Estimate, Ping, Telemetry};
use sonarfix_replay::log::HEADER;
use sonarfix_search::navigator::{Mode, UNKNOWN_POSITION};

use crate::Received;
use crate::sealed::{Output, Sealed};

/// Where the logs of a recording go.
pub trait Logs: Debug + Send {
    /// The name of the first one.
    fn name(&self) -> String;

    /// Begins the log of this number, from 1.
    ///
    /// # Errors
    /// If it cannot be written, or there is one that is to stay ([`ErrorKind::AlreadyExists`]).
    fn create(&mut self, number: u32) -> io::Result<Box<dyn Output>>;
}

/// Writes logs: the first one, and another one at each further start of the robot.
#[derive(Debug)]
pub struct Recording {
    logs: Box<dyn Logs>,
    written: u32,
    /// Of the last log.
    number: u32,
    log: Option<Log<Sealed>>,
    /// The last odometry, for a log that begins during a run or when the pose is set before one began.
    step: Option<Odometry>,
}

impl Recording {
    /// A recording whose first log is created when the robot starts or its first estimate arrives.
    #[must_use]
    pub fn new(logs: impl Logs + 'static) -> Self {
        Self { logs: Box::new(logs), written: 0, number: 0, log: None, step: None }
    }

    /// The name of the first log.
    #[must_use]
    pub fn name(&self) -> String {
        self.logs.name()
    }

    /// Ends the last log, whole; returns the number of logs.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn end(mut self) -> io::Result<u32> {
        self.end_log()?;
        Ok(self.written)
    }

    fn end_log(&mut self) -> io::Result<()> {
        self.log.take().map_or(Ok(()), |log| log.out.end())
    }

    /// Records a message.
    ///
    /// # Errors
    /// If a log cannot be written, or the first one exists.
    pub fn take(&mut self, received: &Received) -> io::Result<()> {
        if let Telemetry::Odometry(step) = &received.telemetry {
            // The robot has restarted, and the frame that reports it was lost.
            if self.log.as_ref().is_some_and(|log| step.at < log.last) {
                self.end_log()?;
            }
            self.step = Some(*step);
        }
        match (&received.telemetry, &mut self.log) {
            (Telemetry::Initialized(began), _) => {
                let file = self.next_log()?;
                self.log = Some(Log::begin(file, began)?);
            }
            (Telemetry::ModeChanged(change), Some(log)) if change.estimate.at >= log.last => {
                log.lost(received.lost)?;
                log.mode(change.mode, &change.estimate)?;
            }
            (Telemetry::PoseSet(estimate), Some(log)) if estimate.at >= log.last => {
                log.lost(received.lost)?;
                log.set_pose(estimate)?;
            }
            (
                Telemetry::PoseSet(estimate) | Telemetry::ModeChanged(ModeChanged { estimate, .. }),
                _,
            ) => {
                if let Some(step) = self.step.filter(|step| step.at == estimate.at) {
                    let file = self.next_log()?;
                    self.log = Some(Log::join(file, estimate, &step)?);
                }
            }
            (_, Some(log)) => log.take(received)?,
            (Telemetry::Estimate(estimate), None) => {
                if let Some(step) = self.step.filter(|step| step.at == estimate.at) {
                    let file = self.next_log()?;
                    self.log = Some(Log::join(file, estimate, &step)?);
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// The next log. A further one takes the next number that is free.
    fn next_log(&mut self) -> io::Result<Sealed> {
        self.end_log()?;
        loop {
            self.number += 1;
            match self.logs.create(self.number) {
                Err(error) if error.kind() == ErrorKind::AlreadyExists && self.number > 1 => {}
                created => {
                    let out = created?;
                    self.written += 1;
                    return Ok(Sealed::new(out));
                }
            }
        }
    }
}

/// One log.
#[derive(Debug)]
pub struct Log<W> {
    out: W,
    /// The time of the last encoder record.
    last: Instant,
}

impl<W: Write> Log<W> {
    /// A log from the start of a robot.
    ///
    /// # Errors
    /// Errors of the writer.
    pub fn begin(out: W, began: &Estimate) -> io::Result<Self> {
        Self::of(out, "", began, [0.0, 0.0])
    }

    /// A log that begins during a run, from an estimate and the odometry before it. It lacks the
    /// correlations of the estimate, so a replay approximates the robot's estimates.
    ///
    /// # Errors
    /// Errors of the writer.
    pub fn join(out: W, estimate: &Estimate, step: &Odometry) -> io::Result<Self> {
        let note = "# recorded from the middle of a run: the replay starts from an estimate\n";
        Self::of(out, note, estimate, [step.right_metres, step.left_metres])
    }

    fn of(mut out: W, note: &str, start: &Estimate, wheels: [f64; 2]) -> io::Result<Self> {
        writeln!(
            out,
            "{HEADER}\n{note}resume,{}{}{}",
            Time(start.at),
            Numbers(start.state.to_array()),
            Numbers(start.deviation.to_array())
        )?;
        let [right, left] = wheels;
        writeln!(out, "wheels,{},{right},{left}", Time(start.at))?;
        let mut log = Self { out, last: start.at };
        if start.deviation.x >= UNKNOWN_POSITION {
            log.mode(Mode::Searching, start)?;
        }
        Ok(log)
    }

    /// Records a message.
    ///
    /// # Errors
    /// Errors of the writer.
    pub fn take(&mut self, received: &Received) -> io::Result<()> {
        self.lost(received.lost)?;
        match &received.telemetry {
            Telemetry::Odometry(step) => self.step(step),
            Telemetry::Turn(reading) => self.turn(reading),
            Telemetry::Ping(ping) => self.ping(ping),
            Telemetry::Absolute(result) => self.absolute(result),
            Telemetry::Sweep(sweep) => self.sweep(sweep),
            Telemetry::SkippedPing(SkippedPing { at, .. }) => {
                writeln!(self.out, "skip,{}", Time(*at))
            }
            _ => Ok(()),
        }
    }

    fn lost(&mut self, frames: u32) -> io::Result<()> {
        if frames == 0 {
            return Ok(());
        }
        writeln!(self.out, "# {frames} frames were lost here")
    }

    fn step(&mut self, step: &Odometry) -> io::Result<()> {
        // A step without duration has no travel, and a log has one encoder record per instant.
        if step.at > self.last {
            self.last = step.at;
            let Odometry { at, right_metres, left_metres } = step;
            writeln!(self.out, "wheels,{},{right_metres},{left_metres}", Time(*at))?;
        }
        Ok(())
    }

    /// The gyro at the time of the next step.
    fn turn(&mut self, reading: &TurnReading) -> io::Result<()> {
        let breaks = reading.breaks().map_or(String::new(), |breaks| breaks.to_string());
        writeln!(self.out, "turn,{},{},{breaks}", Time(reading.at()), reading.angle())
    }

    /// A heading, position or pose from outside. One that was refused has changed nothing.
    fn absolute(&mut self, result: &AbsoluteResult) -> io::Result<()> {
        if matches!(result.fix, AbsoluteFix::Refused(_)) {
            return Ok(());
        }
        let time = Time(result.at);
        let age = result.at.ticks().saturating_sub(result.measured_at.ticks());
        let age = Time(Instant::from_ticks(age));
        match result.measurement {
            AbsoluteMeasurement::Heading { angle, deviation } => {
                let numbers = Numbers([angle.0, deviation.0]);
                writeln!(self.out, "heading,{time}{numbers},{age}")
            }
            AbsoluteMeasurement::Position { point, noise } => {
                let PositionNoise { xx, xy, yy } = noise;
                let numbers = Numbers([point.x.0, point.y.0, xx, xy, yy]);
                writeln!(self.out, "position,{time}{numbers},{age}")
            }
            AbsoluteMeasurement::Pose { pose, noise: PoseNoise { position, xh, yh, hh } } => {
                let PositionNoise { xx, xy, yy } = position;
                let heading = pose.heading.radians().0;
                let numbers = Numbers([pose.x.0, pose.y.0, heading, xx, xy, yy, xh, yh, hh]);
                writeln!(self.out, "measured_pose,{time}{numbers},{age}")
            }
        }
    }

    /// A range without a wall, for the search.
    fn sweep(&mut self, sweep: &Sweep) -> io::Result<()> {
        let range = sweep.outcome.map_or(String::new(), |echo| f64::from(echo.range.0).to_string());
        writeln!(self.out, "range,{},{},{range}", Time(sweep.at), f64::from(sweep.bearing.0))
    }

    fn set_pose(&mut self, estimate: &Estimate) -> io::Result<()> {
        let [x, y, heading, ..] = estimate.state.to_array().map(f64::from);
        let [position, _, turn, ..] = estimate.deviation.to_array().map(f64::from);
        writeln!(self.out, "pose,{},{x},{y},{heading},{position},{turn}", Time(estimate.at))
    }

    fn mode(&mut self, mode: Mode, estimate: &Estimate) -> io::Result<()> {
        let name = match mode {
            Mode::Tracking => "tracking",
            Mode::Searching => "searching",
            Mode::Provisional => "provisional",
        };
        let (state, deviation) = (estimate.state.to_array(), estimate.deviation.to_array());
        writeln!(
            self.out,
            "mode,{},{name}{}{}",
            Time(estimate.at),
            Numbers(state),
            Numbers(deviation)
        )
    }

    fn ping(&mut self, ping: &Ping) -> io::Result<()> {
        let range = ping.outcome.map_or(String::new(), |echo| f64::from(echo.range.0).to_string());
        let (time, bearing) = (Time(ping.at), f64::from(ping.aim.bearing.0));
        write!(self.out, "range,{time},{bearing},{range},{}", ping.aim.wall.0)?;
        // The logs of robots with one ranger have no such field.
        if ping.aim.ranger != RangerId::FIRST {
            write!(self.out, ",{}", ping.aim.ranger.0)?;
        }
        writeln!(self.out)
    }
}

/// Seconds, to the microsecond.
struct Time(Instant);

impl std::fmt::Display for Time {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let micros = self.0.ticks();
        write!(f, "{}.{:06}", micros / 1_000_000, micros % 1_000_000)
    }
}

/// A comma and a number, for each of them. As `f64`, whose shortest decimals give the same `f32` again;
/// those of an `f32` might not, because they are parsed as `f64` and rounded a second time.
struct Numbers<const N: usize>([f32; N]);

impl<const N: usize> std::fmt::Display for Numbers<N> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for value in self.0 {
            write!(f, ",{}", f64::from(value))?;
        }
        Ok(())
    }
}
