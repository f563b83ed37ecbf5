//! Reads robot files into the [`RobotConfig`] of loop, drivers, planner, simulator and replay.

use std::path::Path;

use sonarfix::aim::Policy;
use sonarfix::config::{
    CalibrationPrior, Config, GatingParameters, PingSchedule, PingTiming, ServoTiming, Sonar,
    Weights,
};
use sonarfix::echo::EchoParameters;
use sonarfix::motion::Drive;
use sonarfix::pose::Point;
use sonarfix::range::RangeNoise;
use sonarfix::units::{Duration, Metres, MetresPerSecond, PerRootMetre, Radians};

use sonarfix::search::Region;
use sonarfix_hal::config::{MotorPolicy, RobotConfig, RobotConfigError, StartPose, WheelConfig};
use sonarfix_hal::servo::MeasuredPulse;

use crate::document::{Document, Node, Table};
use crate::error::FileError;
use crate::quantity::{
    ANGLE, Dimension, LENGTH, LENGTH_PER_LENGTH, LENGTH_WALK, SCALE_WALK, SPEED,
};
use crate::{file, ranger_file, single};

const KEYS: [&str; 9] =
    ["start", "start_region", "drive", "sonar", "prior", "gating", "echo", "schedule", "motors"];

const DRIVE_KEYS: [&str; 8] = [
    "track_width",
    "wheel_noise",
    "scale_walk",
    "track_width_walk",
    "max_wheel_speed",
    "encoder_period",
    "right_wheel",
    "left_wheel",
];

const SONAR_KEYS: [&str; 13] = [
    "mount",
    "servo",
    "servo_pulses",
    "servo_timing",
    "cone",
    "min_range",
    "max_range",
    "noise",
    "noise_per_metre",
    "fix_period",
    "ranger",
    "temperature",
    "cycle",
];

/// A servo that turns instantly, with the frame of a digital one: `servo_timing = "instant"`.
pub const INSTANT_SERVO: ServoTiming = ServoTiming {
    frame: Duration::from_ticks(1_000),
    sixty_degrees: Duration::from_ticks(0),
    settle: Duration::from_ticks(0),
};

/// Reads a robot file.
///
/// # Errors
/// [`FileError`] with the first error.
pub fn read(path: &Path) -> Result<RobotConfig, FileError> {
    parse(&file::read(path)?, &file::name(path))
}

/// Parses the text of a robot file. Errors name it `file_name`.
///
/// # Errors
/// [`FileError`] with the first error.
pub fn parse(text: &str, file_name: &str) -> Result<RobotConfig, FileError> {
    let document = Document::parse(text, file_name)?;
    from_table(&document.root(&KEYS)?)
}

/// Reads a `[robot]` table.
pub(crate) fn from_node(node: Node<'_>) -> Result<RobotConfig, FileError> {
    from_table(&node.table(&KEYS)?)
}

fn from_table(robot: &Table<'_>) -> Result<RobotConfig, FileError> {
    let drive = robot.table("drive", &DRIVE_KEYS)?;
    let sonar = robot.table("sonar", &SONAR_KEYS)?;
    let ranger = ranger_file::read(&sonar)?;
    let mut localizer = Config::for_track_width(Metres(quantity(&drive, "track_width", &LENGTH)?));
    localizer.drive = read_drive(&drive)?;
    localizer.max_wheel_speed = MetresPerSecond(quantity(&drive, "max_wheel_speed", &SPEED)?);
    read_sonar(&sonar, ranger.cycle, &mut localizer.sonar)?;
    read_prior(robot, &mut localizer.prior)?;
    read_gating(robot, &mut localizer.gating)?;
    read_echo(robot, &mut localizer.echo)?;
    localizer.policy = read_policy(robot)?;
    read_weights(robot, &mut localizer.weights)?;
    let config = RobotConfig {
        localizer,
        right_wheel: read_wheel(drive.require("right_wheel")?)?,
        left_wheel: read_wheel(drive.require("left_wheel")?)?,
        encoder_period: drive.require("encoder_period")?.period()?,
        servo_pulses: read_pulses(&sonar)?,
        ranger: ranger.config,
        motors: read_motors(robot)?,
        start: read_start(robot)?,
    };
    config.check().map_err(|error| {
        let message = format!("must be {}", error.rule);
        robot.error_at(key_of(error), message)
    })?;
    Ok(config)
}

/// The position in the file of a field that a check refused.
fn key_of(error: RobotConfigError) -> &'static str {
    match error.field {
        "max_wheel_speed" => "drive.max_wheel_speed",
        "sonar.noise.floor" => "sonar.noise",
        "sonar.noise.per_metre" => "sonar.noise_per_metre",
        "right_wheel.travel_per_edge" => "drive.right_wheel",
        "left_wheel.travel_per_edge" => "drive.left_wheel",
        "encoder_period" => "drive.encoder_period",
        "servo_pulses" => "sonar.servo_pulses",
        "ranger.temperature" => "sonar.temperature",
        "start.region" => "start_region",
        same => same,
    }
}

