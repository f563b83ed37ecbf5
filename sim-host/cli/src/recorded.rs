//! A run to be shown beside another one: a log, which is replayed, a trace, or a scenario, which is simulated.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use anyhow::Context;
use sonarfix_exchange::recorded::Recorded;
use sonarfix_exchange::trace_csv;
use sonarfix_hal::config::RobotConfig;
use sonarfix_map::{Floor, MapFile, NamedWall, Scenario, robot_file};
use sonarfix_replay::thinned::{CAPACITY, Thinned};
use sonarfix_replay::{Replay, log};
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::trace::{Trace, Wall};
use sonarfix_terminal::output;

use crate::statistics::RunStatistics;

/// The files that a run needs beside itself, where they are not beside it.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sources<'a> {
    /// The map of a log or a trace.
    pub map: Option<&'a Path>,
    /// The robot of a log.
    pub robot: Option<&'a Path>,
}

/// A run with its statistics, robot and files.
#[derive(Debug)]
pub struct Run {
    /// The name of its file.
    pub name: String,
    /// Its records.
    pub trace: Trace,
    /// Errors, outcomes and verdicts.
    pub statistics: RunStatistics,
    /// The robot as configured; unknown of a trace.
    pub robot: Option<RobotConfig>,
    /// The files that were read.
    pub files: Vec<PathBuf>,
}

impl Run {
    /// Reads or simulates a run.
    ///
    /// # Errors
    /// What is wrong with a file.
    pub fn read(file: &Path, sources: Sources<'_>) -> anyhow::Result<Self> {
        if file.extension().is_some_and(|ending| ending == "toml") {
            simulated(file)
        } else if is_log(file)? {
            replayed(file, sources)
        } else {
            traced(file, sources)
        }
    }
}

/// Whether a file starts like a log.
pub fn is_log(file: &Path) -> anyhow::Result<bool> {
    let mut start = String::new();
    let opened = open(file)?.take(log::HEADER.len() as u64).read_to_string(&mut start);
    Ok(opened.is_ok() && start == log::HEADER)
}

/// The walls of a floor.
pub fn walls(floor: &Floor) -> Vec<Wall> {
    let wall =
        |wall: &NamedWall| Wall { name: wall.name().to_owned(), from: wall.from(), to: wall.to() };
    floor.named_walls().iter().map(wall).collect()
}

fn open(file: &Path) -> anyhow::Result<BufReader<File>> {
    Ok(BufReader::new(output::open(file)?))
}

/// A given file, or the one with the default name beside the run.
fn beside(run: &Path, given: Option<&Path>, name: &str) -> PathBuf {
    given.map_or_else(|| run.with_file_name(name), Path::to_owned)
}

fn name(file: &Path) -> String {
    file.display().to_string()
}

/// The first run of a scenario.
fn simulated(file: &Path) -> anyhow::Result<Run> {
    let scenario = Scenario::read(file)?;
    let (seed, robot) = (scenario.run.seed, scenario.robot);
    let simulation = Simulation::new(scenario);
    let mut trace = simulation.empty_trace();
    let mut statistics = RunStatistics::default();
    simulation.run(seed, &mut statistics.of(&mut trace))?;
    let robot = Some(robot);
    Ok(Run { name: name(file), trace, statistics, robot, files: vec![file.to_owned()] })
}

fn replayed(file: &Path, sources: Sources<'_>) -> anyhow::Result<Run> {
    let map = beside(file, sources.map, "map.toml");
    let config = beside(file, sources.robot, "robot.toml");
    let floor = MapFile::read(&map, None)?.floor;
    let robot = robot_file::read(&config)?;
    let reference = file.with_file_name("reference.csv");
    let truth = reference.exists().then(|| open(&reference)).transpose()?;
    let walls = floor.walls();
    let replay = Replay { robot: &robot, walls: &walls, strict: false, pings_per_scan: 1 };
    let mut thinned = Thinned::new(&floor, robot.localizer.rangers.first.cone, CAPACITY);
    let mut statistics = RunStatistics::default();
    replay
        .run(open(file)?, truth, &mut statistics.of(&mut thinned), &mut |_| {})
        .with_context(|| name(file))?;
    let trace = thinned.trace().clone();
    let files = vec![file.to_owned(), map, config, reference];
    Ok(Run { name: name(file), trace, statistics, robot: Some(robot), files })
}

fn traced(file: &Path, sources: Sources<'_>) -> anyhow::Result<Run> {
    let map = beside(file, sources.map, "map.toml");
    let walls = walls(&MapFile::read(&map, None)?.floor);
    let mut trace = Trace { walls: walls.clone(), ..Trace::default() };
    let mut statistics = RunStatistics::default();
    let mut measured = statistics.of(&mut trace);
    let mut records = Recorded::new(&mut measured, &walls);
    trace_csv::read(open(file)?, &mut [&mut records]).with_context(|| name(file))?;
    Ok(Run { name: name(file), trace, statistics, robot: None, files: vec![file.to_owned(), map] })
}
