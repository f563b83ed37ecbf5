//! Rooms that nobody tuned to: how consistent the filter is, and how often the verdict is wrong, in generated rooms.
//!
//! | module | what |
//! |---|---|
//! | `family`, `objects` | rooms and paths, and what is not in the map, from seeds |
//! | `sensor`, `robot` | the robot that drives there |
//! | `text` | a room as a scenario |
//! | `cell` | the runs of a family with objects, a sensor and a robot |
//! | `watch`, `sums` | the judgement of a run, and the statistics of some |
//! | `polygon` | plane geometry |

mod cell;
mod family;
mod objects;
mod polygon;
mod robot;
mod sensor;
mod sums;
mod text;
mod watch;

use std::fmt::Write;

use rayon::prelude::*;
use sonarfix_sim::progress::Progress;

pub use cell::{Cell, RoomError};
pub use family::Family;
pub use objects::Objects;
pub use robot::Robot;
pub use sensor::Sensor;
pub use sums::Sums;

/// The results of all cells.
pub type Results = Vec<(Cell, Sums)>;

/// Runs the cells with the seeds from `first`, `runs` of each, unless it is interrupted. Cells without a finished run are missing.
///
/// # Errors
/// The [`RoomError`] of the first run that fails.
pub fn run(
    cells: &[Cell],
    first: u64,
    runs: u32,
    progress: &impl Progress,
) -> Result<Results, RoomError> {
    let of = |cell: &Cell| {
        let seeds = (0..u64::from(runs)).into_par_iter().filter(|_| !progress.is_interrupted());
        let one = |run| {
            let sums = cell.run(first.wrapping_add(run));
            progress.finished();
            sums
        };
        let all: Vec<Sums> = seeds.map(one).collect::<Result<_, _>>()?;
        Ok((*cell, all.iter().fold(Sums::default(), Sums::plus)))
    };
    let all: Results = cells.par_iter().map(of).collect::<Result<_, RoomError>>()?;
    Ok(all.into_iter().filter(|(_, sums)| sums.runs > 0).collect())
}

const HEAD: &str = "\
| room | objects | sensor | runs | NEES/7 | median | NIS | range scale, σ | RMS, mm | bound, mm | lost | `Lost` | falsely | above 20 cm | noticed after, s \
| wrong and `Tracking`, s | not `Tracking` |
|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|
";

/// The results as a table.
#[must_use]
pub fn markdown(results: &Results) -> String {
    let mut page = HEAD.to_owned();
    for (cell, sums) in results {
        // Writing to a String does not fail.
        let _ = writeln!(
            page,
            "| {} | {} | {} | {} | {:.2} | {:.2} | {:.2} | {:+.2} | {:.1} | {:.1} | {} | {} | {} | {} | {:.1} | {:.2} | {:.2} % |",
            cell.family.name(),
            cell.objects.name(),
            cell.sensor.name(),
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
