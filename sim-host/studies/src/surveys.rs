//! How exactly `survey` maps simulated rooms, and how well the robot localizes on the map that it made.

mod score;

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use rayon::prelude::*;
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::Metres;
use sonarfix::map::Wall;
use sonarfix_batch::log;
use sonarfix_batch::recording::Recording;
use sonarfix_files::Output;
use sonarfix_map::{CLASSROOM, FileError, Follow, Scenario};
use sonarfix_sim::progress::Progress;
use sonarfix_sim::simulate::{Simulation, SimulationError};
use sonarfix_survey::problem::Robot;
use sonarfix_survey::survey::{Motion, Survey, SurveyError, survey};
use sonarfix_survey::walls::MappedWall;

use crate::floor_plan::FloorPlan;
use crate::sweeping_robot::drive;

pub use score::Score;

/// Where a robot drives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// The classroom without its furniture.
    Room,
    /// The classroom.
    Classroom,
    /// A floor plan of the drive's seed, driven for ten minutes.
    Plans,
}

/// One drive.
#[derive(Debug)]
pub struct Trial {
    /// Its seed.
    pub seed: u64,
    /// Duration of the drive, seconds.
    pub seconds: f64,
    /// The score of the map, or the reason for which the recording gave no map.
    pub outcome: Result<Score, SurveyError>,
}

/// Why the study failed.
#[derive(Debug, thiserror::Error)]
pub enum SurveyStudyError {
    /// The scenario cannot be read.
    #[error(transparent)]
    Scenario(#[from] FileError),
    /// The robot does not start.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] std::io::Error),
}

/// Speed of a survey, and the path through the classroom: twice around in less than five minutes.
const SPEED: &str = "speed = \"0.13 m/s\"\n";
const START: &str = "start = [1.2, 1.2]\n";
const CORNERS: &str = "corners = [[4.8, 1.2], [4.8, 6.8], [1.2, 6.8], [1.2, 1.2]]\n";
/// Duration of a drive through a floor plan, seconds.
const PLAN_SECONDS: f64 = 600.0;

/// The scenario of a drive.
fn scenario(place: Place, seed: u64) -> Result<Scenario, FileError> {
    let mut scenario = match place {
        Place::Plans => return FloorPlan::new(seed).scenario(),
        Place::Room | Place::Classroom => {
            let mut text = String::new();
            for line in CLASSROOM.lines() {
                match line.split('=').next().unwrap_or_default().trim() {
                    "laps" => text.push_str("laps = 2\n"),
                    "speed" => text.push_str(SPEED),
                    "start" if line.contains('[') => text.push_str(START),
                    "corners" => text.push_str(CORNERS),
                    _ => {
                        text.push_str(line);
                        text.push('\n');
                    }
                }
            }
            Scenario::parse(&text, "classroom.toml", Path::new(""))?
        }
    };
    if place == Place::Room {
        scenario.surroundings.obstacles.clear();
    }
    scenario.follow = Follow::Truth;
    Ok(scenario)
}

/// The plan's path there and back, as often as it takes.
fn there_and_back(scenario: &mut Scenario) {
    let plan = scenario.path.plan().clone();
    let mut back: Vec<[f64; 2]> = plan.corners.iter().rev().skip(1).copied().collect();
    back.push(plan.start);
    let mut long = plan;
    long.corners.extend(back);
    if let Ok(path) = sonarfix_map::Path::new(long.clone()) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some laps")]
        let laps = (PLAN_SECONDS / path.duration()).ceil().max(1.0) as u32;
        long.laps = laps;
        if let Ok(path) = sonarfix_map::Path::new(long) {
            scenario.path = path;
        }
    }
}

/// Drives; after an interruption those that have begun.
///
/// # Errors
/// [`SurveyStudyError`].
pub fn trials(
    place: Place,
    first: u64,
    count: u32,
    progress: &impl Progress,
) -> Result<Vec<Trial>, SurveyStudyError> {
    let seeds: Vec<u64> = (0..u64::from(count)).map(|n| first.wrapping_add(n)).collect();
    let run = |&seed: &u64| {
        let trial = trial(place, seed);
        progress.finished();
        trial
    };
    seeds.par_iter().filter(|_| !progress.is_interrupted()).map(run).collect()
}

/// The simulated drive: what it recorded, the true path, and the simulation.
fn driven(
    place: Place,
    seed: u64,
) -> Result<(crate::sweeping_robot::Drive, Simulation), SurveyStudyError> {
    let mut scenario = scenario(place, seed)?;
    if place == Place::Plans {
        there_and_back(&mut scenario);
    }
    let robot = scenario.robot;
    let (mut driven, simulation) = drive(scenario, robot, seed)?;
    if place == Place::Plans {
        driven.recording.readings.retain(|reading| reading.time <= PLAN_SECONDS);
        let end = driven.recording.readings.last().map_or(0.0, |reading| reading.time);
        driven.recording.pings.retain(|ping| ping.time <= end);
    }
    Ok((driven, simulation))
}

