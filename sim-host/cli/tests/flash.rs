//! `sonarfix flash` without a board: a folder as its drive, scripts as the tools.

#![expect(clippy::unwrap_used, reason = "a test should stop")]

use std::fs;
use std::io::{BufRead, BufReader};
use std::net::TcpListener;
use std::path::Path;
use std::process::{Command, Stdio};

use sonarfix_boards::image::Image;
use sonarfix_boards::made::{elf, segment};
use sonarfix_boards::uf2;
use tempfile::TempDir;

use crate::common::{MAP, ROBOT};
use crate::endings::errors;
use crate::virtual_robot::Robot;

/// The addresses of docs/firmware.md, and the families of the UF2 list.
const PICO: Place = Place { config: 0x1010_0000, map: 0x1018_0000, family: 0xe48b_ff56 };
const PICO2: Place = Place { config: 0x1010_0000, map: 0x1020_0000, family: 0xe48b_ff59 };

struct Place {
    config: u32,
    map: u32,
    family: u32,
}

/// A folder with a robot, and a program of 5,000 bytes for each family.
pub fn folder() -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    fs::create_dir(at("robot")).unwrap();
    fs::write(at("robot/robot.toml"), ROBOT).unwrap();
    fs::write(at("robot/map.toml"), MAP).unwrap();
    let mut image = Image::default();
    image.add("program", 0x1000_0000, &program()).unwrap();
    for (name, Place { family, .. }) in [("pico.uf2", PICO), ("pico2.uf2", PICO2)] {
        fs::write(at(name), uf2::write(&image, family).unwrap()).unwrap();
    }
    fs::write(at("pico.elf"), elf(0x1000_0101, &[segment(0x1000_0000, &program())])).unwrap();
    fs::write(at("stm32.elf"), elf(0x0801_0001, &[segment(0x0800_0000, &program())])).unwrap();
    dir
}

fn program() -> Vec<u8> {
    (0..5000_u32).map(|n| n.to_le_bytes()[0] ^ 0x5A).collect()
}

/// A drive of a board in its boot mode.
pub fn drive(dir: &TempDir, id: &str) {
    fs::create_dir(dir.path().join("drive")).unwrap();
    let text = format!("UF2 Bootloader v3.0\r\nModel: Raspberry Pi\r\nBoard-ID: {id}\r\n");
    fs::write(dir.path().join("drive/INFO_UF2.TXT"), text).unwrap();
}

/// The standard output of the command in the folder, or its error.
fn run(dir: &TempDir, arguments: &str) -> Result<String, String> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
    command.arg("flash").args(arguments.split(' ')).current_dir(dir.path()).stdin(Stdio::null());
    // Tools of this computer are not started.
    let output = command.env("PATH", dir.path()).output().unwrap();
    let text = String::from_utf8(output.stdout.clone()).unwrap();
    if output.status.success() { Ok(text) } else { Err(text + &errors(&output)) }
}

/// The image that another command bakes.
fn baked(dir: &TempDir, what: &str, file: &str) -> Vec<u8> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
    command.args([what, "bake", file, "--out", "baked.bin"]).current_dir(dir.path());
    assert!(command.output().unwrap().status.success());
    fs::read(dir.path().join("baked.bin")).unwrap()
}

/// Checks that a file has program, map and configuration at their addresses.
fn check(dir: &TempDir, file: &Path, place: &Place) {
    let (image, family) = uf2::read(&fs::read(file).unwrap()).unwrap();
    assert_eq!(family, place.family);
    for (address, bytes) in [
        (0x1000_0000, program()),
        (place.config, baked(dir, "config", "robot/robot.toml")),
        (place.map, baked(dir, "map", "robot/map.toml")),
    ] {
        assert_eq!(image.at(address, bytes.len()), Some(bytes), "{address:#x}");
    }
    // What the robot has stored is not overwritten.
    assert_eq!(image.at(0x1010_8000, 1), None);
}

#[test]
fn a_drive_gets_program_map_and_configuration() {
    for (board, program, id, place) in [
        ("pico", "pico.uf2", "RPI-RP2", PICO),
        ("pico", "pico.elf", "RPI-RP2", PICO),
        ("pico2", "pico2.uf2", "RP2350", PICO2),
    ] {
        let dir = folder();
        drive(&dir, id);
        let arguments = format!("robot --board {board} --program {program} --to drive");
        let file = dir.path().join(format!("drive/sonarfix-{board}.uf2"));
        let dry = run(&dir, &format!("{arguments} --dry-run")).unwrap();
        assert!(dry.contains("would write") && !file.exists(), "{dry}");
        let text = run(&dir, &arguments).unwrap();
        assert!(text.contains("wrote") && text.contains("monitor"), "{text}");
        assert!(text.contains(&format!("{:#010x}", place.map)), "{text}");
        check(&dir, &file, &place);
    }
}

