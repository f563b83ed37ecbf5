//! The scenario: a floor, a robot on a path, and its true parameters.

pub(crate) mod absolute;
pub(crate) mod faults;
pub(crate) mod fidelity;
pub(crate) mod path_table;
pub(crate) mod start;
pub(crate) mod surroundings;
pub(crate) mod truth;
pub(crate) mod upsets;

use std::path::{Path as FilePath, PathBuf};

use sonarfix_hal::config::RobotConfig;

use crate::document::{Document, Node, Table};
use crate::error::FileError;
use crate::floor::{Floor, MAP, WALL};
use crate::keys::{Key, Section, Value, optional, other};
use crate::path::Path;
use crate::sonar_model::SonarName;
use crate::wall_file::WallFile;
use crate::{file, robot_file};

use absolute::{ABSOLUTE, AbsoluteSensors, HEADING, POSITION};
use faults::{FAULT, Fault};
use fidelity::{Fidelity, Hardware, SENSOR, SERVO, ServoName};
use path_table::{Drive, Follow, PATH};
use start::{START, Start};
use surroundings::{OBSTACLE, Surroundings, WORLD};
use truth::{GYRO, TRUTH, Truth};
use upsets::{HEADING_SLIP, UPSET, Upsets};

#[rustfmt::skip]
static SCENARIO: Section<Fidelity> = Section { name: "scenario", usual: Fidelity::default, keys: &[
    other("name", "a text", "name of the scenario"),
    other("description", "a text", "what the scenario demonstrates"),
    optional(Key::new("fidelity", Value::Word(&["ideal", "pins"], |f| usize::from(*f == Fidelity::Pins), |f, word| {
        *f = if word == 0 { Fidelity::Ideal } else { Fidelity::Pins };
    }), "travel and ranges are passed directly and on time, or through simulated pins, with the drivers and the loop of a robot")),
    other("map", "a table, or a name", "the `[map]` table as in a map file, or the name of one: `map = \"map.toml\"`"),
    other("robot", "tables, or a name", "the robot file's tables, as `[robot.drive]` and so on, or the name of one: `robot = \"robot.toml\"`"),
    other("path", "a table", "[the path](#path)"),
    other("start", "a table, or `\"unknown\"`", "[the initial estimate](#start)"),
    other("truth", "a table", "[the true parameters](#truth)"),
    optional(other("sensor", "a table", "[the simulated sonar](#sensor)")),
    optional(other("servo", "a table", "[the simulated servo](#servo)")),
    optional(other("world", "a table", "[air and obstacles](#world)")),
    optional(other("absolute", "a table", "[sensors that measure from outside](#absolute)")),
    optional(other("faults", "tables", "[faults of the hardware](#faults)")),
    other("run", "a table", "[how many runs](#run)"),
] };

/// The keys of a scenario file, besides `format`.
#[must_use]
pub fn scenario_keys() -> Vec<&'static str> {
    SCENARIO.names()
}

/// The number of runs of the scenario.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Run {
    /// The number of Monte-Carlo runs.
    pub runs: u32,
    /// The seed of the first run; each following run has the next seed.
    pub seed: u64,
}

#[rustfmt::skip]
static RUN: Section<Run> = Section { name: "run", usual: || Run { runs: 1, seed: 0 }, keys: &[
    Key::new("runs", Value::Own("a whole number from 1 to 4294967295", |node, r| r.runs = node.count(), |_| None), "number of Monte-Carlo runs"),
    Key::new("seed", Value::Own("a whole number from 0 to 18446744073709551615", |node, r| r.seed = node.integer(0..=u64::MAX), |_| None),
        "seed of the first run. Each further run uses the next number"),
] };

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
        let path = path_table::read(&path_table, drive, floor.as_ref(), robot.as_ref());
        let (truth, upsets) = truth::read(root.require("truth"), robot.as_ref());
        let (sensor, servo) = (root.get("sensor"), root.get("servo"));
        let (sonar, name) = (SonarName::default(), ServoName::default());
        let scenario = Self {
            name: root.require("name").text().into(),
            description: root.require("description").text().into(),
            fidelity: SCENARIO.read_from(root, Fidelity::default()),
            follow: drive.map_or_else(Follow::default, |drive| drive.follow),
            start: start::read(root, robot.as_ref()),
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

/// The tables of `docs/formats.md`.
pub(crate) fn rows() -> Vec<(&'static str, String)> {
    vec![
        SCENARIO.rows(),
        MAP.rows(),
        WALL.rows(),
        PATH.rows(),
        START.rows(),
        TRUTH.rows(),
        UPSET.rows(),
        HEADING_SLIP.rows(),
        GYRO.rows(),
        SENSOR.rows(),
        SERVO.rows(),
        WORLD.rows(),
        OBSTACLE.rows(),
        FAULT.rows(),
        RUN.rows(),
        ABSOLUTE.rows(),
        HEADING.rows(),
        POSITION.rows(),
    ]
}
