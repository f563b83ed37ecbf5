//! The commands `sonarfix monitor`, `command` and `config`.

#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "a test should stop")]

use std::fs;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Command, Output};
use std::thread::{self, JoinHandle};

use sonarfix::config::Policy;
use sonarfix::filter::ekf::{StandardDeviations, StateEstimate};
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Instant, Metres, MetresPerSecond, Radians, RadiansPerSecond};
use sonarfix::localizer::{AbsoluteFix, Agreement};
use sonarfix::sensor::absolute::{AbsoluteMeasurement, PoseNoise, PositionNoise};
use sonarfix_hal::robot::AbsoluteResult;
use sonarfix_link::message::{CommandError, ImageStatus, Odometry, ResetCause};
use sonarfix_link::{
    Command as Order, CommandResult, Hello, Motion, Receiver, Reporter, Sender, Session,
    SessionCommand, Telemetry, baked, frame,
};
use sonarfix_map::robot_file;

fn sonarfix(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sonarfix")).args(arguments).output().unwrap()
}

fn printed(output: &Output) -> (String, String) {
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (text(&output.stdout), text(&output.stderr))
}

/// A robot on a socket: of its answers, as many as this are lost before each that arrives. Returns the executed
/// commands.
pub fn robot(deaf_for: usize, outcome: CommandResult) -> (String, JoinHandle<Vec<Order>>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp:{}", listener.local_addr().unwrap());
    let run = move || {
        let (mut stream, _) = listener.accept().unwrap();
        let mut receiver = Receiver::<SessionCommand>::new();
        let (mut answered, mut done) = (Session::default(), Vec::new());
        let mut telemetry = Sender::<Telemetry>::new();
        let (mut answers, mut buffer) = (0, [0; 256]);
        while let Ok(count @ 1..) = stream.read(&mut buffer) {
            for frame in buffer[..count].iter().filter_map(|&byte| receiver.push(byte)) {
                let ack = answered.answer(&frame, 77, |order| {
                    done.push(*order);
                    outcome
                });
                answers += 1;
                send(&mut stream, &mut telemetry, &ack, answers % deaf_for.saturating_add(1) == 0);
            }
        }
        done
    };
    (port, thread::spawn(run))
}

/// Sends an answer after some garbage, or only the garbage, as if the answer were lost.
fn send(stream: &mut TcpStream, sender: &mut Sender<Telemetry>, ack: &Telemetry, whole: bool) {
    let mut wire = vec![0x55; 20];
    let mut buffer = frame::EMPTY;
    let frame = sender.frame(ack, &mut buffer);
    if whole {
        wire.extend(frame);
    }
    // The other end may already be closed.
    let _ = stream.write_all(&wire);
}

#[test]
fn a_drive_ends_with_a_robot_that_stands() {
    let (port, robot) = robot(0, CommandResult::Done);
    let drive = ["drive", "--speed", "0.2", "--turn", "-90", "--seconds", "0.5"];
    let output = sonarfix(&[&["command", "--port", &port], &drive[..]].concat());
    let (stdout, stderr) = printed(&output);
    assert!(output.status.success(), "{stderr}");
    assert_eq!(stdout, "done\n");
    let done = robot.join().unwrap();
    let (last, driven) = done.split_last().unwrap();
    assert_eq!(*last, Order::Drive(Motion::default()));
    let turn = RadiansPerSecond(-std::f32::consts::FRAC_PI_2);
    let motion = Order::Drive(Motion { speed: MetresPerSecond(0.2), turn });
    assert!(!driven.is_empty() && driven.iter().all(|order| *order == motion), "{done:?}");
}

#[test]
fn a_refused_drive_is_not_renewed() {
    let reason = CommandError::Motion;
    let (port, robot) = robot(0, CommandResult::Refused(reason));
    let output = sonarfix(&["command", "--port", &port, "drive", "--speed", "90"]);
    let (_, stderr) = printed(&output);
    assert!(!output.status.success() && stderr.contains(&reason.to_string()), "{stderr}");
    assert_eq!(robot.join().unwrap().len(), 1);
}

