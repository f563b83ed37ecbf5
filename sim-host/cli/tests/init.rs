//! `sonarfix init`: the files of a new robot.

#![expect(clippy::unwrap_used, reason = "a test should stop")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// The rows of `firmware/boards.toml`.
fn boards() -> Vec<toml::Table> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../firmware/boards.toml");
    let table: toml::Table = fs::read_to_string(path).unwrap().parse().unwrap();
    let rows = table.get("board").unwrap().as_array().unwrap();
    rows.iter().map(|row| row.as_table().unwrap().clone()).collect()
}

fn text<'t>(board: &'t toml::Table, key: &str) -> &'t str {
    board.get(key).unwrap().as_str().unwrap()
}

fn sonarfix(dir: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
    // A standard input that never ends: the command must not wait for it.
    command.current_dir(dir).args(arguments).stdin(Stdio::piped());
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let input = child.stdin.take();
    let output = child.wait_with_output().unwrap();
    drop(input);
    output
}

fn run(dir: &Path, arguments: &[&str]) -> String {
    let output = sonarfix(dir, arguments);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {errors}");
    String::from_utf8(output.stdout).unwrap()
}

fn refusal(dir: &Path, arguments: &[&str]) -> String {
    let output = sonarfix(dir, arguments);
    assert!(!output.status.success(), "{arguments:?}");
    String::from_utf8(output.stderr).unwrap()
}

/// Every board, sonar and servo: its files are valid, run, and fit into the board's flash.
#[test]
fn the_files_of_every_robot_are_used_without_an_error() {
    let dir = tempfile::tempdir().unwrap();
    let boards = boards();
    assert!(boards.len() >= 3);
    for board in &boards {
        for sonar in ["hc_sr04", "lv_maxsonar"] {
            for servo in ["sg90", "mg996r"] {
                let name = format!("{}-{sonar}-{servo}", text(board, "name"));
                let options = ["--board", text(board, "name"), "--sonar", sonar, "--servo", servo];
                run(dir.path(), &[&["init", &name], &options[..]].concat());
                let robot = dir.path().join(&name);
                let checked = run(&robot, &["map", "check", "map.toml", "--robot", "robot.toml"]);
                assert!(checked.contains("0 errors, 0 warnings"), "{name}: {checked}");
                run(&robot, &["config", "bake", "robot.toml", "--out", "config.bin"]);
                run(&robot, &["map", "bake", "map.toml", "--out", "map.bin"]);
                run(&robot, &["run", "scenario.toml", "--runs", "1"]);
                run(&robot, &["plan", "scenario.toml", "--runs", "1"]);
                fits(&robot, board);
                readme(&robot, board, &["servo", "trigger", "echo"]);
            }
        }
    }
}

/// A robot with two rangers of light is not baked for a board without a bus, nor for a program without these features.
fn refused_by_others(robot: &Path) {
    let refusal = |options: &[&str]| {
        let bake = ["config", "bake", "robot.toml", "--out", "refused.bin"];
        let error = refusal(robot, &[&bake[..], options].concat());
        assert!(!robot.join("refused.bin").exists(), "{error}");
        error
    };
    for board in boards().iter().filter(|board| !board.contains_key("bus")) {
        let error = refusal(&["--board", text(board, "name")]);
        assert!(error.contains(text(board, "title")) && error.contains("ranger"), "{error}");
    }
    for (features, missing) in
        [("rangers,gyro,informative", "light"), ("light,gyro,informative", "rangers")]
    {
        let error = refusal(&["--features", features]);
        assert!(error.contains(&format!("`{missing}`")), "{error}");
    }
    assert!(refusal(&["--board", "pico3"]).contains("pico2"));
    assert!(refusal(&["--features", "lights"]).contains("light, gyro"));
}

