//! The scenario: a floor, a robot on a path, and its true parameters.

use std::path::{Path as FilePath, PathBuf};

use crate::absolute_file::AbsoluteSensors;
use crate::clearance::Collision;
use sonarfix_hal::config::RobotConfig;
use sonarfix_search::navigator::{UNKNOWN_HEADING, UNKNOWN_POSITION};

use crate::document::{Document, Node, Table};
use crate::error::FileError;
use crate::faults::{self, Fault};
use crate::fidelity::{Fidelity, Follow, Hardware, ServoName, Upsets};
use crate::file;
use crate::floor::Floor;
use crate::keys::scenario::{ABSOLUTE, PATH, RUN, SCENARIO, SENSOR, SERVO, START, TRUTH};
use crate::path::{Path, PathPlan};
use crate::robot_file;
use crate::sonar_model::{self, SonarName};
use crate::surroundings::{self, Surroundings};
use crate::wall_file::WallFile;

/// The keys of a scenario file, besides `format`.
#[must_use]
pub fn scenario_keys() -> Vec<&'static str> {
    SCENARIO.names()
}

/// The initial standard deviations of the filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// Of x and of y, metres.
    pub position: f64,
    /// Of the heading, radians.
    pub heading: f64,
    /// Whether the estimate's start is drawn with these deviations around the truth; if not, it
    /// starts on the truth.
    pub drawn: bool,
    /// Whether the robot starts without a pose; the other fields then have no meaning.
    pub is_unknown: bool,
}

impl Start {
    pub(crate) fn unknown() -> Self {
        Self {
            position: UNKNOWN_POSITION.0.into(),
            heading: UNKNOWN_HEADING.0.into(),
            drawn: false,
            is_unknown: true,
        }
    }
}

/// The true parameters of the robot, which the filter does not receive.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Truth {
    /// Track width, metres.
    pub track_width: f64,
    /// Scale error of the right wheel, dimensionless.
    pub scale_right: f64,
    /// Scale error of the left wheel, dimensionless.
    pub scale_left: f64,
    /// Scale error of the ranger, dimensionless.
    pub range_scale: f64,
    /// White noise of each wheel's travel, m/√m.
    pub wheel_noise: f64,
    /// Random walk of the wheels' scale errors, 1/√m.
    pub scale_walk: f64,
    /// Random walk of the track width, m/√m.
    pub track_width_walk: f64,
    /// Standard deviation of a range, at range zero, metres.
    pub range_noise: f64,
    /// Standard deviation of a range per metre of range, dimensionless.
    pub range_noise_per_metre: f64,
    /// Half of the sonar's cone, radians.
    pub cone: f64,
    /// The gyro; without effect on a robot that has none.
    pub gyro: GyroTruth,
}

/// The true parameters of a gyro.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct GyroTruth {
    /// Bias at the start, rad/s; without this key it is drawn with the deviation that the robot assumes.
    pub bias: Option<f64>,
    /// Scale error, dimensionless.
    pub scale: f64,
}

/// The number of runs of the scenario.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Run {
    /// The number of Monte-Carlo runs.
    pub runs: u32,
    /// The seed of the first run; each following run has the next seed.
    pub seed: u64,
}

/// A scenario.
///
/// ```
/// use std::path::Path;
/// use sonarfix_map::{PAPER, Scenario};
/// let paper = Scenario::parse(PAPER, "paper.toml", Path::new(""))?;
/// assert_eq!(paper.floor.walls().len(), 8);
/// let wrong = PAPER.replace("cone = \"15 deg\"", "cone = 15");
/// let error = Scenario::parse(&wrong, "paper.toml", Path::new("")).unwrap_err();
/// assert_eq!(error.first().key(), "robot.sonar.cone");
/// # Ok::<(), sonarfix_map::FileError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// Name.
    pub name: String,
    /// Description.
    pub description: String,
    /// The part that is simulated between world and localizer.
    pub fidelity: Fidelity,
    /// The walls.
    pub floor: Floor,
    /// The robot as configured.
    pub robot: RobotConfig,
    /// The path.
    pub path: Path,
    /// How the robot follows the path.
    pub follow: Follow,
    /// Initial deviations of the filter.
    pub start: Start,
    /// The true parameters.
    pub truth: Truth,
    /// Disturbances of the wheels.
    pub upsets: Upsets,
    /// Sonar and servo.
    pub hardware: Hardware,
    /// The surroundings that are not in the map.
    pub surroundings: Surroundings,
    /// Sensors that measure heading, position or pose from outside.
    pub absolute: AbsoluteSensors,
    /// Faults of the hardware, at [`Fidelity::Pins`] only.
    pub faults: Vec<Fault>,
    /// Number of runs.
    pub run: Run,
}

