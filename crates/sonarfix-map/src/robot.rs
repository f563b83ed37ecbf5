//! The robot: what its builder knows.

use std::path::Path;

use sonarfix::aim::Policy;
use sonarfix::config::{
    CalibrationPrior, Config, ConfigError, Pace, Rhythm, Sonar, Timing, Trust, Weights,
};
use sonarfix::motion::{Drive, WheelTravel};
use sonarfix::pose::Point;
use sonarfix::range::RangeNoise;
use sonarfix::units::{Duration, Metres, MetresPerSecond, PerRootMetre, Radians};

use crate::document::{Document, Node, Table};
use crate::error::FileError;
use crate::quantity::{
    ANGLE, Dimension, LENGTH, LENGTH_PER_LENGTH, LENGTH_WALK, SCALE_WALK, SPEED, TIME,
};
use crate::{file, single};

const TABLES: [&str; 5] = ["drive", "sonar", "prior", "trust", "schedule"];

const DRIVE_KEYS: [&str; 7] = [
    "track_width",
    "wheel_noise",
    "scale_walk",
    "track_width_walk",
    "max_wheel_speed",
    "encoder_period",
    "travel_per_tick",
];

const SONAR_KEYS: [&str; 10] = [
    "mount",
    "servo",
    "cone",
    "min_range",
    "max_range",
    "noise",
    "noise_per_metre",
    "fix_period",
    "servo_pace",
    "cycle",
];

/// A robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Robot {
    /// The localizer's configuration; it has passed [`Config::check`].
    pub config: Config,
    /// From one reading of the encoders to the next.
    pub encoder_period: Duration,
    /// How far each wheel rolls from one encoder tick to the next, negative where the encoder
    /// counts down as the robot drives ahead.
    pub travel_per_tick: Option<WheelTravel>,
}

impl Robot {
    /// Reads a robot file.
    ///
    /// # Errors
    /// [`FileError`] with the first thing that is wrong.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        Self::parse(&file::read(path)?, &file::name(path))
    }

    /// Reads the text of a robot file that errors call `file_name`.
    ///
    /// # Errors
    /// [`FileError`] with the first thing that is wrong.
    pub fn parse(text: &str, file_name: &str) -> Result<Self, FileError> {
        let document = Document::parse(text, file_name)?;
        Self::from_table(&document.root(&TABLES)?)
    }

    /// Reads a `[robot]` table.
    pub(crate) fn from_node(node: Node<'_>) -> Result<Self, FileError> {
        Self::from_table(&node.table(&TABLES)?)
    }

    fn from_table(robot: &Table<'_>) -> Result<Self, FileError> {
        let drive = robot.table("drive", &DRIVE_KEYS)?;
        let sonar = robot.table("sonar", &SONAR_KEYS)?;
        let config = Config {
            drive: read_drive(&drive)?,
            max_wheel_speed: MetresPerSecond(quantity(&drive, "max_wheel_speed", &SPEED)?),
            sonar: read_sonar(&sonar)?,
            prior: read_prior(robot)?,
            trust: read_trust(robot)?,
            policy: read_policy(robot)?,
            weights: read_weights(robot)?,
        };
        config.check().map_err(|error| {
            let message = format!("must be {}", error.rule);
            robot.error_at(key_of(error), message)
        })?;
        Ok(Self {
            config,
            encoder_period: period(&drive.require("encoder_period")?)?,
            travel_per_tick: drive.get("travel_per_tick").map(per_tick).transpose()?,
        })
    }
}

/// Where the file has the field that the localizer refused.
fn key_of(error: ConfigError) -> &'static str {
    match error.field {
        "max_wheel_speed" => "drive.max_wheel_speed",
        "sonar.noise.floor" => "sonar.noise",
        "sonar.noise.per_metre" => "sonar.noise_per_metre",
        same => same,
    }
}

fn quantity(table: &Table<'_>, key: &str, dimension: &Dimension) -> Result<f32, FileError> {
    Ok(single(table.require(key)?.quantity(dimension)?))
}

fn fraction(table: &Table<'_>, key: &str) -> Result<f32, FileError> {
    Ok(single(table.require(key)?.fraction()?))
}

fn read_drive(table: &Table<'_>) -> Result<Drive, FileError> {
    let wheel_noise = quantity(table, "wheel_noise", &LENGTH_WALK)?;
    let track_width_walk = quantity(table, "track_width_walk", &LENGTH_WALK)?;
    Ok(Drive {
        track_width: Metres(quantity(table, "track_width", &LENGTH)?),
        wheel_noise: PerRootMetre(Metres(wheel_noise)),
        scale_walk: PerRootMetre(quantity(table, "scale_walk", &SCALE_WALK)?),
        track_width_walk: PerRootMetre(Metres(track_width_walk)),
    })
}

fn read_sonar(table: &Table<'_>) -> Result<Sonar, FileError> {
    let [ahead, left] = pair(table, "mount", &LENGTH)?;
    let [rightmost, leftmost] = pair(table, "servo", &ANGLE)?;
    Ok(Sonar {
        mount: Point::new(ahead, left),
        servo: (Radians(rightmost), Radians(leftmost)),
        cone: Radians(quantity(table, "cone", &ANGLE)?),
        min_range: Metres(quantity(table, "min_range", &LENGTH)?),
        max_range: Metres(quantity(table, "max_range", &LENGTH)?),
        noise: RangeNoise {
            floor: Metres(quantity(table, "noise", &LENGTH)?),
            per_metre: quantity(table, "noise_per_metre", &LENGTH_PER_LENGTH)?,
        },
        timing: Timing {
            rhythm: read_rhythm(&table.require("fix_period")?)?,
            servo: table.get("servo_pace").map_or(Ok(Pace::INSTANT), read_pace)?,
            cycle: table.get("cycle").map_or(Ok(Duration::micros(0)), |node| span(&node))?,
        },
    })
}