/// A ranger of light, alone or with a second one: on the boards that have a bus, with its pins; refused by name on the others.
#[test]
fn the_files_of_a_robot_with_light_are_used_without_an_error() {
    let dir = tempfile::tempdir().unwrap();
    for board in &boards() {
        for sonar in ["vl53l1x", "vl53l0x"] {
            let name = format!("{}-{sonar}", text(board, "name"));
            let options = ["init", &name, "--board", text(board, "name"), "--sonar", sonar];
            let second = [&options[..], &["--second-at", "90 deg"]].concat();
            let Some(bus) = board.get("bus") else {
                let error = refusal(dir.path(), &options);
                assert!(error.contains(text(board, "title")) && error.contains("bus"), "{error}");
                let sonars = [&options[..4], &["--second-at", "90 deg"]].concat();
                let error = refusal(dir.path(), &sonars);
                assert!(error.contains("has one ranger"), "{error}");
                continue;
            };
            run(dir.path(), &second);
            let robot = dir.path().join(&name);
            let checked = run(&robot, &["map", "check", "map.toml", "--robot", "robot.toml"]);
            assert!(checked.contains("0 errors, 0 warnings"), "{name}: {checked}");
            refused_by_others(&robot);
            let bake = ["config", "bake", "robot.toml", "--out", "config.bin"];
            run(&robot, &[&bake[..], &["--board", text(board, "name")]].concat());
            run(&robot, &["map", "bake", "map.toml", "--out", "map.bin"]);
            let json = run(&robot, &["run", "scenario.toml", "--runs", "2", "--json"]);
            let summary: serde_json::Value = serde_json::from_str(&json).unwrap();
            assert_eq!(summary.get("lost_runs").unwrap(), 0, "{name}: {summary}");
            run(&robot, &["plan", "scenario.toml", "--runs", "1"]);
            fits(&robot, board);
            readme(&robot, board, &["servo"]);
            let readme = fs::read_to_string(robot.join("README.md")).unwrap();
            for bus in [bus, &board["second"]["bus"]] {
                let [scl, sda] =
                    ["scl", "sda"].map(|line| bus.get(line).unwrap().as_str().unwrap());
                assert!(readme.contains(&format!("{scl}, {sda}")), "{name}: {readme}");
            }
        }
    }
}

fn fits(robot: &Path, board: &toml::Table) {
    for (file, key) in [("config.bin", "config"), ("map.bin", "map")] {
        let bytes = board.get(key).unwrap().get("bytes").unwrap().as_integer().unwrap();
        let length = fs::metadata(robot.join(file)).unwrap().len();
        assert!(i64::try_from(length).unwrap() <= bytes, "{file}: {length} bytes");
    }
}

/// The commands and pins are those of the board, and nothing is left of the template.
/// The pins of a ranger are those of `ranger`.
fn readme(robot: &Path, board: &toml::Table, ranger: &[&str]) {
    for file in ["robot.toml", "map.toml", "scenario.toml", "README.md"] {
        let text = fs::read_to_string(robot.join(file)).unwrap();
        assert!(!text.contains('@'), "{file}: {text}");
    }
    let readme = fs::read_to_string(robot.join("README.md")).unwrap();
    for key in ["title", "package", "target", "chip"] {
        assert!(readme.contains(text(board, key)), "{key}");
    }
    let of_rangers = ["servo", "trigger", "echo"];
    for (signal, pin) in board.get("pins").unwrap().as_table().unwrap() {
        if of_rangers.contains(&signal.as_str()) && !ranger.contains(&signal.as_str()) {
            continue;
        }
        assert!(readme.contains(pin.as_str().unwrap()), "{signal}");
    }
    for key in ["config", "map"] {
        let address = board.get(key).unwrap().get("address").unwrap().as_integer().unwrap();
        assert!(readme.contains(&format!("0x{address:08X}")), "{key}");
    }
}

/// In the simulated drive of the written files no robot is lost, and the pose is known to centimetres.
#[test]
fn the_written_robot_finds_its_way() {
    let dir = tempfile::tempdir().unwrap();
    let options = ["--wheel-diameter", "68 mm", "--track-width", "14 cm", "--ticks-per-revolution"];
    run(dir.path(), &[&["init", "robot"], &options[..], &["900"]].concat());
    let json = run(&dir.path().join("robot"), &["run", "scenario.toml", "--json"]);
    let summary: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(summary.get("lost_runs").unwrap(), 0, "{summary}");
    let rms = |axis: &str| summary["rms_path"][axis].as_f64().unwrap();
    assert!(rms("x").hypot(rms("y")) < 0.03, "{summary}");
}

