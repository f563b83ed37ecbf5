//! Reads robot files into the [`RobotConfig`] of loop, drivers, planner, simulator and replay.

use std::path::Path;

use sonarfix::aim::Policy;
use sonarfix::config::{
    CalibrationPrior, Config, GatingParameters, PingSchedule, PingTiming, ServoTiming, Sonar,
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
use crate::spelling::alternatives;
use crate::{file, gyro_file, ranger_file, single, sonar_model};

const KEYS: [&str; 10] = [
    "start",
    "start_region",
    "drive",
    "sonar",
    "prior",
    "gating",
    "echo",
    "schedule",
    "motors",
    "gyro",
];

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

/// Names of servos.
const SERVOS: [(&str, ServoTiming); 3] =
    [("instant", INSTANT_SERVO), ("sg90", ServoTiming::SG90), ("mg996r", ServoTiming::MG996R)];

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
    Document::parse(text, file_name)?.read(&KEYS, |root| Some(from_table(root)))
}

/// Reads a `[robot]` table.
pub(crate) fn from_node(node: Node<'_>) -> RobotConfig {
    from_table(&node.table(&KEYS))
}

fn from_table(robot: &Table<'_>) -> RobotConfig {
    let mistakes = robot.mistakes();
    let drive = robot.table("drive", &DRIVE_KEYS);
    let sonar = robot.table("sonar", &SONAR_KEYS);
    let ranger = ranger_file::read(&sonar);
    let mut localizer = Config::for_track_width(Metres(quantity(&drive, "track_width", &LENGTH)));
    localizer.drive = read_drive(&drive, localizer.drive.track_width);
    localizer.max_wheel_speed = MetresPerSecond(quantity(&drive, "max_wheel_speed", &SPEED));
    read_sonar(&sonar, ranger.cycle, &mut localizer.sonar);
    read_prior(robot, &mut localizer.prior);
    read_gating(robot, &mut localizer.gating);
    read_echo(robot, &mut localizer.echo);
    read_schedule(robot, &mut localizer);
    localizer.gyro = gyro_file::read(robot);
    let config = RobotConfig {
        localizer,
        right_wheel: read_wheel(drive.require("right_wheel")),
        left_wheel: read_wheel(drive.require("left_wheel")),
        encoder_period: drive.require("encoder_period").period(),
        servo_pulses: read_pulses(&sonar),
        ranger: ranger.config,
        motors: read_motors(robot),
        start: read_start(robot),
    };
    if robot.mistakes() == mistakes
        && let Err(error) = config.check()
    {
        robot.report_at(key_of(error), format!("must be {}", error.rule));
    }
    if robot.mistakes() == mistakes && config.start.is_unknown() && !config.motors.lost {
        robot.report_at("motors.lost", SEARCH_STOPPED);
    }
    config
}

/// Why a robot that searches for its pose must be able to drive while it is lost.
const SEARCH_STOPPED: &str = "must be \"on\" with start = \"unknown\": a robot finds its pose while it drives, and is lost until \
     then; write \"on\", or start = \"known\"";

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
fn read_start(robot: &Table<'_>) -> StartPose {
    let is_unknown = robot
        .get("start")
        .is_some_and(|node| node.one_of(&[("known", false), ("unknown", true)], false));
    let region = robot.get("start_region");
    if !is_unknown {
        if let Some(region) = region {
            region.report("needs start = \"unknown\"");
        }
        return StartPose::Known;
    }
    let region = region.map(|node| {
        let table = node.table(&["from", "to"]);
        let corner = |key| {
            let [x, y] = pair(&table, key, &LENGTH);
            Point::new(x, y)
        };
        Region { from: corner("from"), to: corner("to") }
    });
    StartPose::Unknown { region }
}

fn quantity(table: &Table<'_>, key: &str, dimension: &Dimension) -> f32 {
    single(table.require(key).quantity(dimension))
}

fn fraction(table: &Table<'_>, key: &str) -> f32 {
    single(table.require(key).fraction())
}

