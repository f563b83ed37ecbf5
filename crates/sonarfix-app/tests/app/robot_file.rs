//! The loop and its drivers follow the baked robot file.

use std::path::Path;

use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::localizer::Start;
use sonarfix_hal::config::{RobotConfig, Unsupported};
use sonarfix_hal::servo::SettingError;
use sonarfix_link::message::{CommandError, CommandResult, ImageStatus};
use sonarfix_link::{Command, Telemetry, baked as image};
use sonarfix_map::robot_file;

use crate::flash::SimFlash;
use crate::rig::{Baked, Bench, loop_status};

/// A robot file with these values.
fn file(encoder_period: &str, fix_period: &str, wheel: &str, servo: &str) -> String {
    format!(
        r#"format = 1
[drive]
track_width = "160 mm"
wheel_noise = "1 mm/sqrt(m)"
scale_walk = "1e-5 /sqrt(m)"
track_width_walk = "1e-5 m/sqrt(m)"
max_wheel_speed = "2 m/s"
encoder_period = "{encoder_period}"
right_wheel = {{ travel_per_edge = "{wheel}" }}
left_wheel = {{ travel_per_edge = "{wheel}", mirrored = true }}
[sonar]
mount = ["0 mm", "0 mm"]
servo = [{servo}]
servo_pulses = [{{ width = "600 us", bearing = "-100 deg" }}, {{ width = "2400 us", bearing = "100 deg" }}]
servo_timing = "sg90"
ranger = "hc_sr04"
cone = "15 deg"
min_range = "5 cm"
max_range = "4 m"
noise = "5 mm"
noise_per_metre = "2 mm/m"
fix_period = "{fix_period}"
[prior]
scale_right = "1 %"
scale_left = "1 %"
track_width = "3 mm"
range_scale = "2 %"
[gating]
confidence = 1.0
[schedule]
policy = "nearest"
"#
    )
}

fn baked(text: &str) -> Baked {
    Baked::new(&robot_file::parse(text, "robot.toml").unwrap())
}

fn started(baked: &Baked, heading: f32) -> Bench<'_> {
    let mut bench = Bench::switched_on(baked, SimFlash::new());
    let start = Start {
        pose: Pose::new(1.0, 1.5, Radians::from_degrees(heading)),
        position_deviation: Metres(0.02),
        heading_deviation: Radians(0.01),
    };
    assert_eq!(bench.order(&Command::SetPose(start)), CommandResult::Done);
    assert_eq!(bench.order(&Command::Start), CommandResult::Done);
    bench
}

fn count(messages: &[Telemetry], is: impl Fn(&Telemetry) -> bool) -> usize {
    messages.iter().filter(|message| is(message)).count()
}

const AROUND: &str = r#""-90 deg", "90 deg""#;

#[test]
fn the_ping_schedule_of_the_robot_file_is_the_loops() {
    for (period, expected) in [("2 s", 5), ("1 s", 10), ("500 ms", 20)] {
        let baked = baked(&file("100 ms", period, "0.2 mm", AROUND));
        let messages = started(&baked, 170.0).wait(10_100);
        let pings = count(&messages, |message| matches!(message, Telemetry::Ping(_)));
        assert!(pings.abs_diff(expected) <= 1, "{period}: {pings} pings in 10 s");
    }
}

#[test]
fn the_encoder_period_of_the_robot_file_is_the_loops() {
    for (period, expected) in [("100 ms", 100), ("50 ms", 200), ("20 ms", 500)] {
        let baked = baked(&file(period, "1 s", "0.2 mm", AROUND));
        let messages = started(&baked, 0.0).wait(10_000);
        let ticks = count(&messages, |message| matches!(message, Telemetry::Estimate(_)));
        assert!(ticks.abs_diff(expected) <= 1, "{period}: {ticks} ticks in 10 s");
    }
}

#[test]
fn the_wheels_of_the_robot_file_are_the_loops() {
    for (wheel, metres) in [("0.2 mm", 0.02), ("0.5 mm", 0.05)] {
        let baked = baked(&file("100 ms", "1 s", wheel, AROUND));
        let mut bench = started(&baked, 0.0);
        bench.wait(500);
        let before = bench.estimate().state.x;
        // 100 edges ahead: the left encoder is mirrored, and so counts down.
        bench.hardware.right.0 = Some(100);
        bench.hardware.left.0 = Some(100_u16.wrapping_neg());
        bench.wait(500);
        let rolled = (bench.estimate().state.x - before).0;
        assert!((rolled - metres).abs() < 1e-3, "{wheel}: {rolled} m");
    }
}

