//! What the page asks for: a scenario, a seed, a duration, and where the robot is kidnapped to.

use std::path::Path;

use serde::{Deserialize, Serialize};
use sonarfix_map::{Fidelity, FileError, Follow, Scenario};
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::trace::Pose;
use thiserror::Error;

/// Longest run, seconds.
pub const MOST_SECONDS: f64 = 3_600.0;
/// Largest coordinate of a kidnapped robot, metres.
const FARTHEST: f64 = 1_000.0;

/// A request.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Request {
    /// The scenario, with the keys of a scenario file.
    pub scenario: toml::Table,
    /// The seed of the run.
    pub seed: u64,
    /// How long it lasts at most, simulated seconds.
    pub seconds: f64,
    /// When the robot is kidnapped, and to where.
    #[serde(default)]
    pub moves: Vec<Move>,
    /// Whether the robot searches for its pose when it is lost.
    #[serde(default)]
    pub searches: bool,
}

/// A kidnapping: the robot is moved elsewhere, without odometry.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Move {
    /// When, seconds since the run began.
    pub at: f64,
    /// Where, metres.
    pub x: f64,
    /// Where, metres.
    pub y: f64,
    /// True heading, radians.
    pub heading: f64,
}

/// Why a request has no run.
#[derive(Debug, Error)]
pub enum RequestError {
    /// It is not a request in JSON.
    #[error("{0}")]
    Json(#[from] serde_json::Error),
    /// The scenario has mistakes.
    #[error("{0}")]
    Scenario(#[from] FileError),
    /// The duration is not valid.
    #[error("the seconds must be from 0 to {MOST_SECONDS}")]
    Seconds,
    /// The robot cannot be moved there.
    #[error(
        "a robot is kidnapped to a place within {FARTHEST} m of the origin, at a time of the run"
    )]
    Move,
    /// The scenario's robot cannot be kidnapped.
    #[error("only a robot at the fidelity \"pins\" that follows its estimate can be kidnapped")]
    NotSteered,
}

impl Request {
    /// The simulation.
    ///
    /// # Errors
    /// [`RequestError`]
    pub fn simulation(&self) -> Result<Simulation, RequestError> {
        let text = self.scenario.to_string();
        let mut scenario = Scenario::parse(&text, "scenario", Path::new(""))?;
        if !(0.0..=MOST_SECONDS).contains(&self.seconds) {
            return Err(RequestError::Seconds);
        }
        let is_steered = scenario.fidelity == Fidelity::Pins && scenario.follow == Follow::Estimate;
        if !self.moves.is_empty() && !is_steered {
            return Err(RequestError::NotSteered);
        }
        if self.searches {
            scenario.robot.start = sonarfix_hal::config::StartPose::Unknown { region: None };
        }
        let mut simulation = Simulation::new(scenario).shortened(self.seconds);
        for put in &self.moves {
            simulation = simulation.put_down(put.at, put.pose()?);
        }
        Ok(simulation)
    }
}

impl Move {
    fn pose(&self) -> Result<Pose, RequestError> {
        let Self { at, x, y, heading } = *self;
        let is_near = |metres: f64| metres.abs() <= FARTHEST;
        let is_valid = (0.0..=MOST_SECONDS).contains(&at) && is_near(x) && is_near(y);
        if !is_valid || !heading.is_finite() {
            return Err(RequestError::Move);
        }
        Ok(Pose { x, y, heading: sonarfix_sim::angle::wrap(heading) })
    }
}