/// Replaces a value by that of an optional key.
fn replace<T>(table: &Table<'_>, key: &str, value: &mut T, read: impl Fn(Node<'_>) -> T) {
    if let Some(node) = table.get(key) {
        *value = read(node);
    }
}

fn read_drive(table: &Table<'_>, track_width: Metres) -> Drive {
    Drive {
        track_width,
        wheel_noise: PerRootMetre(Metres(quantity(table, "wheel_noise", &LENGTH_WALK))),
        scale_walk: PerRootMetre(quantity(table, "scale_walk", &SCALE_WALK)),
        track_width_walk: PerRootMetre(Metres(quantity(table, "track_width_walk", &LENGTH_WALK))),
    }
}

fn read_sonar(table: &Table<'_>, cycle: Duration, sonar: &mut Sonar) {
    let [ahead, left] = pair(table, "mount", &LENGTH);
    sonar.mount = Point::new(ahead, left);
    let [rightmost, leftmost] = pair(table, "servo", &ANGLE);
    sonar.servo = (Radians(rightmost), Radians(leftmost));
    sonar.cone = Radians(quantity(table, "cone", &ANGLE));
    sonar.min_range = Metres(quantity(table, "min_range", &LENGTH));
    sonar.max_range = Metres(quantity(table, "max_range", &LENGTH));
    sonar.noise = RangeNoise {
        floor: Metres(quantity(table, "noise", &LENGTH)),
        per_metre: quantity(table, "noise_per_metre", &LENGTH_PER_LENGTH),
    };
    sonar.timing = PingTiming {
        schedule: read_ping_schedule(&table.require("fix_period")),
        servo: read_timing(table.require("servo_timing")),
        cycle,
    };
}

fn pair(table: &Table<'_>, key: &str, dimension: &Dimension) -> [f32; 2] {
    table.require(key).pair().map(|node| single(node.quantity(dimension)))
}

fn read_prior(robot: &Table<'_>, prior: &mut CalibrationPrior) {
    let keys = ["scale_right", "scale_left", "track_width", "range_scale"];
    let table = robot.table("prior", &keys);
    prior.scale_right = fraction(&table, "scale_right");
    prior.scale_left = fraction(&table, "scale_left");
    prior.track_width = Metres(quantity(&table, "track_width", &LENGTH));
    prior.range_scale = fraction(&table, "range_scale");
}

/// Optional keys keep the defaults.
fn read_gating(robot: &Table<'_>, gating: &mut GatingParameters) {
    let keys = ["confidence", "inflation", "max_distance_without_fix", "max_position_deviation"];
    let table = robot.table("gating", &keys);
    gating.confidence = single(table.require("confidence").number());
    let length = |node: Node<'_>| Metres(single(node.quantity(&LENGTH)));
    replace(&table, "inflation", &mut gating.inflation, length);
    replace(&table, "max_distance_without_fix", &mut gating.max_distance_without_fix, length);
    replace(&table, "max_position_deviation", &mut gating.max_position_deviation, length);
}

/// The parameters of a known sensor, that of an HC-SR04 if none is named, or keys of their own.
fn read_echo(robot: &Table<'_>, echo: &mut EchoParameters) {
    let Some(node) = robot.get("echo") else {
        return;
    };
    let table = node.table(&["sensor", "missed", "short", "long", "free_path", "map_accuracy"]);
    if let Some(sensor) = table.get("sensor") {
        *echo = sonar_model::read(&sensor, &[], *echo, |model| model.echo);
    }
    let share = |node: Node<'_>| single(node.fraction());
    replace(&table, "missed", &mut echo.missed, share);
    replace(&table, "short", &mut echo.short, share);
    replace(&table, "long", &mut echo.long, share);
    let length = |node: Node<'_>| Metres(single(node.deviation(&LENGTH)));
    replace(&table, "free_path", &mut echo.free_path, length);
    replace(&table, "map_accuracy", &mut echo.map_accuracy, length);
}

