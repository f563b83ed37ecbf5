//! Reads robot files into the [`RobotConfig`] of loop, drivers, planner, simulator and replay, and writes them, by the
//! table of keys.

mod common_parts;
pub(crate) mod drive;
mod echo;
mod ranger;
pub(crate) mod sonar;

use std::collections::HashMap;
use std::path::Path;

use sonarfix::aim::Policy;
use sonarfix::config::Rangers;
use sonarfix::geometry::pose::Point;
use sonarfix::sensor::gyro::GyroParameters;
use sonarfix_hal::config::{
    RobotConfig, RobotConfigError, SearchMotion, SearchMotionKind, StartPose,
};
use sonarfix_search::search::Region;

use crate::document::{Document, Node, Table};
use crate::error::FileError;
use crate::file;
use crate::keys::{Key, Section, Value, number, optional};
use crate::quantity::{ANGLE_WALK, FRACTION, LENGTH, NUMBER, TIME, TURN_RATE, TURN_RATE_WALK};

use common_parts::usual;
use drive::{DRIVE, WHEEL};
use echo::ECHO;
use ranger::{BEAM, RANGER};
use sonar::{PULSE, SERVO_TIMING, SONAR};

#[rustfmt::skip]
static ROBOT: Section<RobotConfig> = Section { name: "robot", usual, keys: &[
    optional(Key::new("start", Value::Word(&["known", "unknown"], |c| usize::from(c.start.is_unknown()), |c, word| {
        c.start = if word == 0 { StartPose::Known } else { StartPose::Unknown { region: None } };
    }), "whether the pose is set before the start. If not, or when it is lost, the robot \
        [searches](search.md#in-the-robots-loop) for it. A robot with a known start stays lost")),
    optional(Key::new("start_region", Value::Own("a table of `from` and `to`", read_region, |c| c.start.region().map(|region| REGION.inline(&region))),
        "where on the map a robot without a pose starts, with `start = \"unknown\"`. Anywhere without this key")),
    optional(Key::new("search_motion", Value::Own("a table of `kind` and `bumper_distance`", read_motion, |c| c.start.motion().map(|motion| MOTION.inline(&motion))),
        "how the robot moves by itself [while it searches](driving.md#a-robot-that-searches) and no motion is commanded, with `start = \"unknown\"`. Not \
        at all without this key. The board's program needs the feature `drive`, and a motor code that obeys it")),
    Key::new("drive", Value::Table(&DRIVE), "wheels and encoders"),
    Key::new("sonar", Value::Tables(sonar::read, sonar::text), "ranger and servo"),
    Key::new("prior", Value::Table(&PRIOR), "how wrong the calibration may be"),
    Key::new("gating", Value::Table(&GATING), "which ranges and walls are used"),
    optional(Key::new("echo", Value::Table(&ECHO), "what a ping returns besides the range of its wall")),
    Key::new("schedule", Value::Table(&SCHEDULE), "which wall is measured next"),
    optional(Key::new("motors", Value::Table(&MOTORS), "when the motors are enabled")),
    optional(Key::new("gyro", Value::Tables(|node, c| c.localizer.gyro = Some(GYRO.read(node, (GYRO.usual)())), |c| {
        c.localizer.gyro.map_or_else(String::new, |gyro| format!("\n[gyro]\n{}", GYRO.lines(&gyro)))
    }), "a gyro that measures the yaw rate")),
] };

#[rustfmt::skip]
static REGION: Section<Region> = Section {
    name: "start_region", usual: || Region { from: Point::new(0.0, 0.0), to: Point::new(0.0, 0.0) }, keys: &[
    Key::new("from", Value::Pair(&LENGTH, ("-8000 m", "8000 m"), |r| [&mut r.from.x.0, &mut r.from.y.0]),
        "the corner with the smaller coordinates, on the map"),
    Key::new("to", Value::Pair(&LENGTH, ("-8000 m", "8000 m"), |r| [&mut r.to.x.0, &mut r.to.y.0]), "the corner with the larger ones"),
] };

