//! What the robot's software runs on. Here: this process. `crate::pil` has a microcontroller.

use sonarfix::aim::{Aim, NoAim};
use sonarfix::localizer::{Fix, Localizer, OdometryError, Start};
use sonarfix::motion::WheelTravel;
use sonarfix::units::{Instant, Metres};
use sonarfix_hal::robot::{Report, Robot};
use sonarfix_pil::board::WiredDevices;
use sonarfix_pil::{Actuators, Sensors, SetupError, Wires};

use super::{Simulation, SimulationError};
use crate::pins::devices;

/// A computer that can be switched on, again and again.
pub trait Computer {
    /// A localizer on it that is told everything.
    type Told<'w>: Told
    where
        Self: 'w;
    /// The loop on it, with its drivers.
    type Controller<'w>: Controller
    where
        Self: 'w;

    /// Switches on a localizer that starts at this time.
    ///
    /// # Errors
    /// [`SimulationError`], if it does not start.
    fn localizer(&mut self, start: Start, at: Instant) -> Result<Self::Told<'_>, SimulationError>;

    /// Switches on the loop, which starts at this time; with what it does to its devices at once.
    ///
    /// # Errors
    /// [`SimulationError`], if it does not start.
    fn controller<'w>(
        &'w mut self,
        wires: &'w Wires,
        start: Start,
        at: Instant,
    ) -> Result<(Self::Controller<'w>, Actuators), SimulationError>;
}

/// A localizer that is told everything at once and on the dot.
pub trait Told {
    /// The wheels rolled.
    ///
    /// # Errors
    /// [`SimulationError`], if the computer fails.
    fn odometry(
        &mut self,
        at: Instant,
        travel: WheelTravel,
    ) -> Result<Result<(), OdometryError>, SimulationError>;
    /// Where the sonar should look.
    ///
    /// # Errors
    /// [`SimulationError`], if the computer fails.
    fn aim(&mut self) -> Result<Result<Aim, NoAim>, SimulationError>;
    /// What came back from the last aim.
    ///
    /// # Errors
    /// [`SimulationError`], if the computer fails.
    fn fix(&mut self, aim: &Aim, range: Option<Metres>) -> Result<Fix, SimulationError>;
    /// There was nothing to look at.
    ///
    /// # Errors
    /// [`SimulationError`], if the computer fails.
    fn skip(&mut self) -> Result<(), SimulationError>;
    /// What it knows.
    ///
    /// # Errors
    /// [`SimulationError`], if the computer fails.
    fn localizer(&self) -> Result<&Localizer<'_>, SimulationError>;
}

/// A robot's loop and its drivers.
pub trait Controller {
    /// Polls the loop.
    ///
    /// # Errors
    /// [`SimulationError`], if the computer fails.
    fn poll(&mut self, sensors: &Sensors) -> Result<(Report, Actuators), SimulationError>;
    /// What it knows.
    ///
    /// # Errors
    /// [`SimulationError`], if it no longer runs.
    fn localizer(&self) -> Result<&Localizer<'_>, SimulationError>;
    /// Until when polling it is of no use; `None` while a ping is in flight.
    fn idle_until(&mut self) -> Option<Instant>;
}

/// This process.
#[derive(Debug)]
pub struct ThisProcess<'s>(pub &'s Simulation);

impl Computer for ThisProcess<'_> {
    type Told<'w>
        = Localizer<'w>
    where
        Self: 'w;
    type Controller<'w>
        = RobotOnWires<'w>
    where
        Self: 'w;

    fn localizer(&mut self, start: Start, at: Instant) -> Result<Localizer<'_>, SimulationError> {
        self.0.localizer(start, at)
    }

    fn controller<'w>(
        &'w mut self,
        wires: &'w Wires,
        start: Start,
        at: Instant,
    ) -> Result<(RobotOnWires<'w>, Actuators), SimulationError> {
        let Self(simulation) = self;
        let board = devices::board(&simulation.scenario, simulation.stamp);
        let robot = Robot::new(simulation.localizer(start, at)?, board.wheels()?, board.settings);
        let robot = robot.map_err(SetupError::Loop)?;
        let controller = RobotOnWires { robot, devices: board.devices(wires)?, wires };
        Ok((controller, Actuators::default()))
    }
}

impl Told for Localizer<'_> {
    fn odometry(
        &mut self,
        at: Instant,
        travel: WheelTravel,
    ) -> Result<Result<(), OdometryError>, SimulationError> {
        Ok(Localizer::odometry(self, at, travel))
    }

    fn aim(&mut self) -> Result<Result<Aim, NoAim>, SimulationError> {
        Ok(Localizer::aim(self))
    }

    fn fix(&mut self, aim: &Aim, range: Option<Metres>) -> Result<Fix, SimulationError> {
        Ok(Localizer::fix(self, aim, range))
    }

    fn skip(&mut self) -> Result<(), SimulationError> {
        Localizer::skip(self);
        Ok(())
    }

    fn localizer(&self) -> Result<&Localizer<'_>, SimulationError> {
        Ok(self)
    }
}

/// The loop in this process.
#[derive(Debug)]
pub struct RobotOnWires<'w> {
    robot: Robot<'w>,
    devices: WiredDevices<'w>,
    wires: &'w Wires,
}

impl Controller for RobotOnWires<'_> {
    fn poll(&mut self, sensors: &Sensors) -> Result<(Report, Actuators), SimulationError> {
        self.wires.show(sensors);
        let report = self.robot.poll(sensors.at, &mut self.devices);
        Ok((report, self.wires.take()))
    }

    fn localizer(&self) -> Result<&Localizer<'_>, SimulationError> {
        Ok(self.robot.localizer())
    }

    fn idle_until(&mut self) -> Option<Instant> {
        self.robot.idle_until(&mut self.devices)
    }
}
