//! The bytes of every message. If one of these fails, the layout has changed: raise
//! [`sonarfix_link::VERSION`] (and [`sonarfix_link::baked::VERSION`], if it was a configuration's),
//! and only then the bytes here.

use sonarfix::aim::NoAim;
use sonarfix::config::{Config, PingSchedule, Policy, ServoTiming};
use sonarfix::filter::ekf::Innovation;
use sonarfix::geometry::units::{Duration, Metres, Radians, SquareMetres};
use sonarfix::health::Verdict;
use sonarfix::localizer::Fix;
use sonarfix_hal::config::{Feature, NotLinked, RobotConfig, Unsupported};
use sonarfix_hal::ranger::{PulseTiming, RangerKind};
use sonarfix_hal::servo::SettingError;
use sonarfix_link::message::ImageStatus;
use sonarfix_link::{Command, CommandResult, Telemetry, VERSION, baked};

use crate::messages::{
    ABSOLUTE_REFUSALS, ANSWERS, COMMANDS, Counting, MODES, NO_ECHO, REFUSALS, REFUSED, RESETS,
    TELEMETRY, command, telemetry,
};
use crate::wire::to_stdvec;

/// The version of the bytes below.
const OF_VERSION: u8 = 11;

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |hex, byte| format!("{hex}{byte:02x}"))
}

fn name_of_telemetry(message: &Telemetry) -> &'static str {
    // No wildcard: a new message needs a line here, and bytes below.
    match message {
        Telemetry::Hello(_) => "hello",
        Telemetry::Initialized(_) => "initialized",
        Telemetry::Odometry(_) => "odometry",
        Telemetry::Ping(_) => "ping",
        Telemetry::SkippedPing(_) => "skipped ping",
        Telemetry::Estimate(_) => "estimate",
        Telemetry::LoopStatus(_) => "loop status",
        Telemetry::Ack(_) => "ack",
        Telemetry::PoseSet(_) => "pose set",
        Telemetry::ModeChanged(_) => "mode changed",
        Telemetry::Sweep(_) => "sweep",
        Telemetry::Search(_) => "search status",
        Telemetry::Hypothesis(_) => "hypothesis",
        Telemetry::Devices(_) => "devices",
        Telemetry::Turn(_) => "turn",
        Telemetry::Gyro(_) => "gyro",
        Telemetry::Absolute(_) => "absolute result",
    }
}

fn name_of_command(message: &Command) -> &'static str {
    match message {
        Command::SetPose(_) => "set pose",
        Command::SetConfiguration(_) => "set configuration",
        Command::Start => "start",
        Command::Stop => "stop",
        Command::ResetCalibration => "reset calibration",
        Command::MapChecksum => "map checksum",
        Command::OpenSession => "open session",
        Command::Search => "search",
        Command::ShowDevices => "show devices",
        Command::Absolute { .. } => "absolute",
        Command::Point(_) => "point",
        Command::Drive(_) => "drive",
        Command::SetUnusable(_) => "never sent",
    }
}

/// One message of each kind: numbers count up field by field, and of all variants the first is chosen.
fn all() -> Vec<(&'static str, String)> {
    let numbers = || Counting { next: 0, variant: 0 };
    let telemetry = (0..TELEMETRY).map(|kind| telemetry(kind, &mut numbers()));
    let commands = (0..COMMANDS).map(|kind| command(kind, &mut numbers()));
    let telemetry =
        telemetry.map(|message| (name_of_telemetry(&message), hex(&to_stdvec(&message))));
    telemetry
        .chain(
            commands.map(|message| (name_of_command(&message.command), hex(&to_stdvec(&message)))),
        )
        .collect()
}

#[test]
fn every_message_has_the_bytes_of_its_version() {
    assert_eq!(VERSION, OF_VERSION);
    let golden: Vec<_> = include_str!("golden.txt").lines().collect();
    let now: Vec<_> = all().into_iter().map(|(name, hex)| format!("{name}: {hex}")).collect();
    assert_eq!(now, golden);
}

/// The indices of variants, which are bytes as well.
#[test]
fn every_variant_has_the_number_of_its_version() {
    fn numbered<T: serde::Serialize>(variants: &[T]) {
        for (number, variant) in (0_u8..).zip(variants) {
            assert_eq!(to_stdvec(variant)[0], number);
        }
    }
    numbered(&NO_ECHO);
    numbered(&REFUSALS);
    numbered(&RESETS);
    numbered(&REFUSED);
    numbered(&ABSOLUTE_REFUSALS);
    numbered(&[NoAim::NoWall]);
    numbered(&[Verdict::Tracking, Verdict::Degraded, Verdict::Lost]);
    let innovation = Innovation { value: Metres(0.0), variance: SquareMetres(0.0) };
    numbered(&[
        Fix::Accepted(innovation),
        Fix::Downweighted(innovation),
        Fix::Gated(innovation),
        Fix::Refused(REFUSALS[0]),
    ]);
    numbered(&MODES);
    numbered(&ANSWERS);
    numbered(&[Policy::Nearest, Policy::Informative]);
    numbered(&[PingSchedule::Every(Duration::from_ticks(0)), PingSchedule::AsFastAsPossible]);
    numbered(&[
        ImageStatus::Valid(0),
        ImageStatus::Missing,
        ImageStatus::Corrupt,
        ImageStatus::Version(1),
    ]);
    numbered(&[
        RangerKind::Pulse(PulseTiming::HC_SR04),
        RangerKind::Srf { address: 0 },
        RangerKind::Custom,
        RangerKind::Vl53l1x { address: 0 },
        RangerKind::Vl53l0x { address: 0 },
    ]);
    let limits = SettingError::Limits;
    numbered(&[
        Unsupported::Ranger,
        Unsupported::Servo(limits),
        Unsupported::Counter,
        Unsupported::Gyro,
        Unsupported::Rangers,
        Unsupported::NotLinked(NotLinked(Feature::Light)),
    ]);
    numbered(&[
        Feature::Light,
        Feature::Gyro,
        Feature::Rangers,
        Feature::Absolute,
        Feature::Informative,
        Feature::Search,
        Feature::Drive,
        Feature::Mount,
    ]);
    numbered(&[SettingError::Calibration, limits, SettingError::Pulse, SettingError::Frame]);
    numbered(&[
        CommandResult::Done,
        CommandResult::Map(ImageStatus::Missing),
        CommandResult::Refused(REFUSED[0]),
        CommandResult::Session(0),
    ]);
}

#[test]
fn a_baked_configuration_has_the_bytes_of_its_version() {
    assert_eq!(baked::VERSION, 10);
    let mut localizer = Config::for_track_width(Metres(0.35));
    localizer.rangers.first.servo = (Radians(-1.5), Radians(1.5));
    localizer.rangers.first.timing.servo = ServoTiming::SG90;
    // The bytes are those of the format, whatever the default is.
    localizer.gating.max_position_deviation = Metres(0.5);
    let config = RobotConfig::with_common_parts(localizer);
    let mut buffer = [0; baked::LENGTH_MAX];
    let bytes = baked::write(&config, &mut buffer).unwrap();
    assert_eq!(hex(bytes), include_str!("baked.txt").trim());
}