/// The robot file of an XRP in the repository, which is tested on an emulated chip, is the one that is written.
#[test]
fn the_robot_file_of_the_xrp_is_the_written_one() {
    let dir = tempfile::tempdir().unwrap();
    run(dir.path(), &["init", ".", "--board", "xrp"]);
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../firmware/xrp/robot.toml");
    let written = fs::read_to_string(dir.path().join("robot.toml")).unwrap();
    assert_eq!(fs::read_to_string(file).unwrap(), written, "copy it to firmware/xrp");
    let json = run(dir.path(), &["run", "scenario.toml", "--json"]);
    let summary: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(summary.get("lost_runs").unwrap(), 0, "{summary}");
    let rms = |axis: &str| summary["rms_path"][axis].as_f64().unwrap();
    assert!(rms("x").hypot(rms("y")) < 0.01, "{summary}");
}

/// A rectangular room is the map, and the simulated drive in it is valid.
#[test]
fn a_room_is_the_map_and_has_a_path() {
    let dir = tempfile::tempdir().unwrap();
    run(dir.path(), &["init", "robot", "--room", "5 x 3.5"]);
    let robot = dir.path().join("robot");
    let map = fs::read_to_string(robot.join("map.toml")).unwrap();
    assert_eq!(map.matches("name = ").count(), 4, "{map}");
    assert!(map.contains("to = [5.0, 3.5]"), "{map}");
    let drawing = fs::read_to_string(robot.join("wiring.svg")).unwrap();
    assert!(drawing.contains("Raspberry Pi Pico 2") && drawing.contains("HC-SR04"), "{drawing}");
    let json = run(&robot, &["run", "scenario.toml", "--runs", "2", "--json"]);
    let summary: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(summary.get("lost_runs").unwrap(), 0, "{summary}");
}

/// A robot that is to find its pose needs motors that run while it is lost, and the file states it.
#[test]
fn the_written_robot_can_be_changed_to_find_its_pose() {
    let dir = tempfile::tempdir().unwrap();
    run(dir.path(), &["init", "."]);
    let file = dir.path().join("robot.toml");
    let written = fs::read_to_string(&file).unwrap();
    let searching = written.replace("\nstart = \"known\"", "\nstart = \"unknown\"");
    assert_ne!(searching, written);
    fs::write(&file, &searching).unwrap();
    let bake = ["config", "bake", "robot.toml", "--out", "config.bin"];
    let error = refusal(dir.path(), &bake);
    assert!(error.contains("motors.lost") && error.contains("write \"on\""), "{error}");
    let driving = searching.replace("\nlost = \"off\"", "\nlost = \"on\"");
    assert_ne!(driving, searching);
    fs::write(&file, driving).unwrap();
    run(dir.path(), &bake);
}

#[test]
fn a_folder_with_files_is_left_alone() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("mine.txt"), "mine").unwrap();
    let error = refusal(dir.path(), &["init", "."]);
    assert!(error.contains("is not empty"), "{error}");
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
}

#[test]
fn wrong_answers_are_refused_and_leave_no_folder() {
    let dir = tempfile::tempdir().unwrap();
    let cases: [(&[&str], &str); 10] = [
        (&["--board", "arduino"], "pico2"),
        (&["--sonar", "srf08"], "hc_sr04, lv_maxsonar, vl53l1x, vl53l0x"),
        (&["--second-at", "90"], "a unit is missing"),
        (&["--servo", "sg91"], "sg90, mg996r"),
        (&["--wheel-diameter", "65"], "a unit is missing"),
        (&["--wheel-diameter", "0 mm"], "must be from 1 mm to 10 m"),
        (&["--track-width", "12\" }"], "is no value"),
        (&["--ticks-per-revolution", "nan"], "is not a positive number"),
        (&["--room", "4 m"], "write, for example, 4 x 3"),
        (&["--room", "4 x 0"], "write, for example, 4 x 3"),
    ];
    for (options, message) in cases {
        let error = refusal(dir.path(), &[&["init", "robot"], options].concat());
        assert!(error.contains(message), "{options:?}: {error}");
        assert!(!dir.path().join("robot").exists(), "{options:?}");
    }
}

/// The table has the regions of the linker's memory maps.
#[test]
fn the_table_of_boards_agrees_with_the_memory_maps() {
    for board in boards() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
        let memory = fs::read_to_string(Path::new(path).join(text(&board, "memory"))).unwrap();
        for (region, key) in [("CONFIG", "config"), ("MAP", "map")] {
            let number =
                |what: &str| board.get(key).unwrap().get(what).unwrap().as_integer().unwrap();
            let size = match number("bytes") {
                bytes if bytes % (1 << 20) == 0 => format!("{}M", bytes >> 20),
                bytes => format!("{}K", bytes >> 10),
            };
            let line = format!("{region} : ORIGIN = 0x{:08X}, LENGTH = {size}", number("address"));
            assert!(memory.contains(&line), "{}: {line}", text(&board, "name"));
        }
    }
}

