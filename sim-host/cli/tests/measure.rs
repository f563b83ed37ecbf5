//! `sonarfix measure` with a simulated robot, which stands in the corner of a room.

#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "a test should stop")]

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::thread;
use std::time::Duration;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix_hal::ranger::{Echo, NoEcho};
use sonarfix_link::message::{CommandError, DeviceReadings, EncoderReading, Sweep};
use sonarfix_link::{
    Command as Order, CommandResult, Receiver, Sender, Session, SessionCommand, Telemetry, frame,
};

/// Edges of ten revolutions of each wheel, right and left.
const EDGES: [i64; 2] = [-14_966, 14_390];
/// The true bearing of a commanded one, degrees: offset and scale.
const SERVO: [f64; 2] = [6.0, 1.05];
/// Distances of the wall ahead and of the one at the left, metres.
const WALLS: [f64; 2] = [0.5, 0.6];
/// Half of the cone in which a wall answers, degrees.
const CONE: f64 = 18.0;

/// What is wrong with a robot.
#[derive(Clone, Copy, PartialEq)]
enum Defect {
    None,
    /// The encoders are exchanged.
    Exchanged,
    /// Nothing answers the sonar.
    Deaf,
    /// Its servo has narrower limits than the robot file.
    Narrow,
}

/// A robot that is measured: what it sends depends on the last command.
struct Robot {
    defect: Defect,
    /// Wheels that have been turned, bearings that were asked for, and messages since the last command.
    wheels: usize,
    bearings: u32,
    messages: u32,
    last: Order,
}

impl Robot {
    fn new(defect: Defect) -> Self {
        Self { defect, wheels: 0, bearings: 0, messages: 0, last: Order::Stop }
    }

    fn take(&mut self, order: &Order) -> CommandResult {
        if self.defect == Defect::Narrow && matches!(order, Order::Point(_)) {
            return CommandResult::Refused(CommandError::OutOfReach);
        }
        self.wheels += usize::from(*order == Order::ShowDevices);
        self.bearings += u32::from(matches!(order, Order::Point(_)));
        (self.last, self.messages) = (*order, 0);
        CommandResult::Done
    }

    fn next(&mut self) -> Option<Telemetry> {
        self.messages += 1;
        let at = Instant::from_ticks(self.messages.into());
        match self.last {
            Order::ShowDevices => {
                // At first the wheel has not been turned; 16 bits wrap around.
                let turned = |wheel: usize| match self.wheels.cmp(&(wheel + 1)) {
                    std::cmp::Ordering::Equal if self.messages > 1 => EDGES[wheel],
                    std::cmp::Ordering::Greater => EDGES[wheel],
                    _ => 0,
                };
                let encoder = |wheel: usize| EncoderReading {
                    count: Some(
                        u32::try_from((60_000 + turned(wheel)).rem_euclid(65_536)).unwrap(),
                    ),
                    bits: 16,
                    illegal: 0,
                    metres_per_edge: 1e-4,
                };
                let [right, left] = if self.defect == Defect::Exchanged { [1, 0] } else { [0, 1] };
                let (right, left) = (encoder(right), encoder(left));
                Some(Telemetry::Devices(DeviceReadings {
                    at,
                    right,
                    left,
                    servo: None,
                    ping: None,
                }))
            }
            Order::Point(bearing) => {
                Some(Telemetry::Sweep(self.ping(at, bearing.to_degrees().into())))
            }
            _ => None,
        }
    }

    /// A ping at the bearing that was asked for. Its errors depend on its number at this bearing alone: how many pings are sent
    /// before the next command depends on the speed of the machine.
    fn ping(&self, at: Instant, bearing: f64) -> Sweep {
        let mut rng = ChaCha8Rng::seed_from_u64(1_000 * u64::from(self.bearings));
        rng.set_stream(self.messages.into());
        let truth = SERVO[0] + SERVO[1] * bearing;
        // The rim of the cone is blurred.
        let blur = 6.0 * (rng.random::<f64>() + rng.random::<f64>() - 1.0);
        let off = |perpendicular: f64| (truth - perpendicular).abs() + blur;
        let corner = WALLS[0].hypot(WALLS[1]);
        let reflectors = [(0.0, WALLS[0]), (90.0, WALLS[1]), (48.0, corner), (-70.0, 2.5)];
        let mut heard = reflectors.iter().filter(|(perpendicular, _)| off(*perpendicular) < CONE);
        let is_heard = self.defect != Defect::Deaf && rng.random::<f64>() < 0.95;
        let range =
            heard.next().filter(|_| is_heard).map(|(_, range)| range + 0.01 * rng.random::<f64>());
        #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
        let (bearing, range) = (bearing as f32, range.map(|range| range as f32));
        let echo = |range| Echo { sent: at, heard: at, range: Metres(range) };
        Sweep {
            at,
            bearing: Radians::from_degrees(bearing),
            outcome: range.map(echo).ok_or(NoEcho::Nothing),
        }
    }

