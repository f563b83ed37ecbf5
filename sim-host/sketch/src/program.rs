//! A program for Arduino as the computer of a simulated robot.

use std::io::{BufReader, BufWriter};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use anyhow::Context;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::units::{Duration, Instant};
use sonarfix::health::Verdict;
use sonarfix::localizer::{Localizer, Start};
use sonarfix::sensor::absolute::AbsoluteMeasurement;
use sonarfix_hal::robot::{Report, Tick};
use sonarfix_pil::wires::FULL_DUTY;
use sonarfix_pil::{Actuators, RangerActuators, Sensors, Wires};
use sonarfix_search::navigator::Mode;
use sonarfix_search::search::Search;
use sonarfix_sim::simulate::computer::{Computer, Controller, no_pose};
use sonarfix_sim::simulate::{Simulation, SimulationError};

use crate::estimate::{Listener, Reported};
use crate::wire::{self, Outputs, RangerOutput};

/// Time between two calls of `loop()`, µs.
const LOOP: Duration = Duration::from_ticks(1_000);
/// Period of the pulses of Arduino's library `Servo`, µs.
const FRAME: u32 = 20_000;

/// A program that can be started repeatedly.
#[derive(Debug)]
pub struct Program<'s> {
    simulation: &'s Simulation,
    path: &'s Path,
}

impl<'s> Program<'s> {
    /// The program of this file, in this simulation.
    pub fn new(simulation: &'s Simulation, path: &'s Path) -> Self {
        Self { simulation, path }
    }

    fn start(&self, start: Option<Start>, at: Instant) -> anyhow::Result<Running<'s>> {
        let mut child = Command::new(self.path)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| format!("cannot start {}", self.path.display()))?;
        let to = BufWriter::new(child.stdin.take().context("no standard input")?);
        let from = BufReader::new(child.stdout.take().context("no standard output")?);
        let mirror = self.simulation.localizer(start.unwrap_or_else(no_pose), at)?;
        let mode = if start.is_some() { Mode::Tracking } else { Mode::Searching };
        let listener = Listener::default();
        Ok(Running { child, to, from, listener, mirror, mode, polled: at, is_pinging: false })
    }
}

/// Why a program failed, as an error of the simulation.
fn failed(error: impl std::fmt::Display) -> SimulationError {
    SimulationError::Computer(format!("the program has failed: {error:#}"))
}

impl Computer for Program<'_> {
    type Inputs<'w>
        = Localizer<'w>
    where
        Self: 'w;
    type Controller<'w>
        = Running<'w>
    where
        Self: 'w;

    fn localizer(&mut self, _: Start, _: Instant) -> Result<Localizer<'_>, SimulationError> {
        Err(failed("it needs a scenario of the fidelity \"pins\""))
    }

    fn controller<'w>(
        &'w mut self,
        _: &'w Wires,
        start: Option<Start>,
        at: Instant,
    ) -> Result<(Running<'w>, Actuators), SimulationError> {
        Ok((self.start(start, at).map_err(failed)?, Actuators::default()))
    }
}

/// A program that runs.
#[derive(Debug)]
pub struct Running<'w> {
    child: Child,
    to: BufWriter<ChildStdin>,
    from: BufReader<ChildStdout>,
    listener: Listener,
    /// A localizer with the estimate that the program reports, from which the simulator takes it.
    mirror: Localizer<'w>,
    mode: Mode,
    polled: Instant,
    /// Whether a ping is in flight.
    is_pinging: bool,
}

impl Running<'_> {
    /// Takes over an estimate.
    fn reflect(&mut self, reported: &Reported, at: Instant) -> Result<(), SimulationError> {
        let Reported { start, verdict } = reported;
        self.mirror.odometry(at, WheelTravel::new(0.0, 0.0)).map_err(failed)?;
        self.mirror.set_pose(start).map_err(failed)?;
        self.mode = Mode::Tracking;
        if *verdict == Verdict::Lost {
            self.mirror.declare_lost();
            self.mode = Mode::Searching;
        }
        Ok(())
    }
}

impl Drop for Running<'_> {
    fn drop(&mut self) {
        // It may have ended already.
        self.child.kill().ok();
        self.child.wait().ok();
    }
}

impl Controller for Running<'_> {
    fn poll(
        &mut self,
        sensors: &Sensors,
        report: &mut Report,
    ) -> Result<Actuators, SimulationError> {
        wire::send(sensors, &mut self.to).map_err(failed)?;
        let Outputs { rangers, serial } = wire::receive(&mut self.from).map_err(failed)?;
        self.polled = sensors.at;
        let has_fallen = sensors.echoes.iter().any(|echo| echo.fell.is_some());
        let has_pinged = rangers.iter().any(|ranger| ranger.has_pinged);
        self.is_pinging = has_pinged || (self.is_pinging && !has_fallen);
        *report = Report::default();
        if let Some(reported) = self.listener.hear(&serial) {
            self.reflect(&reported, sensors.at)?;
            let lateness = Duration::from_ticks(0);
            report.tick = Some(Tick { step: None, lateness, held: false, skipped: 0 });
        }
        Ok(Actuators { rangers: rangers.map(actuators) })
    }

    fn absolute(&mut self, _: Instant, _: &AbsoluteMeasurement) -> Result<bool, SimulationError> {
        Ok(false)
    }

    fn localizer(&self) -> Result<&Localizer<'_>, SimulationError> {
        Ok(&self.mirror)
    }

    fn next_poll(&mut self) -> Instant {
        self.polled.checked_add_duration(LOOP).unwrap_or(self.polled)
    }

    fn idle_until(&mut self) -> Option<Instant> {
        (!self.is_pinging).then(|| self.next_poll())
    }

    fn mode(&self) -> Result<Mode, SimulationError> {
        Ok(self.mode)
    }

    fn search(&self) -> Option<&Search<'_>> {
        None
    }
}

fn actuators(output: RangerOutput) -> RangerActuators {
    let duty = u32::from(output.servo) * u32::from(FULL_DUTY) / FRAME;
    RangerActuators {
        duty: (output.servo != 0).then(|| u16::try_from(duty).unwrap_or(FULL_DUTY)),
        is_raised: false,
        has_fallen: output.has_pinged,
    }
}
