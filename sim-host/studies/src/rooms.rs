//! Rooms that nobody tuned to: how consistent the filter is, and how often the verdict is wrong, in generated rooms.
//!
//! | module | what |
//! |---|---|
//! | `family` | rooms and paths, from seeds |
//! | `watch` | the judgement of a run |
//! | `sums` | the statistics of some runs |

mod family;
mod sums;
mod watch;

use std::fmt::Write;

use rayon::prelude::*;
use sonarfix_map::FileError;
use sonarfix_sim::progress::Progress;
use sonarfix_sim::simulate::{Simulation, SimulationError};

pub use family::Family;
pub use sums::Sums;
use watch::{Unobservable, Watch};

/// Why a run failed.
#[derive(Debug, thiserror::Error)]
pub enum RoomError {
    /// The room is invalid.
    #[error(transparent)]
    Room(#[from] FileError),
    /// The run failed.
    #[error(transparent)]
    Run(#[from] SimulationError),
}

/// The results of all families with their names.
pub type Results = Vec<(&'static str, Sums)>;

/// Runs the rooms with the seeds from `first`, `runs` of each family, unless it is interrupted.
///
/// # Errors
/// The [`RoomError`] of the first run that fails.
pub fn run(first: u64, runs: u32, progress: &impl Progress) -> Result<Results, RoomError> {
    Family::ALL
        .into_iter()
        .map(|family| Ok((family.name(), of(family, first, runs, progress)?)))
        .collect()
}

fn of(family: Family, first: u64, runs: u32, progress: &impl Progress) -> Result<Sums, RoomError> {
    let seeds = (0..u64::from(runs)).into_par_iter().filter(|_| !progress.is_interrupted());
    let one = |run| {
        let sums = one(family, first.wrapping_add(run));
        progress.finished();
        sums
    };
    let all: Vec<Sums> = seeds.map(one).collect::<Result<_, _>>()?;
    Ok(all.iter().fold(Sums::default(), Sums::plus))
}

fn one(family: Family, seed: u64) -> Result<Sums, RoomError> {
    let simulation = Simulation::new(family.scenario(seed)?);
    let mut watch = Watch::new(Unobservable::None);
    let result = simulation.run(seed, &mut watch)?;
    Ok(Sums::of(&result, &watch))
}

const HEAD: &str = "\
| room | runs | NEES/7 | median | NIS | range scale, σ | RMS, mm | bound, mm | lost | `Lost` | falsely | above 20 cm | noticed after, s \
| wrong and `Tracking`, s | not `Tracking` |
|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|
";

/// The results as a table.
#[must_use]
pub fn markdown(results: &[(&str, Sums)]) -> String {
    let mut page = HEAD.to_owned();
    for (name, sums) in results {
        // Writing to a String does not fail.
        let _ = writeln!(
            page,
            "| {name} | {} | {:.2} | {:.2} | {:.2} | {:+.2} | {:.1} | {:.1} | {} | {} | {} | {} | {:.1} | {:.2} | {:.2} % |",
            sums.runs,
            sums.nees(),
            sums.median_nees(),
            sums.nis(),
            sums.range_scale(),
            1e3 * sums.rms(),
            1e3 * sums.bound(),
            sums.lost,
            sums.called,
            sums.falsely,
            sums.far,
            sums.longest_unnoticed,
            sums.wrong_tracking(),
            100.0 * sums.untracked(),
        );
    }
    page
}