    fn serve(mut self, mut stream: TcpStream) {
        stream.set_read_timeout(Some(Duration::from_millis(1))).unwrap();
        let mut receiver = Receiver::<SessionCommand>::new();
        let (mut session, mut sender) = (Session::default(), Sender::<Telemetry>::new());
        let mut buffer = [0; 256];
        loop {
            let mut messages = Vec::new();
            match stream.read(&mut buffer) {
                Ok(0) => return,
                Ok(count) => {
                    for frame in buffer[..count].iter().filter_map(|&byte| receiver.push(byte)) {
                        messages.push(session.answer(&frame, 77, |order| self.take(order)));
                    }
                }
                Err(_) => messages.extend(self.next()),
            }
            for message in messages {
                let mut bytes = frame::EMPTY;
                if stream.write_all(sender.frame(&message, &mut bytes)).is_err() {
                    return;
                }
            }
        }
    }
}

/// The command with a robot; Enter is pressed whenever it waits for that.
fn measure(defect: Defect, folder: &Path, options: &[&str]) -> Output {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp:{}", listener.local_addr().unwrap());
    thread::spawn(move || Robot::new(defect).serve(listener.accept().unwrap().0));
    let wheels = include_str!("robot.toml")
        .replace(
            "{ travel_per_edge = \"0.3255 mm\" }",
            "{ diameter = \"65 mm\", edges_per_revolution = 1500 }",
        )
        .replace(
            "{ travel_per_edge = \"0.3289 mm\", mirrored = true }",
            "{ diameter = \"65 mm\", edges_per_revolution = 1500, mirrored = true } # the left one",
        );
    let [robot, out] =
        ["robot.toml", "measured.toml"].map(|name| folder.join(name).display().to_string());
    std::fs::write(&robot, wheels).unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_sonarfix"))
        .args(["measure", "--port", &port, "--robot", &robot, "--out", &out, "--passes", "2"])
        .args(options)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(b"\n\n\n").unwrap();
    child.wait_with_output().unwrap()
}

#[test]
fn wheels_and_servo_are_measured_and_written() {
    let folder = tempfile::tempdir().unwrap();
    let output = measure(Defect::None, folder.path(), &[]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{text} {}", String::from_utf8_lossy(&output.stderr));
    for line in [
        "right wheel: 1497 edges per revolution, mirrored",
        "left wheel: 1439 edges per revolution, not mirrored",
    ] {
        assert!(text.contains(line), "{text}");
    }
    let written = std::fs::read_to_string(folder.path().join("measured.toml")).unwrap();
    // Within the precision of turning by hand the file's number is kept.
    assert!(written.contains("edges_per_revolution = 1500, mirrored = true }\n"), "{written}");
    assert!(written.contains("edges_per_revolution = 1439.0 } # the left one\n"), "{written}");
    let robot = sonarfix_map::robot_file::parse(&written, "measured.toml").unwrap();
    for (pulse, nominal) in robot.rangers.first.servo_pulses.iter().zip([-110.0, 110.0]) {
        let expected = SERVO[0] + SERVO[1] * nominal;
        let found = f64::from(pulse.bearing.0).to_degrees();
        assert!((found - expected).abs() < 2.0, "{found} instead of {expected}: {text}");
    }
}

#[test]
fn the_results_are_one_json_value() {
    let folder = tempfile::tempdir().unwrap();
    let output = measure(Defect::None, folder.path(), &["--json", "--quiet"]);
    let errors = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{errors}");
    // The steps remain, of a quiet command, too.
    assert!(errors.contains("Turn the right wheel forwards by 10 revolutions"), "{errors}");
    let value: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    crate::json::assert_documented(&value);
    assert_eq!(value["right_wheel"]["edges_per_revolution"], 1496.6);
    assert_eq!(value["right_wheel"]["mirrored"], true);
    assert_eq!(value["left_wheel"]["mirrored"], false);
    let offset = value["servo"]["offset"].as_f64().unwrap().to_degrees();
    assert!((offset - SERVO[0]).abs() < 2.0, "{offset}");
}

#[test]
fn what_prevents_a_measurement_is_named() {
    let cases = [
        (Defect::Exchanged, "exchange the encoders' connectors"),
        (Defect::Deaf, "no wall ahead answers"),
        (Defect::Narrow, "the servo does not reach this bearing"),
    ];
    for (defect, reason) in cases {
        let folder = tempfile::tempdir().unwrap();
        let output = measure(defect, folder.path(), &[]);
        let errors = String::from_utf8(output.stderr).unwrap();
        assert!(!output.status.success() && errors.contains(reason), "{errors}");
        assert!(!folder.path().join("measured.toml").exists());
    }
}