impl Scenario {
    /// Reads a scenario file, and the map and robot files it names.
    ///
    /// # Errors
    /// [`FileError`] with all mistakes, also those in the files it names.
    pub fn read(path: &FilePath) -> Result<Self, FileError> {
        let base = path.parent().unwrap_or(FilePath::new(""));
        Self::parse(&file::read(path)?, &file::name(path), base)
    }

    /// Parses the text of a scenario file. Errors name it `file_name`; the files that it names are relative to the directory
    /// `base`.
    ///
    /// # Errors
    /// [`FileError`] with all mistakes, also those in the files it names.
    pub fn parse(text: &str, file_name: &str, base: &FilePath) -> Result<Self, FileError> {
        Document::parse(text, file_name)?
            .read(&SCENARIO.names(), |root| Self::from_table(root, base))
    }

    /// None if there is no floor, robot or path, which is recorded.
    fn from_table(root: &Table<'_>, base: &FilePath) -> Option<Self> {
        let (map, robot) = (root.require("map"), root.require("robot"));
        let floor = root.faultless(|| match beside(&map, base) {
            Some(file) => Some(file_or_report(&map, WallFile::read(&file, None))?.floor),
            None => Some(Floor::from_node(map).0),
        });
        let robot = root.faultless(|| match beside(&robot, base) {
            Some(file) => file_or_report(&robot, robot_file::read(&file)),
            None => Some(robot_file::from_node(robot)),
        });
        let path_table = root.table("path", &PATH.names());
        let drive = || Some(PATH.read_from(&path_table, Drive::default()));
        let drive = path_table.faultless(drive);
        let path = read_path(&path_table, drive, floor.as_ref(), robot.as_ref());
        let (truth, upsets) = TRUTH.read(root.require("truth"), Default::default());
        let (sensor, servo) = (root.get("sensor"), root.get("servo"));
        let (sonar, name) = (SonarName::default(), ServoName::default());
        let scenario = Self {
            name: root.require("name").text().into(),
            description: root.require("description").text().into(),
            fidelity: SCENARIO.read_from(root, Fidelity::default()),
            follow: drive.map_or_else(Follow::default, |drive| drive.follow),
            start: read_start(root, robot.as_ref()),
            truth,
            upsets,
            hardware: Hardware {
                sonar: sensor.map_or(sonar, |node| SENSOR.read(node, sonar)),
                servo: servo.map_or(name, |node| SERVO.read(node, name)),
            },
            surroundings: surroundings::read(root),
            absolute: root.get("absolute").map_or_else(AbsoluteSensors::default, |node| {
                ABSOLUTE.read(node, AbsoluteSensors::default())
            }),
            faults: faults::read(root),
            run: RUN.read(root.require("run"), (RUN.usual)()),
            path: path?,
            floor: floor?,
            robot: robot?,
        };
        Some(scenario)
    }

    /// The reference scenario, [`crate::PAPER`].
    ///
    /// # Errors
    /// [`FileError`] if the built-in file were invalid.
    pub fn paper() -> Result<Self, FileError> {
        Self::parse(crate::PAPER, "paper.toml", FilePath::new(""))
    }

    /// Sets the random walk of the true parameters to the filter's model. In this variant of a scenario the filter should
    /// be efficient and consistent.
    pub fn let_truth_walk_as_assumed(&mut self) {
        let drive = &self.robot.localizer.drive;
        self.truth.scale_walk = drive.scale_walk.0.into();
        self.truth.track_width_walk = drive.track_width_walk.0.0.into();
    }
}

