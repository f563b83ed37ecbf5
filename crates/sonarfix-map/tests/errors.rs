//! Whatever is wrong with a file is reported with its file, line and key.

use std::fs;
use std::path::Path;

use proptest::prelude::*;
use sonarfix_map::{
    CLASSROOM, Fault, FaultKind, Fidelity, FileError, Floor, Follow, PAPER, Robot, Scenario,
    ServoName, SonarName, Wheel,
};

fn parse(text: &str) -> Result<Scenario, FileError> {
    Scenario::parse(text, "paper.toml", Path::new(""))
}

/// The line, from 1, of the first `marker` in `text`.
fn line_of(text: &str, marker: &str) -> Option<usize> {
    let at = text.find(marker)?;
    Some(text.get(..at)?.matches('\n').count() + 1)
}

/// The reference scenario with one thing changed, and what is then reported.
struct Case {
    /// What is replaced, the first time it occurs.
    old: &'static str,
    new: &'static str,
    /// What the line reported begins or contains, the first time it occurs after the change.
    line: &'static str,
    key: &'static str,
    message: &'static str,
}

const fn case(
    old: &'static str,
    new: &'static str,
    line: &'static str,
    key: &'static str,
    message: &'static str,
) -> Case {
    Case { old, new, line, key, message }
}

/// A changed value, reported where it stands.
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
    case("gate = 5.0", "confidence = 1\ngate = 5.0", "confidence = 3.0", "", "duplicate key"),
    value("format = 1", "format = 2", "format", "version 2 cannot be read, only version 1"),
    value("format = 1", "format = \"1\"", "format", "must be a whole number"),
    case("format = 1\n", "", "# The ref", "format", "is missing"),
    value(
        "servo =",
        "srvo =",
        "robot.sonar.srvo",
        "unknown key; possible here: mount, servo, cone",
    ),
    value("[run]", "[ran]", "ran", "unknown key; possible here: format, name"),
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
    case("gate = 5.0", "", "[robot.trust]", "robot.trust.gate", "is missing"),
    case(
        "[robot.prior]",
        "[robot.sonar.extra]",
        "[robot.sonar.extra]",
        "robot.sonar.extra",
        "unknown key",
    ),
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
    value("gate = 5.0", "gate = \"5\"", "robot.trust.gate", "must be a number"),
    value("gate = 5.0", "gate = nan", "robot.trust.gate", "must be finite"),
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
    value("from = [-3, 3]", "from = [-3, 1e6]", "map.wall[4].from", "within 100 km"),
    case("wall = [", "wall = []\nignored = [", "ignored", "map.ignored", "unknown key"),
];

/// Every rule of the localizer's own check, at the key that the file has it under.
const CONFIG: [Case; 17] = [
    value(
        "track_width = \"350",
        "track_width = \"0",
        "robot.drive.track_width",
        "must be positive and finite",
    ),
    value(
        "track_width = \"350 mm",
        "track_width = \"1e60 m",
        "robot.drive.track_width",
        "must be positive and finite",
    ),
    value(
        "wheel_noise = \"0.5",
        "wheel_noise = \"-1",
        "robot.drive.wheel_noise",
        "must be positive",
    ),
    value(
        "scale_walk = \"5",
        "scale_walk = \"-5",
        "robot.drive.scale_walk",
        "must be zero or positive",
    ),
    value(
        "track_width_walk = \"5",
        "track_width_walk = \"-5",
        "robot.drive.track_width_walk",
        "must be zero or positive",
    ),
    value(
        "max_wheel_speed = \"2",
        "max_wheel_speed = \"0",
        "robot.drive.max_wheel_speed",
        "must be positive",
    ),
    value("mount = [\"0", "mount = [\"1e60", "robot.sonar.mount", "must be finite"),
    value(
        "servo = [\"-180",
        "servo = [\"190",
        "robot.sonar.servo",
        "must be a rightmost below a leftmost bearing",
    ),
    value(
        "cone = \"15",
        "cone = \"90",
        "robot.sonar.cone",
        "must be between 0 and 90° (half of the cone)",
    ),
    value(
        "min_range = \"5",
        "min_range = \"-5",
        "robot.sonar.min_range",
        "must be zero or positive",
    ),
    value(
        "max_range = \"10 m\"",
        "max_range = \"1 cm\"",
        "robot.sonar.max_range",
        "must be greater than sonar.min_range",
    ),
    value("noise = \"2.4", "noise = \"0.0", "robot.sonar.noise", "must be positive"),
    value(
        "noise_per_metre = \"0",
        "noise_per_metre = \"-1",
        "robot.sonar.noise_per_metre",
        "must be zero or positive",
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
        "must be zero or positive",
    ),
    value("gate = 5.0", "gate = 0", "robot.trust.gate", "must be positive"),
    value(
        "confidence = 3.0",
        "confidence = -3.0",
        "robot.trust.confidence",
        "must be zero or positive",
    ),
];

