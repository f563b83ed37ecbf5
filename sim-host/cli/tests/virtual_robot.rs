//! `sonarfix virtual-robot`, with the commands that are used with a robot.

#![expect(clippy::unwrap_used, reason = "a test should stop")]

use std::io::{BufRead, BufReader, Lines};
use std::process::{Child, ChildStdout, Command, Output, Stdio};

use crate::endings::CLASSROOM;

/// A virtual robot that ends with the test.
pub struct Robot {
    child: Child,
    pub ports: Vec<String>,
    /// Open until the robot ends: it may print more.
    _printed: Lines<BufReader<ChildStdout>>,
}

impl Robot {
    fn new() -> Self {
        Self::with(&[CLASSROOM, "--stand"])
    }

    pub fn with(arguments: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_sonarfix"))
            .arg("virtual-robot")
            .args(arguments)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let mut ports = Vec::new();
        for line in lines.by_ref().map(Result::unwrap) {
            let Some(port) = line.strip_prefix("port ") else { break };
            ports.push(port.to_owned());
        }
        Self { child, ports, _printed: lines }
    }

    fn command(&self, arguments: &[&str]) -> Output {
        let port = ["command", "--port", self.ports.first().unwrap()];
        Command::new(env!("CARGO_BIN_EXE_sonarfix")).args(port).args(arguments).output().unwrap()
    }
}

impl Drop for Robot {
    fn drop(&mut self) {
        // It may have ended already.
        self.child.kill().ok();
        self.child.wait().ok();
    }
}

/// The commands of the guide, word by word as it prints them.
#[cfg(unix)]
#[test]
fn the_commands_work_on_it_as_on_a_robot() {
    let robot = Robot::new();
    let printed = |arguments: &[&str]| {
        let output = robot.command(arguments);
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (output.status.success(), text(&output.stdout) + &text(&output.stderr))
    };
    let (is_done, text) = printed(&["drive", "--speed", "0.2", "--seconds", "1"]);
    assert!(!is_done && text.contains("start it first"), "{text}");
    for arguments in [&["set-pose", "1.5", "1.5", "0"][..], &["start"], &["heading", "0"]] {
        let (is_done, text) = printed(arguments);
        assert!(is_done, "{text}");
    }
    let (is_done, text) = printed(&["drive", "--speed", "5", "--seconds", "1"]);
    assert!(!is_done && text.contains("max_wheel_speed"), "{text}");
    let (is_done, text) = printed(&["drive", "--speed", "0.2", "--turn", "-10", "--seconds", "2"]);
    assert!(is_done && text == "done\n", "{text}");
    let (is_done, text) = printed(&["goto", "1.9", "1.7", "--end-deviation", "0.1"]);
    assert!(is_done && text == "arrived\n", "{text}");
    let (is_done, text) =
        printed(&["goto", "1.5", "1.5", "--max-deviation", "1e-6", "--patience", "0.5"]);
    assert!(!is_done && text.contains("stands: the pose is too uncertain"), "{text}");
    let patrol = ["patrol", "1.9", "1.7", "1.6", "1.6", "--end-deviation", "0.1"];
    let (is_done, text) = printed(&[&patrol[..], &["--rounds", "2", "--pause", "0.2"]].concat());
    assert!(is_done, "{text}");
    for part in ["round 1: at 1.9 1.7", "round 1: at 1.6 1.6", "round 2: at 1.6 1.6"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let uncertain = ["--max-deviation", "1e-6", "--patience", "0.3"];
    let (is_done, text) = printed(&[&patrol[..], &uncertain].concat());
    assert!(!is_done && text.contains("has reached no point of round 1"), "{text}");
    let (is_done, text) = printed(&["goto", "1", "2", "3"]);
    assert!(!is_done && text.contains("no y"), "{text}");
    let (is_done, text) = printed(&["stop"]);
    assert!(is_done, "{text}");
}

/// The report of a board: its clock depends on the load of this computer, and is only shown.
#[cfg(unix)]
#[test]
fn a_board_reports_what_a_self_test_finds() {
    let robot = Robot::new();
    let output = robot.command(&["self-test", "--seconds", "11"]);
    let text = String::from_utf8_lossy(&output.stdout);
    for (part, verdict) in [
        ("board", "passed"),
        ("link", "passed"),
        ("right encoder", "passed"),
        ("left encoder", "passed"),
        ("servo pulses", "passed"),
        ("capture", "not tested"),
        ("flash", "passed"),
    ] {
        let line = text.lines().find(|line| line.starts_with(part));
        assert!(line.is_some_and(|line| line.contains(verdict)), "{part}: {text}");
    }
    assert!(text.contains("against this PC"), "{text}");
    assert!(robot.command(&["set-pose", "1.5", "1.5", "0"]).status.success());
    assert!(robot.command(&["start"]).status.success());
    let refused = robot.command(&["self-test", "--seconds", "1"]);
    assert!(String::from_utf8_lossy(&refused.stderr).contains("refuses"), "{refused:?}");
}

#[test]
fn a_scenario_without_pins_is_refused() {
    let paper = "../../crates/sonarfix-map/scenarios/paper.toml";
    let command = ["virtual-robot", paper, "--seconds", "1"];
    let output = Command::new(env!("CARGO_BIN_EXE_sonarfix")).args(command).output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && text.contains("fidelity = \"pins\""), "{text}");
}
