//! Every error in a file is reported with its file, line and key.

use std::fs;
use std::path::Path;

use proptest::prelude::*;
use sonarfix::config::{LightBeam, PingSchedule, RangerId, Ranging, ServoTiming};
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::{Duration, Metres, Radians};
use sonarfix_hal::config::{
    MotorPolicy, RangerConfig, RobotConfig, SearchMotion, SearchMotionKind, StartPose, WheelConfig,
};
use sonarfix_hal::ranger::{PulseTiming, RangerKind};
use sonarfix_map::{
    CLASSROOM, Fault, FaultKind, Fidelity, FileError, Floor, Follow, Mistake, PAPER, Scenario,
    ServoName, SonarName, Wheel, devices, robot_file, robot_text,
};
use sonarfix_search::search::Region;

fn parse(text: &str) -> Result<Scenario, FileError> {
    Scenario::parse(text, "paper.toml", Path::new(""))
}

/// The line, from 1, of the first `marker` in `text`.
fn line_of(text: &str, marker: &str) -> Option<usize> {
    let at = text.find(marker)?;
    Some(text.get(..at)?.matches('\n').count() + 1)
}

/// The reference scenario with one change, and the expected report.
struct Case {
    /// The replaced text, at its first occurrence.
    old: &'static str,
    new: &'static str,
    /// Text of the reported line, at its first occurrence after the change.
    line: &'static str,
    key: &'static str,
    message: &'static str,
    /// The number of mistakes in all.
    mistakes: usize,
}

impl Case {
    const fn among(self, mistakes: usize) -> Self {
        Self { mistakes, ..self }
    }
}

const fn case(
    old: &'static str,
    new: &'static str,
    line: &'static str,
    key: &'static str,
    message: &'static str,
) -> Case {
    Case { old, new, line, key, message, mistakes: 1 }
}

/// A changed value, reported at its position.
const fn value(
    old: &'static str,
    new: &'static str,
    key: &'static str,
    message: &'static str,
) -> Case {
    case(old, new, new, key, message)
}

const FORMAT: [Case; 9] = [
    value("unit = \"m\"", "unit = \"m", "", "this is not TOML at `"),
    value("name = \"paper\"", "name = ", "", "this is not TOML at `"),
    case(
        "sensor = \"ideal\"",
        "missed = 0\nsensor = \"ideal\"\nmissed = 1",
        "missed = 1",
        "",
        "duplicate key",
    ),
    value("format = 1", "format = 2", "format", "version 2 cannot be read, only version 1"),
    value("format = 1", "format = \"1\"", "format", "must be a whole number"),
    case("format = 1\n", "", "# The ref", "format", "is missing"),
    value(
        "servo =",
        "srvo =",
        "robot.sonar.srvo",
        "unknown key: did you mean `servo`? possible here: mount, bearing, servo",
    ),
    value("[run]", "[ran]", "ran", "unknown key: did you mean `run`? possible here: format, name"),
    value(
        "{ name = \"inner east\",",
        "{ name = \"inner east\", height = 2,",
        "map.wall[4].height",
        "unknown key; possible here: name, from, to",
    ),
];

const MISSING: [Case; 9] = [
    case("[robot.schedule]\npolicy", "# policy", "[robot.drive]", "robot.schedule", "is missing"),
    case("cone = \"15 deg\"", "", "[robot.sonar]", "robot.sonar.cone", "is missing"),
    case("confidence = 3.0", "", "[robot.gating]", "robot.gating.confidence", "is missing"),
    case(
        "[robot.prior]",
        "[robot.sonar.extra]",
        "[robot.sonar.extra]",
        "robot.sonar.extra",
        "unknown key",
    )
    .among(2),
    case("unit = \"m\"     #", "#", "[map]", "map.unit", "is missing"),
    case("unit = \"m\"\nstart", "start", "[path]", "path.unit", "is missing"),
    case("runs = 50", "", "[run]", "run.runs", "is missing"),
    case("name = \"inner west\", ", "", "{ from = [-17, 37]", "map.wall[6].name", "is missing"),
    case("description =", "# description =", "# The ref", "description", "is missing"),
];

const UNITS: [Case; 9] = [
    value(
        "track_width = \"350 mm\"",
        "track_width = 350",
        "robot.drive.track_width",
        "a unit is missing: write \"350 m\" or \"350 cm\" or \"350 mm\"",
    ),
    value(
        "max_range = \"10 m\"",
        "max_range = \"10\"",
        "robot.sonar.max_range",
        "a unit is missing: write \"10 m\"",
    ),
    value(
        "max_range = \"10 m\"",
        "max_range = \"10 s\"",
        "robot.sonar.max_range",
        "\"10 s\" is not a length: write a finite number with a unit (m, cm, mm)",
    ),
    value("speed = \"0.4 m/s\"", "speed = \"0.4 m\"", "path.speed", "is not a speed"),
    value("heading = \"1 mrad\"", "heading = \"1 mm\"", "start.heading", "is not an angle"),
    value(
        "scale_right = \"1 %\"",
        "scale_right = \"1 mm\"",
        "robot.prior.scale_right",
        "is not a fraction",
    ),
    value(
        "noise_per_metre = \"0 mm/m\"",
        "noise_per_metre = \"0 mm\"",
        "robot.sonar.noise_per_metre",
        "is not a length per length",
    ),
    value("unit = \"m\"", "unit = \"ft\"", "map.unit", "must be one of m, cm, mm"),
    value(
        "servo = [\"-180 deg\"",
        "servo = [-180",
        "robot.sonar.servo[0]",
        "a unit is missing: write \"-180 deg\"",
    ),
];

const TYPES: [Case; 10] = [
    value("name = \"paper\"", "name = 1", "name", "must be a string, but this is of type integer"),
    value("drawn = true", "drawn = \"yes\"", "start.drawn", "must be true or false"),
    value("confidence = 3.0", "confidence = \"3\"", "robot.gating.confidence", "must be a number"),
    value("confidence = 3.0", "confidence = nan", "robot.gating.confidence", "must be finite"),
    value("seed = 0", "seed = 0.5", "run.seed", "must be a whole number from 0"),
    value("seed = 0", "seed = -1", "run.seed", "must be a whole number from 0"),
    value("start = [0, 0]", "start = [0]", "path.start", "must be two values, but there are 1"),
    value("start = [0, 0]", "start = 0", "path.start", "must be an array"),
    value("start = [0, 0]", "start = [0, \"0 m\"]", "path.start[1]", "must be a number"),
    value(
        "mount = [\"0 mm\", \"0 mm\"]",
        "mount = \"0 mm\"",
        "robot.sonar.mount",
        "must be an array",
    ),
];

