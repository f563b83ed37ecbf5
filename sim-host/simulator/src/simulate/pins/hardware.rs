//! The simulated hardware step by step, for a robot whose software and time are the caller's.

use sonarfix::geometry::units::Instant;
use sonarfix::localizer::Localizer;
use sonarfix::sensor::absolute::AbsoluteMeasurement;
use sonarfix_pil::{Actuators, Sensors};
use sonarfix_search::navigator::Mode;

use super::SimulatedHardware;
use crate::pins::wires::EncoderWires;
use crate::plant::follower::Command;
use crate::simulate::{Simulation, SimulationError};
use crate::trace::Pose;

/// The true robot and its devices. Times are microseconds since it was switched on.
pub struct Hardware<'a>(SimulatedHardware<'a>);

impl<'a> Hardware<'a> {
    /// The robot at the start of its path, at rest.
    ///
    /// # Errors
    /// [`SimulationError`], if the scenario has no such robot.
    pub fn new(
        simulation: &'a Simulation,
        seed: u64,
        encoders: &'a [EncoderWires; 2],
    ) -> Result<Self, SimulationError> {
        SimulatedHardware::new(simulation, seed, encoders).map(|(hardware, _)| Self(hardware))
    }

    /// The time.
    #[must_use]
    pub fn now(&self) -> u64 {
        self.0.now
    }

    /// The true pose.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.0.plant.pose()
    }

    /// Whether an echo line has had an edge since the last poll.
    #[must_use]
    pub fn has_edges(&self) -> bool {
        self.0.has_edges()
    }

    /// The next heading, position or pose from outside that has arrived.
    pub fn arrived(&mut self) -> Option<(Instant, AbsoluteMeasurement)> {
        self.0.absolute.arrived(self.0.now, self.0.now)
    }

    /// The inputs of the devices since the last poll.
    pub fn sensors(&mut self) -> Sensors {
        let has_failed = self.0.read_fails();
        self.0.sensors(has_failed)
    }

    /// Applies the outputs of a poll, after which the software determines the pose by `mode`.
    pub fn obey(&mut self, actuators: Actuators, mode: Mode) {
        self.0.mode = mode;
        self.0.obey(actuators);
    }

    /// Steers along the path by the estimate; while the robot searches for its pose, by the true one. At the end of the path
    /// the robot stands.
    pub fn follow(&mut self, localizer: &Localizer) {
        self.0.steer(localizer);
    }

    /// Drives with this motion until the next call.
    pub fn steer(&mut self, command: Command) {
        self.0.plant.steer(command);
    }

    /// The time of the next step; `idle_until`: before that a poll has no effect, `None` while a ping is in flight.
    pub fn next_step(&mut self, idle_until: Option<Instant>) -> u64 {
        self.0.next_step(idle_until)
    }

    /// Advances to a later time.
    pub fn advance(&mut self, now: u64) {
        self.0.advance(now);
    }
}
