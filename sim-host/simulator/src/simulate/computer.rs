//! The computer that runs the robot's software: here this process; in `sonarfix-pil-host` an emulated
//! microcontroller.

use sonarfix::aim::{Aim, NoAim};
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::localizer::{AbsoluteFix, Fix, Localizer, OdometryError, Start};
use sonarfix::sensor::absolute::AbsoluteMeasurement;
use sonarfix::sensor::gyro::MeasuredTurn;
use sonarfix_hal::robot::{EVALUATIONS_PER_MILLISECOND, Report, Robot, Settings};
use sonarfix_pil::board::{self, WiredDevices};
use sonarfix_pil::{Actuators, Sensors, Wires};
use sonarfix_search::navigator::{Mode, UNKNOWN_HEADING, UNKNOWN_POSITION};
use sonarfix_search::search::{Search, SearchParameters};

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

    /// Starts the loop at this time, without a pose if there is no start; returns its first outputs, too.
    ///
    /// # Errors
    /// [`SimulationError`], if it does not start.
    fn controller<'w>(
        &'w mut self,
        wires: &'w Wires,
        start: Option<Start>,
        at: Instant,
    ) -> Result<(Self::Controller<'w>, Actuators), SimulationError>;
}

/// The inputs of a localizer, without drivers.
pub trait LocalizerInputs {
    /// Passes wheel travel, and the turn by the gyro.
    ///
    /// # Errors
    /// [`SimulationError`], if the computer fails.
    fn odometry(
        &mut self,
        at: Instant,
        travel: WheelTravel,
        turn: Option<MeasuredTurn>,
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
    /// Passes a heading, position or pose that was measured at a time.
    ///
    /// # Errors
    /// [`SimulationError`], if the computer fails.
    fn absolute(
        &mut self,
        at: Instant,
        measurement: &AbsoluteMeasurement,
    ) -> Result<AbsoluteFix, SimulationError>;
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
    /// Polls the loop, which writes its report in place.
    ///
    /// # Errors
    /// [`SimulationError`], if the computer fails.
    fn poll(
        &mut self,
        sensors: &Sensors,
        report: &mut Report,
    ) -> Result<Actuators, SimulationError>;
    /// Passes a heading, position or pose that was measured at a time, for the next polls; returns whether it waits for
    /// one, or an earlier one still does.
    ///
    /// # Errors
    /// [`SimulationError`], if the computer fails.
    fn absolute(
        &mut self,
        at: Instant,
        measurement: &AbsoluteMeasurement,
    ) -> Result<bool, SimulationError>;
    /// The localizer, for reading its state.
    ///
    /// # Errors
    /// [`SimulationError`], if it has stopped.
    fn localizer(&self) -> Result<&Localizer<'_>, SimulationError>;
    /// When it must be polled next, if no edge of the echo comes earlier.
    fn next_poll(&mut self) -> Instant;
    /// The time before which a poll has no effect; `None` while a ping is in flight.
    fn idle_until(&mut self) -> Option<Instant>;
    /// What determines the pose.
    ///
    /// # Errors
    /// [`SimulationError`], if it has stopped.
    fn mode(&self) -> Result<Mode, SimulationError>;
    /// The search, if the robot has one.
    fn search(&self) -> Option<&Search<'_>>;
}

/// The start of a localizer without a pose.
#[must_use]
pub fn no_pose() -> Start {
    Start {
        pose: Pose::new(0.0, 0.0, Radians(0.0)),
        position_deviation: UNKNOWN_POSITION,
        heading_deviation: UNKNOWN_HEADING,
    }
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
        start: Option<Start>,
        at: Instant,
    ) -> Result<(RobotOnWires<'w>, Actuators), SimulationError> {
        let Self(simulation) = self;
        let config = simulation.robot();
        config.check()?;
        let settings = Settings {
            encoder_period: config.encoder_period,
            stamp: simulation.stamp,
            // A robot that searches is polled every millisecond.
            evaluations: EVALUATIONS_PER_MILLISECOND,
            ..Settings::default()
        };
        let localizer = simulation.localizer(start.unwrap_or_else(no_pose), at)?;
        let mut search = config.start.is_unknown().then(|| {
            let (sonar, map) = (&config.localizer.rangers.first, localizer.map());
            Search::new(sonar, map, SearchParameters::default())
        });
        let mut robot = Robot::new(localizer, config.wheels()?, settings)?;
        if let (None, Some(search)) = (start, &mut search) {
            robot.search_in(at, config.start.region(), search);
        }
        let devices = board::devices(&config, wires)?;
        let controller = RobotOnWires { robot, search, devices, wires };
        Ok((controller, Actuators::default()))
    }
}

impl LocalizerInputs for Localizer<'_> {
    fn odometry(
        &mut self,
        at: Instant,
        travel: WheelTravel,
        turn: Option<MeasuredTurn>,
    ) -> Result<Result<(), OdometryError>, SimulationError> {
        Ok(Localizer::odometry_with_turn(self, at, travel, turn))
    }

    fn aim(&mut self) -> Result<Result<Aim, NoAim>, SimulationError> {
        Ok(Localizer::aim(self))
    }

    fn fix(&mut self, aim: &Aim, range: Option<Metres>) -> Result<Fix, SimulationError> {
        Ok(Localizer::fix(self, aim, range))
    }

    fn absolute(
        &mut self,
        at: Instant,
        measurement: &AbsoluteMeasurement,
    ) -> Result<AbsoluteFix, SimulationError> {
        Ok(Localizer::absolute(self, at, measurement))
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
    search: Option<Search<'w>>,
    devices: WiredDevices<'w>,
    wires: &'w Wires,
}

impl Controller for RobotOnWires<'_> {
    fn poll(
        &mut self,
        sensors: &Sensors,
        report: &mut Report,
    ) -> Result<Actuators, SimulationError> {
        self.wires.apply(sensors);
        self.robot.poll_into(sensors.at, &mut self.devices, self.search.as_mut(), report);
        Ok(self.wires.take())
    }

    fn absolute(
        &mut self,
        at: Instant,
        measurement: &AbsoluteMeasurement,
    ) -> Result<bool, SimulationError> {
        Ok(self.robot.absolute(at, measurement).is_ok())
    }

    fn localizer(&self) -> Result<&Localizer<'_>, SimulationError> {
        Ok(self.robot.localizer())
    }

    fn next_poll(&mut self) -> Instant {
        self.robot.next_poll(&mut self.devices)
    }

    fn idle_until(&mut self) -> Option<Instant> {
        self.robot.idle_until(&mut self.devices)
    }

    fn mode(&self) -> Result<Mode, SimulationError> {
        Ok(self.robot.mode())
    }

    fn search(&self) -> Option<&Search<'_>> {
        self.search.as_ref()
    }
}
