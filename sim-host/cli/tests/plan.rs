//! `sonarfix plan`: forecast of the localization accuracy.

#![expect(clippy::unwrap_used, reason = "a test should stop")]

use std::fs;
use std::path::Path as FilePath;
use std::process::{Command, Output};

use serde_json::Value;
use sonarfix::sensor::gyro::GyroParameters;
use sonarfix_map::{GyroTruth, HeadingSensor, PAPER, Scenario};
use sonarfix_plan::preset::SonarPreset;
use sonarfix_plan::{Forecast, Sample};
use sonarfix_sim::simulate::Simulation;

use crate::command::assert_documented;

const ROOM: &str = "format = 1
[map]
unit = \"m\"
wall = [
    { name = \"south\", from = [0, 0], to = [5, 0] },
    { name = \"east\", from = [5, 0], to = [5, 4] },
    { name = \"north\", from = [5, 4], to = [0, 4] },
    { name = \"west\", from = [0, 4], to = [0, 0] },
    { name = \"partition\", from = [2.5, 0], to = [2.5, 2.5] },
]
";

/// Two walls along x, 2 m apart and 40 m long: the position along them is unobservable.
const CORRIDOR: &str = "format = 1
[map]
unit = \"m\"
wall = [
    { name = \"left\", from = [0, 1], to = [40, 1] },
    { name = \"right\", from = [0, -1], to = [40, -1] },
    { name = \"end\", from = [40, 1], to = [40, -1] },
]
";

fn sonarfix(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sonarfix")).args(arguments).output().unwrap()
}

fn text(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn error(arguments: &[&str]) -> String {
    let output = sonarfix(arguments);
    assert!(!output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
    String::from_utf8(output.stderr).unwrap()
}

fn write(dir: &FilePath, name: &str, text: &str) -> String {
    let file = dir.join(name);
    fs::write(&file, text).unwrap();
    file.to_str().unwrap().to_owned()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

fn paper() -> Scenario {
    let laps = PAPER.replace("laps = 4", "laps = 1");
    Scenario::parse(&laps, "paper.toml", FilePath::new("")).unwrap()
}

fn forecast(scenario: &Scenario, runs: u32) -> Forecast {
    Forecast::new(scenario, runs, &|| ()).unwrap().unwrap()
}

/// The forecast equals the error of runs: RMS over 40 noisy runs of the same lap, whose parameters are
/// drawn and walk as the filter assumes. 40 runs along the same walls leave a sampling error of 20 %.
#[test]
fn a_forecast_equals_the_error_of_runs() {
    let mut scenario = paper();
    let forecast = forecast(&scenario, 2);
    let config = scenario.robot.localizer;
    scenario.truth.range_noise = config.rangers.first.noise.floor.0.into();
    let (mut squares, runs) = (0.0, 40_u32);
    for seed in 0..u64::from(runs) {
        // The systematic errors of the wheels are quantiles of the prior, evenly spaced, in a
        // different order for each wheel.
        let spread = |step: u64| {
            let part = f64::from(u32::try_from((seed * step) % 40).unwrap());
            ((part + 0.5) / 40.0 - 0.5) * 12_f64.sqrt()
        };
        scenario.truth.scale_right = 0.01 * spread(7);
        scenario.truth.scale_left = 0.01 * spread(11);
        scenario.truth.track_width = 0.35 + 0.01 * spread(13);
        let result = Simulation::new(scenario.clone()).run(seed, &mut ()).unwrap();
        squares += result.path.position_mean_square();
    }
    let rms = (squares / f64::from(runs)).sqrt();
    let ratio = rms / forecast.position.rms;
    assert!((0.75..1.3).contains(&ratio), "{rms} m, forecast {}", forecast.position.rms);
}

/// In a corridor the uncertainty along it grows, and the robot is blind, until the end is in range.
#[test]
fn a_corridor_is_blind_until_its_end_is_in_range() {
    let dir = tempfile::tempdir().unwrap();
    let map = write(dir.path(), "corridor.toml", CORRIDOR);
    let arguments = ["plan", &map, "--path", "2,0 38.5,0", "--sensor", "hc-sr04", "--json"];
    let answer: Value = serde_json::from_str(&text(&sonarfix(&arguments))).unwrap();
    let longest = &answer[0]["blind"][0];
    // 0.25 m/s; the end is at 40 m, in range from 3.5 m: not before x = 36.4.
    let (from, to) = (number(&longest["from"][0]), number(&longest["to"][0]));
    assert!(from < 3.5 && (36.0..38.5).contains(&to), "{from} to {to}");
    assert!((number(&longest["seconds"]) - (to - from) / 0.25).abs() < 1.0);
    let leg = &answer[0]["legs"][0];
    assert!(number(&leg["x"]["worst"]) > 5.0 * number(&leg["y"]["worst"]), "{leg}");
    assert!(number(&answer[0]["worst_at"][0]) > 35.0);

    // A sonar with three times the range measures the end earlier.
    let far = ["plan", &map, "--path", "2,0 38.5,0", "--sensor", "polaroid6500", "--json"];
    let answer: Value = serde_json::from_str(&text(&sonarfix(&far))).unwrap();
    let to = number(&answer[0]["blind"][0]["to"][0]);
    assert!((28.0..34.0).contains(&to), "{to}");
}

/// Errors of wheels, gyro and compass, and unmapped obstacles do not enter a forecast.
#[test]
fn errors_and_obstacles_do_not_enter_a_forecast() {
    let mut honest = paper();
    honest.robot.localizer.gyro = Some(GyroParameters::MPU_6050);
    honest.absolute.heading = Some(HeadingSensor::COMPASS);
    let mut wrong = honest.clone();
    wrong.truth.gyro = GyroTruth { bias: Some(0.05), scale: 0.02 };
    wrong.absolute.heading.as_mut().unwrap().sampling.outliers = 0.3;
    wrong.truth.scale_right = 0.02;
    wrong.truth.wheel_noise = 0.01;
    wrong.start.drawn = true;
    assert_eq!(forecast(&honest, 2), forecast(&wrong, 2));
}

/// Missed echoes increase the bound.
#[test]
fn missed_echoes_increase_the_bound() {
    let mut scenario = paper();
    scenario.robot.localizer.rangers.first.max_range.0 = 3.5;
    let all = forecast(&scenario, 4);
    let robot = scenario.robot;
    SonarPreset::HcSr04.fit(&mut scenario);
    scenario.robot = robot;
    let some = forecast(&scenario, 4);
    assert!(some.ranges_per_second < all.ranges_per_second);
    let rms = |forecast: &Forecast| {
        let squares = forecast.samples.iter().map(|sample: &Sample| sample.position().powi(2));
        squares.sum::<f64>()
    };
    assert!(rms(&some) > rms(&all), "{} {}", some.position.rms, all.position.rms);
}

#[test]
fn sonars_are_compared_the_best_first() {
    let dir = tempfile::tempdir().unwrap();
    let map = write(dir.path(), "room.toml", ROOM);
    let picture = dir.path().join("plan.svg");
    let path = write(dir.path(), "path.txt", "1,1 # by the west wall\n\n1,3\n4, 3\n4,1\n");
    let svg = picture.to_str().unwrap();
    let compare = ["plan", &map, "--path", &path, "--compare", "--need", "1000", "--out", svg];
    let table = text(&sonarfix(&compare));
    for name in ["HC-SR04", "LV-MaxSonar", "SRF08", "Polaroid 6500"] {
        let row = table.lines().find(|line| line.starts_with(name)).unwrap();
        assert!(row.ends_with("yes"), "{row}");
    }
    let svg = fs::read_to_string(picture).unwrap();
    assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n"));
    assert!(svg.contains("bound on the position") && !svg.contains("NaN"), "{svg}");
    let json = sonarfix(&["plan", &map, "--path", &path, "--compare", "--json"]);
    let answer: Value = serde_json::from_str(&text(&json)).unwrap();
    assert_documented(&answer);
    let rms: Vec<f64> =
        answer.as_array().unwrap().iter().map(|c| number(&c["position"]["rms"])).collect();
    assert_eq!(rms.len(), 18);
    assert!(rms.is_sorted(), "{rms:?}");
}

/// A gyro and a compass reduce the uncertainty of the heading with every sonar; a scenario's own gyro counts.
#[test]
fn sonars_are_compared_with_and_without_a_gyro_and_a_compass() {
    let dir = tempfile::tempdir().unwrap();
    let gyro = "[robot.gyro]\nsensor = \"mpu6050\"\nnoise = \"30 deg/sqrt(s)\"\n\n[robot.prior]";
    let noisy = PAPER.replace("laps = 4", "laps = 1").replace("[robot.prior]", gyro);
    let room = write(dir.path(), "room.toml", ROOM);
    let noisy = write(dir.path(), "noisy.toml", &noisy);
    let compared = |arguments: &[&str]| -> Value {
        let arguments = [&["plan"], arguments, &["--compare", "--runs", "2", "--json"]].concat();
        serde_json::from_str(&text(&sonarfix(&arguments))).unwrap()
    };
    let heading = |answer: &Value, sensor: &str, aid: &str| {
        let mut candidates = answer.as_array().unwrap().iter();
        let found = candidates.find(|it| it["sensor"] == sensor && it["heading_aid"] == aid);
        number(&found.unwrap()["heading"]["rms"])
    };
    let in_room = compared(&[&room, "--path", "1,1 1,3 4,3 4,1"]);
    for sensor in ["HC-SR04", "LV-MaxSonar", "SRF08", "Polaroid 6500"] {
        let of = |aid| heading(&in_room, sensor, aid);
        assert!(of("gyro") < 0.9 * of("none"), "{sensor}: {} {}", of("gyro"), of("none"));
        assert!(of("compass") < of("none"), "{sensor}: {} {}", of("compass"), of("none"));
    }
    let with_noise = compared(&[&noisy]);
    let of = |aid| heading(&with_noise, "Polaroid 6500", aid);
    assert!((0.97..1.001).contains(&(of("gyro") / of("none"))), "{} {}", of("gyro"), of("none"));
}

/// The start of a scenario may be less certain than what is needed; what the sonar does along the path is another matter.
#[test]
fn the_uncertainty_of_the_start_does_not_decide_what_suffices() {
    let dir = tempfile::tempdir().unwrap();
    let unsure = PAPER
        .replace("laps = 4", "laps = 1")
        .replace("position = \"1 mm\"", "position = \"300 mm\"");
    let scenario = write(dir.path(), "unsure.toml", &unsure);
    let json = sonarfix(&["plan", &scenario, "--runs", "1", "--need", "250", "--json"]);
    let answer: Value = serde_json::from_str(&text(&json)).unwrap();
    assert_documented(&answer);
    let worst = |key: &str| number(&answer[0][key]["worst"]);
    assert!(worst("position") > 0.3 && worst("from_known_start") < 0.25, "{answer}");
    let table = text(&sonarfix(&["plan", &scenario, "--runs", "1", "--need", "250"]));
    assert!(table.contains(": suffices for 250 mm"), "{table}");
    let table = text(&sonarfix(&["plan", &scenario, "--runs", "1", "--need", "0.1"]));
    assert!(table.contains(": does not suffice for 0.1 mm"), "{table}");
}

/// Starts without a pose are reported for each leg; far from the end of a corridor no pose is determined, in a room
/// without symmetry most are.
#[test]
fn starts_without_a_pose_are_forecast() {
    let dir = tempfile::tempdir().unwrap();
    let room = write(dir.path(), "room.toml", ROOM);
    let path = "1,1 1,3 4,3 4,1";
    let plan = ["plan", &room, "--path", path, "--runs", "1", "--starts", "6"];
    let answer = text(&sonarfix(&[&plan[..], &["--json"]].concat()));
    let answer: Value = serde_json::from_str(&answer).unwrap();
    assert_documented(&answer);
    let starts = &answer[0]["starts"];
    let legs = starts["legs"].as_array().unwrap();
    assert_eq!(legs.len(), 3);
    let of_legs: f64 = legs.iter().map(|leg| number(&leg["starts"])).sum();
    assert!((of_legs - 6.0).abs() < 1e-9 && (number(&starts["starts"]) - 6.0).abs() < 1e-9);
    let right: f64 = legs.iter().map(|leg| number(&leg["right"]) * number(&leg["starts"])).sum();
    assert!((right / 6.0 - number(&starts["right"])).abs() < 1e-9, "{starts}");
    assert!(number(&starts["right"]) > 0.6 && number(&starts["wrong"]) < 1e-9, "{starts}");
    assert!(number(&starts["median_metres"]) > 0.3, "{starts}");
    let table = text(&sonarfix(&plan));
    assert!(table.contains("Starts without a pose") && table.contains("all"), "{table}");
    // Far from the end of a corridor every place along it looks the same.
    let corridor = write(dir.path(), "corridor.toml", CORRIDOR);
    let along =
        ["plan", &corridor, "--path", "15,0 20,0", "--runs", "1", "--starts", "2", "--json"];
    let answer: Value = serde_json::from_str(&text(&sonarfix(&along))).unwrap();
    let starts = &answer[0]["starts"];
    assert!(number(&starts["right"]) < 1e-9 && starts["median_metres"].is_null(), "{starts}");
    let message = error(&["plan", &room, "--path", path, "--starts", "0"]);
    assert!(message.contains("--starts must be at least 1"), "{message}");
}

/// A map is the same to `plan` and `map` whether it is TOML, CSV, baked or that of a scenario.
#[test]
fn a_map_is_read_from_every_format() {
    let dir = tempfile::tempdir().unwrap();
    let map = write(dir.path(), "room.toml", ROOM);
    let csv = dir.path().join("room.csv").display().to_string();
    let baked = dir.path().join("room.bin").display().to_string();
    text(&sonarfix(&["map", "simplify", &map, "--out", &csv]));
    text(&sonarfix(&["map", "bake", &map, "--out", &baked]));
    let named = |map: &str| {
        let room = ROOM.split_once("[map]").unwrap().1;
        assert!(PAPER.contains("[map]") && room.contains("wall"));
        let (head, rest) = PAPER.split_once("[map]").unwrap();
        let (_, tail) = rest.split_once("[robot.drive]").unwrap();
        let start = tail.find("[path]").unwrap();
        let end = tail.find("[start]").unwrap();
        let path = "[path]\nunit = \"m\"\nstart = [1, 1]\ncorners = [[1, 3]]\nspeed = \"0.4 m/s\"\nturn_rate = \"30 deg/s\"\n\n";
        let tail = [&tail[..start], path, &tail[end..]].concat();
        let head = head.replace("format = 1", &format!("format = 1\nmap = {map:?}"));
        format!("{head}[robot.drive]{tail}")
    };
    let scenarios = ["room.toml", "room.csv", "room.bin"].map(named);
    let path = ["--path", "1,1 1,3", "--runs", "1", "--json"];
    let plan = |map: &str| {
        let arguments = [&["plan", map], &path[..]].concat();
        serde_json::from_str::<Value>(&text(&sonarfix(&arguments))).unwrap()
    };
    let expected = plan(&map);
    assert_eq!(plan(&csv), expected);
    assert_eq!(plan(&baked), expected);
    let [one, others @ ..] = scenarios.map(|text| plan(&write(dir.path(), "all.toml", &text)));
    for other in others {
        assert_eq!(one, other);
    }
    text(&sonarfix(&["map", "check", &write(dir.path(), "all.toml", &named("room.bin"))]));
}

#[test]
fn errors_are_printed_with_their_place() {
    let dir = tempfile::tempdir().unwrap();
    let map = write(dir.path(), "room.toml", ROOM);
    let broken = write(dir.path(), "path.txt", "1,1\n1;3\n");
    let scenario = write(dir.path(), "paper.toml", PAPER);
    let cases: [(&[&str], &[&str]); 10] = [
        (&["plan", &map, "--path", "1,1 1,3", "--sensor", "nxt"], &["\"nxt\"", "lv_maxsonar"]),
        (&["plan", &map, "--path", "1,1 4,1"], &["(1, 1) to (4, 1)", "\"partition\"", "gap"]),
        (&["plan", "nowhere.toml"], &["nowhere.toml", "cannot be read"]),
        (&["plan", &map], &["room.toml", "no path", "--path"]),
        (&["plan", &map, "--path", "1,1 4;3"], &["\"4;3\"", "metres"]),
        (&["plan", &map, "--path", "1,1"], &["two points"]),
        (&["plan", &map, "--path", "1,1 1,1"], &["point 2", "already there"]),
        (&["plan", &map, "--path", &broken], &["path.txt:2", "x,y"]),
        (&["plan", &map, "--path", "1,1 1,3", "--sensor", "bat"], &["\"bat\"", "hc_sr04"]),
        (&["plan", &scenario, "--need", "-1"], &["--need", "above zero"]),
    ];
    for (arguments, words) in cases {
        let error = error(arguments);
        assert!(error.starts_with("error: "), "{error}");
        for word in words {
            assert!(error.contains(word), "{arguments:?}: {error}");
        }
    }
}