const ROBOT: [Case; 6] = [
    value(
        "encoder_period = \"100",
        "encoder_period = \"0",
        "robot.drive.encoder_period",
        "must be from 1 us to 1 hour",
    ),
    value(
        "fix_period = \"1 s",
        "fix_period = \"2e4 s",
        "robot.sonar.fix_period",
        "must be from 1 us to 1 hour",
    ),
    value(
        "policy = \"nearest\"",
        "policy = \"best\"",
        "robot.schedule.policy",
        "must be \"nearest\" or \"informative\"",
    ),
    case(
        "encoder_period = \"100 ms\"",
        "encoder_period = \"100 ms\"\ntravel_per_tick = { right = \"0 mm\", left = \"1 mm\" }",
        "travel_per_tick",
        "robot.drive.travel_per_tick.right",
        "must be a length that is not zero",
    ),
    case(
        "encoder_period = \"100 ms\"",
        "encoder_period = \"100 ms\"\ntravel_per_tick = { right = \"1 mm\" }",
        "travel_per_tick",
        "robot.drive.travel_per_tick.left",
        "is missing",
    ),
    value(
        "range_scale = \"0 %\"",
        "range_scale = -0.5",
        "robot.prior.range_scale",
        "must be zero or positive",
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
    value("corners = [[0, 40]", "corners = [[0, 4e9]", "path.corners[0]", "within 100 km"),
    value("corners = [[0, 40]", "corners = [] #", "path.corners", "at least one corner"),
    value("speed = \"0.4 m/s\"", "speed = \"0 m/s\"", "path.speed", "must be positive"),
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
        "must be zero or positive",
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
        "must be \"ideal\" or \"hc_sr04\" or \"nxt\"",
    ),
    case("[run]", "[servo]\nmodle = 1\n[run]", "modle = ", "servo.modle", "unknown key"),
    case(
        "[run]",
        "[sensor]\ntemperature = \"90 degC\"\n[run]",
        "temperature = ",
        "sensor.temperature",
        "must be from -40 to 85 degC",
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
        "must be positive",
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
        "must be positive",
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
        "must be zero or positive",
    ),
    value(
        "heading = \"1 mrad\"",
        "heading = \"-1 mrad\"",
        "start.heading",
        "must be zero or positive",
    ),
    value(
        "track_width = \"348.8 mm\"",
        "track_width = \"0 mm\"",
        "truth.track_width",
        "must be positive",
    ),
    value(
        "scale_right = -0.0065",
        "scale_right = -1",
        "truth.scale_right",
        "must be greater than -1",
    ),
    value(
        "range_noise = \"2.4",
        "range_noise = \"-2.4",
        "truth.range_noise",
        "must be zero or positive",
    ),
    value(
        "cone = \"15 deg\"                      # paper\n\n[run]",
        "cone = \"0 deg\" # here\n\n[run]",
        "truth.cone",
        "must be between 0 and 90°",
    ),
    value("runs = 50", "runs = 0", "run.runs", "must be a whole number from 1"),
    case("[map]", "map = \"nowhere.toml\"\n[was_map]", "[was_map]", "was_map", "unknown key"),
];