fn pair(table: &Table<'_>, key: &str, dimension: &Dimension) -> Result<[f32; 2], FileError> {
    let [first, second] = table.require(key)?.pair()?;
    let value = |node: Node<'_>| node.quantity(dimension).map(single);
    Ok([value(first)?, value(second)?])
}

fn read_prior(robot: &Table<'_>) -> Result<CalibrationPrior, FileError> {
    let keys = ["scale_right", "scale_left", "track_width", "range_scale"];
    let table = robot.table("prior", &keys)?;
    Ok(CalibrationPrior {
        scale_right: fraction(&table, "scale_right")?,
        scale_left: fraction(&table, "scale_left")?,
        track_width: Metres(quantity(&table, "track_width", &LENGTH)?),
        range_scale: fraction(&table, "range_scale")?,
    })
}

fn read_trust(robot: &Table<'_>) -> Result<Trust, FileError> {
    let keys = ["gate", "confidence", "outer_gate", "short", "reopen", "stale", "doubtful"];
    let table = robot.table("trust", &keys)?;
    let number = |node: Node<'_>| node.number().map(single);
    let length = |node: Node<'_>| node.quantity(&LENGTH).map(single).map(Metres);
    let default = Trust::default();
    Ok(Trust {
        gate: number(table.require("gate")?)?,
        confidence: number(table.require("confidence")?)?,
        outer_gate: table.get("outer_gate").map_or(Ok(default.outer_gate), number)?,
        short: table.get("short").map_or(Ok(default.short), number)?,
        reopen: table.get("reopen").map_or(Ok(default.reopen), length)?,
        stale: table.get("stale").map_or(Ok(default.stale), length)?,
        doubtful: table.get("doubtful").map_or(Ok(default.doubtful), length)?,
    })
}

const SCHEDULE_KEYS: [&str; 3] = ["policy", "heading_weight", "wheels_weight"];

fn read_policy(robot: &Table<'_>) -> Result<Policy, FileError> {
    let policy = robot.table("schedule", &SCHEDULE_KEYS)?.require("policy")?;
    match policy.text()? {
        "nearest" => Ok(Policy::Nearest),
        "informative" => Ok(Policy::Informative),
        _ => Err(policy.error("must be \"nearest\" or \"informative\"")),
    }
}

/// What is missing weighs nothing.
fn read_weights(robot: &Table<'_>) -> Result<Weights, FileError> {
    let table = robot.table("schedule", &SCHEDULE_KEYS)?;
    let weight = |key| {
        let metres = table.get(key).map(|node| node.deviation(&LENGTH)).transpose()?;
        Ok(Metres(metres.map_or(0.0, single)))
    };
    Ok(Weights { heading: weight("heading_weight")?, wheels: weight("wheels_weight")? })
}

fn read_rhythm(node: &Node<'_>) -> Result<Rhythm, FileError> {
    if node.as_text() == Some(AS_FAST_AS_POSSIBLE) {
        return Ok(Rhythm::AsFastAsPossible);
    }
    Ok(Rhythm::Every(period(node)?))
}

/// A servo by its name, or by its times.
fn read_pace(node: Node<'_>) -> Result<Pace, FileError> {
    match node.as_text() {
        Some("instant") => return Ok(Pace::INSTANT),
        Some("sg90") => return Ok(Pace::SG90),
        Some("mg996r") => return Ok(Pace::MG996R),
        Some(_) => {
            let known = "must be \"instant\", \"sg90\", \"mg996r\", or a table of its times";
            return Err(node.error(known));
        }
        None => {}
    }
    let table = node.table(&["frame", "sixty_degrees", "settle"])?;
    let time = |key| span(&table.require(key)?);
    Ok(Pace {
        frame: time("frame")?,
        sixty_degrees: time("sixty_degrees")?,
        settle: time("settle")?,
    })
}

/// What stands for the fix period of a sonar that is never kept waiting.
const AS_FAST_AS_POSSIBLE: &str = "as fast as possible";

const LONGEST: f64 = 3600.0;

/// A period: a span that is not zero.
fn period(node: &Node<'_>) -> Result<Duration, FileError> {
    const SHORTEST: f64 = 1e-6;
    let seconds = node.quantity(&TIME)?;
    node.check(seconds, (SHORTEST..=LONGEST).contains(&seconds), "from 1 us to 1 hour")?;
    span(node)
}

/// A span in whole microseconds: the tick of the localizer's time.
fn span(node: &Node<'_>) -> Result<Duration, FileError> {
    let seconds = node.quantity(&TIME)?;
    let seconds = node.check(seconds, (0.0..=LONGEST).contains(&seconds), "from 0 s to 1 hour")?;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "rounded, and between 0 and 3.6e9"
    )]
    let microseconds = (seconds * 1e6).round() as u64;
    Ok(Duration::micros(microseconds))
}

fn per_tick(node: Node<'_>) -> Result<WheelTravel, FileError> {
    let table = node.table(&["right", "left"])?;
    let travel = |key| {
        let node = table.require(key)?;
        let travel = single(node.quantity(&LENGTH)?);
        node.check(travel, travel.is_normal(), "a length that is not zero")
    };
    Ok(WheelTravel::new(travel("right")?, travel("left")?))
}