/// A missing weight is zero.
fn read_schedule(robot: &Table<'_>, localizer: &mut Config) {
    let table = robot.table("schedule", &["policy", "heading_weight", "wheels_weight"]);
    let policies = [("nearest", Policy::Nearest), ("informative", Policy::Informative)];
    localizer.policy = table.require("policy").one_of(&policies, Policy::Nearest);
    let weight = |key| {
        let metres = table.get(key).map_or(0.0, |node| node.deviation(&LENGTH));
        Metres(single(metres))
    };
    localizer.weights.heading = weight("heading_weight");
    localizer.weights.wheels = weight("wheels_weight");
}

fn read_ping_schedule(node: &Node<'_>) -> PingSchedule {
    if node.as_text() == Some(AS_FAST_AS_POSSIBLE) {
        return PingSchedule::AsFastAsPossible;
    }
    PingSchedule::Every(node.period())
}

/// A servo by its name, or by its times.
fn read_timing(node: Node<'_>) -> ServoTiming {
    if let Some(name) = node.as_text() {
        let found = SERVOS.iter().find(|(known, _)| *known == name);
        let Some((_, timing)) = found else {
            let known = alternatives(name, &SERVOS.map(|(known, _)| known));
            node.report(format!("must be {known}, or a table of its times"));
            return INSTANT_SERVO;
        };
        return *timing;
    }
    let table = node.table(&["frame", "sixty_degrees", "settle"]);
    let time = |key| table.require(key).span();
    ServoTiming {
        frame: time("frame"),
        sixty_degrees: time("sixty_degrees"),
        settle: time("settle"),
    }
}

/// The fix period of a sonar that pings as fast as possible.
const AS_FAST_AS_POSSIBLE: &str = "as fast as possible";

/// A wheel: by its diameter and the edges per revolution of its encoder, or by its travel per edge.
fn read_wheel(node: Node<'_>) -> WheelConfig {
    let table = node.table(&["diameter", "edges_per_revolution", "travel_per_edge", "mirrored"]);
    let positive = |node: &Node<'_>, value: f64, what: &str| {
        let value = single(value);
        node.check(value, value > 0.0 && value.is_finite(), what)
    };
    let length = |node: &Node<'_>| positive(node, node.quantity(&LENGTH), "a positive length");
    let wheel = if let Some(travel) = table.get("travel_per_edge") {
        if let Some(other) = table.get("diameter").or(table.get("edges_per_revolution")) {
            other.report("contradicts travel_per_edge: remove one of them");
        }
        WheelConfig { travel_per_edge: Metres(length(&travel)), is_mirrored: false }
    } else {
        let edges = table.require("edges_per_revolution");
        let edges = positive(&edges, edges.number(), "a positive number");
        WheelConfig::of_diameter(Metres(length(&table.require("diameter"))), edges)
    };
    let is_mirrored = table.get("mirrored").is_some_and(|node| node.boolean());
    if is_mirrored { wheel.mirrored() } else { wheel }
}

/// Missing keys keep the defaults.
fn read_motors(robot: &Table<'_>) -> MotorPolicy {
    let mut motors = MotorPolicy::DEFAULT;
    let Some(node) = robot.get("motors") else { return motors };
    let table = node.table(&["lost", "dead_encoder", "lost_link", "link_timeout"]);
    let switch = |node: Node<'_>| node.one_of(&[("on", true), ("off", false)], true);
    replace(&table, "lost", &mut motors.lost, switch);
    replace(&table, "dead_encoder", &mut motors.dead_encoder, switch);
    replace(&table, "lost_link", &mut motors.lost_link, switch);
    replace(&table, "link_timeout", &mut motors.link_timeout, |node| node.period());
    motors
}

fn read_pulses(sonar: &Table<'_>) -> [MeasuredPulse; 2] {
    sonar.require("servo_pulses").pair().map(|node| {
        let table = node.table(&["width", "bearing"]);
        let bearing = Radians(quantity(&table, "bearing", &ANGLE));
        MeasuredPulse { width: table.require("width").span(), bearing }
    })
}