#[test]
fn every_fault_has_its_line_and_key() {
    let tables: [&[Case]; 10] =
        [&FORMAT, &MISSING, &UNITS, &TYPES, &MAP, &CONFIG, &ROBOT, &PATH, &HARDWARE, &REST];
    let faults: Vec<_> = tables.into_iter().flatten().filter_map(fault).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// What is wrong with the report of a case.
fn fault(case: &Case) -> Option<String> {
    let text = PAPER.replacen(case.old, case.new, 1);
    if text == PAPER {
        return Some(format!("{} is not in the file", case.old));
    }
    let line = line_of(&text, case.line);
    let Err(error) = parse(&text) else {
        return Some(format!("{} is accepted", case.new));
    };
    let is_right = (error.file(), error.line(), error.key()) == ("paper.toml", line, case.key)
        && error.message().contains(case.message);
    (!is_right).then(|| format!("{}: expected {line:?}: {}: {error}", case.new, case.key))
}

/// Lines counted by hand, and the whole of what is shown.
#[test]
fn an_error_reads_as_a_compiler_writes_it() {
    let map = "format = 1\n\n[map]\nunit = \"cm\"\n\n[[map.wall]]\nname = \"a\"\nfrom = [0, 0]\n\
               to = [100, 0]\n\n[[map.wall]]\nname = \"b\"\nfrom = [0, 0]\nto = [0, 0]\n";
    let cases = [
        (
            map.to_owned(),
            "m.toml:14: map.wall[1].to: must differ from `from`: the wall has no length",
        ),
        (map.replace("name = \"b\"\n", ""), "m.toml:11: map.wall[1].name: is missing"),
        (
            map.replace("\"b\"", "\"a\"").replace("to = [0, 0]", "to = [0, 1]"),
            "m.toml:12: map.wall[1].name: another wall is already called \"a\"",
        ),
        (map.replace("unit = \"cm\"\n", ""), "m.toml:3: map.unit: is missing"),
        (
            "format = 1\r\n[map]\r\nunit = \"m\"\r\nwall = []\r\n".into(),
            "m.toml:4: map.wall: must be at least one wall",
        ),
        ("format = 1".into(), "m.toml:1: map: is missing"),
        (String::new(), "m.toml:1: format: is missing"),
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

    // GIVEN the reference scenario in three files, THEN it is the one in one file.
    let paper = parse(PAPER).unwrap();
    assert_eq!(Scenario::read(&place("all.toml")).unwrap(), paper);
    assert_eq!(Floor::read(&place("map.toml")).unwrap(), paper.floor);
    assert_eq!(Robot::read(&place("robot.toml")).unwrap(), paper.robot);

    // WHEN one of the files is wrong, THEN it is the one that is named, with its own keys.
    let wrong = robot.replace("max_wheel_speed = \"2", "max_wheel_speed = \"0");
    fs::write(place("robot.toml"), &wrong).unwrap();
    let error = Scenario::read(&place("all.toml")).unwrap_err();
    assert_eq!(error.file(), place("robot.toml").display().to_string());
    assert_eq!(error.key(), "drive.max_wheel_speed");
    assert_eq!(error.line(), line_of(&wrong, "max_wheel_speed"));

    // WHEN one is not there, THEN the scenario's line that names it is.
    fs::remove_file(place("map.toml")).unwrap();
    let error = Scenario::read(&place("all.toml")).unwrap_err();
    assert_eq!(error.key(), "map");
    let scenario = fs::read_to_string(place("all.toml")).unwrap();
    assert_eq!(error.line(), line_of(&scenario, "map = "));
    assert!(error.message().contains("map.toml cannot be read"), "{error}");

    // WHEN the scenario itself is not there, THEN there is no line.
    let error = Scenario::read(&place("none.toml")).unwrap_err();
    assert_eq!((error.line(), error.key()), (None, ""));
    assert!(error.to_string().contains("none.toml: cannot be read: "), "{error}");
}

#[test]
fn what_may_be_left_out_may_be() {
    let text = PAPER.replace("laps = 4", "").replace("clearance = \"20 cm\"", "");
    let scenario = parse(&text).unwrap();
    assert!((scenario.path.duration() - 312.0).abs() < 1e-9);
}

#[test]
fn travel_per_tick_is_read_and_may_be_negative() {
    let ticks = "\ntravel_per_tick = { right = \"0.3255 mm\", left = \"-0.3289 mm\" }\n";
    let period = "encoder_period = \"100 ms\"";
    let text = PAPER.replace(period, &[period, ticks].concat());
    let travel = parse(&text).unwrap().robot.travel_per_tick.unwrap();
    assert_eq!((travel.right.0, travel.left.0), (0.000_325_5, -0.000_328_9));
}

proptest! {
    /// Whatever is cut out of a file or typed into it, it is read or refused at one of its lines.
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
            prop_assert!(error.line().is_some_and(|line| (1..=lines).contains(&line)), "{}", error);
            prop_assert!(!error.message().is_empty());
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
        ("kind = \"gremlins\"", "kind", "is none of the faults"),
        ("kind = \"lost_echoes\"", "share", "is missing"),
        ("kind = \"cross_talk\", share = 1.5", "share", "must be from 0 to 1"),
        ("kind = \"dead_encoder\", wheel = \"front\"", "wheel", "must be \"right\" or"),
        ("kind = \"slow_servo\", times = 0.5", "times", "must be at least 1"),
        ("kind = \"clock_jitter\", late = 5", "late", "a unit is missing"),
        ("kind = \"stuck_servo\", since = \"1 s\"", "since", "unknown key"),
    ];
    for (fault, key, message) in cases {
        let error = of_fault(&format!("{fault}, {when}"));
        assert_eq!(error.key(), format!("faults[0].{key}"), "{error}");
        assert_eq!(error.line(), line_of(PAPER, "format = 1").map(|line| line + 1), "{error}");
        assert!(error.message().contains(message), "{error}");
    }
    let error = of_fault("kind = \"brown_out\", from = \"2 s\", to = \"2 s\"");
    assert_eq!((error.key(), error.message()), ("faults[0].to", "must be after `from`"));
}

#[test]
fn faults_are_read_in_their_order() {
    let list = "format = 1\nfaults = [
        { kind = \"missing_ticks\", wheel = \"left\", share = \"1 %\", from = \"0 s\", to = \"1 s\" },
        { kind = \"stuck_echo\", from = \"5 s\", to = \"7 s\" },
    ]";
    let faults = parse(&PAPER.replace("format = 1", list)).unwrap().faults;
    let ticks = Fault { kind: FaultKind::MissingTicks(Wheel::Left, 0.01), from: 0.0, to: 1.0 };
    let echo = Fault { kind: FaultKind::StuckEcho, from: 5.0, to: 7.0 };
    assert_eq!(faults, [ticks, echo]);
}
