//! Conversion and replay of one recording.

use std::io;
use std::path::Path;

use sonarfix::config::Policy;
use sonarfix_replay::Summary;
use sonarfix_replay::convert::carmen::Carmen;
use sonarfix_replay::convert::given::Given;
use sonarfix_replay::convert::lego::{ENCODER_LAG, Lego, Nominal};

use super::discover::{Format, Recording};
use crate::recordings;

/// The replay of a recording, or why there is none.
#[derive(Debug)]
pub struct Row {
    /// Name of the recording.
    pub recording: String,
    /// Robot file.
    pub robot: String,
    /// Policy.
    pub policy: &'static str,
    /// The result, or the error as text.
    pub outcome: Result<Summary, String>,
}

/// The policies, and their names in the table.
const POLICIES: [(Policy, &str); 2] =
    [(Policy::Nearest, "nearest"), (Policy::Informative, "informative")];

/// The robot files of a recording: name in the table, file.
type Robots = &'static [(&'static str, &'static str)];

const LEGO: Robots = &[
    ("LEGO, fitted", "robot-fitted.toml"),
    ("LEGO, rounded", "robot-rounded.toml"),
    ("LEGO, course", "robot-course.toml"),
];
const CARMEN: Robots = &[("CARMEN", "robot.toml")];

/// Reports of a conversion that are kept.
const KEPT: usize = 5;

/// Converts a recording into a temporary folder and replays it with each robot file and policy.
///
/// # Errors
/// If no temporary folder can be created. What is wrong with the recording is in its rows.
pub fn replay(recording: &Recording, pings_per_scan: u32) -> io::Result<(Vec<Row>, Vec<String>)> {
    let folder = tempfile::tempdir()?;
    let mut reports = Vec::new();
    let mut more = 0_u64;
    let converted = convert(&recording.format, folder.path(), &mut |text| {
        if reports.len() < KEPT {
            // Without the path of the data, which differs from machine to machine.
            let text = text.rsplit_once('/').map_or(text.as_str(), |(_, name)| name);
            reports.push(text.to_owned());
        } else {
            more += 1;
        }
    });
    if more > 0 {
        reports.push(format!("{more} more lines"));
    }
    let row = |robot: &str, policy, outcome| Row {
        recording: recording.name.clone(),
        robot: robot.to_owned(),
        policy,
        outcome,
    };
    let robots = match converted {
        Ok(robots) => robots,
        Err(error) => return Ok((vec![row("–", "–", Err(error))], reports)),
    };
    let mut rows = Vec::new();
    for (robot, file) in robots {
        for (policy, name) in POLICIES {
            let outcome = replay_with(folder.path(), file, policy, pings_per_scan);
            rows.push(row(robot, name, outcome));
        }
    }
    Ok((rows, reports))
}

fn convert(format: &Format, to: &Path, report: &mut dyn FnMut(String)) -> Result<Robots, String> {
    let converted = match format {
        Format::Lego { folder } => {
            let nominal = Nominal::Fitted;
            let lego = Lego { from: folder, to, nominal, encoder_lag: ENCODER_LAG };
            lego.convert(report).map(|_| LEGO)
        }
        Format::Carmen { log, walls } => {
            let walls =
                walls.as_deref().ok_or("no walls beside it (NAME_walls.csv or NAME_map.csv)")?;
            Carmen { from: log, walls: Some(walls), to }.convert(report).map(|_| CARMEN)
        }
        Format::Given { log, reference, walls } => {
            let walls =
                walls.as_deref().ok_or("no walls beside it (NAME_walls.csv or NAME_map.csv)")?;
            let reference =
                reference.as_deref().ok_or("no reference beside it (NAME_reference.csv)")?;
            Given { log, reference, walls, to }.prepare().map(|()| CARMEN)
        }
    };
    converted.map_err(|error| error.to_string())
}

fn replay_with(
    folder: &Path,
    robot: &str,
    policy: Policy,
    pings_per_scan: u32,
) -> Result<Summary, String> {
    check_reference(folder)?;
    let (mut robot, floor) = recordings::read(folder, robot)?;
    robot.localizer.policy = policy;
    recordings::replay(folder, &robot, &floor.walls(), pings_per_scan, &mut ())
}

fn check_reference(folder: &Path) -> Result<(), String> {
    let has_reference = folder.join("reference.csv").is_file();
    has_reference
        .then_some(())
        .ok_or_else(|| "has no reference: its poses are raw odometry".to_owned())
}

/// Converts a recording into a temporary folder and passes that to `replay` with the name of its first robot file.
///
/// # Errors
/// If no temporary folder can be created.
pub fn replay_converted<T>(
    recording: &Recording,
    replay: impl Fn(&Path, &str) -> Result<T, String>,
) -> io::Result<Result<T, String>> {
    let folder = tempfile::tempdir()?;
    let robots = convert(&recording.format, folder.path(), &mut |_| {});
    Ok(robots.and_then(|robots| {
        check_reference(folder.path())?;
        let (_, robot) = robots.first().ok_or("has no robot file")?;
        replay(folder.path(), robot)
    }))
}
