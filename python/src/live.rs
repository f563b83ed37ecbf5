//! Telemetry and commands of a robot.

use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use pyo3::exceptions::PyStopIteration;
use pyo3::prelude::*;
use serde_json::Value;
use sonarfix::geometry::units::{Duration as RobotDuration, Radians};
use sonarfix_link::{Command, CommandResult, Telemetry};
use sonarfix_monitor::log_files::LogFiles;
use sonarfix_monitor::port::Port;
use sonarfix_monitor::request;
use sonarfix_telemetry::recording::Recording;
use sonarfix_telemetry::{Monitor as Receiver, Received};

use crate::robot::Robot;
use crate::{errors, localizer, values};

/// Longest time between two checks for a signal.
const LOOK: Duration = Duration::from_millis(200);

/// The connection, and what has arrived.
struct Line {
    port: Port,
    receiver: Receiver,
    arrived: VecDeque<Received>,
    recording: Option<Recording>,
    is_over: bool,
}

impl Line {
    fn take(&mut self, byte: u8) -> anyhow::Result<()> {
        let Some(received) = self.receiver.push(byte) else { return Ok(()) };
        if let Some(recording) = &mut self.recording {
            recording.take(&received)?;
        }
        self.arrived.push_back(received);
        Ok(())
    }

    /// The next message; none before the deadline.
    fn next(&mut self, until: Instant) -> anyhow::Result<Option<Received>> {
        while self.arrived.is_empty() && !self.is_over && Instant::now() < until {
            let mut bytes = Vec::new();
            let read = self.port.read(|part| {
                bytes.extend_from_slice(part);
                Ok(ControlFlow::Break(()))
            })?;
            self.is_over = read.is_none();
            bytes.into_iter().try_for_each(|byte| self.take(byte))?;
        }
        Ok(self.arrived.pop_front())
    }

    /// Sends a command; keeps what arrives meanwhile.
    fn ask(&mut self, command: &Command) -> anyhow::Result<CommandResult> {
        let mut bytes = Vec::new();
        let result = request::ask_and_watch(&mut self.port, command, |byte| bytes.push(byte));
        bytes.into_iter().try_for_each(|byte| self.take(byte))?;
        result
    }
}

/// A message of a robot: its kind, its content, and the number of frames lost before it.
type Message<'py> = (String, Bound<'py, PyAny>, u32);

/// A message as JSON: `{"Estimate": {…}}`.
fn message<'py>(py: Python<'py>, received: &Received) -> PyResult<Message<'py>> {
    let Received { lost, telemetry } = received;
    let value = serde_json::to_value(telemetry);
    let value = value.map_err(|error| errors::internal(error.to_string()))?;
    let (kind, content) = match value {
        Value::Object(of) => of.into_iter().next().unwrap_or_default(),
        other => (other.to_string(), Value::Null),
    };
    let content = match (telemetry, content) {
        (Telemetry::Ack(_), content) | (_, content @ Value::Object(_)) => content,
        (_, content) => serde_json::json!({ "value": content }),
    };
    Ok((kind, values::of_json(py, &content)?, *lost))
}

/// Wrapped by sonarfix.Monitor.
#[pyclass(frozen, module = "sonarfix")]
pub struct Monitor(Mutex<Line>);

impl Monitor {
    fn with<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Line) -> anyhow::Result<T> + Send,
    ) -> PyResult<T> {
        let done = py.detach(|| match self.0.lock() {
            Ok(mut line) => work(&mut line),
            Err(_) => Err(anyhow::anyhow!("the connection is broken")),
        });
        done.map_err(|error| errors::connection(&error))
    }

    fn command(&self, py: Python<'_>, command: &Command) -> PyResult<()> {
        match self.with(py, |line| line.ask(command))? {
            CommandResult::Refused(reason) => {
                Err(errors::connection(&anyhow::anyhow!("the robot refuses: {reason}")))
            }
            _ => Ok(()),
        }
    }
}

