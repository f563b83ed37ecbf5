//! The computer that runs the robot's software: here this process; in `sonarfix-pil-host` an emulated
//! microcontroller.

use sonarfix::aim::{Aim, NoAim};
use sonarfix::localizer::{Fix, Localizer, OdometryError, Start};
use sonarfix::motion::WheelTravel;
use sonarfix::units::{Instant, Metres};
use sonarfix_hal::robot::{Report, Robot, Settings};
use sonarfix_pil::board::{self, WiredDevices};
use sonarfix_pil::{Actuators, Sensors, Wires};

use super::error::SimulationError;
use super::simulation::Simulation;

/// A computer that can be started repeatedly.
pub trait Computer {
    /// The localizer on it, without drivers.
    type Inputs<'w>: LocalizerInputs
    where
        Self: 'w;
    /// The loop on it, with its drivers.
    type Controller<'w>: Controller
    where
        Self: 'w;

    /// Starts a localizer at this time.
    ///
    /// # Errors
    /// [`SimulationError`], if it does not start.
    fn localizer(&mut self, start: Start, at: Instant)
    -> Result<Self::Inputs<'_>, SimulationError>;

    /// Starts the loop at this time; returns its first outputs, too.
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

/// The inputs of a localizer, without drivers.
pub trait LocalizerInputs {
    /// Passes wheel travel.
    ///
    /// # Errors
    /// [`SimulationError`], if the computer fails.
    fn odometry(
        &mut self,
        at: Instant,
        travel: WheelTravel,
    ) -> Result<Result<(), OdometryError>, SimulationError>;
    /// Chooses the wall to measure.
    ///
    /// # Errors
    /// [`SimulationError`], if the computer fails.
    fn aim(&mut self) -> Result<Result<Aim, NoAim>, SimulationError>;
    /// Passes the range of an aim.
    ///
    /// # Errors
    /// [`SimulationError`], if the computer fails.
    fn fix(&mut self, aim: &Aim, range: Option<Metres>) -> Result<Fix, SimulationError>;
    /// Reports a cycle without a measurable wall.
    ///
    /// # Errors
    /// [`SimulationError`], if the computer fails.
    fn skip(&mut self) -> Result<(), SimulationError>;
    /// The localizer, for reading its state.
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
    /// The localizer, for reading its state.
    ///
    /// # Errors
    /// [`SimulationError`], if it has stopped.
    fn localizer(&self) -> Result<&Localizer<'_>, SimulationError>;
    /// The time before which a poll has no effect; `None` while a ping is in flight.
    fn idle_until(&mut self) -> Option<Instant>;
}

/// This process.
#[derive(Debug)]
pub struct ThisProcess<'s>(pub &'s Simulation);

impl Computer for ThisProcess<'_> {
    type Inputs<'w>
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
        let config = simulation.robot();
        config.check()?;
        let settings = Settings {
            encoder_period: config.encoder_period,
            stamp: simulation.stamp,
            ..Settings::default()
        };
        let robot = Robot::new(simulation.localizer(start, at)?, config.wheels()?, settings)?;
        let controller = RobotOnWires { robot, devices: board::devices(&config, wires)?, wires };
        Ok((controller, Actuators::default()))
    }
}

impl LocalizerInputs for Localizer<'_> {
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
        self.wires.apply(sensors);
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
