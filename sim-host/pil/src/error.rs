//! Errors of processor in the loop.

use sonarfix_map::BakeError;
use sonarfix_pil::{Answer, RequestError};
use sonarfix_sim::simulate::SimulationError;

/// Why processor in the loop failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PilError {
    /// The map cannot be baked.
    #[error("the map cannot be baked: {0}")]
    Map(BakeError),
    /// The emulator failed.
    #[error("{0}")]
    Emulator(String),
    /// The request is too long.
    #[error("the map is too large for the emulated microcontroller")]
    TooLong,
    /// The session was refused.
    #[error("{0}")]
    Refused(RequestError),
    /// The loop has stopped.
    #[error("the robot's loop does not run")]
    Stopped,
    /// An answer of the wrong kind.
    #[error("the answer does not match the request: {0:?}")]
    Mismatched(Box<Answer>),
    /// The answers differ.
    #[error("at {seconds:.3} s the answers of microcontroller and PC differ: {what}")]
    Differs {
        /// Simulated seconds.
        seconds: f64,
        /// The difference.
        what: String,
    },
}

impl From<PilError> for SimulationError {
    fn from(error: PilError) -> Self {
        Self::Computer(error.to_string())
    }
}