/// The page of the firmware has the table's programs and addresses, the guide its pins.
#[test]
fn the_docs_have_the_table_of_boards() {
    let docs = |page: &str| {
        fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs").join(page))
            .unwrap()
    };
    let (firmware, guide, kit) = (docs("firmware.md"), docs("build-a-robot.md"), docs("xrp.md"));
    for board in boards() {
        let number = |key: &str, what: &str| board[key][what].as_integer().unwrap();
        let row = format!(
            "| `{}` | `{}` | `{}` | `{}` | 0x{:08X} | 0x{:08X}, {} |",
            text(&board, "name"),
            text(&board, "package"),
            text(&board, "target"),
            text(&board, "chip"),
            number("config", "address"),
            number("map", "address"),
            number("map", "bytes"),
        );
        assert!(firmware.contains(&row), "docs/firmware.md lacks {row}");
        let guide = if board.contains_key("kit") { &kit } else { &guide };
        let name = format!("`{}`", text(&board, "name"));
        let header = guide.lines().find(|line| line.starts_with("| signal |")).unwrap();
        let column = header.split('|').position(|cell| cell.contains(&name)).unwrap();
        let rows: Vec<&str> =
            guide.lines().filter_map(|line| line.split('|').nth(column)).collect();
        for (signal, pin) in board["pins"].as_table().unwrap() {
            let pin = pin.as_str().unwrap();
            let has_pin = |cell: &&str| cell.split_whitespace().next() == Some(pin);
            assert!(rows.iter().any(has_pin), "{name} {signal}: {pin}");
        }
        let second = board.get("second").and_then(toml::Value::as_table);
        let buses = [board.get("bus"), second.and_then(|second| second.get("bus"))];
        let buses = buses.into_iter().flatten().filter_map(toml::Value::as_table);
        for (signal, pin) in second.into_iter().chain(buses).flatten() {
            let Some(pin) = pin.as_str() else { continue };
            assert!(rows.iter().any(|cell| cell.contains(pin)), "{name} {signal}: {pin}");
        }
        for resistor in board.get("divider").and_then(toml::Value::as_array).into_iter().flatten() {
            assert!(guide.contains(resistor.as_str().unwrap()), "{name}: {resistor}");
        }
    }
}

/// Ten typical mistakes of a builder who edits the three files: one run names each with its file and what to write.
#[test]
fn ten_mistakes_in_the_written_files_are_answered_at_once() {
    let dir = tempfile::tempdir().unwrap();
    run(dir.path(), &["init", "."]);
    let changes = [
        ("map.toml", "unit = \"m\"", "unit = \"metres\"", "must be one of m, cm, mm"),
        ("map.toml", "\"east\", from", "\"east\", form", "did you mean `from`?"),
        ("robot.toml", "track_width = \"121 mm\"", "track_width = 121", "write \"121 m\" or"),
        ("robot.toml", "mirrored = true", "mirrord = true", "did you mean `mirrored`?"),
        ("robot.toml", "servo_timing = \"sg90\"", "servo_timing = \"SG90\"", "mean \"sg90\"?"),
        ("robot.toml", "ranger = \"hc_sr04\"", "ranger = \"HC-SR04\"", "mean \"hc_sr04\"?"),
        ("robot.toml", "encoder_period = \"50 ms\"", "", "write, for example, encoder_period"),
        ("scenario.toml", "fidelity = \"pins\"", "fidelity = \"pin\"", "did you mean \"pins\"?"),
        ("scenario.toml", "speed = \"0.2 m/s\"", "speed = \"0.2 m\"", "is not a speed"),
        ("scenario.toml", "laps = 4", "laps = 4.5", "must be a whole number"),
    ];
    for (name, old, new, _) in changes {
        let file = dir.path().join(name);
        let text = fs::read_to_string(&file).unwrap();
        assert!(text.contains(old), "{name}: {old}");
        fs::write(&file, text.replacen(old, new, 1)).unwrap();
    }
    let error = refusal(dir.path(), &["run", "scenario.toml"]);
    for (name, old, _, remedy) in changes {
        let answered = error.lines().any(|line| line.contains(name) && line.contains(remedy));
        assert!(answered, "{name}, {old}: {error}");
    }
}