/// A wall at 100° to the left is within the limits of the documented example.
#[test]
fn the_servo_limits_of_the_robot_file_are_the_drivers() {
    let baked = baked(&file("100 ms", "1 s", "0.2 mm", r#""95 deg", "110 deg""#));
    let mut bench = started(&baked, 80.0);
    let messages = bench.wait(10_000);
    assert_eq!(loop_status(&messages).faults.servo, 0);
    let bearings: Vec<f32> = messages
        .iter()
        .filter_map(|message| match message {
            Telemetry::Ping(ping) => Some(ping.aim.bearing.0.to_degrees()),
            _ => None,
        })
        .collect();
    assert!(bearings.len() >= 9, "{bearings:?}");
    assert!(bearings.iter().all(|bearing| (bearing - 100.0).abs() < 0.2), "{bearings:?}");
    // 2,400 µs of a frame of 40,000 counts: the pulse that the file has for 100°.
    assert!(bench.hardware.servo.release().duty.abs_diff(4_800) < 5);
}

#[test]
fn the_example_of_the_documentation_runs() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/formats.md");
    let page = std::fs::read_to_string(page).unwrap();
    let (_, rest) = page.split_once("```toml robot\n").unwrap();
    let (text, _) = rest.split_once("```").unwrap();
    let baked = baked(text);
    // Walls at 100° and −80°, both within the documented limits.
    let messages = started(&baked, 80.0).wait(10_000);
    let pings = count(&messages, |message| matches!(message, Telemetry::Ping(_)));
    // A ping every 200 ms unless servo and ranger take longer.
    assert!(pings >= 24, "{pings} pings in 10 s");
    assert_eq!(loop_status(&messages).faults.servo, 0);
}

/// The reasons for which a robot refuses a file, at `Start` and when it receives the file.
fn refusal(text: &str) -> CommandError {
    let config = robot_file::parse(text, "robot.toml").unwrap();
    let refused = |outcome| match outcome {
        CommandResult::Refused(reason) => reason,
        other => panic!("{other:?}"),
    };
    let baked = Baked::new(&config);
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    assert_eq!(bench.order(&Command::SetPose(crate::rig::start())), CommandResult::Done);
    let at_start = refused(bench.order(&Command::Start));
    assert!(!bench.poll().is_running);

    let good = Baked::new(&crate::rig::config());
    let mut bench = Bench::switched_on(&good, SimFlash::new());
    assert_eq!(bench.order(&Command::SetPose(crate::rig::start())), CommandResult::Done);
    assert_eq!(refused(bench.order(&Command::SetConfiguration(config))), at_start);
    // The refused configuration has changed nothing.
    assert_eq!(bench.order(&Command::Start), CommandResult::Done);
    at_start
}

#[test]
fn a_configuration_beyond_the_board_is_refused_at_start_with_its_reason() {
    let good = file("100 ms", "1 s", "0.2 mm", AROUND);
    let srf = good.replace("\"hc_sr04\"", "{ kind = \"srf08\", address = 0x70 }");
    assert_eq!(refusal(&srf), CommandError::Unsupported(Unsupported::Ranger));
    // 125° are 2,625 µs, and the channel makes 2,600.
    let far = file("100 ms", "1 s", "0.2 mm", r#""-90 deg", "125 deg""#);
    assert_eq!(refusal(&far), CommandError::Unsupported(Unsupported::Servo(SettingError::Pulse)));
    let digital = "{ frame = \"3 ms\", sixty_degrees = \"70 ms\", settle = \"20 ms\" }";
    let digital = good.replace("\"sg90\"", digital);
    assert_eq!(
        refusal(&digital),
        CommandError::Unsupported(Unsupported::Servo(SettingError::Frame))
    );
    // 2 m/s are 50,000 edges in the 250 ms that a reading may take, of 65,536 in 16 bits.
    let fine = file("100 ms", "1 s", "0.01 mm", AROUND);
    assert_eq!(refusal(&fine), CommandError::Unsupported(Unsupported::Counter));
    let reason = refusal(&srf).to_string();
    assert_eq!(reason, "the board has no driver for the configured ranger");
}

/// The image of version 1 held the localizer's configuration alone.
#[test]
fn an_image_of_an_older_version_is_refused_by_its_version() {
    let mut baked = Baked::new(&crate::rig::config());
    baked.config[4] = 1;
    assert_eq!(image::read(&baked.config), Err(image::BakedError::Version(1)));
    let mut bench = Bench::switched_on(&baked, SimFlash::new());
    let messages = bench.wait(1);
    let Some(Telemetry::Hello(hello)) = messages.first() else { panic!("{messages:?}") };
    assert_eq!(hello.configuration, ImageStatus::Version(1));
    assert_eq!(bench.order(&Command::Start), CommandResult::Refused(CommandError::NoConfiguration));
}

/// A configuration that is sent configures the drivers as well.
#[test]
fn loop_and_drivers_follow_a_configuration_that_is_sent() {
    let before = baked(&file("100 ms", "1 s", "0.2 mm", AROUND));
    let mut bench = started(&before, 80.0);
    bench.wait(1_000);
    let text = file("50 ms", "500 ms", "0.2 mm", r#""95 deg", "110 deg""#);
    let config: RobotConfig = robot_file::parse(&text, "robot.toml").unwrap();
    assert_eq!(bench.order(&Command::SetConfiguration(config)), CommandResult::Done);
    let _ = bench.received();
    let messages = bench.wait(10_000);
    assert!(
        count(&messages, |message| matches!(message, Telemetry::Estimate(_))).abs_diff(200) <= 1
    );
    assert!(count(&messages, |message| matches!(message, Telemetry::Ping(_))).abs_diff(20) <= 1);
    assert!(bench.hardware.servo.release().duty.abs_diff(4_800) < 5);
}
