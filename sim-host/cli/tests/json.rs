//! `--json`: one value on standard output, whose keys are in docs/formats.md. `--quiet` and `--verbose`.

#![expect(clippy::unwrap_used, reason = "a test should stop")]

use std::path::Path;
use std::process::Stdio;

use serde_json::Value;
use sonarfix_replay::convert::carmen::Carmen;

use crate::endings::{CLASSROOM, errors, files, printing};

/// All keys of a value and of what is in it.
fn keys(value: &Value, found: &mut Vec<String>) {
    match value {
        Value::Object(fields) => {
            for (key, value) in fields {
                found.push(key.clone());
                keys(value, found);
            }
        }
        Value::Array(values) => values.iter().for_each(|value| keys(value, found)),
        _ => {}
    }
}

/// Checks that the part of docs/formats.md about JSON names every key of a value.
pub fn assert_documented(value: &Value) {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/formats.md");
    let page = std::fs::read_to_string(page).unwrap();
    let (_, part) = page.split_once("## JSON output").unwrap();
    let (part, _) = part.split_once("\n## ").unwrap();
    let mut found = Vec::new();
    keys(value, &mut found);
    assert!(!found.is_empty());
    for key in found {
        assert!(part.contains(&format!("`{key}`")), "docs/formats.md does not name `{key}`");
    }
}

/// What a command prints with `--json`.
fn json(arguments: &[&str], folder: &Path) -> Value {
    let arguments = [arguments, &["--json"]].concat();
    let output = printing(&arguments, folder).stdout(Stdio::piped()).output().unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", errors(&output));
    let value = serde_json::from_slice(&output.stdout);
    let value = value.unwrap();
    assert_documented(&value);
    value
}

#[test]
fn every_result_is_one_value_with_documented_keys() {
    let folder = files();
    let of = |arguments: &[&str]| json(arguments, folder.path());

    let survey = of(&["survey", "FILES/survey/log.csv", "--compare", "FILES/survey/true-map.toml"]);
    let walls = survey["walls"].as_array().unwrap();
    assert!(!walls.is_empty() && walls[0]["from"][0].is_f64(), "{survey}");
    assert_eq!(survey["compared"]["walls"].as_array().unwrap().len(), walls.len());

    let converted = of(&["convert", "carmen", "FILES/carmen.log", "--out", "FILES/converted"]);
    let [from, to] = ["carmen.log", "again"].map(|name| folder.path().join(name));
    let again = Carmen { from: &from, walls: None, to: &to }.convert(&mut |_| ()).unwrap();
    for (key, value) in serde_json::to_value(again).unwrap().as_object().unwrap() {
        assert_eq!(&converted[key], value, "{key}");
    }
    assert_eq!(converted["scans"], 2);

    let checked = of(&["map", "check", "FILES/map.toml"]);
    assert_eq!((&checked["walls"], &checked["errors"]), (&4.into(), &0.into()));
    let baked = of(&["map", "bake", "FILES/map.toml", "--out", "FILES/map.bin"]);
    let bytes = std::fs::read(folder.path().join("map.bin")).unwrap();
    // The robot reports the one that the image ends with, over what is before it.
    let contents = bytes.split_last_chunk::<4>().unwrap().0;
    let checksum = format!("{:08x}", sonarfix::map::image::checksum(contents));
    assert_eq!(baked["checksum"], checksum);
    assert_eq!(baked["bytes"], bytes.len());
    assert!(baked["grid"]["columns"].as_u64().unwrap() > 0);
    let halves = "x1_m,y1_m,x2_m,y2_m,name\n0,0,1,0,first\n1,0,2,0,second\n5,5,5,5.001,short\n";
    std::fs::write(folder.path().join("halves.csv"), halves).unwrap();
    let simplify = ["map", "simplify", "FILES/halves.csv", "--out", "FILES/one.csv"];
    let simplified = of(&[simplify.as_slice(), &["--shortest", "10"]].concat());
    assert_eq!((&simplified["walls_before"], &simplified["walls"]), (&3.into(), &1.into()));
    assert_eq!(simplified["joined"][0], Value::from(vec!["first", "second"]));
    assert_eq!(simplified["dropped"][0], Value::from(vec!["short"]));
    let import = ["map", "import", "FILES/room.geojson", "--unit", "m", "--out", "FILES/room.toml"];
    assert_eq!(of(&import)["walls"], 2);
}

/// A map with errors is still described, and the command fails.
#[test]
fn errors_of_a_map_are_findings() {
    let folder = files();
    let twice = "x1_m,y1_m,x2_m,y2_m,name\n0,0,1,0,one\n0,0,1,0,other\n";
    std::fs::write(folder.path().join("twice.csv"), twice).unwrap();
    let arguments = ["map", "check", "FILES/twice.csv", "--json"];
    let output = printing(&arguments, folder.path()).stdout(Stdio::piped()).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let value: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_documented(&value);
    let finding = &value["findings"][0];
    let names = [&finding["wall"], &finding["other"]].map(|name| name.as_str().unwrap());
    assert_eq!(finding["severity"], "error");
    assert!(names.contains(&"one") && names.contains(&"other"), "{finding}");
}

#[test]
fn a_quiet_command_makes_no_remarks_and_a_verbose_one_names_its_files() {
    let folder = files();
    let remarks = |option: &[&str]| {
        let bake = ["map", "bake", "FILES/map.toml", "--out", "FILES/map.bin"];
        let arguments = [option, &bake].concat();
        let output = printing(&arguments, folder.path()).stdout(Stdio::piped()).output().unwrap();
        assert!(output.status.success(), "{}", errors(&output));
        errors(&output)
    };
    assert_eq!(remarks(&["--quiet"]), "");
    assert_eq!(remarks(&["-q"]), "");
    let usual = remarks(&[]);
    assert!(usual.contains("4 walls") && !usual.contains("wrote"), "{usual}");
    let verbose = remarks(&["-v"]);
    let named = |verb: &str, file: &str| {
        let line = format!("{verb} {}", folder.path().join(file).display());
        verbose.lines().any(|it| it == line)
    };
    assert!(named("read", "map.toml") && named("wrote", "map.bin"), "{verbose}");

    // Errors and results remain.
    let arguments = ["-q", "map", "check", "FILES/missing.toml"];
    let output = printing(&arguments, folder.path()).output().unwrap();
    assert!(errors(&output).starts_with("error: "), "{}", errors(&output));
    let arguments = ["bound", CLASSROOM, "--quiet"];
    let output = printing(&arguments, folder.path()).stdout(Stdio::piped()).output().unwrap();
    assert!(!output.stdout.is_empty() && errors(&output).is_empty());
}
