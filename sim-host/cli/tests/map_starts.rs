//! `sonarfix map check --starts`: starts without a pose anywhere on a map.

#![expect(clippy::unwrap_used, reason = "a test should stop")]

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

use crate::command::assert_documented;

fn check(dir: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
    command.current_dir(dir).args(["map", "check"]).args(arguments).output().unwrap()
}

fn text(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn error(output: &Output) -> String {
    assert!(!output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// A map file with the walls between these points, metres.
fn map(dir: &Path, lines: &[&[[f64; 2]]]) {
    let mut csv = "x1_m,y1_m,x2_m,y2_m,name\n".to_owned();
    let walls = lines.iter().flat_map(|points| points.iter().zip(points.iter().skip(1)));
    for (n, ([x0, y0], [x1, y1])) in walls.enumerate() {
        writeln!(csv, "{x0},{y0},{x1},{y1},wall {n}").unwrap();
    }
    fs::write(dir.join("map.csv"), csv).unwrap();
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

const SQUARE: [[f64; 2]; 5] = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0], [0.0, 0.0]];

/// A square is itself after each quarter of a turn: no start has a unique answer, and the poses that it confuses are its images.
/// With the proposed boards, which stand at walls inside, other starts have one.
#[test]
fn a_square_room_is_not_unique_and_boards_make_it_so() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    map(dir, &[&SQUARE]);
    let arguments = ["map.csv", "--starts", "6", "--seconds", "40", "--furniture", "0"];
    let answer = text(&check(dir, &[&arguments[..], &["--out", "starts.svg", "--json"]].concat()));
    let answer: Value = serde_json::from_str(&answer).unwrap();
    assert_documented(&answer);
    let starts = &answer["starts"];
    assert!(number(&starts["right"]) < 1e-9 && number(&starts["wrong"]) < 1e-9, "{starts}");
    assert!(starts["median_seconds"].is_null(), "{starts}");
    // Half a turn about the middle, and a quarter of one in either direction.
    let confused = starts["confused"].as_array().unwrap();
    for turn in ["180°", "90°"] {
        let is_it = |it: &&Value| it["motion"].as_str().unwrap().contains(turn);
        let found = confused.iter().find(is_it).unwrap_or_else(|| panic!("{turn}: {confused:?}"));
        assert!(found["pairs"].as_array().unwrap().len() >= 3, "{found}");
    }
    for pair in confused.iter().flat_map(|it| it["pairs"].as_array().unwrap()) {
        let from_middle = |pose: &Value| (number(&pose[0]) - 2.0).hypot(number(&pose[1]) - 2.0);
        assert!((from_middle(&pair[0]) - from_middle(&pair[1])).abs() < 0.3, "{pair}");
    }
    let board = &starts["landmarks"]["boards"][0];
    let [at, end] = [&board[0], &board[1]].map(|it| [number(&it[0]), number(&it[1])]);
    assert!(((at[0] - end[0]).hypot(at[1] - end[1]) - 0.4).abs() < 1e-6, "{board}");
    assert!(at.iter().any(|place| place.abs() < 1e-6 || (place - 4.0).abs() < 1e-6), "{board}");
    assert!(end.iter().all(|place| (0.3..=3.7).contains(place)), "{board}");
    let with_boards = &starts["landmarks"];
    assert!(
        number(&with_boards["right"]) > 0.7 && number(&with_boards["wrong"]) < 1e-9,
        "{starts}"
    );
    let svg = fs::read_to_string(dir.join("starts.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n") && !svg.contains("NaN"), "{svg}");
    for legend in ["no unique answer", "places that are confused", "proposed boards of 40 cm"] {
        assert!(svg.contains(legend), "{legend} is missing");
    }
}

/// A room without symmetry needs no board. Its door to the outside is open: nevertheless all starts are inside, clear of the walls.
#[test]
fn a_room_with_an_open_door_is_started_in_inside() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    // An L of 5 m × 4 m with a door of 0.9 m in its western wall.
    let outline = [
        [0.0, 1.4],
        [0.0, 0.0],
        [5.0, 0.0],
        [5.0, 2.2],
        [3.1, 2.2],
        [3.1, 4.0],
        [0.0, 4.0],
        [0.0, 2.3],
    ];
    map(dir, &[&outline]);
    let arguments = ["map.csv", "--starts", "6", "--seconds", "40"];
    let answer = text(&check(dir, &[&arguments[..], &["--json"]].concat()));
    let answer: Value = serde_json::from_str(&answer).unwrap();
    let starts = &answer["starts"];
    assert!(number(&starts["right"]) > 0.8 && number(&starts["wrong"]) < 1e-9, "{starts}");
    for place in starts["places"].as_array().unwrap() {
        let [x, y] = [number(&place["at"][0]), number(&place["at"][1])];
        let is_inside = (0.2..=4.8).contains(&x) && (0.2..=3.8).contains(&y);
        assert!(is_inside && (x <= 2.9 || y <= 2.0), "{place}");
        assert!(number(&place["after"]) > 1.0 && place["outcome"] == "right", "{place}");
    }
    let table = text(&check(dir, &["map.csv", "--starts", "1", "--seconds", "5"]));
    assert!(
        table.contains("Starts without a pose, anywhere\n") && table.contains("as it is"),
        "{table}"
    );
}

#[test]
fn wrong_options_and_maps_without_a_place_are_explained() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    map(dir, &[&SQUARE.map(|point| point.map(|place| 0.08 * place))]);
    let cases: [(&[&str], &str); 4] = [
        (&["map.csv", "--starts", "0"], "0 is not in 1.."),
        (
            &["map.csv", "--starts", "1", "--seconds", "nan"],
            "--seconds must be a number above zero",
        ),
        (&["map.csv", "--out", "x.svg"], "--starts"),
        (
            &["map.csv", "--starts", "1"],
            "no place between the walls is 0.20 m away from all of them",
        ),
    ];
    for (arguments, message) in cases {
        let error = error(&check(dir, arguments));
        assert!(error.contains(message), "{arguments:?}: {error}");
    }
}
