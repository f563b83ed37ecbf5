//! Many runs on all cores, with results that do not depend on the number of cores.

use rayon::prelude::*;

use crate::progress::Progress;
use crate::simulate::{Simulation, SimulationError};
use crate::statistics::RunResult;

/// Runs the seeds `seed`, `seed + 1`, … and returns the results in the order of their seeds; after an interruption those
/// of the runs that were finished.
///
/// # Errors
/// The [`SimulationError`] of the first run that fails.
pub fn results(
    simulation: &Simulation,
    seed: u64,
    runs: u32,
    progress: &impl Progress,
) -> Result<Vec<RunResult>, SimulationError> {
    (0..u64::from(runs))
        .into_par_iter()
        .filter(|_| !progress.is_interrupted())
        .map(|run| {
            let result = simulation.run(seed.wrapping_add(run), &mut ());
            progress.finished();
            result
        })
        .collect()
}
