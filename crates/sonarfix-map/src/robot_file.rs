//! Reads robot files into the [`RobotConfig`] of loop, drivers, planner, simulator and replay, and writes them, by the
//! [table of keys](crate::keys).

use std::path::Path;

use sonarfix::config::{Further, MAX_RANGERS, PingSchedule, RangerId, ServoTiming, Sonar};
use sonarfix::geometry::units::{Duration, Metres, Radians};
use sonarfix_hal::config::{RangerConfig, RobotConfig, RobotConfigError, StartPose, WheelConfig};

use crate::devices::SERVOS;
use crate::document::{Document, Node, Table};
use crate::error::FileError;
use crate::file;
use crate::keys::robot::{PULSE, REGION, ROBOT, SERVO_TIMING, SONAR, WHEEL, usual};
use crate::quantity::{Number, TIME};
use crate::ranger_file;
use crate::spelling::alternatives;

/// The fix period of a sonar that pings as fast as possible.
const AS_FAST_AS_POSSIBLE: &str = "as fast as possible";

/// The keys that all sonars of a robot share, so that the first has them.
const SHARED: [&str; 2] = ["fix_period", "temperature"];

/// The keys of a sonar on a servo.
const OF_SERVO: [&str; 3] = ["servo", "servo_pulses", "servo_timing"];

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
    for ((id, _), node) in config.localizer.sonars().zip(sonar_nodes(robot.require("sonar"))) {
        let Some((sonar, driver)) = config.ranger_of(id) else { continue };
        let mut alone = *config;
        (alone.localizer.sonar, alone.ranger) = (*sonar, *driver);
        (alone.localizer.further_sonars, alone.further_rangers) = (Further::NONE, Further::NONE);
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
        same => same,
    }
}