const MAP: [Case; 6] = [
    value("to = [-3, 37]", "to = [-3, 3]", "map.wall[4].to", "the wall has no length"),
    value(
        "name = \"inner west\"",
        "name = \"outer west\", from = [-17, 37], to = [-17, 3] }, #",
        "map.wall[6].name",
        "another wall is already called \"outer west\"",
    ),
    value("name = \"inner west\"", "name = \"\"", "map.wall[6].name", "must be a name"),
    value("from = [-3, 3]", "from = [inf, 3]", "map.wall[4].from[0]", "must be finite"),
    value(
        "from = [-3, 3]",
        "from = [-3, 1e6]",
        "map.wall[4].from",
        "within 8 km of the origin: subtract the same offset",
    ),
    case("wall = [", "wall = []\nignored = [", "ignored", "map.ignored", "unknown key").among(2),
];

/// Every rule of the localizer's own check, at its key in the file.
const CONFIG: [Case; 17] = [
    value(
        "track_width = \"350",
        "track_width = \"0",
        "robot.drive.track_width",
        "must be from 1 cm to 10 m (distance between",
    ),
    value(
        "track_width = \"350 mm",
        "track_width = \"1e60 m",
        "robot.drive.track_width",
        "must be from 1 cm to 10 m (distance between",
    ),
    value(
        "wheel_noise = \"0.5",
        "wheel_noise = \"-1",
        "robot.drive.wheel_noise",
        "must be from 0.001 mm/sqrt(m) to 1 m/sqrt(m)",
    ),
    value(
        "scale_walk = \"5",
        "scale_walk = \"-5",
        "robot.drive.scale_walk",
        "must be from 0 /sqrt(m)",
    ),
    value(
        "track_width_walk = \"5",
        "track_width_walk = \"-5",
        "robot.drive.track_width_walk",
        "must be from 0 m/sqrt(m)",
    ),
    value(
        "max_wheel_speed = \"2",
        "max_wheel_speed = \"0",
        "robot.drive.max_wheel_speed",
        "must be from 1 mm/s to 100 m/s",
    ),
    value("mount = [\"0", "mount = [\"1e60", "robot.sonar.mount[0]", "must be from -10 m to 10 m"),
    value(
        "servo = [\"-180 deg\", \"180",
        "servo = [\"90 deg\", \"-90",
        "robot.sonar.servo",
        "must be a rightmost below a leftmost bearing",
    ),
    value(
        "cone = \"15",
        "cone = \"90",
        "robot.sonar.cone",
        "must be from 0.1 deg to 89 deg (half of the cone",
    ),
    value(
        "min_range = \"5",
        "min_range = \"-5",
        "robot.sonar.min_range",
        "must be from 0 m to 100 m",
    ),
    value(
        "max_range = \"10 m\"",
        "max_range = \"1 cm\"",
        "robot.sonar.max_range",
        "must be greater than sonar.min_range",
    ),
    value("noise = \"2.4", "noise = \"0.0", "robot.sonar.noise", "must be from 0.001 mm to 10 m"),
    value(
        "noise_per_metre = \"0",
        "noise_per_metre = \"-1",
        "robot.sonar.noise_per_metre",
        "must be from 0 mm/m to 1 m/m",
    ),
    value(
        "track_width = \"10",
        "track_width = \"200",
        "robot.prior.track_width",
        "must be less than half the track width",
    ),
    value(
        "scale_left = \"1",
        "scale_left = \"-1",
        "robot.prior.scale_left",
        "must be from 0 % to 100 %",
    ),
    value(
        "sensor = \"ideal\"",
        "missed = 0.6\nshort = 0.5",
        "robot.echo.missed",
        "must be below 1 together with echo.short and echo.long",
    ),
    value(
        "confidence = 3.0",
        "confidence = -3.0",
        "robot.gating.confidence",
        "must be from 0 to 100",
    ),
];

const ROBOT: [Case; 12] = [
    value(
        "encoder_period = \"100",
        "encoder_period = \"0",
        "robot.drive.encoder_period",
        "must be from 1 ms to 1 s (period of the encoder samples)",
    ),
    value(
        "fix_period = \"1 s",
        "fix_period = \"2e4 s",
        "robot.sonar.fix_period",
        "must be from 1 us to 3600 s",
    ),
    value(
        "policy = \"nearest\"",
        "policy = \"best\"",
        "robot.schedule.policy",
        "must be \"nearest\" or \"informative\"",
    ),
    value(
        "right_wheel = { travel_per_edge = \"1 mm\"",
        "right_wheel = { travel_per_edge = \"0 mm\"",
        "robot.drive.right_wheel.travel_per_edge",
        "must be from 0.00001 mm to 1 m",
    ),
    value(
        "left_wheel = {",
        "left_wheel = { diameter = \"65 mm\",",
        "robot.drive.left_wheel.diameter",
        "contradicts travel_per_edge",
    ),
    case(
        "left_wheel = { travel_per_edge = \"1 mm\"",
        "left_wheel = { diameter = \"65 mm\"",
        "left_wheel",
        "robot.drive.left_wheel.edges_per_revolution",
        "is missing",
    ),
    value(
        "servo_pulses = [{ width = \"100 us\", bearing = \"-180",
        "servo_pulses = [{ width = \"900 us\", bearing = \"-180",
        "robot.sonar.servo_pulses",
        "must be two pulses with two bearings",
    ),
    value(
        "servo_pulses = [{ width = \"100 us\", bearing = \"-180",
        "servo_pulses = [{ width = \"100 us\", bearing = \"-90",
        "robot.sonar.servo_pulses",
        "must be within the servo's frame at both limits of the servo",
    ),
    value(
        "ranger = { kind = \"hc_sr04\",",
        "ranger = { kind = \"hc_sr05\",",
        "robot.sonar.ranger.kind",
        "must be \"hc_sr04\", \"lv_maxsonar\", \"srf02\", \"srf08\", \"vl53l1x\", \"vl53l0x\" or \"custom\"; did you mean \"hc_sr04\"?",
    ),
    value(
        "ranger = { kind = \"hc_sr04\",",
        "ranger = { kind = \"srf08\",",
        "robot.sonar.ranger.longest",
        "is no setting of this kind of ranger",
    )
    .among(4),
    value(
        "ranger = { kind = \"hc_sr04\",",
        "ranger = { kind = \"hc_sr04\", adress = 1,",
        "robot.sonar.ranger.adress",
        "unknown key: did you mean `address`?",
    ),
    value(
        "range_scale = \"0 %\"",
        "range_scale = -0.5",
        "robot.prior.range_scale",
        "must be from 0 % to 100 %",
    ),
];