#[rustfmt::skip]
static MOTION: Section<SearchMotion> = Section {
    name: "search_motion", usual: || SearchMotion { kind: SearchMotionKind::Ahead, bumper: SearchMotion::BUMPER }, keys: &[
    Key::new("kind", Value::Word(&["spin", "ahead"], |m| usize::from(m.kind == SearchMotionKind::Ahead), |m, word| {
        m.kind = if word == 0 { SearchMotionKind::Spin } else { SearchMotionKind::Ahead };
    }), "once around on the spot, or ahead where the sonar finds free floor"),
    optional(number("bumper_distance", &LENGTH, ("5 cm", "5 m"), |m| &mut m.bumper.0,
        "least range of an echo ahead, from the sonar, with which the robot drives on. Half of its width, and what it needs to stop")),
] };

#[rustfmt::skip]
static PRIOR: Section<RobotConfig> = Section { name: "prior", usual, keys: &[
    number("scale_right", &FRACTION, ("0 %", "100 %"), |c| &mut c.localizer.prior.scale_right, "scale error of the right wheel's diameter, a fraction"),
    number("scale_left", &FRACTION, ("0 %", "100 %"), |c| &mut c.localizer.prior.scale_left, "scale error of the left wheel's diameter"),
    optional(number("scale_difference", &FRACTION, ("0.0001 %", "100 %"), |c| &mut c.localizer.prior.scale_difference,
        "scale error of the right wheel less that of the left. Wheels of one type are alike, however wrong their nominal diameter is. Limited to what the \
        two above permit ([model.md](model.md#motion), eq. 48); without it their errors are independent")),
    number("track_width", &LENGTH, ("0 m", "5 m"), |c| &mut c.localizer.prior.track_width.0, "error of the track width. Below half the track width"),
    number("range_scale", &FRACTION, ("0 %", "100 %"), |c| &mut c.localizer.prior.range_scale,
        "scale error of the ranges: the speed of sound changes by 0.18 %/°C. Zero: not estimated"),
    optional(number("mount", &LENGTH, ("0 m", "1 m"), |c| &mut c.localizer.prior.mount.0,
        "error of each coordinate of `mount`; that of the first ranger is estimated ([model.md](model.md#mount)). Zero: exact")),
] };

#[rustfmt::skip]
static GATING: Section<RobotConfig> = Section { name: "gating", usual, keys: &[
    number("confidence", &NUMBER, ("0", "100"), |c| &mut c.localizer.gating.confidence,
        "standard deviations of position and heading by which no other wall may return an earlier echo. A wall is measured only then; if no wall passes, \
        the margins are ignored"),
    optional(number("inflation", &LENGTH, ("0 m", "100 m"), |c| &mut c.localizer.gating.inflation.0,
        "standard deviation that each independent contradiction adds to the position of a lost robot. Up to ten times that, and in radians to its heading, up \
        to 0.26. 0: none")),
    optional(number("max_distance_without_fix", &LENGTH, ("1 mm", "10000 m"), |c| &mut c.localizer.gating.max_distance_without_fix.0,
        "travel without a used range after which the verdict is `Degraded`")),
    optional(number("max_position_deviation", &LENGTH, ("1 mm", "1000 m"), |c| &mut c.localizer.gating.max_position_deviation.0,
        "position deviation in any direction above which the verdict is `Degraded`")),
] };

#[rustfmt::skip]
static SCHEDULE: Section<RobotConfig> = Section { name: "schedule", usual, keys: &[
    Key::new("policy", Value::Word(&["nearest", "informative"], |c| usize::from(c.localizer.policy == Policy::Informative), |c, word| {
        c.localizer.policy = if word == 0 { Policy::Nearest } else { Policy::Informative };
    }), "measures the nearest wall, or the one with the highest expected information gain on the position per time"),
    optional(number("heading_weight", &LENGTH, ("0 m", "1000 m"), |c| &mut c.localizer.weights.heading.0,
        "weight of the heading in the gain, in metres of position per radian: a lever arm")),
    optional(number("wheels_weight", &LENGTH, ("0 m", "1000 m"), |c| &mut c.localizer.weights.wheels.0,
        "weight of a wheel's scale error in the gain, in metres of position per 100 %")),
] };

