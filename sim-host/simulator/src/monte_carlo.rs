//! Many runs on all cores, with results that do not depend on the number of cores.

use rayon::prelude::*;

use crate::simulate::{Simulation, SimulationError};
use crate::statistics::RunResult;

/// Runs the seeds `seed`, `seed + 1`, … and returns the results in the order of their seeds. Calls
/// `done` after every run.
///
/// # Errors
/// The [`SimulationError`] of the first run that fails.
pub fn results(
    simulation: &Simulation,
    seed: u64,
    runs: u32,
    done: impl Fn() + Sync,
) -> Result<Vec<RunResult>, SimulationError> {
    (0..u64::from(runs))
        .into_par_iter()
        .map(|run| {
            let result = simulation.run(seed.wrapping_add(run), &mut ());
            done();
            result
        })
        .collect()
}
