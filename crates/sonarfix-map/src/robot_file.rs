//! Reads robot files into the [`RobotConfig`] of loop, drivers, planner, simulator and replay.

use std::path::Path;

use sonarfix::aim::Policy;
use sonarfix::config::{
    CalibrationPrior, Config, Further, GatingParameters, MAX_RANGERS, PingSchedule, PingTiming,
    ServoTiming, Sonar,
};
use sonarfix::filter::motion::Drive;
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::{Duration, Metres, MetresPerSecond, PerRootMetre, Radians};
use sonarfix::sensor::echo::EchoParameters;
use sonarfix::sensor::range::RangeNoise;

use sonarfix_hal::config::{
    MotorPolicy, RangerConfig, RobotConfig, RobotConfigError, StartPose, WheelConfig,
};
use sonarfix_hal::servo::MeasuredPulse;
use sonarfix_search::search::Region;

use crate::document::{Document, Node, Table};
use crate::error::FileError;
use crate::quantity::{
    ANGLE, Dimension, LENGTH, LENGTH_PER_LENGTH, LENGTH_WALK, SCALE_WALK, SPEED,
};
use crate::ranger_file::Ranger;
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

const SONAR_KEYS: [&str; 15] = [
    "mount",
    "bearing",
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
    "beam",
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
    let (sonar, further) = sonar_tables(robot);
    let ranger = ranger_file::read(&sonar);
    let mut localizer = Config::for_track_width(Metres(quantity(&drive, "track_width", &LENGTH)));
    localizer.drive = read_drive(&drive, localizer.drive.track_width);
    localizer.max_wheel_speed = MetresPerSecond(quantity(&drive, "max_wheel_speed", &SPEED));
    let schedule = read_ping_schedule(&sonar.require("fix_period"));
    read_sonar(&sonar, &ranger, schedule, &mut localizer.sonar);
    read_prior(robot, &mut localizer.prior);
    read_gating(robot, &mut localizer.gating);
    read_echo(robot, &mut localizer.echo);
    read_schedule(robot, &mut localizer);
    localizer.gyro = gyro_file::read(robot);
    let mut config = RobotConfig {
        localizer,
        right_wheel: read_wheel(drive.require("right_wheel")),
        left_wheel: read_wheel(drive.require("left_wheel")),
        encoder_period: drive.require("encoder_period").period(),
        ranger: RangerConfig {
            servo_pulses: read_pulses(&sonar, &localizer.sonar),
            ..ranger.config
        },
        motors: read_motors(robot),
        start: read_start(robot),
        further_rangers: Further::NONE,
    };
    if robot.mistakes() == mistakes
        && let Err(error) = config.check()
    {
        let (key, message) = (key_of(error), format!("must be {}", error.rule));
        match key.strip_prefix("sonar.") {
            Some(key) => sonar.report_at(key, message),
            None => robot.report_at(key, message),
        }
    }
    let alone = config;
    for table in &further {
        let (sonar, ranger) = read_further(table, &alone);
        // Too many are a mistake that has been reported.
        _ = config.localizer.further_sonars.push(sonar);
        _ = config.further_rangers.push(ranger);
    }
    if robot.mistakes() == mistakes && config.start.is_unknown() && !config.motors.lost {
        robot.report_at("motors.lost", SEARCH_STOPPED);
    }
    config
}

/// The table `[sonar]`, or the first of the tables `[[sonar]]` and the others.
fn sonar_tables<'a>(robot: &Table<'a>) -> (Table<'a>, Vec<Table<'a>>) {
    let node = robot.require("sonar");
    if !node.is_array() {
        return (node.table(&SONAR_KEYS), Vec::new());
    }
    let mut items = node.items().into_iter();
    if !(1..=MAX_RANGERS).contains(&items.len()) {
        node.report(format!("must be 1 to {MAX_RANGERS} tables"));
    }
    let first = items.next().unwrap_or(node).table(&SONAR_KEYS);
    (first, items.map(|item| item.table(&SONAR_KEYS)).collect())
}

/// A ranger beside the first one of this robot, with which it shares the air and the ping schedule.
fn read_further(table: &Table<'_>, robot: &RobotConfig) -> (Sonar, RangerConfig) {
    let mistakes = table.mistakes();
    for shared in ["fix_period", "temperature"] {
        if let Some(node) = table.get(shared) {
            node.report("is one for all sonars: write it in the first only");
        }
    }
    let ranger = ranger_file::read(table);
    let mut sonar = robot.localizer.sonar;
    read_sonar(table, &ranger, sonar.timing.schedule, &mut sonar);
    let temperature = robot.ranger.temperature;
    let servo_pulses = read_pulses(table, &sonar);
    let ranger = RangerConfig { temperature, servo_pulses, ..ranger.config };
    // The same rules as for the only one.
    let mut alone = RobotConfig { ranger, ..*robot };
    alone.localizer.sonar = sonar;
    if table.mistakes() == mistakes
        && robot.check().is_ok()
        && let Err(error) = alone.check()
    {
        let key = key_of(error);
        table.report_at(
            key.strip_prefix("sonar.").unwrap_or(key),
            format!("must be {}", error.rule),
        );
    }
    (sonar, ranger)
}

