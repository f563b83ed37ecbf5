//! The command `sonarfix map`.

#![expect(clippy::unwrap_used, reason = "a test should stop")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use sonarfix::map::Map;
use sonarfix_map::Floor;

fn map(dir: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
    command.current_dir(dir).arg("map").args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// A room with one wall in two pieces and one wall drawn twice.
const FLAWED: &str = "x1,y1,x2,y2,name\n0,0,400,0,south\n400,0,400,300,east\n400,300,0,300,north\n\
                      0,300,0,100,west <1>\n0,100,0,0,west 2\n400,0,0,0,twice\n";

#[test]
fn a_flawed_map_is_checked_simplified_baked_and_drawn() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    fs::write(dir.join("room.csv"), FLAWED).unwrap();

    // GIVEN a map with an error, THEN the error has its line, and the map is not baked.
    let checked = map(dir, &["check", "room.csv", "--unit", "cm"]);
    assert!(!checked.status.success());
    let found = text(&checked.stdout);
    assert!(
        found.starts_with(
            "room.csv:7: \"twice\" and \"south\" (line 2): error: the same wall twice"
        ),
        "{found}"
    );
    let baked = map(dir, &["bake", "room.csv", "--unit", "cm", "--out", "room.bin"]);
    assert!(!baked.status.success() && !dir.join("room.bin").exists());
    assert!(text(&baked.stderr).contains("sonarfix map check room.csv"));

    // WHEN it is simplified, THEN the changes are printed, and the result is correct.
    let simplified = map(
        dir,
        &["simplify", "room.csv", "--unit", "cm", "--out", "room.toml", "--tolerance", "1"],
    );
    let printed = text(&simplified.stdout);
    assert!(printed.contains("joined: \"south\", \"twice\"\n"), "{printed}");
    assert!(printed.ends_with("room.toml: 4 walls of 6\n"), "{printed}");
    assert!(map(dir, &["check", "room.toml"]).status.success());

    // WHEN that is baked, THEN a robot reads the same walls, and the image can be checked and drawn.
    assert!(map(dir, &["bake", "room.toml", "--out", "room.bin"]).status.success());
    let image = fs::read(dir.join("room.bin")).unwrap();
    let floor = Floor::read(&dir.join("room.toml")).unwrap();
    let walls: Vec<_> = Map::read(&image).unwrap().walls().map(|(_, wall)| wall).collect();
    assert_eq!(walls, floor.walls());
    assert!(map(dir, &["check", "room.bin"]).status.success());
    assert!(map(dir, &["draw", "room.bin", "--grid", "--out", "baked.svg"]).status.success());

    assert!(map(dir, &["draw", "room.toml", "--out", "room.svg"]).status.success());
    let svg = fs::read_to_string(dir.join("room.svg")).unwrap();
    assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
    // Escaped names where they fit; the scale bar; no grid by default.
    assert!(svg.contains(">south<") && svg.contains(">west &lt;1&gt;<") && svg.contains(">1 m<"));
    assert!(!svg.contains("clip-path"));
    assert!(fs::read_to_string(dir.join("baked.svg")).unwrap().contains("clip-path"));
}

#[test]
fn errors_are_printed_as_text() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    fs::write(dir.join("room.csv"), FLAWED).unwrap();
    fs::write(dir.join("cut.bin"), b"SFXM\x01\0\0\0 and so on").unwrap();
    let cases: [(&[&str], &str); 4] = [
        (&["check", "room.csv"], "room.csv:1: the unit is missing"),
        (&["check", "cut.bin"], "cut.bin: the map is damaged or cut off"),
        (&["draw", "none.toml", "--out", "x.svg"], "none.toml: cannot be read"),
        (
            &["simplify", "room.csv", "--unit", "cm", "--out", "x.csv", "--tolerance", "nan"],
            "--tolerance must be zero or positive",
        ),
    ];
    for (arguments, message) in cases {
        let output = map(dir, arguments);
        assert!(!output.status.success());
        let error = text(&output.stderr);
        assert!(error.contains(message), "{arguments:?}: {error}");
    }
}

/// Every command that takes a map takes it as TOML, CSV, baked image and scenario: what is missing then is only the log.
#[test]
fn every_command_takes_every_kind_of_map() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let run = |arguments: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
        command.current_dir(dir).args(arguments.split_whitespace()).output().unwrap()
    };
    assert!(run("init .").status.success());
    assert!(run("map bake map.toml --out map.bin").status.success());
    assert!(run("map simplify map.toml --out map.csv").status.success());
    let log = "sonarfix-log,1\nstart,0,1,0.8,0,0.02,0.03\nwheels,0,0,0\nwheels,0.1,0.01,0.01\n\
               range,0.1,-1.5707963,0.8\nwheels,0.2,0.02,0.02\n";
    fs::write(dir.join("log.csv"), log).unwrap();
    fs::write(dir.join("route.csv"), "1,0.8\n1.5,0.8\n").unwrap();
    for map in ["map.toml", "map.csv", "map.bin", "scenario.toml"] {
        for command in [
            format!("map check {map}"),
            format!("plan {map} --path route.csv --sensor hc_sr04"),
            format!("replay log.csv --map {map} --config robot.toml"),
            format!("find log.csv --map {map} --config robot.toml"),
            format!("export log.csv --map {map} --config robot.toml --mcap log.mcap"),
            format!("calibrate log.csv --map {map} --robot robot.toml --out new.toml"),
        ] {
            let errors = text(&run(&command).stderr);
            // A log of a tenth of a second calibrates nothing.
            let is_expected = errors.is_empty() || command.starts_with("calibrate");
            assert!(is_expected && !errors.contains(map), "{command}: {errors}");
        }
    }
}