#[test]
fn a_file_is_written_in_place_of_a_drive() {
    let dir = folder();
    let text = run(&dir, "robot --board pico --program pico.uf2 --out robot.uf2").unwrap();
    assert!(text.contains("RPI-RP2"), "{text}");
    check(&dir, &dir.path().join("robot.uf2"), &PICO);
}

#[test]
fn what_does_not_fit_is_refused_with_what_to_do() {
    let dir = folder();
    drive(&dir, "RPI-RP2");
    fs::write(
        dir.path().join("damaged.uf2"),
        &fs::read(dir.path().join("pico.uf2")).unwrap()[..512],
    )
    .unwrap();
    fs::create_dir(dir.path().join("empty")).unwrap();
    for (arguments, reasons) in [
        (
            "robot --board pico --program pico2.uf2 --to drive",
            ["for a Raspberry Pi Pico 2", "--board"],
        ),
        ("robot --board pico2 --program pico2.uf2 --to drive", ["the drive of RPI-RP2", "RP2350"]),
        ("robot --board pico --program stm32.elf --to drive", ["no program for", "0x10000000"]),
        (
            "robot --board pico --program damaged.uf2 --to drive",
            ["damaged.uf2", "all of its blocks"],
        ),
        (
            "robot --board pico --program robot/map.toml --to drive",
            ["neither UF2 nor ELF", "map.toml"],
        ),
        ("robot --board pico --program pico.uf2 --to robot", ["INFO_UF2.TXT", "BOOTSEL"]),
        ("robot --board pico --to drive", ["firmware/sonarfix-pico.uf2", "--program"]),
        ("empty --board pico --program pico.uf2", ["sonarfix init", "robot.toml"]),
        ("robot --board arduino --program pico.uf2", ["there are", "pico2"]),
        ("robot --board stm32f405 --program pico.uf2", ["takes an ELF", "sonarfix-stm32f405.elf"]),
        ("robot --board stm32f405 --program pico.elf", ["no program for", "0x08000000"]),
        ("robot --board stm32f405 --program stm32.elf --to drive", ["no UF2", "--to"]),
    ] {
        let error = run(&dir, arguments).unwrap_err();
        assert!(reasons.iter().all(|reason| error.contains(reason)), "{arguments}: {error}");
    }
    assert_eq!(fs::read_dir(dir.path().join("drive")).unwrap().count(), 1);
}

#[test]
fn a_map_that_is_too_large_is_refused() {
    let dir = folder();
    let wall = |n: u32| {
        let (x, y) = (n % 100, n / 100 * 2);
        format!("    {{ name = \"{n}\", from = [{x}, {y}], to = [{x}, {}] }},\n", y + 1)
    };
    let walls: String = (0..7000).map(wall).collect();
    let map = format!("format = 1\n[map]\nunit = \"m\"\nwall = [\n{walls}]\n");
    fs::write(dir.path().join("robot/map.toml"), map).unwrap();
    let error = run(&dir, "robot --board stm32f405 --program stm32.elf").unwrap_err();
    assert!(error.contains("has room for 131072"), "{error}");
}

/// A script that writes its arguments into `calls`.
#[cfg(unix)]
fn install(dir: &TempDir, name: &str) {
    use std::os::unix::fs::PermissionsExt;
    let file = dir.path().join(name);
    let calls = dir.path().join("calls");
    let script = format!("#!/bin/sh\necho {name} \"$@\" >> {}\n", calls.display());
    fs::write(&file, script).unwrap();
    fs::set_permissions(&file, PermissionsExt::from_mode(0o755)).unwrap();
}