const PATH: [Case; 13] = [
    value("laps = 4", "laps = 0", "path.laps", "must be a whole number from 1"),
    value("laps = 4", "laps = 20000", "path.laps", "must be from 1 to 10000"),
    case(", [0, 0]]", "]", "laps = 4", "path.laps", "the last corner is not the start"),
    value(
        "corners = [[0, 40]",
        "corners = [[0, 0]",
        "path.corners[0]",
        "the robot is already there",
    ),
    value(
        "corners = [[0, 40]",
        "corners = [[0, 40], [0, 40]",
        "path.corners[1]",
        "the robot is already there",
    ),
    value(
        "corners = [[0, 40]",
        "corners = [[0, 4e9]",
        "path.corners[0]",
        "within 8 km of the origin: subtract the same offset",
    ),
    value("corners = [[0, 40]", "corners = [] #", "path.corners", "at least one corner"),
    value(
        "speed = \"0.4 m/s\"",
        "speed = \"0 m/s\"",
        "path.speed",
        "must be from 1 mm/s to 100 m/s",
    ),
    value(
        "speed = \"0.4 m/s\"",
        "speed = \"3 m/s\"",
        "path.speed",
        "faster than the robot's drive.max_wheel_speed of 2.000 m/s",
    ),
    value(
        "turn_rate = \"30 deg/s\"",
        "turn_rate = \"20 rad/s\"",
        "path.turn_rate",
        "rolls a wheel at 3.500 m/s",
    ),
    value(
        "corners = [[0, 40], [-20, 40]",
        "corners = [[0, 40], [-30, 40]",
        "path.corners[1]",
        "the leg from (0, 40) to (-30, 40) m goes through the wall \"outer west\"",
    ),
    case(
        "clearance = \"20 cm\"",
        "clearance = \"1.6 m\"",
        "corners = ",
        "path.corners[0]",
        "comes within 1.500 m of the wall \"outer north\", nearer than the clearance of 1.600 m",
    ),
    value(
        "clearance = \"20 cm\"",
        "clearance = \"-1 cm\"",
        "path.clearance",
        "must be from 0 m to 100 m",
    ),
];

const HARDWARE: [Case; 12] = [
    value(
        "name = \"paper\"",
        "fidelity = \"exact\"\nname = \"paper\"",
        "fidelity",
        "must be \"ideal\" or \"pins\"",
    ),
    value(
        "clearance = \"20 cm\"",
        "follow = \"me\"",
        "path.follow",
        "must be \"truth\" or \"estimate\"",
    ),
    case(
        "[run]",
        "[sensor]\nmodel = \"srf99\"\n[run]",
        "model = ",
        "sensor.model",
        "must be \"ideal\", \"hc_sr04\", \"nxt\", \"ev3\", \"lv_maxsonar\", \"srf08\", \"polaroid_6500\", \"vl53l1x\" or \"vl53l0x\"",
    ),
    case("[run]", "[servo]\nmodle = 1\n[run]", "modle = ", "servo.modle", "unknown key"),
    case(
        "ranger = {",
        "temperature = \"90 degC\"\nranger = {",
        "temperature = ",
        "robot.sonar.temperature",
        "must be from -40 degC to 85 degC",
    ),
    case(
        "[run]",
        "[world]\ntemperature = 15\n[run]",
        "temperature = ",
        "world.temperature",
        "a unit is missing: write \"15 degC\"",
    ),
    case("[run]", "[world]\nobstacle = []\n[run]", "[world]", "world.unit", "is missing"),
    case(
        "[run]",
        "[world]\nunit = \"m\"\nobstacle = [{ centre = [0, 0], radius = \"0 m\" }]\n[run]",
        "obstacle = ",
        "world.obstacle[0].radius",
        "must be from 0.1 mm to 1000 m",
    ),
    case(
        "[run]",
        "[world]\nunit = \"m\"\nobstacle = [{ from = [1, 2], to = [1, 2] }]\n[run]",
        "obstacle = ",
        "world.obstacle[0].to",
        "must be different from `from`",
    ),
    case(
        "[run]",
        "[world]\nunit = \"m\"\nobstacle = [{ centre = [0, 0], radius = \"1 m\", walk = [1, 0] }]\n[run]",
        "obstacle = ",
        "world.obstacle[0].takes",
        "is missing",
    ),
    value(
        "track_width = \"348.8 mm\"",
        "slip = { every = \"0 m\", by = \"1 mm\" }\ntrack_width = \"348.8 mm\"",
        "truth.slip.every",
        "must be from 1 mm to 1000000 m",
    ),
    value(
        "track_width = \"348.8 mm\"",
        "bump = { every = \"1 m\" }\ntrack_width = \"348.8 mm\"",
        "truth.bump.by",
        "is missing",
    ),
];

const REST: [Case; 8] = [
    value(
        "position = \"1 mm\"",
        "position = \"-1 mm\"",
        "start.position",
        "must be from 0 m to 1000 m",
    ),
    value(
        "heading = \"1 mrad\"",
        "heading = \"-1 mrad\"",
        "start.heading",
        "must be from 0 deg to 360 deg",
    ),
    value(
        "track_width = \"348.8 mm\"",
        "track_width = \"0 mm\"",
        "truth.track_width",
        "must be from 1 cm to 10 m",
    ),
    value(
        "scale_right = -0.0065",
        "scale_right = -1",
        "truth.scale_right",
        "must be from -99 % to 1000 %",
    ),
    value(
        "range_noise = \"2.4",
        "range_noise = \"-2.4",
        "truth.range_noise",
        "must be from 0 m to 10 m",
    ),
    value(
        "cone = \"15 deg\"                      # paper\n\n[run]",
        "cone = \"0 deg\" # here\n\n[run]",
        "truth.cone",
        "must be from 0.1 deg to 89 deg",
    ),
    value("runs = 50", "runs = 0", "run.runs", "must be a whole number from 1"),
    case("[map]", "map = \"nowhere.toml\"\n[was_map]", "[was_map]", "was_map", "unknown key")
        .among(2),
];

