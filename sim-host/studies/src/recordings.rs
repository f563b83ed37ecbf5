//! Recordings in the project's own format, replayed with the robot file beside each: how right the pose is, and what the verdict says.
//!
//! A recording is a folder with `log.csv`, `robot.toml`, `map.toml` and `reference.csv` (`docs/formats.md`).

use std::fmt::Write;
use std::fs::{self, File};
use std::io::{self, BufReader};
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use sonarfix::geometry::units::Radians;
use sonarfix::map::Wall;
use sonarfix_hal::config::RobotConfig;
use sonarfix_map::{FileError, Floor, robot_file};
use sonarfix_replay::{Replay, Summary};
use sonarfix_sim::trace::Recorder;

/// How deep folders are searched.
const DEEPEST: usize = 4;

/// The replay of a recording.
#[derive(Debug)]
pub struct Row {
    /// Its path in the folder.
    pub name: String,
    /// The cone that replaces that of the robot file, degrees.
    pub cone: Option<f32>,
    /// The result, or the error as text.
    pub outcome: Result<Summary, String>,
}

/// Replays all recordings in a folder, with the robot files as they are and with each of these cones (degrees) instead.
///
/// # Errors
/// If the folder cannot be read. An error of one recording is a row.
pub fn rows(data: &Path, cones: &[f32]) -> io::Result<Vec<Row>> {
    let folders = folders(data)?;
    let cones: Vec<Option<f32>> =
        [None].into_iter().chain(cones.iter().copied().map(Some)).collect();
    let of = |(name, folder): &(String, PathBuf)| {
        let row = |cone: &Option<f32>| {
            let (name, cone) = (name.clone(), *cone);
            Row { name, cone, outcome: replay_with(folder, cone) }
        };
        cones.iter().map(row).collect::<Vec<_>>()
    };
    Ok(folders.par_iter().flat_map(of).collect())
}

/// The folders with a log, in the order of their names, each with its path in the folder.
///
/// # Errors
/// If the folder cannot be read.
pub(crate) fn folders(data: &Path) -> io::Result<Vec<(String, PathBuf)>> {
    fs::read_dir(data)?;
    let mut found = Vec::new();
    search(data, 0, &mut found);
    let name = |folder: &Path| folder.strip_prefix(data).unwrap_or(folder).display().to_string();
    Ok(found.into_iter().map(|folder| (name(&folder), folder)).collect())
}

/// Whether a folder has a log with robot file and map.
pub(crate) fn is_recording(folder: &Path) -> bool {
    ["log.csv", "robot.toml", "map.toml"].iter().all(|name| folder.join(name).is_file())
}

fn search(folder: &Path, depth: usize, found: &mut Vec<PathBuf>) {
    if is_recording(folder) {
        found.push(folder.to_owned());
    }
    // A folder that cannot be read has no recordings.
    let Ok(entries) = fs::read_dir(folder) else { return };
    let mut folders: Vec<PathBuf> =
        entries.filter_map(|entry| Some(entry.ok()?.path())).filter(|path| path.is_dir()).collect();
    folders.sort();
    if depth < DEEPEST {
        for folder in folders {
            search(&folder, depth + 1, found);
        }
    }
}

fn replay_with(folder: &Path, cone: Option<f32>) -> Result<Summary, String> {
    let (robot, floor) = read(folder, "robot.toml")?;
    replay(folder, &with_cone(robot, cone), &floor.walls(), 1, &mut ())
}

/// A robot file of a folder, and its map.
pub(crate) fn read(folder: &Path, robot: &str) -> Result<(RobotConfig, Floor), String> {
    let text = |error: FileError| error.to_string();
    let floor = Floor::read(&folder.join("map.toml")).map_err(text)?;
    Ok((robot_file::read(&folder.join(robot)).map_err(text)?, floor))
}

/// Replays the log of a folder, with its reference if there is one, and at most so many ranges of a scan.
pub(crate) fn replay(
    folder: &Path,
    robot: &RobotConfig,
    walls: &[Wall],
    pings_per_scan: u32,
    recorder: &mut impl Recorder,
) -> Result<Summary, String> {
    let open = |name: &str| File::open(folder.join(name)).map(BufReader::new);
    let log = open("log.csv").map_err(|error| error.to_string())?;
    let reference = open("reference.csv").ok();
    let replay = Replay { robot, walls, strict: false, pings_per_scan };
    replay.run(log, reference, recorder, &mut |_| {}).map_err(|error| error.to_string())
}

fn with_cone(mut robot: RobotConfig, cone: Option<f32>) -> RobotConfig {
    if let Some(cone) = cone.map(Radians::from_degrees) {
        for ranger in robot.localizer.rangers.iter_mut() {
            ranger.cone = cone;
        }
    }
    robot
}

const HEAD: &str = "\
| recording | cone | within 0.5 m | median, mm | RMS, mm | encoders alone, mm | ratio | heading, median | `Degraded`, s | `Lost`, s | falsely `Lost`, s |
|---|---|---|---|---|---|---|---|---|---|---|
";

/// The rows as a table. *Falsely*: with the position within 0.5 m of the reference.
#[must_use]
pub fn markdown(rows: &[Row]) -> String {
    let mut table = HEAD.to_owned();
    for Row { name, cone, outcome } in rows {
        let cone = cone.map_or_else(|| "of the file".to_owned(), |cone| format!("{cone}°"));
        // Writing to a String does not fail.
        let _ = match outcome {
            Ok(summary) => writeln!(table, "| {name} | {cone} | {} |", cells(summary)),
            Err(error) => writeln!(table, "| {name} | {cone} | {error} | | | | | | | | |"),
        };
    }
    table
}

fn cells(summary: &Summary) -> String {
    let (within, beyond) =
        (&summary.consistency.within_half_a_metre, &summary.consistency.beyond_half_a_metre);
    let share = within.tracking + within.degraded + within.lost;
    let lost = within.lost + beyond.lost;
    let falsely = if lost > 0.0 { summary.health.lost_seconds * within.lost / lost } else { 0.0 };
    let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let (rms, encoders) = (number(summary.position_rms), number(summary.odometry_position_rms));
    format!(
        "{:.1} % | {:.0} | {:.0} | {:.0} | {:.2} | {:.1}° | {:.1} | {:.1} | {falsely:.1}",
        100.0 * share,
        1e3 * number(summary.position_median),
        1e3 * rms,
        1e3 * encoders,
        rms / encoders,
        number(summary.heading_median).to_degrees(),
        summary.health.degraded_seconds,
        summary.health.lost_seconds,
    )
}
