//! Typical mistakes are named with their reason, and unusual but right robots are not.

use std::path::Path;

use sonarfix_map::{CLASSROOM, PAPER, Scenario, plausibility};

const ROBOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../firmware/robot.toml");

/// What a user reads about a file: the errors, or else the warnings.
fn diagnosis(text: &str, name: &str) -> String {
    let is_robot = !text.contains("[path]");
    let error = if is_robot {
        sonarfix_map::robot_file::parse(text, name).err()
    } else {
        Scenario::parse(text, name, Path::new("")).err()
    };
    if let Some(error) = error {
        return error.to_string();
    }
    let warnings = plausibility::of_text(text, name, Path::new(""));
    warnings.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

/// A file with one edit, and the text that its diagnosis has.
type Edit = (&'static str, &'static str, &'static str);

fn edited(base: &str, old: &str, new: &str) -> String {
    assert!(base.contains(old), "{old} is not in the file");
    base.replacen(old, new, 1)
}

fn unnamed(base: &str, name: &str, edits: &[Edit]) -> Vec<String> {
    let check = |(old, new, expected): &Edit| {
        let found = diagnosis(&edited(base, old, new), name);
        (!found.contains(expected))
            .then(|| format!("{new}\n  expected {expected}\n  found {found}"))
    };
    edits.iter().filter_map(check).collect()
}

#[rustfmt::skip]
const IN_ROBOT: &[Edit] = &[
    ("right_wheel = { diameter = \"65 mm\"", "right_wheel = { diameter = \"65 m\"", "did you mean \"65 mm\""),
    ("right_wheel = { diameter = \"65 mm\"", "right_wheel = { diameter = \"65 cm\"", "did you mean \"65 mm\""),
    ("right_wheel = { diameter = \"65 mm\"", "right_wheel = { diameter = \"2.5 mm\"", "did you mean \"2.5 cm\""),
    ("left_wheel = { diameter = \"65 mm\"", "left_wheel = { diameter = \"32.5 mm\"", "radius"),
    ("left_wheel = { diameter = \"65 mm\", edges_per_revolution = 1496.6", "left_wheel = { diameter = \"65 mm\", edges_per_revolution = 374.15", "four edges"),
    ("left_wheel = { diameter = \"65 mm\", edges_per_revolution = 1496.6", "left_wheel = { diameter = \"65 mm\", edges_per_revolution = 44", "factor"),
    ("right_wheel = { diameter = \"65 mm\", edges_per_revolution = 1496.6", "right_wheel = { diameter = \"65 mm\", edges_per_revolution = 1.294", "gear ratio"),
    ("edges_per_revolution = 1496.6 }", "edges_per_revolution = 0.36 }", "edges_per_revolution: must be"),
    ("track_width = \"121 mm\"", "track_width = \"121 cm\"", "did you mean \"121 mm\""),
    ("track_width = \"121 mm\"", "track_width = \"12.1 mm\"", "did you mean \"12.1 cm\""),
    ("track_width = \"121 mm\"", "track_width = 121", "a unit is missing"),
    ("max_wheel_speed = \"1 m/s\"", "max_wheel_speed = \"1 mm/s\"", "did you mean \"1 m/s\""),
    ("max_wheel_speed = \"1 m/s\"", "max_wheel_speed = \"100 m/s\"", "did you mean \"100 cm/s\""),
    ("encoder_period = \"50 ms\"", "encoder_period = \"50 us\"", "did you mean \"50 ms\""),
    ("encoder_period = \"50 ms\"", "encoder_period = \"50 s\"", "did you mean \"50 ms\""),
    ("wheel_noise = \"3 mm/sqrt(m)\"", "wheel_noise = \"0.003 mm/sqrt(m)\"", "did you mean \"0.003 m/sqrt(m)\""),
    ("wheel_noise = \"3 mm/sqrt(m)\"", "wheel_noise = \"3 m/sqrt(m)\"", "did you mean \"3 mm/sqrt(m)\""),
    ("mount = [\"60 mm\"", "mount = [\"60 cm\"", "did you mean \"60 mm\""),
    ("mount = [\"60 mm\", \"0 mm\"]", "mount = [\"60 mm\", \"2 m\"]", "did you mean \"2 cm\""),
    ("servo = [\"-90 deg\", \"90 deg\"]", "servo = [\"-1.57 deg\", \"1.57 deg\"]", "did you mean \"-90 deg\""),
    ("servo = [\"-90 deg\", \"90 deg\"]", "servo = [\"0 deg\", \"180 deg\"]", "servo turns from -90 deg to 90 deg"),
    ("servo = [\"-90 deg\", \"90 deg\"]", "servo = [\"-90 rad\", \"90 rad\"]", "did you mean \"-90 deg\""),
    ("{ width = \"1000 us\", bearing = \"-45 deg\" }, { width = \"2000 us\", bearing = \"45 deg\" }", "{ width = \"1000 us\", bearing = \"45 deg\" }, { width = \"2000 us\", bearing = \"135 deg\" }", "0 ahead"),
    ("{ width = \"1000 us\", bearing = \"-45 deg\" }, { width = \"2000 us\", bearing = \"45 deg\" }", "{ width = \"1000 us\", bearing = \"-90 deg\" }, { width = \"2000 us\", bearing = \"90 deg\" }", "500 us to 2500 us"),
    ("width = \"1000 us\"", "width = \"1000 ms\"", "did you mean \"1000 us\""),
    ("width = \"1000 us\"", "width = \"1 us\"", "did you mean \"1 ms\""),
    ("cone = \"12 deg\"", "cone = \"30 deg\"", "full angle"),
    ("cone = \"12 deg\"", "cone = \"0.21 deg\"", "did you mean"),
    ("cone = \"12 deg\"", "cone = \"12 rad\"", "did you mean \"12 deg\""),
    ("cone = \"12 deg\"", "cone = \"120 deg\"", "did you mean \"12 deg\""),
    ("servo = [\"-90 deg\", \"90 deg\"]", "servo = [\"-900 deg\", \"900 deg\"]", "did you mean \"-90 deg\""),
    ("max_range = \"3.5 m\"", "max_range = \"350 m\"", "did you mean \"350 cm\""),
    ("max_range = \"3.5 m\"", "max_range = \"35 cm\"", "decimal point"),
    ("max_range = \"3.5 m\"", "max_range = \"12 m\"", "feet"),
    ("min_range = \"10 cm\"", "min_range = \"10 m\"", "did you mean"),
    ("noise = \"6 mm\"", "noise = \"6 m\"", "did you mean \"6 mm\""),
    ("noise = \"6 mm\"", "noise = \"0.006 mm\"", "did you mean \"0.006 m\""),
    ("noise_per_metre = \"2 mm/m\"", "noise_per_metre = \"0.2 m/m\"", "did you mean \"0.2 cm/m\""),
    ("fix_period = \"as fast as possible\"", "fix_period = \"200 us\"", "did you mean \"200 ms\""),
    ("temperature = \"20 degC\"", "temperature = \"68 degC\"", "Fahrenheit"),
    ("temperature = \"20 degC\"", "temperature = \"293 degC\"", "did you mean \"19.85 degC\""),
    ("scale_right = \"1.5 %\"", "scale_right = 1.5", "did you mean"),
    ("scale_right = \"1.5 %\"", "scale_right = \"0.015 %\"", "fraction of 1"),
    ("track_width = \"5 mm\"", "track_width = \"5 cm\"", "did you mean \"5 mm\""),
    ("confidence = 2.0", "confidence = 0.95", "standard deviations"),
    ("confidence = 2.0", "confidense = 2.0", "did you mean `confidence`"),
    ("cone = \"12 deg\"", "cone = \"12 degrees\"", "is not an angle"),
];

#[rustfmt::skip]
const IN_CLASSROOM: &[Edit] = &[
    ("from = [6, 0], to = [6, 8]", "from = [6, 0.03], to = [6, 8]", "does not close"),
    ("from = [6, 0], to = [6, 8]", "from = [6, 0], to = [6, 80]", "far beyond"),
    ("[map]\nunit = \"m\"", "[map]\nunit = \"mm\"", "unit"),
    ("[map]\nunit = \"m\"", "[map]\nunit = \"cm\"", "unit"),
    ("{ name = \"door\",", "{ name = \"again\", from = [6, 8], to = [0, 8] },\n    { name = \"door\",", "the same wall twice"),
    ("start = [1.5, 1.5]\ncorners = [[4.5, 1.5], [4.5, 6.5], [1.5, 6.5], [1.5, 1.5]]", "start = [150, 150]\ncorners = [[450, 150], [450, 650], [150, 650], [150, 150]]", "centimetres"),
    ("start = [1.5, 1.5]\ncorners = [[4.5, 1.5], [4.5, 6.5], [1.5, 6.5], [1.5, 1.5]]", "start = [1.5, -1.5]\ncorners = [[4.5, -1.5], [4.5, -6.5], [1.5, -6.5], [1.5, -1.5]]", "y axis points down"),
    ("[path]\nunit = \"m\"", "[path]\nunit = \"cm\"", "100 times too small"),
    ("corners = [[4.5, 1.5], [4.5, 6.5]", "corners = [[4.5, 1.5], [45, 6.5]", "goes through the wall"),
    ("clearance = \"20 cm\"", "clearance = \"20 m\"", "did you mean a clearance of 0.2 m"),
    ("track_width = \"120 mm\"", "track_width = \"60 mm\"", "half of it"),
    ("speed = \"0.2 m/s\"", "speed = \"20 m/s\"", "did you mean \"20 cm/s\""),
    ("speed = \"0.2 m/s\"", "speed = \"0.2 cm/s\"", "did you mean \"0.2 m/s\""),
    ("turn_rate = \"45 deg/s\"", "turn_rate = \"45 rad/s\"", "did you mean \"45 deg/s\""),
    ("turn_rate = \"45 deg/s\"", "turn_rate = \"0.785 deg/s\"", "did you mean \"0.785 rad/s\""),
    ("position = \"2 cm\"", "position = \"2 m\"", "did you mean \"2 cm\""),
    ("heading = \"2 deg\"", "heading = \"2 rad\"", "did you mean \"2 deg\""),
    ("scale_right = \"1 %\"", "scale_right = 1", "did you mean \"1 %\""),
    ("scale_right = \"1 %\"", "scale_right = \"101 %\"", "scale"),
    ("[world]\ntemperature = \"15 degC\"", "[world]\ntemperature = \"59 degC\"", "Fahrenheit"),
    ("centre = [0.5, 4.0]", "centre = [50, 400]", "centimetres"),
    ("radius = \"20 cm\"", "radius = \"20 m\"", "did you mean \"20 cm\""),
    ("takes = \"20 s\"", "takes = \"20 ms\"", "did you mean \"20 s\""),
    ("travel_per_edge = \"0.4887 mm\"", "travel_per_edge = \"0.4887 m\"", "did you mean \"0.4887 mm\""),
    ("max_range = \"3.5 m\"", "max_range = \"0.9 m\"", "never reaches a wall"),
];

#[test]
fn typical_mistakes_are_named_with_their_reason() {
    let robot = std::fs::read_to_string(ROBOT).unwrap();
    let unnamed = [
        unnamed(&robot, "robot.toml", IN_ROBOT),
        unnamed(CLASSROOM, "classroom.toml", IN_CLASSROOM),
    ]
    .concat();
    let all = IN_ROBOT.len() + IN_CLASSROOM.len();
    assert!(unnamed.is_empty(), "{} of {all}:\n{}", unnamed.len(), unnamed.join("\n"));
}

/// Replaces the values of some keys of a robot file.
fn with(base: &str, edits: &[(&str, &str)]) -> String {
    let replace = |text: String, (old, new): &(&str, &str)| edited(&text, old, new);
    edits.iter().fold(base.to_owned(), replace)
}

const WHEELS: &str = "right_wheel = { diameter = \"65 mm\", edges_per_revolution = 1496.6 }\nleft_wheel = { diameter = \"65 mm\", edges_per_revolution = 1496.6, mirrored = true }";

#[rustfmt::skip]
const UNUSUAL_ROBOTS: &[&[(&str, &str)]] = &[
    &[(WHEELS, "right_wheel = { diameter = \"200 mm\", edges_per_revolution = 40000 }\nleft_wheel = { diameter = \"200 mm\", edges_per_revolution = 40000 }"), ("\"121 mm\"", "\"1 m\""), ("[\"60 mm\"", "[\"700 mm\""), ("max_wheel_speed = \"1 m/s\"", "max_wheel_speed = \"2.5 m/s\"")],
    &[(WHEELS, "right_wheel = { diameter = \"500 mm\", edges_per_revolution = 8192 }\nleft_wheel = { diameter = \"500 mm\", edges_per_revolution = 8192 }"), ("\"121 mm\"", "\"1.6 m\""), ("[\"60 mm\"", "[\"1.5 m\"")],
    &[(WHEELS, "right_wheel = { diameter = \"20 mm\", edges_per_revolution = 40000 }\nleft_wheel = { diameter = \"20 mm\", edges_per_revolution = 40000 }"), ("\"121 mm\"", "\"45 mm\""), ("[\"60 mm\"", "[\"20 mm\"")],
    &[(WHEELS, "right_wheel = { diameter = \"13 mm\", edges_per_revolution = 120 }\nleft_wheel = { diameter = \"13 mm\", edges_per_revolution = 120 }"), ("\"121 mm\"", "\"30 mm\""), ("[\"60 mm\"", "[\"-12 mm\"")],
    &[(WHEELS, "right_wheel = { diameter = \"42 mm\", edges_per_revolution = 48 }\nleft_wheel = { diameter = \"42 mm\", edges_per_revolution = 48 }")],
    &[(WHEELS, "right_wheel = { travel_per_edge = \"5 mm\" }\nleft_wheel = { travel_per_edge = \"5 mm\", mirrored = true }")],
    &[("max_wheel_speed = \"1 m/s\"", "max_wheel_speed = \"5 cm/s\"")],
    &[("max_wheel_speed = \"1 m/s\"", "max_wheel_speed = \"4 m/s\"")],
    &[("encoder_period = \"50 ms\"", "encoder_period = \"1 ms\"")],
    &[("encoder_period = \"50 ms\"", "encoder_period = \"200 ms\"")],
    &[("[\"60 mm\", \"0 mm\"]", "[\"-100 mm\", \"55 mm\"]")],
    &[("[\"60 mm\", \"0 mm\"]", "[\"0 mm\", \"0 mm\"]")],
    &[("servo = [\"-90 deg\", \"90 deg\"]", "servo = [\"-35 deg\", \"110 deg\"]")],
    &[("{ width = \"1000 us\", bearing = \"-45 deg\" }, { width = \"2000 us\", bearing = \"45 deg\" }", "{ width = \"500 us\", bearing = \"135 deg\" }, { width = \"2500 us\", bearing = \"-135 deg\" }")],
    &[("{ width = \"1000 us\", bearing = \"-45 deg\" }, { width = \"2000 us\", bearing = \"45 deg\" }", "{ width = \"610 us\", bearing = \"-83.5 deg\" }, { width = \"2380 us\", bearing = \"96.25 deg\" }")],
    &[("cone = \"12 deg\"", "cone = \"5 deg\"")],
    &[("cone = \"12 deg\"", "cone = \"22.5 deg\"")],
    &[("min_range = \"10 cm\"", "min_range = \"0 m\"")],
    &[("max_range = \"3.5 m\"", "max_range = \"1 m\"")],
    &[("max_range = \"3.5 m\"", "max_range = \"7.5 m\""), ("ranger = \"hc_sr04\"", "ranger = \"lv_maxsonar\"")],
    &[("max_range = \"3.5 m\"", "max_range = \"1.2 m\""), ("ranger = \"hc_sr04\"", "ranger = \"vl53l0x\"")],
    &[("noise = \"6 mm\"", "noise = \"25 mm\"")],
    &[("noise = \"6 mm\"", "noise = \"0.5 mm\""), ("noise_per_metre = \"2 mm/m\"", "noise_per_metre = \"20 mm/m\"")],
    &[("fix_period = \"as fast as possible\"", "fix_period = \"10 s\"")],
    &[("temperature = \"20 degC\"", "temperature = \"-25 degC\"")],
    &[("temperature = \"20 degC\"", "temperature = \"45 degC\"")],
    &[("scale_right = \"1.5 %\"", "scale_right = 0.1"), ("scale_left = \"1.5 %\"", "scale_left = 0.1")],
    &[("wheel_noise = \"3 mm/sqrt(m)\"", "wheel_noise = \"20 mm/sqrt(m)\"")],
    &[("wheel_noise = \"3 mm/sqrt(m)\"", "wheel_noise = \"0.1 mm/sqrt(m)\""), ("scale_walk = \"2e-5 /sqrt(m)\"", "scale_walk = \"0 /sqrt(m)\"")],
];

#[rustfmt::skip]
const UNUSUAL_SCENARIOS: &[&[(&str, &str)]] = &[
    // A corridor that is open at both ends, a hall of 80 m, a map far from the origin, a doorway.
    &[("    { name = \"door\", from = [0, 8], to = [0, 0] },\n", ""), ("    { name = \"board\", from = [6, 0], to = [6, 8] },\n", "")],
    &[("from = [0, 0], to = [6, 0]", "from = [-40, 0], to = [40, 0]"), ("from = [6, 0], to = [6, 8]", "from = [40, 0], to = [40, 40]"), ("from = [6, 8], to = [0, 8]", "from = [40, 40], to = [-40, 40]"), ("from = [0, 8], to = [0, 0]", "from = [-40, 40], to = [-40, 0]")],
    &[("from = [0, 8], to = [0, 0]", "from = [0, 8], to = [0, 0.9]")],
    &[("from = [0, 8], to = [0, 0]", "from = [0, 8], to = [0, 5] },\n    { name = \"door 2\", from = [0, 4.2], to = [0, 0]")],
    &[("speed = \"0.2 m/s\"", "speed = \"2 cm/s\""), ("laps = 7 ", "laps = 1 ")],
    &[("clearance = \"20 cm\"", "clearance = \"0 m\"")],
    &[("position = \"2 cm\"", "position = \"50 cm\""), ("heading = \"2 deg\"", "heading = \"20 deg\"")],
];

#[test]
fn unusual_robots_are_accepted() {
    let robot = std::fs::read_to_string(ROBOT).unwrap();
    let robots = UNUSUAL_ROBOTS.iter().map(|edits| with(&robot, edits));
    let scenarios = UNUSUAL_SCENARIOS.iter().map(|edits| with(CLASSROOM, edits));
    for (index, text) in robots.chain(scenarios).enumerate() {
        assert_eq!(diagnosis(&text, "right.toml"), "", "{index}");
    }
}

#[test]
fn shipped_files_are_accepted() {
    for text in [CLASSROOM, PAPER] {
        assert_eq!(diagnosis(text, "shipped.toml"), "");
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let files = ["firmware", "tests/robots", "tests/scenarios", "sim-host/cli/tests"];
    let in_folder = |folder| std::fs::read_dir(root.join(folder)).unwrap();
    let mut count = 0;
    for path in files.into_iter().flat_map(in_folder).map(|entry| entry.unwrap().path()) {
        let text = std::fs::read_to_string(&path).unwrap_or_default();
        if text.starts_with("format = ") || text.contains("\nformat = ") {
            assert_eq!(plausibility::of_file(&path), [], "{}", path.display());
            count += 1;
        }
    }
    assert!(count >= 8, "{count}");
}

/// The classroom with its robot as it is instead of scale errors.
fn with_built_robot() -> String {
    let built = "right_wheel = { travel_per_edge = \"0.4936 mm\" }\n\
        left_wheel = { travel_per_edge = \"0.4838 mm\" }\n\
        mount = [\"60 mm\", \"0 mm\"]\n\
        servo_pulses = [{ width = \"500 us\", bearing = \"-100 deg\" }, { width = \"2500 us\", bearing = \"100 deg\" }]";
    edited(CLASSROOM, "scale_right = \"1 %\"\nscale_left = \"-1 %\"", built)
}

#[test]
fn a_robot_file_is_compared_with_the_true_robot() {
    let base = with_built_robot();
    assert_eq!(diagnosis(&base, "scenario.toml"), "");
    let edits: &[Edit] = &[
        (
            "right_wheel = { travel_per_edge = \"0.4887 mm\" }",
            "right_wheel = { travel_per_edge = \"0.6 mm\" }",
            "\"0.6 mm\" is that of a wheel that rolls 1.22 times as far per edge as truth.right_wheel with \"0.4936 mm\"",
        ),
        (
            "left_wheel = { travel_per_edge = \"0.4887 mm\" }",
            "left_wheel = { travel_per_edge = \"0.4887 mm\", mirrored = true }",
            "counts in the other direction than truth.left_wheel",
        ),
        ("mount = [\"60 mm\", \"0 mm\"]", "mount = [\"0 mm\", \"0 mm\"]", "6 cm from truth.mount"),
        (
            "servo_pulses = [{ width = \"500 us\", bearing = \"-100 deg\" }",
            "servo_pulses = [{ width = \"500 us\", bearing = \"-75 deg\" }",
            "up to 25° from those of truth.servo_pulses",
        ),
        ("right_wheel = { travel_per_edge = \"0.4936 mm\" }", "", "truth.scale_right: is missing"),
        (
            "range_scale = \"0 %\"",
            "scale_left = 0\nrange_scale = \"0 %\"",
            "contradicts scale_left",
        ),
        (
            "range_scale = \"0 %\"",
            "servo_zero = \"3 deg\"\nrange_scale = \"0 %\"",
            "truth.servo_zero: contradicts servo_pulses",
        ),
    ];
    assert_eq!(unnamed(&base, "scenario.toml", edits), Vec::<String>::new());
    let fixed = edited(&base, "servo = [\"-100 deg\", \"100 deg\"]", "bearing = \"0 deg\"");
    let fixed = fixed.replacen("servo_pulses", "# servo_pulses", 1).replacen(
        "servo_timing",
        "# servo_timing",
        1,
    );
    assert!(
        diagnosis(&fixed, "scenario.toml").contains("truth.servo_pulses: is of a sonar on a servo")
    );
    let by_error = |key: &str| {
        edited(CLASSROOM, "range_scale = \"0 %\"", &format!("{key}\nrange_scale = \"0 %\""))
    };
    let found = diagnosis(&by_error("servo_zero = \"25 deg\""), "scenario.toml");
    assert!(
        found.contains("up to 25° from those of truth.servo_zero and truth.servo_scale"),
        "{found}"
    );
    let found = diagnosis(&by_error("servo_scale = \"20 %\""), "scenario.toml");
    assert!(
        found.contains("up to 20° from those of truth.servo_zero and truth.servo_scale"),
        "{found}"
    );
}

#[test]
fn a_comment_accepts_a_line() {
    let text =
        edited(CLASSROOM, "speed = \"0.2 m/s\"", "speed = \"0.2 cm/s\" # plausible: a snail");
    assert_eq!(diagnosis(&text, "snail.toml"), "");
}

#[test]
fn files_that_a_scenario_names_are_checked_with_their_lines() {
    let folder = tempfile::tempdir().unwrap();
    let robot = std::fs::read_to_string(ROBOT).unwrap();
    std::fs::write(folder.path().join("robot.toml"), robot.replace("\"60 mm\"", "\"60 cm\""))
        .unwrap();
    let start = CLASSROOM.find("[robot.drive]").unwrap();
    let end = CLASSROOM.find("[path]").unwrap();
    let text = format!("{}{}", CLASSROOM.get(..start).unwrap(), CLASSROOM.get(end..).unwrap());
    let text = text.replacen("[map]", "robot = \"robot.toml\"\n[map]", 1);
    let warnings = plausibility::of_text(&text, "scenario.toml", folder.path());
    let [warning] = warnings.as_slice() else { panic!("{warnings:?}") };
    assert!(warning.file().ends_with("robot.toml"));
    assert_eq!(warning.key(), "sonar.mount[0]");
    let line = warning.line().unwrap();
    assert!(robot.lines().nth(line - 1).unwrap().starts_with("mount"));
}
