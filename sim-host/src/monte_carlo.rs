//! Many runs on all cores, with results that do not depend on how many there are.

use cpu_time::ProcessTime;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use rayon::prelude::*;

use crate::simulate::{Simulation, SimulationError};
use crate::statistics::{RunResult, Summary};

/// Runs seeds `seed`, `seed + 1`, … and sums them up. On a terminal a bar shows how far it is; in
/// a pipe there is none.
///
/// # Errors
/// The [`SimulationError`] of the first run that could not go on.
pub fn run(simulation: &Simulation, seed: u64, runs: u32) -> Result<Summary, SimulationError> {
    let start = ProcessTime::now();
    let results = results(simulation, seed, runs)?;
    Ok(Summary::of(&results, start.elapsed().as_secs_f64()))
}

/// The runs themselves, in the order of their seeds, with the same bar.
///
/// # Errors
/// The [`SimulationError`] of the first run that could not go on.
pub fn results(
    simulation: &Simulation,
    seed: u64,
    runs: u32,
) -> Result<Vec<RunResult>, SimulationError> {
    let bar = progress_bar(runs);
    let results = (0..u64::from(runs))
        .into_par_iter()
        .map(|run| {
            let result = simulation.run(seed.wrapping_add(run), &mut ());
            bar.inc(1);
            result
        })
        .collect();
    bar.finish_and_clear();
    results
}

/// A bar that counts runs.
pub(crate) fn progress_bar(runs: u32) -> ProgressBar {
    // indicatif hides the bar by itself where standard error is not a terminal.
    let bar = ProgressBar::with_draw_target(Some(runs.into()), ProgressDrawTarget::stderr());
    match ProgressStyle::with_template("{bar:40} {pos}/{len} runs, {eta} left") {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}