/// Ctrl-C is a stop, not the end of a program that leaves a robot to its dead-man.
#[cfg(target_os = "linux")]
#[test]
fn an_interrupted_drive_ends_with_a_robot_that_stands() {
    let (port, robot) = robot(0, CommandResult::Done);
    let drive = ["command", "--port", &port, "drive", "--speed", "0.2"];
    let mut child = Command::new(env!("CARGO_BIN_EXE_sonarfix")).args(drive).spawn().unwrap();
    let has_begun = || {
        let signals = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
        // Ctrl-C is caught (SIGINT, signal 2) before the first command is sent.
        signals
            .lines()
            .find_map(|line| line.strip_prefix("SigCgt:\t"))
            .is_some_and(|mask| u64::from_str_radix(mask, 16).unwrap() & 0b10 != 0)
    };
    while !has_begun() {
        thread::yield_now();
    }
    let interrupt = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(interrupt.success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!(robot.join().unwrap().last(), Some(&Order::Drive(Motion::default())));
}

#[test]
fn a_command_is_repeated_until_answered_and_executed_once() {
    let (port, robot) = robot(2, CommandResult::Done);
    let output = sonarfix(&["command", "--port", &port, "set-pose", "1.5", "-2", "-90"]);
    let (stdout, stderr) = printed(&output);
    assert!(output.status.success(), "{stderr}");
    assert_eq!(stdout, "done\n");
    let done = robot.join().unwrap();
    let [Order::SetPose(start)] = done[..] else { panic!("{done:?}") };
    assert_eq!((start.pose.x, start.pose.y), (Metres(1.5), Metres(-2.0)));
    assert_eq!(start.pose.heading.radians(), Radians::from_degrees(-90.0));
}

#[test]
fn a_heading_a_position_and_a_pose_are_commands() {
    let sent = |arguments: &[&str]| {
        let (port, robot) = robot(0, CommandResult::Refused(CommandError::Waiting));
        let output = sonarfix(&[&["command", "--port", &port], arguments].concat());
        let refused = "error: the robot refuses: the loop does not run: start it first\n";
        assert_eq!(printed(&output).1, refused);
        let done = robot.join().unwrap();
        let [Order::Absolute { age, measurement }] = done[..] else { panic!("{done:?}") };
        (age.to_millis(), measurement)
    };
    let degrees = Radians::from_degrees;
    let heading = AbsoluteMeasurement::Heading { angle: degrees(-90.0), deviation: degrees(5.0) };
    assert_eq!(sent(&["heading", "-90", "--deviation", "5", "--age", "40"]), (40, heading));
    let noise = PositionNoise::circular(Metres(0.05));
    let position = AbsoluteMeasurement::Position { point: Point::new(1.5, -2.0), noise };
    assert_eq!(sent(&["position", "1.5", "-2"]), (0, position));
    let noise = PoseNoise::independent(Metres(0.1), degrees(3.0));
    let pose = AbsoluteMeasurement::Pose { pose: Pose::new(1.0, 2.0, degrees(45.0)), noise };
    assert_eq!(sent(&["pose", "1", "2", "45", "--position-deviation", "0.1"]), (0, pose));
}

/// The localizer's response is printed.
#[test]
fn what_the_localizer_did_with_a_position_is_printed() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp:{}", listener.local_addr().unwrap());
    let robot = thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let mut receiver = Receiver::<SessionCommand>::new();
        let mut telemetry = Sender::<Telemetry>::new();
        let (mut session, mut buffer) = (Session::default(), [0; 256]);
        while let Ok(count @ 1..) = stream.read(&mut buffer) {
            for frame in buffer[..count].iter().filter_map(|&byte| receiver.push(byte)) {
                let mut taken = None;
                let ack = session.answer(&frame, 77, |order| {
                    if let Order::Absolute { measurement, .. } = *order {
                        let (at, measured_at) = (at(0.5), at(0.45));
                        let fix = AbsoluteFix::Gated(Agreement { nis: 50.0, dimensions: 2 });
                        taken = Some(AbsoluteResult { at, measured_at, measurement, fix });
                    }
                    CommandResult::Done
                });
                send(&mut stream, &mut telemetry, &ack, true);
                if let Some(result) = taken {
                    send(&mut stream, &mut telemetry, &Telemetry::Absolute(result), true);
                }
            }
        }
    });
    let output = sonarfix(&["command", "--port", &port, "position", "1.5", "-2"]);
    let (stdout, stderr) = printed(&output);
    assert!(output.status.success(), "{stderr}");
    assert_eq!(stdout, "outside x 1.500 m, y -2.000 m, measured 0.050 s before, gated\n");
    robot.join().unwrap();
}