/// A table for each sonar: `[sonar]`, or several of `[[sonar]]`.
fn sonar_nodes(node: Node<'_>) -> Vec<Node<'_>> {
    if node.is_array() { node.items() } else { vec![node] }
}

pub(crate) fn read_sonars(node: Node<'_>, config: &mut RobotConfig) {
    let count = if node.is_array() { node.items().len() } else { 1 };
    if !(1..=MAX_RANGERS).contains(&count) {
        node.report(format!("must be 1 to {MAX_RANGERS} tables"));
    }
    for (index, node) in sonar_nodes(node).into_iter().enumerate() {
        let table = node.table(&SONAR.names());
        if index == 0 {
            table.require("fix_period");
            let Ranger { sonar, driver, .. } = read_sonar(&table, Ranger::usual());
            (config.localizer.sonar, config.ranger) = (sonar, driver);
            continue;
        }
        for node in SHARED.iter().filter_map(|key| table.get(key)) {
            node.report("is one for all sonars: write it in the first only");
        }
        let first = Ranger { sonar: config.localizer.sonar, driver: config.ranger, bearing: None };
        let Ranger { sonar, driver, .. } = read_sonar(&table, first);
        // Too many are a mistake that has been reported.
        _ = config.localizer.further_sonars.push(sonar);
        _ = config.further_rangers.push(driver);
    }
}

/// Reads a sonar, which is on a servo or at a bearing.
fn read_sonar(table: &Table<'_>, usual: Ranger) -> Ranger {
    let mut ranger = SONAR.read_from(table, usual);
    ranger_file::require_cycle(table, &ranger);
    let bearing = ranger.bearing.map(Radians);
    for key in OF_SERVO {
        if let (Some(_), Some(node)) = (bearing, table.get(key)) {
            node.report(
                "is of a sonar on a servo, and `bearing` of one without: remove one of them",
            );
        } else if bearing.is_none() {
            table.require(key);
        }
    }
    if let Some(bearing) = bearing {
        ranger.sonar.servo = (bearing, bearing);
        ranger.sonar.timing.servo = ServoTiming::INSTANT;
        ranger.driver.servo_pulses = RangerConfig::NO_PULSES;
    } else if ranger.sonar.fixed_bearing().is_some() {
        table.report_at(
            "servo",
            "must be a rightmost below a leftmost bearing: a sonar without a servo has `bearing`",
        );
    }
    ranger
}

/// The tables of all sonars; the first has what they share.
pub(crate) fn sonars_text(config: &RobotConfig) -> String {
    let header = if config.localizer.has_several_sonars() { "[[sonar]]" } else { "[sonar]" };
    let tables = config.localizer.sonars().filter_map(|(id, _)| {
        let (&sonar, &driver) = config.ranger_of(id)?;
        let bearing = sonar.fixed_bearing().map(|bearing| bearing.0);
        let shared: &[&str] = if id == RangerId::FIRST { &[] } else { &SHARED };
        let of_servo: &[&str] = if bearing.is_some() { &OF_SERVO } else { &[] };
        let is_written = |line: &&str| {
            let key = line.split(" = ").next().unwrap_or_default();
            !shared.contains(&key) && !of_servo.contains(&key)
        };
        let lines = SONAR.lines(&Ranger { sonar, driver, bearing });
        let lines: String = lines.split_inclusive('\n').filter(is_written).collect();
        Some(format!("\n{header}\n{lines}"))
    });
    tables.collect()
}

/// A ranger as its table describes it.
#[derive(Clone, Copy)]
pub(crate) struct Ranger {
    pub sonar: Sonar,
    pub driver: RangerConfig,
    /// That of a sonar without a servo, radians.
    pub bearing: Option<f32>,
}

impl Ranger {
    pub(crate) fn usual() -> Self {
        Self { sonar: usual().localizer.sonar, driver: usual().ranger, bearing: None }
    }
}

pub(crate) fn read_region(node: Node<'_>, config: &mut RobotConfig) {
    if config.start.is_unknown() {
        let region = Some(REGION.read(node, (REGION.usual)()));
        config.start = StartPose::Unknown { region };
    } else {
        node.report("needs start = \"unknown\"");
    }
}

pub(crate) fn read_schedule(node: &Node<'_>, ranger: &mut Ranger) {
    ranger.sonar.timing.schedule = if node.as_text() == Some(AS_FAST_AS_POSSIBLE) {
        PingSchedule::AsFastAsPossible
    } else {
        let mut period = Duration::from_ticks(0);
        period.set(node.within(&TIME, ("1 us", "3600 s"), "period of the pings"));
        PingSchedule::Every(period)
    };
}

pub(crate) fn schedule_text(ranger: &Ranger) -> Option<String> {
    match ranger.sonar.timing.schedule {
        PingSchedule::Every(period) => TIME.text(&period),
        PingSchedule::AsFastAsPossible => Some(format!("\"{AS_FAST_AS_POSSIBLE}\"")),
    }
}

/// A servo by its name, or by its times.
pub(crate) fn read_timing(node: Node<'_>, ranger: &mut Ranger) {
    let timing = &mut ranger.sonar.timing.servo;
    let Some(name) = node.as_text() else {
        *timing = SERVO_TIMING.read(node, *timing);
        return;
    };
    if let Some((_, named)) = SERVOS.iter().find(|(known, _)| *known == name) {
        *timing = *named;
    } else {
        let known = alternatives(name, &SERVOS.map(|(known, _)| known));
        node.report(format!("must be {known}, or a table of its times"));
    }
}

pub(crate) fn read_pulses(node: &Node<'_>, ranger: &mut Ranger) {
    ranger.driver.servo_pulses = node.pair().map(|node| PULSE.read(node, (PULSE.usual)()));
}

pub(crate) fn pulses_text(ranger: &Ranger) -> String {
    let pulses = ranger.driver.servo_pulses.map(|pulse| PULSE.inline(&pulse));
    format!("[{}]", pulses.join(", "))
}

/// A wheel as its table describes it; lengths in metres.
#[derive(Clone, Copy, Default)]
pub(crate) struct Wheel {
    pub diameter: Option<f32>,
    pub edges: Option<f32>,
    pub travel: Option<f32>,
    pub is_mirrored: bool,
}

/// A wheel: by its diameter and the edges per revolution of its encoder, or by its travel per edge.
pub(crate) fn read_wheel(node: Node<'_>) -> WheelConfig {
    let table = node.table(&WHEEL.names());
    let Wheel { diameter, edges, travel, is_mirrored } = WHEEL.read_from(&table, Wheel::default());
    let wheel = if let Some(travel) = travel {
        if let Some(other) = table.get("diameter").or(table.get("edges_per_revolution")) {
            other.report("contradicts travel_per_edge: remove one of them");
        }
        WheelConfig { travel_per_edge: Metres(travel), is_mirrored: false }
    } else {
        table.require("edges_per_revolution");
        table.require("diameter");
        WheelConfig::of_diameter(Metres(diameter.unwrap_or(1.0)), edges.unwrap_or(1.0))
    };
    if is_mirrored { wheel.mirrored() } else { wheel }
}

pub(crate) fn wheel_text(wheel: WheelConfig) -> String {
    let WheelConfig { travel_per_edge, is_mirrored } = wheel;
    WHEEL.inline(&Wheel { travel: Some(travel_per_edge.0), is_mirrored, ..Wheel::default() })
}
