//! `sonarfix monitor --signs-of-life`.

#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "a test should stop")]

mod hints;

use std::io::{Read, Write};
use std::net::TcpListener;
use std::process::{Command, Output};
use std::thread::{self, JoinHandle};

use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix_hal::ranger::{Echo, NoEcho};
use sonarfix_link::message::{
    CommandError, DeviceReadings, EncoderReading, ImageStatus, ResetCause, ServoReading,
};
use sonarfix_link::{
    Command as Order, CommandResult, Hello, Receiver, Sender, Session, SessionCommand, Telemetry,
    frame,
};

fn monitor(port: &str, options: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
    command.args(["monitor", "--signs-of-life", "--port", port]).args(options);
    command.output().unwrap()
}

/// The last line of a device.
fn line<'t>(text: &'t str, device: &str) -> &'t str {
    text.lines().rev().find(|line| line.starts_with(device)).unwrap()
}

fn hello() -> Telemetry {
    Telemetry::Hello(Hello {
        firmware: [1, 2, 3],
        map: ImageStatus::Valid(0xab),
        configuration: ImageStatus::Valid(0xcd),
        reset: ResetCause::PowerOn,
    })
}

/// Readings after a tenth of a second for each count of the right wheel; the left one stays.
fn readings(tenth: u64, count: u32) -> Telemetry {
    let encoder = |count, metres_per_edge| EncoderReading {
        count: Some(count),
        bits: 16,
        illegal: 0,
        metres_per_edge,
    };
    let at = Instant::from_ticks(100_000 * tenth);
    let sent = Instant::from_ticks(100_000 * tenth - 20_000);
    let heard = Instant::from_ticks(100_000 * tenth - 15_000);
    Telemetry::Devices(DeviceReadings {
        at,
        right: encoder(count, 2e-4),
        left: encoder(9, -2e-4),
        servo: Some(ServoReading { bearing: Radians::from_degrees(90.0), micros: 2_000.0 }),
        ping: Some(if tenth > 3 {
            Ok(Echo { sent, heard, range: Metres(0.858) })
        } else {
            Err(NoEcho::StuckHigh)
        }),
    })
}

fn bytes(messages: impl IntoIterator<Item = Telemetry>) -> Vec<u8> {
    let mut sender = Sender::<Telemetry>::new();
    let frame = |message| sender.frame(&message, &mut frame::EMPTY.clone()).to_vec();
    messages.into_iter().flat_map(frame).collect()
}

#[test]
fn a_line_for_each_device_with_its_hint() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("stream.bin");
    // The counter wraps around; the wheel turns forwards, then back.
    let counts = [65_500, 65_530, 100, 200, 150, 65_530];
    let wheels = (1..).zip(counts).map(|(tenth, count)| readings(tenth, count));
    std::fs::write(&file, bytes([hello()].into_iter().chain(wheels))).unwrap();
    let output = monitor(file.to_str().unwrap(), &[]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{text}");
    let expected = [
        ("board", "1.2.3, map 000000ab, robot 000000cd", "good"),
        ("supply", "started by power on", "good"),
        ("right encoder", "+30 edges, +0.006 m", "good  counts in both directions"),
        ("left encoder", "+0 edges, +0.000 m", "try   roll the robot forwards by hand"),
        ("servo", "pulses of 2000 µs, +90°", "must point to the left"),
        ("sonar", "echo after 5000 µs: 0.858 m", "good"),
    ];
    for (device, reading, hint) in expected {
        let line = line(&text, device);
        assert!(line.contains(reading) && line.contains(hint), "{line}");
    }
    assert_eq!(text.lines().rev().take_while(|line| !line.is_empty()).count(), 6, "{text}");
    // Each change of a hint was printed.
    assert!(text.contains("WRONG the echo line is high: no divider?"), "{text}");
    assert!(text.contains("try   now roll it backwards"), "{text}");
}

/// A robot on a socket that executes or refuses a command, and then shows its devices for a second.
fn robot(result: CommandResult) -> (String, JoinHandle<Vec<Order>>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp:{}", listener.local_addr().unwrap());
    let run = move || {
        let (mut stream, _) = listener.accept().unwrap();
        let mut receiver = Receiver::<SessionCommand>::new();
        let (mut session, mut orders) = (Session::default(), Vec::new());
        let mut buffer = [0; 256];
        while let Ok(count @ 1..) = stream.read(&mut buffer) {
            for frame in buffer[..count].iter().filter_map(|&byte| receiver.push(byte)) {
                let ack = session.answer(&frame, 77, |order| {
                    orders.push(*order);
                    result
                });
                let mut messages = vec![ack];
                if frame.message.command == Order::ShowDevices {
                    messages.push(hello());
                    messages.extend((1..=12).map(|tenth| readings(tenth, 7)));
                }
                // The other end may already be closed.
                let _ = stream.write_all(&bytes(messages));
            }
        }
        orders
    };
    (port, thread::spawn(run))
}

#[test]
fn the_robot_is_asked_to_show_its_devices() {
    let (port, robot) = robot(CommandResult::Done);
    let output = monitor(&port, &["--seconds", "1"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success() && line(&text, "sonar").contains("0.858 m"), "{text}");
    assert_eq!(robot.join().unwrap(), [Order::ShowDevices]);
}

#[test]
fn a_robot_that_drives_refuses() {
    let (port, robot) = robot(CommandResult::Refused(CommandError::Running));
    let output = monitor(&port, &[]);
    assert!(!output.status.success());
    let errors = String::from_utf8(output.stderr).unwrap();
    assert_eq!(errors, "error: the robot refuses: the loop runs: stop it first\n");
    assert_eq!(robot.join().unwrap(), [Order::ShowDevices]);
}