fn at(seconds: f64) -> Instant {
    Instant::from_ticks(sonarfix_sim::time::micros(seconds))
}

#[test]
fn answers_are_printed_as_text() {
    let (port, robot) = robot(0, CommandResult::Refused(CommandError::NoMap));
    let output = sonarfix(&["command", "--port", &port, "start"]);
    assert!(!output.status.success());
    let refused = "error: the robot refuses: the robot has no valid map in its flash\n";
    assert_eq!(printed(&output).1, refused);
    assert_eq!(robot.join().unwrap(), [Order::Start]);

    let (port, robot) = self::robot(0, CommandResult::Map(ImageStatus::Valid(0xbeef)));
    assert_eq!(
        printed(&sonarfix(&["command", "--port", &port, "map-checksum"])).0,
        "map 0000beef\n"
    );
    assert_eq!(robot.join().unwrap(), [Order::MapChecksum]);
}

#[test]
fn a_robot_that_does_not_answer_is_an_error() {
    let (port, robot) = robot(usize::MAX, CommandResult::Done);
    let output = sonarfix(&["command", "--port", &port, "stop"]);
    assert!(!output.status.success());
    assert!(
        printed(&output).1.starts_with("error: no answer after 10 attempts (0 frames received, ")
    );
    assert_eq!(robot.join().unwrap(), [], "no session was opened");
    let output = sonarfix(&["command", "--port", "nowhere/at/all", "stop"]);
    assert!(printed(&output).1.starts_with("error: cannot open the port nowhere/at/all: "));
    let output = sonarfix(&["command", "--port", "-", "stop"]);
    assert!(printed(&output).1.contains("this port can only be read"));
}

fn write(dir: &Path, name: &str, bytes: &[u8]) -> String {
    let file = dir.join(name);
    fs::write(&file, bytes).unwrap();
    file.to_str().unwrap().to_owned()
}

