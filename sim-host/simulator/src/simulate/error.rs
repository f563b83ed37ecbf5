//! Errors that end a run early.

use sonarfix::localizer::StartError;
use sonarfix::map::MapError;
use sonarfix_hal::config::{RobotConfigError, Unsupported};
use sonarfix_hal::encoder::GeometryError;
use sonarfix_hal::robot::SettingsError;

/// Why a run failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimulationError {
    /// The localizer rejects its start.
    #[error("the localizer rejects its start: {0}")]
    Start(#[from] StartError),
    /// At the ideal fidelity the robot has no loop, and so no search.
    #[error("a robot without a start pose needs the fidelity \"pins\"")]
    NoPose,
    /// The localizer rejects its baked map.
    #[error("the localizer rejects its map: {0}")]
    Map(#[from] MapError),
    /// The robot's configuration breaks a rule.
    #[error("the robot's configuration is wrong: {0}")]
    Config(#[from] RobotConfigError),
    /// The simulated board cannot be this robot.
    #[error("the robot cannot be simulated down to its pins: {0}")]
    Unsupported(#[from] Unsupported),
    /// A wheel of the robot is invalid.
    #[error("the robot's wheels: {0}")]
    Wheels(#[from] GeometryError),
    /// The loop refused its settings.
    #[error("the robot's loop: {0}")]
    Loop(#[from] SettingsError),
    /// The localizer rejects the travel of the simulated wheels.
    #[error("at {time:.1} s the localizer rejects the travel of the wheels: {error}")]
    Odometry {
        /// Seconds since the run began.
        time: f64,
        /// The reason.
        error: sonarfix::localizer::OdometryError,
    },
    /// The computer that runs the robot's software failed.
    #[error("{0}")]
    Computer(String),
    /// The filter's covariance is no longer positive definite.
    #[error("at the end of the run the covariance is not positive definite")]
    Covariance,
}