/// A missing key means that the pose must be known.
fn read_start(robot: &Table<'_>) -> Result<StartPose, FileError> {
    let region = robot.get("start_region");
    let is_unknown = match robot.get("start") {
        None => false,
        Some(node) => match node.text()? {
            "known" => false,
            "unknown" => true,
            _ => return Err(node.error("must be \"known\" or \"unknown\"")),
        },
    };
    if !is_unknown {
        return match region {
            Some(region) => Err(region.error("needs start = \"unknown\"")),
            None => Ok(StartPose::Known),
        };
    }
    let region = match region {
        None => None,
        Some(node) => {
            let table = node.table(&["from", "to"])?;
            let corner = |key| pair(&table, key, &LENGTH).map(|[x, y]| Point::new(x, y));
            Some(Region { from: corner("from")?, to: corner("to")? })
        }
    };
    Ok(StartPose::Unknown { region })
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

fn read_sonar(table: &Table<'_>, cycle: Duration, sonar: &mut Sonar) -> Result<(), FileError> {
    let [ahead, left] = pair(table, "mount", &LENGTH)?;
    sonar.mount = Point::new(ahead, left);
    let [rightmost, leftmost] = pair(table, "servo", &ANGLE)?;
    sonar.servo = (Radians(rightmost), Radians(leftmost));
    sonar.cone = Radians(quantity(table, "cone", &ANGLE)?);
    sonar.min_range = Metres(quantity(table, "min_range", &LENGTH)?);
    sonar.max_range = Metres(quantity(table, "max_range", &LENGTH)?);
    sonar.noise = RangeNoise {
        floor: Metres(quantity(table, "noise", &LENGTH)?),
        per_metre: quantity(table, "noise_per_metre", &LENGTH_PER_LENGTH)?,
    };
    sonar.timing = PingTiming {
        schedule: read_ping_schedule(&table.require("fix_period")?)?,
        servo: read_timing(table.require("servo_timing")?)?,
        cycle,
    };
    Ok(())
}

fn pair(table: &Table<'_>, key: &str, dimension: &Dimension) -> Result<[f32; 2], FileError> {
    let [first, second] = table.require(key)?.pair()?;
    let value = |node: Node<'_>| node.quantity(dimension).map(single);
    Ok([value(first)?, value(second)?])
}

fn read_prior(robot: &Table<'_>, prior: &mut CalibrationPrior) -> Result<(), FileError> {
    let keys = ["scale_right", "scale_left", "track_width", "range_scale"];
    let table = robot.table("prior", &keys)?;
    prior.scale_right = fraction(&table, "scale_right")?;
    prior.scale_left = fraction(&table, "scale_left")?;
    prior.track_width = Metres(quantity(&table, "track_width", &LENGTH)?);
    prior.range_scale = fraction(&table, "range_scale")?;
    Ok(())
}

/// Optional keys keep the defaults.
fn read_gating(robot: &Table<'_>, gating: &mut GatingParameters) -> Result<(), FileError> {
    let keys = ["confidence", "inflation", "max_distance_without_fix", "max_position_deviation"];
    let table = robot.table("gating", &keys)?;
    let number = |node: Node<'_>| node.number().map(single);
    gating.confidence = number(table.require("confidence")?)?;
    let length = |node: Node<'_>| node.quantity(&LENGTH).map(single).map(Metres);
    let optional_length = |key, value: &mut Metres| -> Result<(), FileError> {
        *value = table.get(key).map_or(Ok(*value), length)?;
        Ok(())
    };
    optional_length("inflation", &mut gating.inflation)?;
    optional_length("max_distance_without_fix", &mut gating.max_distance_without_fix)?;
    optional_length("max_position_deviation", &mut gating.max_position_deviation)
}

/// The parameters of a known sensor, that of an HC-SR04 if none is named, or keys of their own.
fn read_echo(robot: &Table<'_>, echo: &mut EchoParameters) -> Result<(), FileError> {
    let Some(node) = robot.get("echo") else {
        return Ok(());
    };
    let table = node.table(&["sensor", "missed", "short", "long", "free_path", "map_accuracy"])?;
    if let Some(sensor) = table.get("sensor") {
        *echo = read_sensor(&sensor)?;
    }
    let share = |key, value: &mut f32| -> Result<(), FileError> {
        *value = table.get(key).map_or(Ok(*value), |node| node.fraction().map(single))?;
        Ok(())
    };
    share("missed", &mut echo.missed)?;
    share("short", &mut echo.short)?;
    share("long", &mut echo.long)?;
    let length = |key, value: &mut Metres| -> Result<(), FileError> {
        let metres = table.get(key).map(|node| node.deviation(&LENGTH)).transpose()?;
        *value = metres.map_or(*value, |metres| Metres(single(metres)));
        Ok(())
    };
    length("free_path", &mut echo.free_path)?;
    length("map_accuracy", &mut echo.map_accuracy)
}

fn read_sensor(node: &Node<'_>) -> Result<EchoParameters, FileError> {
    match node.text()? {
        "ideal" => Ok(EchoParameters::NONE),
        "hc_sr04" => Ok(EchoParameters::HC_SR04),
        "nxt" => Ok(EchoParameters::NXT),
        "srf08" => Ok(EchoParameters::SRF08),
        "lv_maxsonar" => Ok(EchoParameters::LV_MAXSONAR),
        "polaroid_6500" => Ok(EchoParameters::POLAROID_6500),
        _ => Err(node.error(
            "must be \"ideal\", \"hc_sr04\", \"nxt\", \"srf08\", \"lv_maxsonar\" or \"polaroid_6500\"",
        )),
    }
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

/// A missing weight is zero.
fn read_weights(robot: &Table<'_>, weights: &mut Weights) -> Result<(), FileError> {
    let table = robot.table("schedule", &SCHEDULE_KEYS)?;
    let weight = |key| {
        let metres = table.get(key).map(|node| node.deviation(&LENGTH)).transpose()?;
        Ok(Metres(metres.map_or(0.0, single)))
    };
    weights.heading = weight("heading_weight")?;
    weights.wheels = weight("wheels_weight")?;
    Ok(())
}

fn read_ping_schedule(node: &Node<'_>) -> Result<PingSchedule, FileError> {
    if node.as_text() == Some(AS_FAST_AS_POSSIBLE) {
        return Ok(PingSchedule::AsFastAsPossible);
    }
    Ok(PingSchedule::Every(node.period()?))
}

/// A servo by its name, or by its times.
fn read_timing(node: Node<'_>) -> Result<ServoTiming, FileError> {
    match node.as_text() {
        Some("instant") => return Ok(INSTANT_SERVO),
        Some("sg90") => return Ok(ServoTiming::SG90),
        Some("mg996r") => return Ok(ServoTiming::MG996R),
        Some(_) => {
            let known = "must be \"instant\", \"sg90\", \"mg996r\", or a table of its times";
            return Err(node.error(known));
        }
        None => {}
    }
    let table = node.table(&["frame", "sixty_degrees", "settle"])?;
    let time = |key| table.require(key)?.span();
    Ok(ServoTiming {
        frame: time("frame")?,
        sixty_degrees: time("sixty_degrees")?,
        settle: time("settle")?,
    })
}

/// The fix period of a sonar that pings as fast as possible.
const AS_FAST_AS_POSSIBLE: &str = "as fast as possible";

/// A wheel: by its diameter and the edges per revolution of its encoder, or by its travel per edge.
fn read_wheel(node: Node<'_>) -> Result<WheelConfig, FileError> {
    let table = node.table(&["diameter", "edges_per_revolution", "travel_per_edge", "mirrored"])?;
    let positive = |node: &Node<'_>, value: f64, what: &str| {
        let value = single(value);
        node.check(value, value > 0.0 && value.is_finite(), what)
    };
    let length = |node: &Node<'_>| positive(node, node.quantity(&LENGTH)?, "a positive length");
    let wheel = if let Some(travel) = table.get("travel_per_edge") {
        if let Some(other) = table.get("diameter").or(table.get("edges_per_revolution")) {
            return Err(other.error("contradicts travel_per_edge: remove one of them"));
        }
        WheelConfig { travel_per_edge: Metres(length(&travel)?), is_mirrored: false }
    } else {
        let edges = table.require("edges_per_revolution")?;
        let edges = positive(&edges, edges.number()?, "a positive number")?;
        WheelConfig::of_diameter(Metres(length(&table.require("diameter")?)?), edges)
    };
    let mirrored = table.get("mirrored").map(|node| node.boolean()).transpose()?.unwrap_or(false);
    Ok(if mirrored { wheel.mirrored() } else { wheel })
}

/// Missing keys keep the defaults.
fn read_motors(robot: &Table<'_>) -> Result<MotorPolicy, FileError> {
    let mut motors = MotorPolicy::DEFAULT;
    let Some(node) = robot.get("motors") else { return Ok(motors) };
    let table = node.table(&["lost", "dead_encoder", "lost_link", "link_timeout"])?;
    for (key, is_on) in [
        ("lost", &mut motors.lost),
        ("dead_encoder", &mut motors.dead_encoder),
        ("lost_link", &mut motors.lost_link),
    ] {
        let Some(node) = table.get(key) else { continue };
        *is_on = match node.text()? {
            "on" => true,
            "off" => false,
            _ => return Err(node.error("must be \"on\" or \"off\"")),
        };
    }
    if let Some(node) = table.get("link_timeout") {
        motors.link_timeout = node.period()?;
    }
    Ok(motors)
}

fn read_pulses(sonar: &Table<'_>) -> Result<[MeasuredPulse; 2], FileError> {
    let [one, other] = sonar.require("servo_pulses")?.pair()?;
    let pulse = |node: Node<'_>| {
        let table = node.table(&["width", "bearing"])?;
        let bearing = Radians(quantity(&table, "bearing", &ANGLE)?);
        Ok(MeasuredPulse { width: table.require("width")?.span()?, bearing })
    };
    Ok([pulse(one)?, pulse(other)?])
}