#[test]
fn the_monitor_shows_a_recorded_stream_and_records_its_log() {
    let dir = tempfile::tempdir().unwrap();
    let mut sender = Sender::<Telemetry>::new();
    let mut wire = b"boot: a line of text that no frame is\n".to_vec();
    let mut send =
        |telemetry| wire.extend(sender.frame(&telemetry, &mut frame::EMPTY.clone()).to_vec());
    send(Telemetry::Hello(Hello {
        firmware: [1, 2, 3],
        map: ImageStatus::Missing,
        configuration: ImageStatus::Valid(0x1234_5678),
        reset: ResetCause::Watchdog,
    }));
    let at = Instant::from_ticks(2_500_000);
    let state = StateEstimate {
        x: Metres(1.25),
        y: Metres(-0.5),
        scale_left: 0.001,
        ..StateEstimate::default()
    };
    let deviation = StandardDeviations {
        x: Metres(0.01),
        y: Metres(0.01),
        heading: Radians(0.02),
        ..StandardDeviations::default()
    };
    send(Reporter::resume(at, state, deviation).1);
    let later = Instant::from_ticks(2_600_000);
    send(Telemetry::Odometry(Odometry { at: later, right_metres: 0.1, left_metres: 0.0625 }));
    let stream = write(dir.path(), "stream.bin", &wire);
    let log = dir.path().join("log.csv");
    let output = sonarfix(&["monitor", "--port", &stream, "--record", log.to_str().unwrap()]);
    let (stdout, stderr) = printed(&output);
    assert!(output.status.success(), "{stderr}");
    let robot = "robot   1.2.3, started by the watchdog; map missing, configuration 12345678";
    assert!(stdout.starts_with(robot), "{stdout}");
    assert!(stdout.contains("pose    x 1.250 m ± 10.0 mm, y -0.500 m ± 10.0 mm"), "{stdout}");
    let link = "link    3 frames, 0 lost, 0 restarts; skipped: 1 corrupt, 0 too long";
    assert!(stdout.contains(link), "{stdout}");
    let expected = "sonarfix-log,1\n\
        resume,2.500000,1.25,-0.5,0,0,0.0010000000474974513,0,0,\
        0.009999999776482582,0.009999999776482582,0.019999999552965164,0,0,0,0\n\
        wheels,2.500000,0,0\n\
        wheels,2.600000,0.1,0.0625\n";
    let log = fs::read_to_string(log).unwrap();
    let seal = log.strip_prefix(expected).unwrap_or_else(|| panic!("{log}"));
    assert!(seal.starts_with("# checksum ") && seal.ends_with("\n# end\n"), "{seal}");
}

/// A robot file.
const ROBOT: &str = include_str!("robot.toml");

#[test]
fn a_configuration_is_baked_checked_and_shown() {
    let dir = tempfile::tempdir().unwrap();
    let robot = write(dir.path(), "robot.toml", ROBOT.as_bytes());
    let baked_file = dir.path().join("config.bin");
    let baked_name = baked_file.to_str().unwrap();
    let output = sonarfix(&["config", "bake", &robot, "--out", baked_name]);
    assert!(output.status.success(), "{}", printed(&output).1);
    let config = baked::read(&fs::read(&baked_file).unwrap()).unwrap();
    assert_eq!(config, robot_file::parse(ROBOT, "robot.toml").unwrap());
    assert_eq!(config.localizer.policy, Policy::Nearest);

    let checksum = format!("checksum {:08x}", baked::checksum(&config));
    let check = sonarfix(&["config", "check", baked_name]);
    assert!(printed(&check).0.contains(&checksum));
    // The output is a robot file with the same checksum except for angles, which are in degrees.
    let (shown, _) = printed(&sonarfix(&["config", "show", baked_name]));
    assert!(shown.contains(&checksum), "{shown}");
    let shown = robot_file::parse(&shown, "shown").unwrap();
    assert_eq!(shown.left_wheel, config.left_wheel);
    assert_eq!(shown.rangers.first, config.rangers.first);
    assert_eq!(shown.localizer.gating, config.localizer.gating);

    let mut damaged = fs::read(&baked_file).unwrap();
    damaged[40] ^= 1;
    let damaged = write(dir.path(), "damaged.bin", &damaged);
    for what in ["check", "show"] {
        let output = sonarfix(&["config", what, &damaged]);
        assert!(!output.status.success());
        let expected =
            format!("error: {damaged}: the configuration is damaged: its checksum is wrong\n");
        assert_eq!(printed(&output).1, expected);
    }
}

/// A log, a map and an empty file: only the last may be the end of a robot's bytes.
#[test]
fn a_text_file_is_no_port() {
    let dir = tempfile::tempdir().unwrap();
    for (text, is_refused) in
        [("sonarfix-log,1\nticks,0,1,2\n", true), ("größe", true), ("", false)]
    {
        let file = dir.path().join("file");
        std::fs::write(&file, text).unwrap();
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_sonarfix"));
        let output = command.args(["monitor", "--port"]).arg(&file).output().unwrap();
        assert_eq!(output.status.success(), !is_refused, "{text}");
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(error.contains("it is a text file"), is_refused, "{error}");
    }
}
