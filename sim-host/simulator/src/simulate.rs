//! One simulated run of the shipped localizer.
//!
//! - [`Simulation`]: a scenario, prepared to be run;
//! - `ideal`: a run that passes travel and ranges directly and on time to the localizer;
//! - `pins`: a run through pins, drivers and the shipped loop; [`Hardware`]: its hardware step by step;
//! - `score`: the result of a run;
//! - [`computer`]: the computer that runs the robot's software;
//! - `streams`: the random streams of a run.

pub mod computer;
mod error;
mod ideal;
mod pins;
mod score;
mod simulation;
mod streams;

use sonarfix_map::Fidelity;

use self::computer::{Computer, ThisProcess};
use crate::statistics::RunResult;
use crate::trace::Recorder;

pub use error::SimulationError;
pub use pins::hardware::Hardware;
pub use simulation::{MANY, Simulation, start_at};

impl Simulation {
    /// Runs once.
    ///
    /// # Errors
    /// [`SimulationError`], if the localizer refuses its start or its wheels, or the hardware
    /// cannot be set up.
    pub fn run(
        &self,
        seed: u64,
        recorder: &mut impl Recorder,
    ) -> Result<RunResult, SimulationError> {
        self.run_on(&mut ThisProcess(self), seed, recorder)
    }

    /// Runs once, with the robot's software on this computer.
    ///
    /// # Errors
    /// [`SimulationError`], as [`Self::run`], or if the computer fails.
    pub fn run_on(
        &self,
        computer: &mut impl Computer,
        seed: u64,
        recorder: &mut impl Recorder,
    ) -> Result<RunResult, SimulationError> {
        match self.scenario.fidelity {
            Fidelity::Ideal => ideal::run(self, seed, recorder, computer),
            Fidelity::Pins => pins::run(self, seed, recorder, computer),
        }
    }
}
