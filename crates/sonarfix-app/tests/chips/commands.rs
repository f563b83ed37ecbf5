//! Commands over the link: configuration, poses while driving, and motions.

use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Metres, MetresPerSecond, Radians, RadiansPerSecond};
use sonarfix::localizer::Start;
use sonarfix_link::message::{CommandResult, ImageStatus, ResetCause};
use sonarfix_link::{Command, Motion, Telemetry, baked};

use crate::pico::{Pico, Polls, World};
use crate::results::{Table, polls, row};
use crate::{ELF, beside, configuration, done, driving_in, image, map, start, world};

/// From the last motion that the PC commands to motors without voltage, milliseconds: the motion lasts 300.
const UNPOWERED_WITHIN: f64 = 350.0;

/// The checksum at the end of an image.
fn checksum(image: &[u8]) -> ImageStatus {
    ImageStatus::Valid(u32::from_le_bytes(*image.last_chunk().unwrap()))
}

/// The map is written as `sonarfix flash` writes it, because the link has no command for it; the configuration is sent.
#[test]
#[ignore = "cargo xtask chips"]
fn a_configuration_that_was_sent_survives_resets_of_every_kind() {
    let counted = configuration_is_kept(&world());
    polls("configuration over the link, resets", counted);
}

pub fn configuration_is_kept(world: &World) -> Polls {
    let mut config = configuration();
    let mut pico = Pico::switched_on(world.board.elf, world, &map(), &[]);
    assert_eq!(pico.hello().configuration, ImageStatus::Missing);
    // Not that of the file in the repository: another track width, and a sonar for nearer walls.
    config.localizer.drive.track_width = Metres(0.1234);
    config.localizer.rangers.first.max_range = Metres(3.0);
    done(pico.order(&Command::SetConfiguration(config)));
    done(pico.order(&Command::SetPose(start())));
    let sent = ImageStatus::Valid(baked::checksum(&config));
    for (reset, cause) in [
        ("hang", ResetCause::Watchdog),
        ("fault", ResetCause::Software),
        ("off-and-on", ResetCause::PowerOn),
    ] {
        pico.ask(reset);
        pico.run(1_000, &[]);
        pico.forget_session();
        let hello = pico.hello();
        assert_eq!((hello.configuration, hello.map), (sent, checksum(&map())), "{reset}");
        assert_eq!(hello.reset, cause);
        let asked = pico.order(&Command::MapChecksum);
        assert_eq!(asked, Some(CommandResult::Map(checksum(&map()))));
        // It drives with them.
        done(pico.order(&Command::Start));
        pico.run(2_000, &[]);
        assert!(pico.state().is_enabled, "{reset}");
        let compared = beside::compare(&pico.heard, &map(), &config);
        assert!(compared.estimates > 20, "{compared:?}");
        done(pico.order(&Command::Stop));
    }
    pico.polls()
}

/// What `sonarfix command self-test --loop` reads: the captured widths are those of the pulses, by the clock of the chip.
#[test]
#[ignore = "cargo xtask chips"]
fn a_wire_from_the_servo_to_the_echo_shows_its_pulses() {
    let mut pico = Pico::switched_on(ELF, &world(), &map(), &image(&configuration()));
    pico.ask("loop");
    pico.hello();
    done(pico.order(&Command::ShowDevices));
    let (mut steady, mut before, mut captured, mut worst) = (0, 0.0, 0, 0.0_f64);
    for _ in 0..90 {
        pico.run(100, &[]);
        for message in pico.messages() {
            let Telemetry::Devices(readings) = message else { continue };
            let pulse = f64::from(readings.servo.unwrap().micros);
            steady = if (pulse - before).abs() < 0.1 { steady + 1 } else { 0 };
            before = pulse;
            let Some(Ok(echo)) = readings.ping.filter(|_| steady >= 5) else { continue };
            let width = echo.heard.checked_duration_since(echo.sent).unwrap().to_micros();
            #[expect(clippy::cast_precision_loss, reason = "some milliseconds")]
            let off = (width as f64 - pulse).abs();
            (captured, worst) = (captured + 1, worst.max(off));
        }
    }
    row(
        Table::Measured,
        &[
            &"width of the servo's pulses, captured by the echo's pin: off by at most",
            &format!("{worst:.1} µs"),
        ],
    );
    assert!(captured > 20 && worst <= 3.0, "{captured} pulses, {worst} µs");
}

