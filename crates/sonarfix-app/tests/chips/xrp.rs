//! The XRP with the RP2040: its pins, its motor drivers without an enable pin, and its gyro on a bus of two pins.

use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{MetresPerSecond, Radians, RadiansPerSecond};
use sonarfix::health::Verdict;
use sonarfix::localizer::Start;
use sonarfix_hal::config::RobotConfig;
use sonarfix_link::message::{ImageStatus, ResetCause};
use sonarfix_link::{Command, Motion, Telemetry, baked};

use crate::pico::{Event, Pico, World, XRP};
use crate::results::{Table, polls, row};
use crate::stops::STOPS_WITHIN;
use crate::{done, image, map_of, segments, start};

/// The arena that `sonarfix init --board xrp` writes.
const CORNERS: [(f32, f32); 7] =
    [(0.0, 0.0), (1.8, 0.0), (1.8, 1.2), (0.5, 1.2), (0.5, 0.8), (0.0, 0.8), (0.0, 0.0)];
const POSE: [f32; 3] = [1.1, 0.35, 0.0];
/// A circle of 0.25 m, which stays within the arena.
const MOTION: Motion = Motion { speed: MetresPerSecond(0.12), turn: RadiansPerSecond(0.48) };

/// The robot that `sonarfix init --board xrp` writes.
fn configuration() -> RobotConfig {
    let text = include_str!("../../../../firmware/xrp/robot.toml");
    sonarfix_map::robot_file::parse(text, "firmware/xrp/robot.toml").unwrap()
}

/// An XRP whose motors are enabled, with the pose that it has.
fn driving() -> Pico {
    let world = World { board: XRP, walls: segments(&CORNERS), pose: POSE, seed: 1, second: None };
    let config = configuration();
    let mut xrp = Pico::switched_on(XRP.elf, &world, &map_of(&CORNERS), &image(&config));
    let hello = xrp.hello();
    assert_eq!(hello.configuration, ImageStatus::Valid(baked::checksum(&config)));
    assert!(matches!(hello.map, ImageStatus::Valid(_)), "{hello:?}");
    set_pose(&mut xrp);
    done(xrp.order(&Command::Start));
    xrp.run(500, &[]);
    assert!(xrp.state().is_enabled);
    xrp.events();
    xrp
}

/// Sets the pose that the robot has in the room.
fn set_pose(xrp: &mut Pico) {
    let truth = xrp.state().truth;
    #[expect(clippy::cast_possible_truncation, reason = "the link has f32")]
    let [x, y, heading] = [truth.x, truth.y, truth.heading].map(|number| number as f32);
    done(
        xrp.order(&Command::SetPose(Start { pose: Pose::new(x, y, Radians(heading)), ..start() })),
    );
}

/// The PC drives it in a circle, by the speeds of its wheels, and its gyro measures the turns.
#[test]
#[ignore = "cargo xtask chips"]
fn an_xrp_that_a_pc_drives_in_a_circle_stays_within_15_mm() {
    let mut xrp = driving();
    let (mut estimates, mut worst, mut turn) = (0, 0.0_f64, 0.0_f64);
    let (began, from) = (xrp.state().ms, xrp.state().truth);
    for _ in 0..220 {
        let before = xrp.heard.len();
        done(xrp.order(&Command::Drive(MOTION)));
        xrp.run(80, &[]);
        for message in xrp.take_after(before) {
            let Telemetry::Estimate(estimate) = message else { continue };
            let (truth, pose) = (xrp.truth(estimate.at), estimate.state.pose());
            worst = worst.max(truth.distance(pose.x.0, pose.y.0));
            let off = f64::from(pose.heading.radians().0) - truth.heading;
            turn = turn.max(off.sin().atan2(off.cos()).abs());
            assert_ne!(estimate.health.verdict, Verdict::Lost);
            estimates += 1;
        }
    }
    let (state, status, counters) = (xrp.state(), xrp.loop_status(), xrp.counters());
    let seconds = (state.ms - began) / 1e3;
    let rate = (state.truth.heading - from.heading) / seconds;
    println!(
        "{seconds:.0} s, {estimates} estimates, {} pings, {} samples of the gyro, {rate:.3} rad/s; {status:?}, {counters:?}",
        state.pings,
        xrp.gyro_samples()
    );
    row(
        Table::Measured,
        &[
            &"XRP, 20 s in a circle: position within; heading within",
            &format!("{:.1} mm; {:.2}°", 1e3 * worst, turn.to_degrees()),
        ],
    );
    assert!((rate - f64::from(MOTION.turn.0)).abs() < 0.05, "{rate} rad/s");
    assert_eq!(xrp.missing(), 0);
    // One after each sample of the encoders; the first and the last may be outside of the time that was measured.
    let period = u32::try_from(configuration().encoder_period.to_micros()).unwrap();
    let samples = 1e6 * seconds / f64::from(period);
    assert!(
        (f64::from(estimates) - samples).abs() <= 2.0,
        "{estimates} estimates, {samples} samples"
    );
    assert!(state.pings > 50, "{} pings", state.pings);
    assert!(worst <= 0.015, "{worst} m");
    // It takes a sample each 10 ms, and uses them: its bias in the room is 0.6°/s.
    assert!(xrp.gyro_samples() > 1_500);
    let bias = xrp.heard.iter().rev().find_map(|message| match message {
        Telemetry::Gyro(gyro) => Some(gyro.status.bias.to_degrees()),
        _ => None,
    });
    assert!(bias.is_some_and(|bias| (bias - 0.6).abs() < 0.1), "{bias:?}");
    assert_eq!((status.faults.deadlines, status.faults.gyro, counters.lost_bytes), (0, 0, 0));
    assert_eq!(xrp.events(), []);
    polls("XRP in a circle", xrp.polls());
}

/// The inputs of its motor drivers are low, whatever ends the program.
#[test]
#[ignore = "cargo xtask chips"]
fn an_xrp_whose_program_stops_stops_its_motors() {
    for (end, cause) in [("hang", ResetCause::Watchdog), ("fault", ResetCause::Software)] {
        let mut xrp = driving();
        for _ in 0..10 {
            done(xrp.order(&Command::Drive(MOTION)));
            xrp.run(80, &[]);
        }
        let began = xrp.state().ms;
        assert!(xrp.state().powered > began - 1.0, "no voltage before the {end}");
        xrp.events();
        xrp.ask(end);
        xrp.run(1_000, &[]);
        let events = xrp.events();
        let off = events.iter().find(|event: &&Event| event.what == "disabled").unwrap().ms - began;
        row(Table::Measured, &[&format!("XRP, {end}: motors off after"), &format!("{off:.0} ms")]);
        assert!(off <= STOPS_WITHIN, "{end}: {events:?}");
        assert!(xrp.state().powered - began <= STOPS_WITHIN, "{end}");
        assert!(events.iter().all(|event| event.what != "enabled"), "{end}: {events:?}");
        xrp.forget_session();
        assert_eq!(xrp.hello().reset, cause, "{end}");
        assert!(!xrp.state().is_enabled);
        // It drives again after these commands.
        set_pose(&mut xrp);
        done(xrp.order(&Command::Start));
        xrp.run(500, &[]);
        assert!(xrp.state().is_enabled);
    }
}
