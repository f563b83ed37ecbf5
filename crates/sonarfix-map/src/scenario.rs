//! The scenario: a floor, a robot on a path, and its true parameters.

use std::path::{Path as FilePath, PathBuf};

use crate::absolute_file::{self, AbsoluteSensors};
use crate::clearance::Collision;
use sonarfix_hal::config::RobotConfig;
use sonarfix_search::navigator::{UNKNOWN_HEADING, UNKNOWN_POSITION};

use crate::document::{Document, Node, Table};
use crate::error::FileError;
use crate::faults::{self, Fault};
use crate::fidelity::{self, Fidelity, Follow, Hardware, Upsets};
use crate::file;
use crate::floor::Floor;
use crate::path::{Path, PathPlan};
use crate::quantity::{
    ANGLE, Dimension, LENGTH, LENGTH_PER_LENGTH, LENGTH_WALK, SCALE_WALK, SPEED, TURN_RATE,
};
use crate::robot_file;
use crate::surroundings::{self, Surroundings};
use crate::wall_file::WallFile;

/// The keys of a scenario file, besides `format`.
pub const KEYS: [&str; 14] = [
    "name",
    "description",
    "fidelity",
    "map",
    "robot",
    "path",
    "start",
    "truth",
    "sensor",
    "servo",
    "world",
    "absolute",
    "faults",
    "run",
];

const PATH_KEYS: [&str; 8] =
    ["unit", "start", "corners", "laps", "speed", "turn_rate", "clearance", "follow"];

const TRUTH_KEYS: [&str; 14] = [
    "track_width",
    "scale_right",
    "scale_left",
    "range_scale",
    "wheel_noise",
    "scale_walk",
    "track_width_walk",
    "range_noise",
    "range_noise_per_metre",
    "cone",
    "slip",
    "bump",
    "heading_slip",
    "gyro",
];

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
    fn unknown() -> Self {
        Self {
            position: UNKNOWN_POSITION.0.into(),
            heading: UNKNOWN_HEADING.0.into(),
            drawn: false,
            is_unknown: true,
        }
    }
}

/// The true parameters of the robot, which the filter does not receive.
#[derive(Debug, Clone, Copy, PartialEq)]
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
        Document::parse(text, file_name)?.read(&KEYS, |root| Self::from_table(root, base))
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
        let path_table = root.table("path", &PATH_KEYS);
        let truth = root.table("truth", &TRUTH_KEYS);
        let path = read_path(&path_table, floor.as_ref(), robot.as_ref());
        let scenario = Self {
            name: root.require("name").text().into(),
            description: root.require("description").text().into(),
            fidelity: fidelity::read_fidelity(root),
            follow: fidelity::read_follow(&path_table),
            start: read_start(root, robot.as_ref()),
            truth: read_truth(&truth),
            upsets: fidelity::read_upsets(&truth),
            hardware: fidelity::read_hardware(root),
            surroundings: surroundings::read(root),
            absolute: absolute_file::read(root),
            faults: faults::read(root),
            run: read_run(root),
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

fn quantity(table: &Table<'_>, key: &str, dimension: &Dimension) -> f64 {
    table.require(key).quantity(dimension)
}

fn deviation(table: &Table<'_>, key: &str, dimension: &Dimension) -> f64 {
    table.require(key).deviation(dimension)
}

/// Rules that concern several values are checked only if all of them could be read.
fn read_path(
    table: &Table<'_>,
    floor: Option<&Floor>,
    robot: Option<&RobotConfig>,
) -> Option<Path> {
    let mistakes = table.mistakes();
    let unit = table.require("unit").unit_of_length();
    let corners = table.require("corners").items();
    let plan = PathPlan {
        start: table.require("start").point(unit),
        corners: corners.iter().map(|node| node.point(unit)).collect(),
        laps: table.get("laps").map_or(1, |node| whole(&node)),
        speed: quantity(table, "speed", &SPEED),
        turn_rate: quantity(table, "turn_rate", &TURN_RATE),
    };
    let clearance = table.get("clearance").map_or(0.0, |node| node.deviation(&LENGTH));
    if table.mistakes() > mistakes {
        return None;
    }
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

fn whole(node: &Node<'_>) -> u32 {
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
    let table = start.table(&["position", "heading", "drawn"]);
    Start {
        position: deviation(&table, "position", &LENGTH),
        heading: deviation(&table, "heading", &ANGLE),
        drawn: table.require("drawn").boolean(),
        is_unknown: false,
    }
}

fn read_truth(table: &Table<'_>) -> Truth {
    let width = table.require("track_width");
    let track_width = width.quantity(&LENGTH);
    let cone_node = table.require("cone");
    let cone = cone_node.quantity(&ANGLE);
    let narrow = cone > 0.0 && cone < std::f64::consts::FRAC_PI_2;
    Truth {
        track_width: width.check(track_width, track_width > 0.0, "positive"),
        scale_right: scale(table, "scale_right"),
        scale_left: scale(table, "scale_left"),
        range_scale: scale(table, "range_scale"),
        wheel_noise: deviation(table, "wheel_noise", &LENGTH_WALK),
        scale_walk: deviation(table, "scale_walk", &SCALE_WALK),
        track_width_walk: deviation(table, "track_width_walk", &LENGTH_WALK),
        range_noise: deviation(table, "range_noise", &LENGTH),
        range_noise_per_metre: deviation(table, "range_noise_per_metre", &LENGTH_PER_LENGTH),
        cone: cone_node.check(cone, narrow, "between 0 and 90° (half of the cone)"),
        gyro: table.get("gyro").map_or_else(GyroTruth::default, read_gyro),
    }
}

/// The true noise and random walk are those that the robot assumes.
fn read_gyro(node: Node<'_>) -> GyroTruth {
    let table = node.table(&["bias", "scale"]);
    GyroTruth {
        bias: table.get("bias").map(|node| node.quantity(&TURN_RATE)),
        scale: table.get("scale").map_or(0.0, |node| node.fraction()),
    }
}

/// A scale error, greater than −1: the wheel would otherwise stand still or roll backwards.
fn scale(table: &Table<'_>, key: &str) -> f64 {
    let node = table.require(key);
    let scale = node.fraction();
    node.check(scale, scale > -1.0, "greater than -1")
}

fn read_run(root: &Table<'_>) -> Run {
    let table = root.table("run", &["runs", "seed"]);
    Run { runs: whole(&table.require("runs")), seed: table.require("seed").integer(0..=u64::MAX) }
}
