//! The inputs of the target `link`: one message each, which must be whole.
//!
//! After a change of a message, `cargo test --no-default-features --test link_corpus -- --ignored` in `fuzz` writes
//! them again.

use std::path::{Path, PathBuf};

use sonarfix::config::Config;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Duration, Instant, Metres, Radians};
use sonarfix::localizer::{Fix, Localizer, Start};
use sonarfix::map::{Map, Wall};
use sonarfix_hal::config::RobotConfig;
use sonarfix_hal::ranger::NoEcho;
use sonarfix_hal::robot::Faults;
use sonarfix_link::counters::ReceiverCounters;
use sonarfix_link::message::{FlashStatus, LoopStatus, Message, Ping};
use sonarfix_link::{Command, SessionCommand, Telemetry, reporter};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus/link")
}

/// An input: sequence number 7, flipped bit 3, the message, and its first half as line noise.
fn input(message: &[u8]) -> Vec<u8> {
    let length = u8::try_from(message.len()).expect("longer messages have no input");
    [&[7, 0, 3, length], message, &message[..message.len() / 2]].concat()
}

fn start() -> Start {
    Start {
        pose: Pose::new(1.0, 1.0, Radians(0.3)),
        position_deviation: Metres(0.05),
        heading_deviation: Radians(0.02),
    }
}

/// The messages by the names of their files.
fn inputs() -> [(&'static str, Vec<u8>); 5] {
    let walls = [Wall::new(Point::new(0.0, 0.0), Point::new(4.0, 0.0)).unwrap()];
    let config = Config::for_track_width(Metres(0.16));
    let at = Instant::from_ticks(1_000_000);
    let mut localizer = Localizer::new(config, Map::new(&walls), start(), at).unwrap();
    let aim = localizer.aim().unwrap();
    let fix = localizer.fix(&aim, Some(aim.range));
    assert!(matches!(fix, Fix::Accepted(_)), "{fix:?}");
    let ping = Ping { at, aim, outcome: Err(NoEcho::Nothing), fix };
    let status = LoopStatus {
        at,
        running: true,
        faults: Faults::default(),
        worst_poll: Duration::from_ticks(1_500),
        commands: ReceiverCounters::default(),
        flash: FlashStatus::default(),
        noise_factor: 1.0,
    };
    let telemetry = |message: Telemetry| input(&bytes(&message));
    let command = |command| input(&bytes(&SessionCommand { session: 5, command }));
    [
        ("estimate", telemetry(Telemetry::Estimate(reporter::estimate(&localizer)))),
        ("loop-status", telemetry(Telemetry::LoopStatus(status))),
        ("ping", telemetry(Telemetry::Ping(ping))),
        (
            "set-configuration",
            command(Command::SetConfiguration(RobotConfig::with_common_parts(config))),
        ),
        ("set-pose", command(Command::SetPose(start()))),
    ]
}

fn bytes<M: Message>(message: &M) -> Vec<u8> {
    postcard::to_slice(message, &mut [0; 512]).unwrap().to_vec()
}

/// Each committed input contains a whole message, and not more.
#[test]
fn every_input_contains_a_whole_message() {
    for entry in std::fs::read_dir(folder()).unwrap() {
        let path = entry.unwrap().path();
        let input = std::fs::read(&path).unwrap();
        let length = usize::from(input[3]);
        let message = &input[4..4 + length];
        let telemetry = postcard::take_from_bytes::<Telemetry>(message);
        let command = postcard::take_from_bytes::<SessionCommand>(message);
        let is_whole = telemetry.is_ok_and(|(_, rest)| rest.is_empty())
            || command.is_ok_and(|(_, rest)| rest.is_empty());
        assert!(is_whole, "{}: write the inputs again (see the top of this file)", path.display());
    }
}

#[test]
#[ignore = "writes the corpus"]
fn write_inputs() {
    for (name, input) in inputs() {
        std::fs::write(folder().join(name), input).unwrap();
    }
}