/// The file that replaces a table of the scenario, if one does.
fn beside(node: &Node<'_>, base: &FilePath) -> Option<PathBuf> {
    node.as_text().map(|name| base.join(name))
}

/// What was read from the file that a value names; otherwise its mistakes are recorded.
fn file_or_report<T>(node: &Node<'_>, read: Result<T, FileError>) -> Option<T> {
    read.map_err(|error| match error.first().line() {
        Some(_) => node.report_all(error),
        None => {
            node.report(format!("the file {} {}", error.first().file(), error.first().message()));
        }
    })
    .ok()
}

/// How the path is driven.
#[derive(Clone, Copy)]
pub(crate) struct Drive {
    pub laps: u32,
    pub speed: f64,
    pub turn_rate: f64,
    pub clearance: f64,
    pub follow: Follow,
}

impl Default for Drive {
    fn default() -> Self {
        Self { laps: 1, speed: 0.0, turn_rate: 0.0, clearance: 0.0, follow: Follow::default() }
    }
}

/// Rules that concern several values are checked only if all of them could be read.
fn read_path(
    table: &Table<'_>,
    drive: Option<Drive>,
    floor: Option<&Floor>,
    robot: Option<&RobotConfig>,
) -> Option<Path> {
    let unit = table.require("unit").unit_of_length();
    let corners = table.require("corners").items();
    let points = table.faultless(|| {
        let start = table.require("start").point(unit);
        Some((start, corners.iter().map(|node| node.point(unit)).collect()))
    });
    let (drive, (start, corner_points)) = drive.zip(points)?;
    let Drive { laps, speed, turn_rate, clearance, .. } = drive;
    let plan = PathPlan { start, corners: corner_points, laps, speed, turn_rate };
    let path = match Path::new(plan) {
        Ok(path) => path,
        Err(error) => {
            let corner = error.corner().and_then(|index| corners.get(index));
            match corner {
                Some(node) => node.report(error.to_string()),
                None => table.report_at(error.field(), error.to_string()),
            }
            return None;
        }
    };
    if let Some(robot) = robot {
        check_speeds(table, &path, robot);
    }
    if let Some(floor) = floor {
        check_clearance(&path, &corners, floor, clearance);
    }
    Some(path)
}

pub(crate) fn whole(node: &Node<'_>) -> u32 {
    let number = node.integer(1..=u64::from(u32::MAX));
    u32::try_from(number).unwrap_or(u32::MAX)
}

/// Checks the wheel speed: the localizer refuses the travel of a wheel that is faster than `max_wheel_speed`.
fn check_speeds(table: &Table<'_>, path: &Path, robot: &RobotConfig) {
    let fastest = f64::from(robot.localizer.max_wheel_speed.0);
    let half_width = 0.5 * f64::from(robot.localizer.drive.track_width.0);
    let plan = path.plan();
    for (key, wheel) in [("speed", plan.speed), ("turn_rate", plan.turn_rate * half_width)] {
        if wheel > fastest {
            let message = format!(
                "rolls a wheel at {wheel:.3} m/s, faster than the robot's \
                 drive.max_wheel_speed of {fastest:.3} m/s"
            );
            table.report_at(key, message);
        }
    }
}

/// Records a collision, at the corner at the end of the leg.
fn check_clearance(path: &Path, corners: &[Node<'_>], floor: &Floor, clearance: f64) {
    if let Some(collision) = Collision::first(path.plan(), floor, clearance)
        && let Some(corner) = corners.get(collision.corner)
    {
        corner.report(collision.to_string());
    }
}

fn read_start(root: &Table<'_>, robot: Option<&RobotConfig>) -> Start {
    let start = root.require("start");
    if let Some(text) = start.as_text() {
        start.check((), text == "unknown", "a table of deviations, or \"unknown\"");
        let searches = robot.is_none_or(|robot| robot.start.is_unknown());
        return start.check(Start::unknown(), searches, "that of a robot with start = \"unknown\"");
    }
    Start { is_unknown: false, ..START.read(start, Start::unknown()) }
}

pub(crate) fn read_sensor(node: &Node<'_>, sonar: &mut SonarName) {
    *sonar = sonar_model::read(node, &[], *sonar, |model| model.simulated);
}