/// One drive.
///
/// # Errors
/// [`SurveyStudyError`].
pub fn trial(place: Place, seed: u64) -> Result<Trial, SurveyStudyError> {
    let (driven, simulation) = driven(place, seed)?;
    let robot = Robot::of(&log::nominal(&simulation.scenario.robot, true));
    let seconds = driven.recording.readings.last().map_or(0.0, |reading| reading.time);
    let outcome = match survey(&driven.recording, robot) {
        Ok(mut map) => {
            map.apply(&alignment(&map, &driven.truth));
            let mut score = Score::of(&map, &driven, &simulation);
            score.localized = localized(place, seed, &map)?;
            Ok(score)
        }
        Err(error) => Err(error),
    };
    Ok(Trial { seed, seconds, outcome })
}

/// The rigid motion from the estimated path to the true one: the frame of a map is that of its first pose, whose heading
/// is only as exact as the first centimetres of odometry.
fn alignment(map: &Survey, truth: &[(f64, sonarfix_sim::trace::Pose)]) -> Motion {
    let pairs: Vec<_> = map
        .path
        .iter()
        .filter_map(|(time, pose)| Some((pose.xy(), score::true_position(truth, *time)?)))
        .collect();
    Motion::fit(&pairs)
}

/// The position RMS of a drive with the map, metres, and whether the robot was lost at its end.
fn localized(place: Place, seed: u64, map: &Survey) -> Result<(f64, bool), SurveyStudyError> {
    let scenario = scenario(place, seed)?;
    let robot = scenario.robot;
    #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
    let point = |at: &nalgebra::Vector2<f64>| Point::new(at.x as f32, at.y as f32);
    #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
    let accuracy = |wall: &MappedWall| Metres(wall.accuracy as f32);
    let walls = map.walls.iter().filter_map(|wall| {
        let placed = Wall::new(point(&wall.from), point(&wall.to)).ok()?;
        Some(placed.with_accuracy(accuracy(wall)))
    });
    let simulation = Simulation::new(scenario).believing(robot, walls.collect());
    let result = simulation.run(seed, &mut ())?;
    Ok((result.path.position_mean_square().sqrt(), result.lost))
}

/// Writes log, robot file and true map of a drive into a folder.
///
/// # Errors
/// [`SurveyStudyError`].
pub fn record(place: Place, seed: u64, folder: &Path) -> Result<(), SurveyStudyError> {
    let (driven, simulation) = driven(place, seed)?;
    std::fs::create_dir_all(folder)?;
    let mut log = Vec::new();
    write_log(&mut log, &driven.recording)?;
    let Scenario { robot, floor, .. } = &simulation.scenario;
    for (name, bytes) in [
        ("robot.toml", sonarfix_map::robot_text(robot).into_bytes()),
        ("true-map.toml", floor.to_toml().into_bytes()),
        ("log.csv", log),
    ] {
        let mut file = Output::create(&folder.join(name))?;
        file.write_all(&bytes)?;
        file.finish()?;
    }
    Ok(())
}

/// Writes a recording as a log.
fn write_log(out: &mut impl std::io::Write, recording: &Recording) -> std::io::Result<()> {
    writeln!(out, "{}", sonarfix_replay::log::HEADER)?;
    if let Some(start) = &recording.start {
        let pose = &start.pose;
        writeln!(
            out,
            "start,{},{},{},{},{},{}",
            start.time, pose.x, pose.y, pose.z, start.position, start.heading
        )?;
    }
    let mut pings = recording.pings.iter().peekable();
    for reading in &recording.readings {
        while let Some(ping) = pings.next_if(|ping| ping.time < reading.time) {
            let range = ping.range.map_or_else(String::new, |range| range.to_string());
            writeln!(out, "range,{:.6},{:.6},{range}", ping.time, ping.bearing)?;
        }
        let [right, left] = reading.travel;
        writeln!(out, "wheels,{:.6},{right},{left}", reading.time)?;
    }
    Ok(())
}

/// The table of some drives.
#[must_use]
pub fn page(trials: &[Trial]) -> String {
    let mut page = String::from(
        "| seed | s | walls found | hearable length found | offset RMS, worst (cm) | angle (°) | invented | corners (cm) | \
         path RMS, worst (cm) | fwd/back (cm) | verdict | localized (mm) |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    // Writing to a String does not fail.
    for trial in trials {
        let _ = match &trial.outcome {
            Ok(score) => {
                writeln!(page, "| {} | {:.0} | {}", trial.seed, trial.seconds, score.row())
            }
            Err(error) => writeln!(page, "| {} | {:.0} | {error} |", trial.seed, trial.seconds),
        };
    }
    page.push('\n');
    page.push_str(&summary(trials));
    page
}

/// What the drives amount to, as a table.
#[must_use]
pub fn summary(trials: &[Trial]) -> String {
    let scores: Vec<&Score> =
        trials.iter().filter_map(|trial| trial.outcome.as_ref().ok()).collect();
    score::summary(trials.len(), &scores)
}