#[rustfmt::skip]
static GYRO: Section<GyroParameters> = Section { name: "gyro", usual: || GyroParameters::MPU_6050, keys: &[
    Key::new("sensor", Value::Word(&["mpu6050", "lsm6dso"], |_| 0, |_, _| {}),
        "the sensor. The program of a board has the driver of one of them; both have these defaults. An MPU-6500 or MPU-9250 is an `mpu6050`, an LSM6DSOX is an `lsm6dso`"),
    optional(number("range", &TURN_RATE, ("1 deg/s", "2000 deg/s"), |g| &mut g.range.0,
        "largest rate. The driver sets the smallest range of the sensor that includes it")),
    optional(number("noise", &ANGLE_WALK, ("0.000001 deg/sqrt(s)", "100 deg/sqrt(s)"), |g| &mut g.noise.0.0,
        "white noise of the rate, as the angle after one second")),
    optional(number("bias", &TURN_RATE, ("0.00001 deg/s", "1000 deg/s"), |g| &mut g.bias.0, "standard deviation of the bias at the start")),
    optional(number("bias_walk", &TURN_RATE_WALK, ("0 deg/s/sqrt(s)", "100 deg/s/sqrt(s)"), |g| &mut g.bias_walk.0.0,
        "random walk of the bias in one second")),
    optional(number("scale", &FRACTION, ("0 %", "50 %"), |g| &mut g.scale, "standard deviation of its scale error")),
    optional(number("period", &TIME, ("1 ms", "50 ms"), |g| &mut g.period, "time from one sample to the next")),
    optional(Key::new("inverted", Value::Flag(|g| &mut g.is_inverted), "whether it is mounted upside down")),
] };

const ON_OFF: &[&str] = &["off", "on"];

#[rustfmt::skip]
static MOTORS: Section<RobotConfig> = Section { name: "motors", usual, keys: &[
    optional(Key::new("lost", Value::Word(ON_OFF, |c| usize::from(c.motors.lost), |c, word| c.motors.lost = word == 1),
        "while the verdict is `Lost`. On, because a robot that searches for its pose drives meanwhile: needed with `start = \"unknown\"`")),
    optional(Key::new("dead_encoder", Value::Word(ON_OFF, |c| usize::from(c.motors.dead_encoder), |c, word| c.motors.dead_encoder = word == 1),
        "once the localizer has had no odometry for 0.5 s")),
    optional(Key::new("lost_link", Value::Word(ON_OFF, |c| usize::from(c.motors.lost_link), |c, word| c.motors.lost_link = word == 1),
        "once the robot has received no valid frame of a command for `link_timeout`. With `\"off\"`, the program that drives the robot must send a command \
        regularly, for example `MapChecksum`")),
    optional(number("link_timeout", &TIME, ("1 ms", "3600 s"), |c| &mut c.motors.link_timeout, "time without a frame after which the link counts as lost")),
] };

/// Why a robot that searches for its pose must be able to drive while it is lost.
const SEARCH_STOPPED: &str = "must be \"on\" with start = \"unknown\": a robot finds its pose while it drives, and is lost until \
     then; write \"on\", or start = \"known\"";

/// Reads a robot file.
///
/// # Errors
/// [`FileError`] with all mistakes.
pub fn read(path: &Path) -> Result<RobotConfig, FileError> {
    parse(&file::read(path)?, &file::name(path))
}

/// Parses the text of a robot file. Errors name it `file_name`.
///
/// # Errors
/// [`FileError`] with all mistakes.
pub fn parse(text: &str, file_name: &str) -> Result<RobotConfig, FileError> {
    Document::parse(text, file_name)?.read(&ROBOT.names(), |root| Some(from_table(root)))
}