/// Why a robot that searches for its pose must be able to drive while it is lost.
const SEARCH_STOPPED: &str = "must be \"on\" with start = \"unknown\": a robot finds its pose while it drives, and is lost until \
     then; write \"on\", or start = \"known\"";

/// The position in the file of a field that a check refused.
fn key_of(error: RobotConfigError) -> &'static str {
    match error.field {
        "max_wheel_speed" => "drive.max_wheel_speed",
        "sonar.ranging.spot" => "sonar.beam.spot",
        "sonar.ranging.pointing" => "sonar.beam.pointing",
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

fn read_sonar(table: &Table<'_>, ranger: &Ranger, schedule: PingSchedule, sonar: &mut Sonar) {
    let [ahead, left] = pair(table, "mount", &LENGTH);
    sonar.mount = Point::new(ahead, left);
    let fixed = read_fixed_bearing(table);
    sonar.servo = fixed.map_or_else(|| read_limits(table), |bearing| (bearing, bearing));
    sonar.cone = Radians(quantity(table, "cone", &ANGLE));
    sonar.min_range = Metres(quantity(table, "min_range", &LENGTH));
    sonar.max_range = Metres(quantity(table, "max_range", &LENGTH));
    sonar.noise = RangeNoise {
        floor: Metres(quantity(table, "noise", &LENGTH)),
        per_metre: quantity(table, "noise_per_metre", &LENGTH_PER_LENGTH),
    };
    sonar.timing = PingTiming {
        schedule,
        servo: match fixed {
            None => read_timing(table.require("servo_timing")),
            Some(_) => ServoTiming::INSTANT,
        },
        cycle: ranger.cycle,
    };
    sonar.ranging = ranger.ranging;
}

/// The bearing of a sonar without a servo.
fn read_fixed_bearing(table: &Table<'_>) -> Option<Radians> {
    let node = table.get("bearing")?;
    for of_servo in ["servo", "servo_pulses", "servo_timing"] {
        if let Some(node) = table.get(of_servo) {
            node.report(
                "is of a sonar on a servo, and `bearing` of one without: remove one of them",
            );
        }
    }
    let bearing = Radians(single(node.quantity(&ANGLE)));
    Some(node.check(bearing, bearing.abs().0 <= core::f32::consts::PI, "within ±180°"))
}

/// The limits of a servo, which turns: those of a sonar without a servo are no limits.
fn read_limits(table: &Table<'_>) -> (Radians, Radians) {
    let [rightmost, leftmost] = pair(table, "servo", &ANGLE);
    if table.get("servo").is_some() && rightmost.to_bits() == leftmost.to_bits() {
        let message =
            "must be a rightmost below a leftmost bearing: a sonar without a servo has `bearing`";
        table.report_at("servo", message);
    }
    (Radians(rightmost), Radians(leftmost))
}

fn pair(table: &Table<'_>, key: &str, dimension: &Dimension) -> [f32; 2] {
    table.require(key).pair().map(|node| single(node.quantity(dimension)))
}

fn read_prior(robot: &Table<'_>, prior: &mut CalibrationPrior) {
    let keys = ["scale_right", "scale_left", "scale_difference", "track_width", "range_scale"];
    let table = robot.table("prior", &keys);
    prior.scale_right = fraction(&table, "scale_right");
    prior.scale_left = fraction(&table, "scale_left");
    prior.scale_difference =
        table.get("scale_difference").map(|_| fraction(&table, "scale_difference"));
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

const ECHO_KEYS: [&str; 10] = [
    "sensor",
    "missed",
    "short",
    "long",
    "free_path",
    "map_accuracy",
    "late",
    "late_per_radian",
    "half_angle",
    "rim",
];

/// The parameters of a known sensor, that of an HC-SR04 if none is named, or keys of their own.
fn read_echo(robot: &Table<'_>, echo: &mut EchoParameters) {
    let Some(node) = robot.get("echo") else {
        return;
    };
    let table = node.table(&ECHO_KEYS);
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
    replace(&table, "late", &mut echo.late, length);
    replace(&table, "late_per_radian", &mut echo.late_per_radian, length);
    let angle = |node: Node<'_>| Radians(single(node.quantity(&ANGLE)));
    replace(&table, "half_angle", &mut echo.half_angle, angle);
    replace(&table, "rim", &mut echo.rim, angle);
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

fn read_pulses(table: &Table<'_>, sonar: &Sonar) -> [MeasuredPulse; 2] {
    if sonar.fixed_bearing().is_some() {
        return RangerConfig::NO_PULSES;
    }
    table.require("servo_pulses").pair().map(|node| {
        let pulse = node.table(&["width", "bearing"]);
        let bearing = Radians(quantity(&pulse, "bearing", &ANGLE));
        MeasuredPulse { width: pulse.require("width").span(), bearing }
    })
}