#[test]
fn every_invalid_fault_has_its_line_and_key() {
    let tables: [&[Case]; 10] =
        [&FORMAT, &MISSING, &UNITS, &TYPES, &MAP, &CONFIG, &ROBOT, &PATH, &HARDWARE, &REST];
    let faults: Vec<_> = tables.into_iter().flatten().filter_map(fault).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// The error in the report of a case.
fn fault(case: &Case) -> Option<String> {
    let text = PAPER.replacen(case.old, case.new, 1);
    if text == PAPER {
        return Some(format!("{} is not in the file", case.old));
    }
    let line = line_of(&text, case.line);
    let Err(error) = parse(&text) else {
        return Some(format!("{} is accepted", case.new));
    };
    let is_it = |mistake: &Mistake| {
        (mistake.file(), mistake.line(), mistake.key()) == ("paper.toml", line, case.key)
            && mistake.message().contains(case.message)
    };
    let count = error.mistakes().count();
    let is_right = error.mistakes().any(is_it) && count == case.mistakes;
    (!is_right).then(|| format!("{}: expected {line:?}: {}: {error}", case.new, case.key))
}

/// Complete messages, with lines counted by hand.
#[test]
fn an_error_has_the_format_of_a_compiler() {
    let map = "format = 1\n\n[map]\nunit = \"cm\"\n\n[[map.wall]]\nname = \"a\"\nfrom = [0, 0]\n\
               to = [100, 0]\n\n[[map.wall]]\nname = \"b\"\nfrom = [0, 0]\nto = [0, 0]\n";
    let cases = [
        (
            map.to_owned(),
            "m.toml:14: map.wall[1].to: must differ from `from`: the wall has no length",
        ),
        (
            map.replace("name = \"b\"\n", ""),
            "m.toml:11: map.wall[1].name: is missing: write, for example, name = \"window\"",
        ),
        (
            map.replace("\"b\"", "\"a\"").replace("to = [0, 0]", "to = [0, 1]"),
            "m.toml:12: map.wall[1].name: another wall is already called \"a\"",
        ),
        (
            map.replace("unit = \"cm\"\n", ""),
            "m.toml:3: map.unit: is missing: write, for example, unit = \"m\"\n\
             m.toml:13: map.wall[1].to: must differ from `from`: the wall has no length",
        ),
        (
            "format = 1\r\n[map]\r\nunit = \"m\"\r\nwall = []\r\n".into(),
            "m.toml:4: map.wall: must be at least one wall",
        ),
        ("format = 1".into(), "m.toml:1: map: is missing: a table with unit, wall"),
        (
            String::new(),
            "m.toml:1: format: is missing: write, for example, format = 1\n\
             m.toml:1: map: is missing: a table with unit, wall",
        ),
        (
            "format = 1\nmap = \"x\"".into(),
            "m.toml:2: map: must be a table, but this is of type string",
        ),
    ];
    for (text, shown) in cases {
        assert_eq!(Floor::parse(&text, "m.toml").unwrap_err().to_string(), shown);
    }
    let good = map.replace("to = [0, 0]", "to = [0, 250]");
    let floor = Floor::parse(&good, "m.toml").unwrap();
    let [x, y] = floor.named_walls()[1].to();
    assert!(x.abs() + (y - 2.5).abs() < 1e-12);
}

/// Ten typical mistakes of a first file, each with what to write instead.
#[test]
fn ten_mistakes_are_reported_at_once() {
    let changes = [
        ("fidelity = \"pins\"", "fidelity = \"pin\"", "did you mean \"pins\"?"),
        ("from = [6, 0], to = [6, 8]", "from = [6, 0], to = [6, 0]", "must differ from `from`"),
        (
            "track_width = \"120 mm\"",
            "track_width = 120",
            "write \"120 m\" or \"120 cm\" or \"120 mm\"",
        ),
        ("encoder_period = \"100 ms\"", "", "write, for example, encoder_period = \"100 ms\""),
        ("max_range = ", "maxrange = ", "did you mean `max_range`?"),
        ("servo_timing = \"sg90\"", "servo_timing = \"SG90\"", "did you mean \"sg90\"?"),
        ("ranger = \"hc_sr04\"", "ranger = \"hcsr04\"", "did you mean \"hc_sr04\"?"),
        ("[robot.gating]\nconfidence = 2.0", "", "a table with confidence"),
        ("speed = \"0.2 m/s\"", "speed = \"0.2 m\"", "is not a speed"),
        ("laps = 7", "laps = 7.5", "must be a whole number"),
    ];
    let mut text = CLASSROOM.to_owned();
    for (old, new, _) in changes {
        assert!(text.contains(old), "{old}");
        text = text.replacen(old, new, 1);
    }
    let error = Scenario::parse(&text, "first.toml", Path::new("")).unwrap_err();
    let shown = error.to_string();
    assert_eq!(error.mistakes().count(), changes.len(), "{shown}");
    for (_, _, remedy) in changes {
        assert!(shown.contains(remedy), "{remedy}: {shown}");
    }
    let lines: Vec<_> = error.mistakes().filter_map(Mistake::line).collect();
    assert!(lines.is_sorted(), "{shown}");
}

/// A robot that searches for its pose has to drive while it is lost.
#[test]
fn a_searching_robot_may_drive_while_it_is_lost() {
    let search =
        CLASSROOM.replacen("[robot.drive]", "[robot]\nstart = \"unknown\"\n\n[robot.drive]", 1);
    let with_motors = |lost: &str| format!("{search}\n[robot.motors]\nlost = \"{lost}\"\n");
    parse(&search).unwrap();
    parse(&with_motors("on")).unwrap();
    let stopped = with_motors("off");
    let error = parse(&stopped).unwrap_err();
    let mistake = error.mistakes().next().unwrap();
    assert_eq!(mistake.line(), line_of(&stopped, "lost = \"off\""));
    let shown = error.to_string();
    assert!(shown.contains("must be \"on\" with start = \"unknown\""), "{shown}");
    parse(&stopped.replacen("\"unknown\"", "\"known\"", 1)).unwrap();
}

/// No mistake follows from another: with one value damaged, there is one mistake.
#[test]
fn a_mistake_has_no_consequences() {
    let values = PAPER.lines().filter_map(|line| line.split_once(" = ")).filter(|(key, value)| {
        !key.contains(['[', '{', '#', ' ']) && !value.starts_with("[\n") && !value.ends_with('[')
    });
    let mut damaged = 0;
    for (key, value) in values {
        let value = value.split(" #").next().unwrap_or(value).trim_end();
        let text = PAPER.replacen(&format!("{key} = {value}"), &format!("{key} = {{}}"), 1);
        if let Err(error) = parse(&text) {
            let keys = error.mistakes().filter(|mistake| !mistake.key().contains(key)).count();
            assert_eq!(keys, 0, "{key}: {error}");
            damaged += 1;
        }
    }
    assert!(damaged > 40, "{damaged}");
}

/// The tables of the scenario that `[name]` and `[name.…]` begin, taken out of it.
fn taken_out(text: &str, name: &str) -> (String, String) {
    let begins = [format!("[{name}]"), format!("[{name}.")];
    let (mut taken, mut left) = (String::new(), String::new());
    let mut inside = false;
    for line in text.lines() {
        if line.starts_with('[') {
            inside = begins.iter().any(|begin| line.starts_with(begin));
        }
        let side = if inside { &mut taken } else { &mut left };
        side.push_str(line);
        side.push('\n');
    }
    (taken, left)
}

#[test]
fn map_and_robot_may_be_files_of_their_own() {
    let directory = tempfile::tempdir().unwrap();
    let place = |name: &str| directory.path().join(name);
    let (map, rest) = taken_out(PAPER, "map");
    let (robot, rest) = taken_out(&rest, "robot");
    let names = "map = \"map.toml\"\nrobot = \"robot.toml\"\nformat = 1\n";
    let map = format!("format = 1\n{map}");
    let robot = format!("format = 1\n{}", robot.replace("[robot.", "["));
    fs::write(place("map.toml"), &map).unwrap();
    fs::write(place("robot.toml"), &robot).unwrap();
    fs::write(place("all.toml"), rest.replace("format = 1\n", names)).unwrap();

    // GIVEN the reference scenario in three files, THEN it equals that in one file.
    let paper = parse(PAPER).unwrap();
    assert_eq!(Scenario::read(&place("all.toml")).unwrap(), paper);
    assert_eq!(Floor::read(&place("map.toml")).unwrap(), paper.floor);
    assert_eq!(robot_file::read(&place("robot.toml")).unwrap(), paper.robot);

    // WHEN one of the files has an error, THEN the message names this file, with its own keys.
    let wrong = robot.replace("max_wheel_speed = \"2", "max_wheel_speed = \"0");
    fs::write(place("robot.toml"), &wrong).unwrap();
    let error = Scenario::read(&place("all.toml")).unwrap_err();
    assert_eq!(error.first().file(), place("robot.toml").display().to_string());
    assert_eq!(error.first().key(), "drive.max_wheel_speed");
    assert_eq!(error.first().line(), line_of(&wrong, "max_wheel_speed"));

    // WHEN one is missing, THEN the message has the scenario's line that names it.
    fs::remove_file(place("map.toml")).unwrap();
    let error = Scenario::read(&place("all.toml")).unwrap_err();
    assert_eq!(error.first().key(), "map");
    let scenario = fs::read_to_string(place("all.toml")).unwrap();
    assert_eq!(error.first().line(), line_of(&scenario, "map = "));
    assert!(error.first().message().contains("map.toml cannot be read"), "{error}");

    // WHEN the scenario itself is missing, THEN there is no line.
    let error = Scenario::read(&place("none.toml")).unwrap_err();
    assert_eq!((error.first().line(), error.first().key()), (None, ""));
    assert!(error.to_string().contains("none.toml: cannot be read: "), "{error}");
}

#[test]
fn optional_keys_may_be_omitted() {
    let text = PAPER.replace("laps = 4", "").replace("clearance = \"20 cm\"", "");
    let scenario = parse(&text).unwrap();
    assert!((scenario.path.duration() - 312.0).abs() < 1e-9);
}

#[test]
fn a_wheel_is_read_in_either_way_and_may_be_mirrored() {
    let (right, left) = ("right_wheel = {", "left_wheel = {");
    let text = PAPER
        .replace(right, "right_wheel = { diameter = \"65 mm\", edges_per_revolution = 1496.6 } #")
        .replace(left, "left_wheel = { mirrored = true,");
    let robot = parse(&text).unwrap().robot;
    assert_eq!(robot.right_wheel, WheelConfig::of_diameter(Metres(0.065), 1_496.6));
    assert_eq!(robot.left_wheel.signed_travel(), Metres(-0.001));
}

/// A sonar without a servo has a bearing, and none of the keys of a servo.
#[test]
fn a_fixed_sonar_has_a_bearing() {
    let without = |keys: &[&str]| {
        let lines = CLASSROOM.lines().filter(|line| !keys.iter().any(|key| line.starts_with(key)));
        lines.collect::<Vec<_>>().join("\n")
    };
    let servo = ["servo = ", "servo_pulses", "servo_timing"];
    let fixed = |bearing: &str| {
        let mount = "mount = [\"60 mm\", \"0 mm\"]";
        without(&servo).replace(mount, &format!("{mount}\nbearing = \"{bearing}\""))
    };
    let robot = parse(&fixed("90 deg")).unwrap().robot;
    let bearing = robot.localizer.rangers.first.fixed_bearing().unwrap();
    assert!((bearing.0 - core::f32::consts::FRAC_PI_2).abs() < 1e-6);
    assert_eq!(robot.localizer.rangers.first.timing.servo, ServoTiming::INSTANT);
    assert_eq!(robot.servo_settings(), None);
    let error = parse(&fixed("200 deg")).unwrap_err();
    assert_eq!(error.first().key(), "robot.sonar.bearing");
    for key in servo {
        let line = CLASSROOM.lines().find(|line| line.starts_with(key)).unwrap();
        let error = parse(&fixed("90 deg").replace("cone = \"12", &format!("{line}\ncone = \"12")));
        let error = error.unwrap_err();
        let key = format!("robot.sonar.{}", key.trim_end_matches(" = "));
        assert_eq!(error.first().key(), key, "{error}");
        assert!(error.first().message().contains("`bearing`"), "{error}");
    }
    let same = CLASSROOM.replace("servo = [\"-100 deg\", ", "servo = [\"100 deg\", ");
    assert_eq!(parse(&same).unwrap_err().first().key(), "robot.sonar.servo");
}

/// Several sonars are an array of tables; what they share is in the first.
#[test]
fn several_sonars_are_tables_of_their_own() {
    let begin = CLASSROOM.find("[robot.sonar]").unwrap();
    let end = CLASSROOM.find("[robot.prior]").unwrap();
    let (before, sonar, after) = (&CLASSROOM[..begin], &CLASSROOM[begin..end], &CLASSROOM[end..]);
    let first = sonar.replace("[robot.sonar]", "[[robot.sonar]]");
    let shared = ["fix_period", "temperature"];
    let is_own = |line: &&str| !shared.iter().any(|key| line.starts_with(key));
    let second: Vec<_> = first.lines().filter(is_own).collect();
    let second = second.join("\n").replace("\"60 mm\", \"0 mm\"", "\"60 mm\", \"50 mm\"");
    let with = |further: &[&str]| parse(&format!("{before}{first}{}\n{after}", further.join("\n")));
    let robot = with(&[&second]).unwrap().robot;
    let other = robot.localizer.rangers.get(RangerId(1)).unwrap();
    assert_eq!(other.mount, Point::new(0.06, 0.05));
    assert_eq!(other.timing, robot.localizer.rangers.first.timing);
    assert_eq!(robot.rangers.get(RangerId(1)), Some(&robot.rangers.first));
    assert_eq!(robot.localizer.rangers.iter().count(), 2);
    assert_eq!(
        robot_file::parse(&robot_text(&robot), "written.toml")
            .unwrap()
            .localizer
            .rangers
            .iter()
            .count(),
        2
    );
    let error = with(&[&second, &second, &second]).unwrap_err();
    assert_eq!(error.first().key(), "robot.sonar");
    let error = with(&[&format!("{second}\ntemperature = \"10 degC\"")]).unwrap_err();
    assert_eq!(error.first().key(), "robot.sonar[1].temperature");
    let error =
        with(&[&second.replace("min_range = \"10 cm\"", "min_range = \"10 m\"")]).unwrap_err();
    assert_eq!(error.first().key(), "robot.sonar[1].max_range");
}

#[test]
fn a_ranger_is_a_name_or_a_table_of_differences() {
    let robot = |ranger: &str| {
        let text = PAPER.replace("cycle = \"100 ms\"", "").replace("ranger = {", ranger);
        parse(&text).unwrap().robot
    };
    let named = robot("ranger = \"lv_maxsonar\" #");
    assert_eq!(named.rangers.first.kind, RangerKind::Pulse(PulseTiming::LV_MAXSONAR));
    assert_eq!(named.localizer.rangers.first.timing.cycle, Duration::millis(50));
    let blanking = Duration::micros(250);
    let other = robot(
        "temperature = \"12.5 degC\"\nranger = { kind = \"hc_sr04\", blanking = \"250 us\" } #",
    );
    let timing = PulseTiming { blanking, ..PulseTiming::HC_SR04 };
    assert_eq!(other.rangers.first.kind, RangerKind::Pulse(timing));
    assert!((other.rangers.first.temperature.0 - 12.5).abs() < 1e-6);
    assert_eq!(other.localizer.rangers.first.timing.cycle, Duration::millis(60));
    let srf = robot("ranger = { kind = \"srf02\", address = 0x72 } #");
    assert_eq!(srf.rangers.first.kind, RangerKind::Srf { address: 0x72 });
    let custom = robot("cycle = \"33 ms\"\nranger = \"custom\" #");
    assert_eq!(custom.rangers.first.kind, RangerKind::Custom);
}

/// A VL53L1X has a beam, whose settings a file may change; a custom ranger may have one, a sonar none.
#[test]
fn a_time_of_flight_ranger_has_a_beam() {
    let with = |ranger: &str| {
        let lines = ["temperature", "ranger"];
        let lines = CLASSROOM.lines().filter(|line| !lines.iter().any(|key| line.starts_with(key)));
        let text = lines.collect::<Vec<_>>().join("\n");
        parse(&text.replace("cone = \"12 deg\"", &format!("cone = \"30 deg\"\n{ranger}")))
    };
    let sonar = |ranger: &str| with(ranger).unwrap().robot.localizer.rangers.first;
    assert_eq!(sonar("ranger = \"hc_sr04\"").ranging, Ranging::Sound);
    assert_eq!(sonar("ranger = \"vl53l1x\"").ranging, Ranging::Light(LightBeam::VL53L1X));
    let wide = sonar("ranger = \"vl53l1x\"\nbeam = { spot = \"10 deg\" }").ranging;
    let spot = Radians::from_degrees(10.0);
    assert_eq!(wide, Ranging::Light(LightBeam { spot, ..LightBeam::VL53L1X }));
    let robot = with("ranger = { kind = \"vl53l1x\", address = 0x30 }").unwrap().robot;
    assert_eq!(robot.rangers.first.kind, RangerKind::Vl53l1x { address: 0x30 });
    assert_eq!(sonar("ranger = \"vl53l0x\"").ranging, Ranging::Light(devices::VL53L0X_BEAM));
    let robot = with("ranger = { kind = \"vl53l0x\", address = 0x31 }").unwrap().robot;
    assert_eq!(robot.rangers.first.kind, RangerKind::Vl53l0x { address: 0x31 });
    assert_eq!(robot.localizer.rangers.first.timing.cycle, Duration::millis(60));
    let custom = "ranger = \"custom\"\ncycle = \"30 ms\"\n";
    assert_eq!(sonar(custom).ranging, Ranging::Sound);
    let beam = "beam = { spot = \"2 deg\", pointing = \"1 deg\" }";
    assert!(matches!(sonar(&format!("{custom}{beam}")).ranging, Ranging::Light(_)));
    for (ranger, key) in [
        (format!("ranger = \"hc_sr04\"\n{beam}"), "robot.sonar.beam"),
        (format!("{custom}beam = {{ spot = \"2 deg\" }}"), "robot.sonar.beam.pointing"),
        ("ranger = \"vl53l1x\"\nbeam = { spot = \"30 deg\" }".to_owned(), "robot.sonar.beam.spot"),
        ("ranger = { kind = \"vl53l1x\", stuck = \"1 s\" }".to_owned(), "robot.sonar.ranger.stuck"),
    ] {
        let error = with(&ranger).unwrap_err();
        assert_eq!(error.first().key(), key, "{error}");
    }
}

/// A robot that moves by itself must not know where it is, and one that drives ahead must see what is there.
#[test]
fn a_motion_of_a_search_needs_a_search_and_a_sonar_that_turns() {
    let classroom = Scenario::parse(CLASSROOM, "classroom.toml", Path::new("")).unwrap().robot;
    let mut robot = classroom;
    let motion = SearchMotion { kind: SearchMotionKind::Ahead, bumper: Metres(0.3) };
    robot.start = StartPose::Exploring { region: None, motion };
    let text = robot_text(&robot);
    let known = text.replace("start = \"unknown\"", "start = \"known\"");
    let error = robot_file::parse(&known, "known.toml").unwrap_err().to_string();
    assert!(error.contains("needs start = \"unknown\""), "{error}");
    robot.localizer.rangers.first.servo = (Radians(-1.5), Radians(0.5));
    let error = robot.check().unwrap_err();
    assert_eq!(error.field, "start.motion.kind");
    let error = robot_file::parse(&robot_text(&robot), "narrow.toml").unwrap_err().to_string();
    assert!(error.contains("45 degrees"), "{error}");
}

/// A written file is read back: every number, except for the last bits of angles, which are in degrees.
#[test]
fn a_robot_that_is_written_is_read_back() {
    let classroom = Scenario::parse(CLASSROOM, "classroom.toml", Path::new("")).unwrap().robot;
    let mut odd = classroom;
    odd.left_wheel = odd.left_wheel.mirrored();
    odd.rangers.first.kind = RangerKind::Srf { address: 0x31 };
    odd.localizer.rangers.first.timing.schedule = PingSchedule::AsFastAsPossible;
    odd.localizer.echo = devices::NXT_ECHO;
    odd.localizer.echo.short = 0.04;
    odd.motors = MotorPolicy {
        lost: false,
        dead_encoder: true,
        lost_link: false,
        link_timeout: Duration::millis(1_500),
    };
    let region = Region { from: Point::new(0.5, -1.0), to: Point::new(2.0, 3.25) };
    let mut lit = odd;
    lit.rangers.first.kind = RangerKind::Vl53l1x { address: 0x29 };
    lit.localizer.rangers.first.ranging = Ranging::Light(LightBeam::VL53L1X);
    let mut searching = odd;
    searching.motors.lost = true;
    searching.start = StartPose::Unknown { region: Some(region) };
    let mut exploring = searching;
    let motion = SearchMotion { kind: SearchMotionKind::Ahead, bumper: Metres(0.45) };
    exploring.start = StartPose::Exploring { region: Some(region), motion };
    let mut spinning = searching;
    let motion = SearchMotion { kind: SearchMotionKind::Spin, bumper: Metres(0.3) };
    spinning.start = StartPose::Exploring { region: None, motion };
    let mut fixed = classroom;
    fixed.localizer.rangers.first.servo = (Radians(-1.25), Radians(-1.25));
    fixed.localizer.rangers.first.timing.servo = ServoTiming::INSTANT;
    fixed.rangers.first.servo_pulses = RangerConfig::NO_PULSES;
    for robot in
        [classroom, odd, lit, searching, exploring, spinning, fixed, parse(PAPER).unwrap().robot]
    {
        let text = robot_text(&robot);
        let mut read = robot_file::parse(&text, "written.toml").unwrap();
        let near = |a: Radians, b: Radians| (a - b).abs() < Radians(1e-6);
        let angles = |robot: &RobotConfig| {
            let sonar = &robot.localizer.rangers.first;
            let [one, other] = robot.rangers.first.servo_pulses;
            let spot = match sonar.ranging {
                Ranging::Sound => Radians(0.0),
                Ranging::Light(beam) => beam.spot + beam.pointing,
            };
            [sonar.servo.0, sonar.servo.1, sonar.cone, one.bearing, other.bearing, spot]
        };
        let pairs = angles(&read).into_iter().zip(angles(&robot));
        assert!(pairs.into_iter().all(|(a, b)| near(a, b)), "{text}");
        read.localizer.rangers.first.servo = robot.localizer.rangers.first.servo;
        read.localizer.rangers.first.cone = robot.localizer.rangers.first.cone;
        read.localizer.rangers.first.ranging = robot.localizer.rangers.first.ranging;
        read.rangers.first.servo_pulses = robot.rangers.first.servo_pulses;
        assert_eq!(read, robot, "{text}");
    }
}

proptest! {
    /// A file with any text removed or inserted is read or refused at one of its lines.
    #[test]
    fn any_damage_is_survived(
        from in 0..PAPER.len(),
        length in 0..40_usize,
        typed in "[\\[\\]{}\"'=.,#\\n 0-9a-z°-]{0,3}",
    ) {
        let to = (from + length).min(PAPER.len());
        prop_assume!(PAPER.is_char_boundary(from) && PAPER.is_char_boundary(to));
        let text = [&PAPER[..from], &typed, &PAPER[to..]].concat();
        if let Err(error) = parse(&text) {
            let lines = text.matches('\n').count() + 1;
            prop_assert!(error.first().line().is_some_and(|line| (1..=lines).contains(&line)), "{}", error);
            prop_assert!(!error.first().message().is_empty());
        }
    }
}

#[test]
fn the_classroom_is_read_with_all_that_it_holds() {
    let scenario = Scenario::parse(CLASSROOM, "classroom.toml", Path::new("")).unwrap();
    assert_eq!(scenario.fidelity, Fidelity::Pins);
    assert_eq!(scenario.follow, Follow::Estimate);
    assert!((scenario.upsets.slip.every - 20.0).abs() < 1e-12);
    assert_eq!(scenario.hardware.sonar, SonarName::HcSr04);
    assert_eq!(scenario.hardware.servo, ServoName::Sg90);
    assert!((scenario.surroundings.temperature - 15.0).abs() < 1e-12);
    let walking = scenario.surroundings.obstacles.iter().filter(|o| o.walk.is_some());
    assert_eq!((scenario.surroundings.obstacles.len(), walking.count()), (6, 1));
    assert!(scenario.path.duration() > 600.0);
}

#[test]
fn the_paper_is_ideal_in_an_empty_room() {
    let scenario = parse(PAPER).unwrap();
    assert_eq!((scenario.fidelity, scenario.follow), (Fidelity::Ideal, Follow::Truth));
    assert_eq!(scenario.hardware.sonar, SonarName::Ideal);
    assert_eq!(scenario.hardware.servo, ServoName::Ideal);
    assert!(scenario.surroundings.obstacles.is_empty());
    assert!(scenario.upsets.slip.every.is_infinite() && scenario.upsets.bump.every.is_infinite());
}

#[test]
fn a_wrong_fault_has_its_line_and_key() {
    let of_fault = |fault: &str| {
        let list = format!("format = 1\nfaults = [{{ {fault} }}]");
        parse(&PAPER.replace("format = 1", &list)).unwrap_err()
    };
    let when = "from = \"1 s\", to = \"2 s\"";
    let cases = [
        ("kind = \"gremlins\"", "kind", "must be one of the faults"),
        ("kind = \"lost_echoes\"", "share", "is missing"),
        ("kind = \"cross_talk\", share = 1.5", "share", "must be from 0 to 1"),
        ("kind = \"read_errors\", wheel = \"left\"", "share", "is missing"),
        ("kind = \"dead_encoder\", wheel = \"front\"", "wheel", "must be \"right\" or"),
        ("kind = \"slow_servo\", times = 0.5", "times", "must be from 1 to 1000"),
        ("kind = \"clock_jitter\", late = 5", "late", "a unit is missing"),
        ("kind = \"stuck_servo\", since = \"1 s\"", "since", "unknown key"),
    ];
    for (fault, key, message) in cases {
        let error = of_fault(&format!("{fault}, {when}"));
        assert_eq!(error.first().key(), format!("faults[0].{key}"), "{error}");
        assert_eq!(
            error.first().line(),
            line_of(PAPER, "format = 1").map(|line| line + 1),
            "{error}"
        );
        assert!(error.first().message().contains(message), "{error}");
    }
    let error = of_fault("kind = \"brown_out\", from = \"2 s\", to = \"2 s\"");
    assert_eq!(
        (error.first().key(), error.first().message()),
        ("faults[0].to", "must be after `from`")
    );
}

#[test]
fn faults_are_read_in_their_order() {
    let list = "format = 1\nfaults = [
        { kind = \"missing_ticks\", wheel = \"left\", share = \"1 %\", from = \"0 s\", to = \"1 s\" },
        { kind = \"stuck_echo\", from = \"5 s\", to = \"7 s\" },
        { kind = \"read_errors\", wheel = \"right\", share = 1.0, from = \"1 s\", to = \"2 s\" },
        { kind = \"dead_sonar\", from = \"1 s\", to = \"2 s\" },
    ]";
    let faults = parse(&PAPER.replace("format = 1", list)).unwrap().faults;
    let ticks = Fault { kind: FaultKind::MissingTicks(Wheel::Left, 0.01), from: 0.0, to: 1.0 };
    let echo = Fault { kind: FaultKind::StuckEcho, from: 5.0, to: 7.0 };
    let read = Fault { kind: FaultKind::ReadErrors(Wheel::Right, 1.0), from: 1.0, to: 2.0 };
    let sonar = Fault { kind: FaultKind::DeadSonar, ..read };
    assert_eq!(faults, [ticks, echo, read, sonar]);
}

/// Numbers that no robot file may have are found in a configuration from elsewhere, each by its key.
#[test]
fn a_configuration_from_elsewhere_is_within_the_limits_of_its_keys() {
    type Change = fn(&mut RobotConfig);
    let robot = Scenario::parse(CLASSROOM, "classroom.toml", Path::new("")).unwrap().robot;
    let changes: [(&str, Change); 12] = [
        ("drive.track_width", |c| c.localizer.drive.track_width = Metres(1e4)),
        ("drive.wheel_noise", |c| c.localizer.drive.wheel_noise.0.0 = f32::NAN),
        ("drive.encoder_period", |c| c.encoder_period = Duration::from_ticks(u64::MAX)),
        ("drive.left_wheel.travel_per_edge", |c| c.left_wheel.travel_per_edge = Metres(2.0)),
        ("sonar.mount[1]", |c| c.localizer.rangers.first.mount.y = Metres(-11.0)),
        ("sonar.cycle", |c| c.localizer.rangers.first.timing.cycle = Duration::secs(61)),
        ("sonar.servo_timing.frame", |c| {
            c.localizer.rangers.first.timing.servo.frame = Duration::secs(11);
        }),
        ("sonar.servo_pulses[0].width", |c| {
            c.rangers.first.servo_pulses[0].width = Duration::secs(1);
        }),
        ("sonar.fix_period", |c| {
            c.localizer.rangers.first.timing.schedule = PingSchedule::Every(Duration::secs(3_601));
        }),
        ("gating.confidence", |c| c.localizer.gating.confidence = f32::INFINITY),
        ("echo.free_path", |c| c.localizer.echo.free_path = Metres(2e4)),
        ("motors.link_timeout", |c| c.motors.link_timeout = Duration::secs(86_400)),
    ];
    assert_eq!(robot_file::check(&robot, "flash"), Ok(()));
    for (key, change) in changes {
        let mut changed = robot;
        change(&mut changed);
        let error = robot_file::check(&changed, "flash").unwrap_err();
        let keys: Vec<_> = error.mistakes().map(Mistake::key).collect();
        assert_eq!(keys, [key], "{error}");
    }
}
