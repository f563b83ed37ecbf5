//! Comparison of the localizer with a particle filter that has the same odometry and the same pings: from a known start in simulated rooms
//! and recordings, and with an unknown start in floor plans.
//!
//! | module | what |
//! |---|---|
//! | [`particle_filter`] | Monte Carlo localization |
//! | [`cone`] | its model of a beam |
//! | `beside`, `compared` | both filters in one run, and their errors |
//! | [`page`] | the page |

mod beside;
mod compared;
pub mod cone;
pub mod page;
pub mod particle_filter;

use std::io;
use std::path::Path;

use rayon::prelude::*;
use serde::Serialize;
use sonarfix::geometry::pose::Point;
use sonarfix::map::Wall;
use sonarfix_map::{FileError, Scenario};
use sonarfix_plan::trial::{SetDown, TrialError, are_one, observed_trial};
use sonarfix_sim::progress::Progress;
use sonarfix_sim::simulate::{Simulation, SimulationError};

use crate::reality::{self, discover};
use crate::recordings;
use crate::rooms::{Cell, RoomError};
use crate::search_study::Plans;

use beside::Beside;
use cone::Segment;

pub use compared::{Compared, Errors};
use particle_filter::ParticleFilter;

/// Why a comparison cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum PeerError {
    /// A scenario cannot be read.
    #[error(transparent)]
    Scenario(#[from] FileError),
    /// A room cannot be simulated.
    #[error(transparent)]
    Room(#[from] RoomError),
    /// The simulation fails.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// A trial of the search cannot be made.
    #[error(transparent)]
    Trial(#[from] TrialError),
    /// The recordings cannot be read.
    #[error("cannot read the recordings")]
    Recordings(#[from] io::Error),
}

/// The comparison in one place.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    /// The scenario, kind of room or recording.
    pub name: String,
    /// Runs.
    pub runs: u32,
    /// The result, or the error as text.
    pub compared: Result<Compared, String>,
}

/// Runs of a scenario from its start, with seeds from `first` on.
///
/// # Errors
/// [`PeerError`] of the first run that fails.
pub fn scenario(
    name: &str,
    of: impl Fn(u64) -> Result<Scenario, PeerError> + Sync,
    (first, runs): (u64, u32),
    progress: &impl Progress,
) -> Result<Row, PeerError> {
    let seeds = (0..u64::from(runs)).into_par_iter().map(|n| first.wrapping_add(n));
    let run = |seed: u64| {
        let simulation = Simulation::new(of(seed)?);
        let walls = segments(&simulation.scenario.floor.walls());
        let mut beside = Beside::new(&simulation.config(), walls, seed);
        simulation.run(seed, &mut beside)?;
        progress.finished();
        Ok::<_, PeerError>(beside.compared())
    };
    let compared: Vec<_> = seeds.map(run).collect::<Result<_, _>>()?;
    let sum = compared.into_iter().fold(Compared::default(), Compared::plus);
    Ok(Row { name: name.to_owned(), runs, compared: Ok(sum) })
}

/// The rooms of a cell, each of a seed.
///
/// # Errors
/// As of [`scenario`].
pub fn rooms(cell: &Cell, seeds: (u64, u32), progress: &impl Progress) -> Result<Row, PeerError> {
    let name = format!("{}, {}", cell.family.name(), cell.objects.name());
    let of = |seed| Ok(Scenario::parse(&cell.toml(seed), "room.toml", Path::new(""))?);
    scenario(&name, of, seeds, progress)
}

/// The recordings of a folder, replayed with the robot file that belongs to each.
///
/// # Errors
/// If the folder cannot be read. An error of one recording is a row.
pub fn of_recordings(data: &Path) -> Result<Vec<Row>, PeerError> {
    let replay = |folder: &Path, robot: &str| {
        let (robot, floor) = recordings::read(folder, robot)?;
        let walls = floor.walls();
        let mut beside = Beside::new(&robot.localizer, segments(&walls), 0);
        recordings::replay(folder, &robot, &walls, 1, &mut beside)?;
        Ok(beside.compared())
    };
    let mut rows: Vec<Row> = discover::discover(data)?
        .recordings
        .par_iter()
        .map(|recording| {
            let compared = reality::replay_converted(recording, replay)?;
            Ok(Row { name: recording.name.clone(), runs: 1, compared })
        })
        .collect::<io::Result<_>>()?;
    let own = recordings::folders(data)?;
    // A recording in the project's own format has its map beside it, and not its walls.
    rows.retain(|row| !own.iter().any(|(name, _)| row.name.starts_with(name)));
    rows.par_extend(own.par_iter().map(|(name, folder)| Row {
        name: name.clone(),
        runs: 1,
        compared: replay(folder, "robot.toml"),
    }));
    Ok(rows)
}

fn segments(walls: &[Wall]) -> Vec<Segment> {
    let of = |at: Point| [f64::from(at.x.0), f64::from(at.y.0)];
    walls.iter().map(|wall| [of(wall.from()), of(wall.to())]).collect()
}

/// The particle filter has an answer when it has been sure for so long, seconds.
const SURE_FOR: f64 = 5.0;

/// The times until both have determined an unknown pose.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Found {
    /// Seconds until the search of this project has a unique answer, and whether it is right.
    pub search: Option<(f64, bool)>,
    /// Seconds until the particle filter has been sure for five seconds, and whether it is right then.
    pub particles: Option<(f64, bool)>,
}

/// Trials in floor plans: the search with its own pings, and a particle filter with the same ones, whose particles begin everywhere.
///
/// # Errors
/// [`PeerError`] of the first plan that cannot be used.
pub fn search(
    plans: &Plans,
    seconds: f64,
    progress: &impl Progress,
) -> Result<Vec<Found>, PeerError> {
    let one = |scenario: Scenario, seed| {
        let simulation = Simulation::new(scenario.clone());
        let config = simulation.config();
        let walls = segments(&simulation.scenario.floor.walls());
        let mut filter = ParticleFilter::anywhere(&config, walls, seed);
        let (mut found, mut sure_since) = (None, None);
        let trial = observed_trial(scenario, seed, SetDown::Anywhere, seconds, |heard, _| {
            if found.is_none() {
                let [advance, turn] = heard.travel;
                filter.drive(advance, turn);
                filter.ping(&config.rangers.first, heard.bearing, heard.range);
                let belief = filter.belief();
                let since = sure_since.get_or_insert(heard.time);
                if !belief.is_sure {
                    sure_since = None;
                } else if heard.time - *since >= SURE_FOR {
                    found = Some((heard.time, are_one(&belief.pose, &heard.pose)));
                }
            }
            found.is_none()
        })?;
        let search = trial.unique_after.map(|after| (after, trial.is_right));
        Ok(Found { search, particles: found })
    };
    plans.each(progress, one)
}