/// Writes the robot file of a configuration, which [`parse`] reads back to the bit.
#[must_use]
pub fn text(config: &RobotConfig) -> String {
    format!("format = 1\n{}", ROBOT.lines(config))
}

/// Checks each number of a configuration, from wherever it comes, against the limits of its key in a robot file.
///
/// # Errors
/// [`FileError`] with all mistakes, by the lines of [`text`]; they name `source`.
pub fn check(config: &RobotConfig, source: &str) -> Result<(), FileError> {
    parse(&text(config), source).map(drop)
}

/// Reads a `[robot]` table.
pub(crate) fn from_node(node: Node<'_>) -> RobotConfig {
    from_table(&node.table(&ROBOT.names()))
}

fn from_table(robot: &Table<'_>) -> RobotConfig {
    let mistakes = robot.mistakes();
    let config = ROBOT.read_from(robot, usual());
    if robot.mistakes() == mistakes {
        check_rules(robot, &config);
    }
    config
}

/// Checks the rules about several values, for each sonar as if it were the only one.
fn check_rules(robot: &Table<'_>, config: &RobotConfig) {
    for ((id, _), node) in config.localizer.rangers.iter().zip(sonar::nodes(robot.require("sonar")))
    {
        let Some((sonar, driver)) = config.ranger_of(id) else { continue };
        let mut alone = *config;
        (alone.localizer.rangers, alone.rangers) = (Rangers::one(*sonar), Rangers::one(*driver));
        if let Err(error) = alone.check() {
            let (key, message) = (key_of(error), format!("must be {}", error.rule));
            return match key.strip_prefix("sonar.") {
                Some(key) => node.table(&SONAR.names()).report_at(key, message),
                None => robot.report_at(key, message),
            };
        }
    }
    if config.start.is_unknown() && !config.motors.lost {
        robot.report_at("motors.lost", SEARCH_STOPPED);
    }
}

/// The position in the file of a field that a check refused.
fn key_of(error: RobotConfigError) -> &'static str {
    match error.field {
        "servo_pulses" => "sonar.servo_pulses",
        "start.region" => "start_region",
        "start.motion.kind" => "search_motion.kind",
        "start.motion.bumper" => "search_motion.bumper_distance",
        same => same,
    }
}

fn read_region(node: Node<'_>, config: &mut RobotConfig) {
    if config.start.is_unknown() {
        let region = Some(REGION.read(node, (REGION.usual)()));
        config.start = StartPose::Unknown { region };
    } else {
        node.report("needs start = \"unknown\"");
    }
}

/// After the region, whose row is before.
fn read_motion(node: Node<'_>, config: &mut RobotConfig) {
    if config.start.is_unknown() {
        let (region, motion) = (config.start.region(), MOTION.read(node, (MOTION.usual)()));
        config.start = StartPose::Exploring { region, motion };
    } else {
        node.report("needs start = \"unknown\"");
    }
}

/// The tables of `docs/formats.md`.
pub(crate) fn rows() -> Vec<(&'static str, String)> {
    let main = [&ROBOT, &DRIVE, &PRIOR, &GATING, &ECHO, &SCHEDULE, &MOTORS].map(Section::rows);
    let others = [
        REGION.rows(),
        MOTION.rows(),
        WHEEL.rows(),
        SONAR.rows(),
        PULSE.rows(),
        SERVO_TIMING.rows(),
        RANGER.rows(),
        BEAM.rows(),
        GYRO.rows(),
    ];
    main.into_iter().chain(others).collect()
}

/// The explanation of each key of a table.
pub(crate) fn notes() -> HashMap<String, &'static str> {
    let tables = [&ROBOT, &DRIVE, &PRIOR, &GATING, &ECHO, &SCHEDULE, &MOTORS];
    let notes = tables.into_iter().flat_map(Section::notes);
    notes.chain(SONAR.notes()).chain(GYRO.notes()).collect()
}