#[pymethods]
impl Monitor {
    #[new]
    #[pyo3(signature = (port, baud=115_200, *, record=None, force=false))]
    fn new(
        py: Python<'_>,
        port: &str,
        baud: u32,
        record: Option<PathBuf>,
        force: bool,
    ) -> PyResult<Self> {
        let port = py.detach(|| Port::open(port, baud)).map_err(|e| errors::connection(&e))?;
        let recording = record.map(|path| Recording::new(LogFiles::new(path, force)));
        let (receiver, arrived) = (Receiver::default(), VecDeque::new());
        let line = Line { port, receiver, arrived, recording, is_over: false };
        Ok(Self(Mutex::new(line)))
    }

    /// The next message: kind, content, lost frames; None if none arrives within ``seconds``. Raises StopIteration at the
    /// end of the stream.
    #[pyo3(signature = (seconds=None))]
    fn receive<'py>(
        &self,
        py: Python<'py>,
        seconds: Option<f64>,
    ) -> PyResult<Option<Message<'py>>> {
        let patience = seconds.map(Duration::try_from_secs_f64);
        let patience = patience.transpose().map_err(|error| errors::input(error.to_string()))?;
        let until = patience.and_then(|patience| Instant::now().checked_add(patience));
        loop {
            let look = Instant::now() + LOOK;
            let deadline = until.map_or(look, |until| until.min(look));
            let (received, is_over) = self.with(py, |line| {
                let received = line.next(deadline)?;
                Ok((received, line.is_over))
            })?;
            if let Some(received) = received {
                return message(py, &received).map(Some);
            }
            if is_over {
                return Err(PyStopIteration::new_err(()));
            }
            py.check_signals()?;
            if until.is_some_and(|until| Instant::now() >= until) {
                return Ok(None);
            }
        }
    }

    /// Ends the recording, if there is one; returns the number of logs.
    fn end_recording(&self, py: Python<'_>) -> PyResult<u32> {
        self.with(py, |line| Ok(line.recording.take().map_or(Ok(0), Recording::end)?))
    }

    /// Runs the robot's loop.
    fn start(&self, py: Python<'_>) -> PyResult<()> {
        self.command(py, &Command::Start)
    }

    /// Stops the loop.
    fn stop(&self, py: Python<'_>) -> PyResult<()> {
        self.command(py, &Command::Stop)
    }

    /// Declares the pose unknown, and searches for it.
    fn search(&self, py: Python<'_>) -> PyResult<()> {
        self.command(py, &Command::Search)
    }

    /// Discards the estimated calibration of wheels and ranger.
    fn reset_calibration(&self, py: Python<'_>) -> PyResult<()> {
        self.command(py, &Command::ResetCalibration)
    }

    /// Turns the servo of a robot that waits to a bearing, radians.
    fn point(&self, py: Python<'_>, bearing: f64) -> PyResult<()> {
        let bearing = Radians(values::single(bearing, "the bearing")?);
        self.command(py, &Command::Point(bearing))
    }

    /// Restarts the localizer from a pose: x, y (metres), heading (radians).
    #[pyo3(signature = (pose, *, position_deviation=0.05, heading_deviation=0.05))]
    fn set_pose(
        &self,
        py: Python<'_>,
        pose: &Bound<'_, PyAny>,
        position_deviation: f64,
        heading_deviation: f64,
    ) -> PyResult<()> {
        let pose = localizer::pose_of(pose)?;
        let start = localizer::start(pose, position_deviation, heading_deviation)?;
        self.command(py, &Command::SetPose(start))
    }

    /// Passes a heading (radians), a position (metres) or both, ``age`` seconds old, to the running localizer.
    #[pyo3(signature = (*, heading=None, position=None, position_deviation=0.05, heading_deviation=0.05, age=0.0))]
    fn absolute(
        &self,
        py: Python<'_>,
        heading: Option<f64>,
        position: Option<(f64, f64)>,
        position_deviation: f64,
        heading_deviation: f64,
        age: f64,
    ) -> PyResult<()> {
        let of = localizer::absolute;
        let measurement = of(heading, position, position_deviation, heading_deviation)?;
        let age = RobotDuration::from_ticks(values::instant(age)?.ticks());
        self.command(py, &Command::Absolute { age, measurement })
    }

    /// Stores a robot's configuration, and restarts the localizer with it.
    fn set_configuration(&self, py: Python<'_>, robot: &Robot) -> PyResult<()> {
        self.command(py, &Command::SetConfiguration(robot.config))
    }
}