/// A pose beside the robot, then the right one: the estimate follows both, and nothing else is disturbed.
#[test]
#[ignore = "cargo xtask chips"]
fn a_pose_that_is_set_while_driving_is_taken() {
    let counted = poses_are_taken(&world(), "");
    polls("poses set while driving", counted);
}

/// Sets poses; `robot` precedes what is measured.
pub fn poses_are_taken(world: &World, robot: &str) -> Polls {
    let mut pico = driving_in(world);
    pico.run(5_000, &[]);
    let set = |pico: &mut Pico, aside: f32| {
        let truth = pico.state().truth;
        #[expect(clippy::cast_possible_truncation, reason = "the link has f32")]
        let [x, y, heading] = [truth.x, truth.y, truth.heading].map(|number| number as f32);
        let pose = Pose::new(x, y + aside, Radians(heading));
        done(pico.order(&Command::SetPose(Start { pose, ..start() })));
        pico.wait_for(
            |it| if let Telemetry::PoseSet(set) = it { Some(set.state.pose()) } else { None },
        )
    };
    let beside_it = set(&mut pico, 0.2).unwrap();
    let truth = pico.state().truth;
    assert!((f64::from(beside_it.y.0) - truth.y - 0.2).abs() < 0.01, "{beside_it:?}, {truth:?}");
    set(&mut pico, 0.0).unwrap();
    let (mut worst, mut estimates) = (0.0_f64, 0);
    for _ in 0..200 {
        pico.run(100, &[]);
        for message in pico.messages() {
            let Telemetry::Estimate(estimate) = message else { continue };
            let pose = estimate.state.pose();
            worst = worst.max(pico.truth(estimate.at).distance(pose.x.0, pose.y.0));
            estimates += 1;
        }
    }
    let status = pico.loop_status();
    let compared = beside::compare(&pico.heard, &map(), &configuration());
    row(
        Table::Measured,
        &[
            &format!("{robot}position in 20 s after a pose was set while driving, at most"),
            &format!("{:.1} mm", 1e3 * worst),
        ],
    );
    assert!(estimates > 350 && worst <= 0.015, "{estimates} estimates, {worst} m");
    assert!(compared.estimates > 450, "{compared:?}");
    assert!(status.running && status.faults.deadlines == 0, "{status:?}");
    assert_eq!(pico.events(), []);
    pico.polls()
}

/// The PC drives, then the link is cut.
#[test]
#[ignore = "cargo xtask chips"]
fn a_robot_whose_link_is_cut_stands() {
    let mut pico = driving_in(&world());
    let motion = Motion { speed: MetresPerSecond(0.15), turn: RadiansPerSecond(0.3) };
    let renew = |pico: &mut Pico| {
        done(pico.order(&Command::Drive(motion)));
        // The answer comes within 20 ms.
        pico.run(80, &[]);
    };
    for _ in 0..15 {
        renew(&mut pico);
    }
    let (from, began) = (pico.state().truth, pico.state().ms);
    for _ in 0..10 {
        renew(&mut pico);
    }
    // It has the commanded motion.
    let seconds = (pico.state().ms - began) / 1e3;
    let truth = pico.state().truth;
    let (speed, turn) =
        (truth.distance_from(from) / seconds, (truth.heading - from.heading) / seconds);
    assert!((speed - 0.15).abs() < 0.01 && (turn - 0.3).abs() < 0.04, "{speed} m/s, {turn} rad/s");
    // The last frame begins now.
    let cut = pico.state().ms;
    done(pico.order(&Command::Drive(motion)));
    pico.run(2_000, &[]);
    let state = pico.state();
    let (unpowered, stands) = (state.powered - cut, state.rolled - cut);
    row(
        Table::Measured,
        &[
            &"from the last motion of the PC to motors without voltage; to the last edge of an encoder",
            &format!("{unpowered:.0} ms; {stands:.0} ms"),
        ],
    );
    assert!(unpowered > 250.0 && unpowered <= UNPOWERED_WITHIN, "{unpowered} ms");
    // It stands, and does not drive the example's line.
    let stood = state.truth;
    pico.run(3_000, &[]);
    assert!(pico.state().truth.distance_from(stood) < 1e-3);
    assert!(pico.state().is_enabled);
    // A new motion moves it again.
    for _ in 0..10 {
        renew(&mut pico);
    }
    assert!(pico.state().truth.distance_from(stood) > 0.05);
    polls("driven by the PC, link cut", pico.polls());
}
