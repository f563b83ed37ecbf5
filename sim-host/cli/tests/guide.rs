//! `cargo xtask guide` follows `docs/build-a-robot.md` in simulation: from an empty folder to the fixes of a drive, with the files that
//! `sonarfix init` writes.
//!
//! | step | on |
//! |---|---|
//! | `init`, `map check`, a simulated drive, both images | this computer, for every board |
//! | the board's identification, its signs of life, `set-pose`, `start`, `stop` | the firmware of the reference board, in QEMU, with both images in its flash |
//! | a drive by the estimate, with its fixes | the application on the emulated core of each chip, with both images and simulated devices |
//!
//! QEMU has no encoder, servo or sonar of the reference board, so there the signs of life must say that they are missing.

use std::fs;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use anyhow::{Context, bail, ensure};
use serde_json::Value;
use sonarfix_boards::Board;

/// The package of the firmware that QEMU runs.
const REFERENCE: &str = "sonarfix-stm32f405";

/// Simulated time of a drive, seconds.
const SECONDS: &str = "20";

/// Attempts to open a port, a tenth of a second apart.
const ATTEMPTS: u32 = 100;

/// What the signs of life of the board in QEMU must show: a device and a part of its line.
const SIGNS: [(&str, &str); 6] = [
    ("board", "good  the program runs, and has a map and a configuration"),
    ("supply", "good"),
    ("right encoder", "WRONG its counter does not run"),
    ("left encoder", "WRONG its counter does not run"),
    ("servo", "WRONG its PWM channel refuses"),
    ("sonar", "WRONG no pulse on the echo line"),
];

/// The steps for each board; `SONARFIX_FIRMWARE` is the firmware of the reference board.
#[test]
#[ignore = "needs the firmware and QEMU; `cargo xtask guide` runs it"]
fn the_guide_leads_to_a_drive_on_every_board() -> anyhow::Result<()> {
    let firmware = std::env::var_os("SONARFIX_FIRMWARE").map(PathBuf::from);
    let firmware = firmware.context("SONARFIX_FIRMWARE is not set")?;
    let folder = tempfile::tempdir()?;
    for board in sonarfix_boards::all()? {
        let robot = folder.path().join(&board.name);
        prepare(folder.path(), &robot, &board)?;
        if board.package == REFERENCE {
            bring_up(&robot, &board, &firmware)?;
        }
        drive(&robot, &board)?;
    }
    Ok(())
}

/// Writes the files of a robot, checks them, and bakes both images.
fn prepare(folder: &Path, robot: &Path, board: &Board) -> anyhow::Result<()> {
    sonarfix(folder, &["init", &board.name, "--board", &board.name])?;
    sonarfix(robot, &["map", "check", "map.toml", "--robot", "robot.toml"])?;
    let simulated = json(robot, &["run", "scenario.toml", "--runs", "4", "--json"])?;
    ensure!(number(&simulated, &["lost_runs"]) == Some(0), "{}: a robot is lost", board.name);
    sonarfix(robot, &["config", "bake", "robot.toml", "--out", "config.bin"])?;
    sonarfix(robot, &["map", "bake", "map.toml", "--out", "map.bin"])?;
    Ok(())
}

/// Switches the reference board on in QEMU, reads its signs of life, and starts and stops it.
fn bring_up(robot: &Path, board: &Board, firmware: &Path) -> anyhow::Result<()> {
    let emulator = Emulator::start(robot, board, firmware)?;
    let port = emulator.port.as_str();
    // A Hello comes every 10 s.
    let signs = ["monitor", "--port", port, "--signs-of-life", "--seconds", "11"];
    let signs = sonarfix(robot, &signs)?;
    for (device, part) in SIGNS {
        let line = signs.lines().rev().find(|line| line.starts_with(device));
        ensure!(line.is_some_and(|line| line.contains(part)), "{device}: not `{part}` in\n{signs}");
    }
    for command in [&["set-pose", "1.0", "0.8", "0"][..], &["start"], &["stop"]] {
        let answer = sonarfix(robot, &[&["command", "--port", port][..], command].concat())?;
        ensure!(answer == "done\n", "{command:?}: {answer}");
    }
    println!("{}: Hello, signs of life, start and stop in QEMU", board.name);
    Ok(())
}

