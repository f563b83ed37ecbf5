//! Rooms that nobody tuned to: how consistent the filter is, and how often the verdict is wrong, in generated rooms.
//!
//! | module | what |
//! |---|---|
//! | `family`, `objects` | rooms and paths, and what is not in the map, from seeds |
//! | `sensor`, `robot` | the robot that drives there |
//! | `text` | a room as a scenario |
//! | `cell` | the runs of a family with objects, a sensor and a robot |
//! | `watch`, `sums` | the judgement of a run, and the statistics of some |
//! | `measure`, `picture`, [`page`] | the page |
//! | `polygon` | plane geometry |

mod cell;
mod family;
mod measure;
mod objects;
pub mod page;
mod picture;
mod polygon;
mod robot;
mod sensor;
mod sums;
mod text;
mod watch;

use rayon::prelude::*;
use sonarfix_sim::progress::Progress;

pub use cell::{Cell, RoomError};
pub use family::Family;
pub use objects::Objects;
pub use picture::svg;
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