#[cfg(unix)]
#[test]
fn a_board_without_a_drive_is_flashed_by_its_tool() {
    for (board, tool, program, first, last) in [
        ("stm32f405", "probe-rs", "stm32.elf", "0x08004000 robot/config.bin", "probe-rs reset"),
        ("esp32c6", "espflash", "stm32.elf", "0x00100000 robot/config.bin", "espflash flash"),
    ] {
        let dir = folder();
        let arguments = format!("robot --board {board} --program {program}");
        let missing = run(&dir, &arguments).unwrap_err();
        assert!(missing.contains(first) && missing.contains("is not installed"), "{missing}");
        assert_eq!(
            fs::read(dir.path().join("robot/map.bin")).unwrap(),
            baked(&dir, "map", "robot/map.toml")
        );
        install(&dir, tool);
        // Without those that ask whether the tool is installed.
        let calls = || {
            let made = fs::read_to_string(dir.path().join("calls")).unwrap_or_default();
            made.lines().filter(|it| !it.contains("--version")).map(str::to_owned).collect()
        };
        let calls: &dyn Fn() -> Vec<String> = &calls;
        let dry = run(&dir, &format!("{arguments} --dry-run")).unwrap();
        assert!(dry.contains(first) && calls().is_empty(), "{dry}");
        let text = run(&dir, &arguments).unwrap();
        let made = calls();
        assert!(made.first().unwrap().ends_with(first), "{made:?}");
        assert!(made.last().unwrap().starts_with(last), "{made:?}");
        assert!(made.iter().all(|call| text.contains(call)), "{text}");
    }
}

/// The output of flashing a drive with the robot of a folder that `init` has made, whose `Hello` arrives at a port.
fn flash_and_wait(dir: &TempDir, port: &str, seconds: u32) -> Result<String, String> {
    let to = "robot --board pico --program pico.uf2 --to drive";
    run(dir, &format!("{to} --port {port} --wait {seconds}"))
}

/// A folder with the robot of `init`, and that robot at a socket, with the configuration and the map of its scenario.
fn virtual_robot() -> (TempDir, Robot, String) {
    let dir = folder();
    drive(&dir, "RPI-RP2");
    fs::remove_dir_all(dir.path().join("robot")).unwrap();
    let mut init = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
    init.args(["init", "robot", "--board", "pico"]).current_dir(dir.path()).stdin(Stdio::null());
    assert!(init.output().unwrap().status.success());
    let scenario = dir.path().join("robot/scenario.toml").display().to_string();
    let robot = Robot::with(&[&scenario, "--stand", "--tcp", "0"]);
    let port = robot.ports.last().unwrap().clone();
    (dir, robot, port)
}

#[test]
fn the_hello_of_the_robot_is_compared_with_what_was_flashed() {
    let (dir, _robot, port) = virtual_robot();
    let text = flash_and_wait(&dir, &port, 60).unwrap();
    assert!(text.contains("has this configuration and this map"), "{text}");
    for (file, from, to, reasons) in [
        (
            "robot/robot.toml",
            "track_width = \"121 mm\"",
            "track_width = \"122 mm\"",
            ["the robot's configuration is", "set-configuration"],
        ),
        ("robot/map.toml", "[4.0, 0.0]", "[4.01, 0.0]", ["the robot's map is", "flash it again"]),
    ] {
        let path = dir.path().join(file);
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.contains(from), "{text}");
        fs::write(&path, text.replace(from, to)).unwrap();
        let error = flash_and_wait(&dir, &port, 60).unwrap_err();
        assert!(reasons.iter().all(|reason| error.contains(reason)), "{error}");
        let differs = error.lines().filter(|line| line.contains("as flashed")).count();
        assert_eq!(differs, 1, "{error}");
        fs::write(&path, text).unwrap();
    }
}

#[test]
fn a_robot_that_is_silent_or_absent_is_an_error_with_its_causes() {
    let dir = folder();
    drive(&dir, "RPI-RP2");
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp:{}", listener.local_addr().unwrap());
    let silent = flash_and_wait(&dir, &port, 1).unwrap_err();
    let reasons = ["1 s at most", "no Hello", "TX and RX"];
    assert!(reasons.iter().all(|reason| silent.contains(reason)), "{silent}");
    drop(listener);
    let absent = flash_and_wait(&dir, &port, 1).unwrap_err();
    assert!(absent.contains("cannot open the port"), "{absent}");
    // The file is written all the same.
    check(&dir, &dir.path().join("drive/sonarfix-pico.uf2"), &PICO);
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_the_wait() {
    use std::os::unix::process::ExitStatusExt;
    let dir = folder();
    drive(&dir, "RPI-RP2");
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp:{}", listener.local_addr().unwrap());
    let to = "flash robot --board pico --program pico.uf2 --to drive --wait 600 --port";
    let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
    command.args(to.split(' ')).arg(port).current_dir(dir.path()).stdout(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    lines.find(|line| line.as_ref().unwrap().contains("waiting for Hello")).unwrap().unwrap();
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-s", "INT", &id]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().signal(), Some(2));
}
