//! Many runs on all cores, with results that do not depend on the number of cores.

use rayon::prelude::*;

use crate::progress::Progress;
use crate::row::Row;
use crate::simulate::{Simulation, SimulationError};
use crate::statistics::RunResult;

/// Runs once without a record. It is not generic: what it calls is compiled, and so optimized, with this crate.
fn unrecorded(simulation: &Simulation, seed: u64) -> Result<RunResult, SimulationError> {
    simulation.run(seed, &mut ())
}

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
            let result = unrecorded(simulation, seed.wrapping_add(run));
            progress.finished();
            result
        })
        .collect()
}

/// The rows of the seeds `first`, `first + 1`, … in their order; after an interruption those of the runs that were finished.
///
/// # Errors
/// The [`SimulationError`] of the first run that fails.
pub fn rows(
    simulation: &Simulation,
    first: u64,
    runs: u32,
    progress: &impl Progress,
) -> Result<Vec<Row>, SimulationError> {
    let seeds = (0..u64::from(runs)).into_par_iter().map(|run| first.wrapping_add(run));
    let row = |seed| {
        let result = unrecorded(simulation, seed)?;
        progress.finished();
        Ok(Row::new(seed, &result))
    };
    seeds.filter(|_| !progress.is_interrupted()).map(row).collect()
}