/// Drives by the estimate on the emulated core of the board's chip, if there is one.
fn drive(robot: &Path, board: &Board) -> anyhow::Result<()> {
    let Some(machine) = machine(&board.target) else {
        println!("{}: no emulated core", board.name);
        return Ok(());
    };
    // The emulated robot has the baked files, as in flash.
    let scenario = fs::read_to_string(robot.join("scenario.toml"))?;
    fs::write(robot.join("baked.toml"), scenario.replace("\"map.toml\"", "\"map.bin\""))?;
    let drive = ["pil", "baked.toml", "--robot", "config.bin", "--machine", machine];
    let drive = sonarfix(robot, &[&drive[..], &["--seconds", SECONDS]].concat())?;
    let accepted = drive.lines().find_map(|line| line.split_once(" ranges accepted"));
    let accepted: u32 = accepted.context("no count of ranges")?.0.parse()?;
    ensure!(accepted > 0, "{}: no fix in {SECONDS} s", board.name);
    for part in ["are equal to the bit", "\n0 deadlines missed"] {
        ensure!(drive.contains(part), "{}: not `{part}` in\n{drive}", board.name);
    }
    println!("{}: {accepted} fixes in {SECONDS} s of driving on an emulated {machine}", board.name);
    Ok(())
}

/// The machine of `sonarfix pil` for the chip of a target.
fn machine(target: &str) -> Option<&'static str> {
    match target {
        "thumbv7em-none-eabihf" => Some("m4f"),
        "thumbv8m.main-none-eabihf" => Some("m33"),
        "thumbv6m-none-eabi" => Some("m0plus"),
        "riscv32imac-unknown-none-elf" => Some("rv32"),
        _ => None,
    }
}

/// The reference board in QEMU, ended when it is dropped.
struct Emulator {
    child: Child,
    /// Its link, as `--port`.
    port: String,
}

impl Emulator {
    /// Starts it as the tests of the firmware do (`sonarfix-app`, `emulated`), with the link on a socket.
    fn start(robot: &Path, board: &Board, firmware: &Path) -> anyhow::Result<Self> {
        // The system names a free port.
        let address = TcpListener::bind("127.0.0.1:0")?.local_addr()?;
        let mut qemu = Command::new("qemu-system-arm");
        qemu.args(["-machine", "netduinoplus2", "-icount", "shift=0,sleep=off"]);
        qemu.args(["-display", "none", "-monitor", "none", "-kernel"]).arg(firmware);
        for (file, address) in
            [("map.bin", board.map.address), ("config.bin", board.config.address)]
        {
            let file = robot.join(file);
            let image = format!("loader,file={},addr={address:#x},force-raw=on", file.display());
            qemu.args(["-device", &image]);
        }
        qemu.args(["-serial", "null", "-serial"]);
        qemu.arg(format!("tcp:{address},server=on,wait=on"));
        qemu.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        let child = qemu.spawn().context("is `qemu-system-arm` installed?")?;
        Ok(Self { child, port: format!("tcp:{address}") })
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Runs the command; a port that is not open yet is tried again.
fn sonarfix(folder: &Path, arguments: &[&str]) -> anyhow::Result<String> {
    for _ in 0..ATTEMPTS {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
        command.args(arguments).current_dir(folder).stdin(Stdio::null());
        let output = command.output().context("cannot start `sonarfix`")?;
        let errors = String::from_utf8_lossy(&output.stderr);
        if output.status.success() {
            return Ok(String::from_utf8(output.stdout)?);
        }
        ensure!(
            errors.contains("cannot open the port"),
            "sonarfix {}: {errors}",
            arguments.join(" ")
        );
        std::thread::sleep(Duration::from_millis(100));
    }
    bail!("sonarfix {}: the port is not opened", arguments.join(" "))
}

fn json(folder: &Path, arguments: &[&str]) -> anyhow::Result<Value> {
    serde_json::from_str(&sonarfix(folder, arguments)?).context("the output is not JSON")
}

fn number(value: &Value, keys: &[&str]) -> Option<u64> {
    keys.iter().try_fold(value, |value, key| value.get(key))?.as_u64()
}
