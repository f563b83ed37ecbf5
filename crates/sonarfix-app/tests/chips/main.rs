//! The shipped firmware of the Raspberry Pi Pico and of the XRP on an emulated RP2040, with a robot in a room, over its UART.
//!
//! `cargo xtask chips` builds it and runs these. `firmware/chips` is the chip: `rp2040js`, with what it lacks. All times are those of the
//! chip, and each run is the same.

#![cfg(test)]

mod beside;
mod commands;
mod long;
mod pico;
mod results;
mod search;
mod stm32;
mod stops;
mod two_sonars;
mod usb;
mod xrp;

use pico::{Board, Counters, PICO, Pico, Polls, World};
use results::polls;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::health::Verdict;
use sonarfix::localizer::Start;
use sonarfix::map::Wall;
use sonarfix_hal::config::RobotConfig;
use sonarfix_link::message::{CommandError, CommandResult, ImageStatus, ResetCause};
use sonarfix_link::{Command, Telemetry, baked};

const ELF: &str = PICO.elf;
const UF2: &str = "SONARFIX_PICO_UF2";

/// A room with an alcove.
const CORNERS: [(f32, f32); 7] =
    [(0.0, 0.0), (3.6, 0.0), (3.6, 1.6), (2.6, 1.6), (2.6, 2.9), (0.0, 2.9), (0.0, 0.0)];
const POSE: [f32; 3] = [1.1, 1.3, 0.0];

fn world() -> World {
    world_of(PICO)
}

/// The room with a robot that has this board.
fn world_of(board: &'static Board) -> World {
    World { board, walls: segments(&CORNERS), pose: POSE, seed: 1, second: None }
}

/// The walls between these corners.
fn segments(corners: &[(f32, f32)]) -> Vec<[f32; 4]> {
    corners.windows(2).map(|ends| [ends[0].0, ends[0].1, ends[1].0, ends[1].1]).collect()
}

fn map() -> Vec<u8> {
    map_of(&CORNERS)
}

fn map_of(corners: &[(f32, f32)]) -> Vec<u8> {
    let point = |(x, y): (f32, f32)| Point::new(x, y);
    let wall = |ends: &[(f32, f32)]| Wall::new(point(ends[0]), point(ends[1])).unwrap();
    sonarfix_map::bake(&corners.windows(2).map(wall).collect::<Vec<_>>()).unwrap()
}

/// The robot of the wiring in docs/firmware.md.
fn configuration() -> RobotConfig {
    let text = include_str!("../../../../firmware/robot.toml");
    sonarfix_map::robot_file::parse(text, "firmware/robot.toml").unwrap()
}

fn image(config: &RobotConfig) -> Vec<u8> {
    baked::write(config, &mut [0; baked::LENGTH_MAX]).unwrap().to_vec()
}

/// The robot where it stands.
fn start() -> Start {
    let [x, y, heading] = POSE;
    Start {
        pose: Pose::new(x, y, Radians(heading)),
        position_deviation: Metres(0.03),
        heading_deviation: Radians(0.02),
    }
}

fn done(result: Option<CommandResult>) {
    assert_eq!(result, Some(CommandResult::Done));
}

/// A robot that drives in this world, with the pose that it has there.
fn driving_in(world: &World) -> Pico {
    driving_with(world, &configuration())
}

/// The same with another robot.
fn driving_with(world: &World, config: &RobotConfig) -> Pico {
    let mut pico = Pico::switched_on(world.board.elf, world, &map(), &image(config));
    pico.hello();
    let [x, y, heading] = world.pose;
    let pose = Pose::new(x, y, Radians(heading));
    done(pico.order(&Command::SetPose(Start { pose, ..start() })));
    done(pico.order(&Command::Start));
    pico.run(3_000, &[]);
    assert!(pico.state().is_enabled);
    pico.events();
    pico
}

#[test]
#[ignore = "cargo xtask chips"]
fn without_images_it_says_so_and_does_not_start() {
    for program in [ELF, UF2] {
        let mut pico = Pico::switched_on(program, &world(), &[], &[]);
        let hello = pico.hello();
        let said = pico.state().ms;
        assert_eq!((hello.map, hello.configuration), (ImageStatus::Missing, ImageStatus::Missing));
        assert_eq!(hello.reset, ResetCause::PowerOn);
        let refused = CommandResult::Refused(CommandError::NoMap);
        assert_eq!(pico.order(&Command::Start), Some(refused));
        assert!(!pico.loop_status().running);
        let counters = pico.counters();
        println!("{program}: Hello after {said:.0} ms, {counters:?}");
        assert_eq!((counters.overruns, counters.lost_bytes), (0, 0));
        // An open line would be noise.
        assert_eq!(pico.ask("pull 1"), "up", "the receiver's pin");
        println!("not emulated: {}", pico.ask("unknown"));
    }
}

#[test]
#[ignore = "cargo xtask chips"]
fn with_images_hello_has_their_checksums() {
    let config = configuration();
    let mut pico = Pico::switched_on(ELF, &world(), &map(), &image(&config));
    let hello = pico.hello();
    assert_eq!(hello.configuration, ImageStatus::Valid(baked::checksum(&config)));
    let map = map();
    let checksum = u32::from_le_bytes(*map.last_chunk().unwrap());
    assert_eq!(hello.map, ImageStatus::Valid(checksum));
}

/// What a drive was.
struct Drive {
    /// The largest errors: metres, radians.
    worst: f64,
    turn: f64,
    travelled: f64,
    pings: u32,
    counters: Counters,
    polls: Polls,
}

/// Drives for 90 s.
fn drive(world: &World) -> Drive {
    drive_with(world, &configuration()).1
}

/// Drives for 90 s, and compares each estimate with the robot in the room at the same time of the chip, and with the core on
/// this computer.
fn drive_with(world: &World, config: &RobotConfig) -> (Pico, Drive) {
    let mut pico = driving_with(world, config);
    let (mut estimates, mut worst, mut turn) = (0, 0.0_f64, 0.0_f64);
    let mut travelled = 0.0;
    let mut last = pico.state().truth;
    for _ in 0..900 {
        pico.run(100, &[]);
        for message in pico.messages() {
            let Telemetry::Estimate(estimate) = message else { continue };
            let truth = pico.truth(estimate.at);
            let pose = estimate.state.pose();
            worst = worst.max(truth.distance(pose.x.0, pose.y.0));
            let off = f64::from(pose.heading.radians().0) - truth.heading;
            turn = turn.max(off.sin().atan2(off.cos()).abs());
            assert_ne!(estimate.health.verdict, Verdict::Lost);
            travelled += truth.distance_from(last);
            last = truth;
            estimates += 1;
        }
    }
    let compared = beside::compare(&pico.heard, &map(), config);
    let (status, counters, pings) = (pico.loop_status(), pico.counters(), pico.state().pings);
    println!(
        "{estimates} estimates over {travelled:.1} m and {pings} pings: position within {:.1} mm, heading within {:.2}°; {:?}, worst poll {}, {counters:?}; {compared:?}",
        1e3 * worst,
        turn.to_degrees(),
        status.faults,
        status.worst_poll
    );
    assert!(estimates > 1_700 && travelled > 5.0 && pings > 100, "{travelled} m");
    assert!(compared.estimates >= estimates && compared.pings > 100);
    assert!(worst <= 0.015, "{worst} m");
    assert_eq!((status.faults.deadlines, counters.overruns, counters.lost_bytes), (0, 0, 0));
    assert_eq!((counters.short_triggers, pico.missing()), (0, 0));
    assert_eq!(pico.events(), []);
    let driven = Drive { worst, turn, travelled, pings, counters, polls: pico.polls() };
    (pico, driven)
}

#[test]
#[ignore = "cargo xtask chips"]
fn ninety_seconds_of_driving_stay_within_15_mm_and_have_the_bits_of_the_pc() {
    let Drive { counters, polls: counted, .. } = drive(&world());
    // It was an emulated core that drove, and its flash holds the pose from which it started.
    assert!(counters.instructions > 100_000_000 && counters.programmed > 0, "{counters:?}");
    polls("ninety seconds of driving", counted);
}

/// The erasure of a sector takes longer than the watchdog's window.
#[test]
#[ignore = "cargo xtask chips"]
fn the_slowest_flash_does_not_reset_the_chip() {
    let mut pico = Pico::switched_on(ELF, &world(), &map(), &image(&configuration()));
    pico.ask("slow-flash");
    pico.hello();
    for _ in 0..60 {
        done(pico.order(&Command::SetPose(start())));
        pico.run(100, &[]);
    }
    let counters = pico.counters();
    println!("{counters:?}");
    assert!(counters.erased > 1, "{counters:?}");
    assert_eq!(pico.events(), []);
    assert_eq!(pico.loop_status().flash.failures, 0);
    polls("the slowest flash", pico.polls());
}

/// The record of a pose takes between 91 and 96 steps.
#[test]
#[ignore = "cargo xtask chips"]
fn a_power_cut_loses_no_record() {
    let (cuts, counted) = cut_while_a_pose_is_written(&world(), (1..100).step_by(4));
    assert!(cuts >= 20, "{cuts} cuts");
    polls("power cuts", counted);
}

/// The power is cut in each of these steps while a pose is written: afterwards the robot has the pose before or the new one, and takes
/// another. Returns how often there were so many steps.
fn cut_while_a_pose_is_written(world: &World, steps: impl Iterator<Item = u32>) -> (u32, Polls) {
    let pose = |x: f32| Start { pose: Pose::new(x, 1.3, Radians(0.0)), ..start() };
    let (mut cuts, mut counted) = (0, Polls::default());
    for step in steps {
        let config = image(&configuration());
        let mut pico = Pico::switched_on(world.board.elf, world, &map(), &config);
        pico.hello();
        done(pico.order(&Command::SetPose(pose(1.0))));
        pico.run(100, &[]);
        pico.ask(&format!("cut {step}"));
        // The answer comes at once or not at all.
        pico.patience = 200;
        let answer = pico.order(&Command::SetPose(pose(2.0)));
        pico.ask("cut Infinity");
        if pico.events().iter().all(|event| event.what != "reset-by-power") {
            done(answer);
            continue;
        }
        cuts += 1;
        pico.forget_session();
        let hello = pico.hello();
        assert_eq!(hello.reset, ResetCause::PowerOn);
        done(pico.order(&Command::Start));
        let resumed = pico
            .wait_for(|it| if let Telemetry::Estimate(it) = it { Some(*it) } else { None })
            .expect("no estimate");
        let x = resumed.state.pose().x.0;
        let is_one = [1.0, 2.0].iter().any(|known| (x - known).abs() < 0.05);
        assert!(is_one, "x = {x} m after a cut in step {step}");
        done(pico.order(&Command::SetPose(pose(1.1))));
        assert_eq!(pico.loop_status().flash.failures, 0);
        counted = counted.and(pico.polls());
    }
    println!("{cuts} cuts, and each left the pose before or the new one");
    (cuts, counted)
}

/// Random bytes at the full rate of the line cost no deadline, and commands are executed afterwards.
#[test]
#[ignore = "cargo xtask chips"]
fn noise_at_the_full_rate_of_the_line_costs_no_deadline() {
    let mut pico = driving_in(&world());
    pico.ask("noise on");
    pico.run(20_000, &[]);
    pico.ask("noise off");
    pico.messages();
    // A frame that the noise began ends with a zero.
    pico.run(100, &[0]);
    let status = pico.loop_status();
    println!("{:?}, {:?}, {:?}", status.commands, status.faults, pico.counters());
    assert!(status.running && status.commands.skipped() > 500, "{:?}", status.commands);
    assert_eq!(status.faults.deadlines, 0);
    assert_eq!(pico.counters().overruns, 0);
    done(pico.order(&Command::Stop));
    pico.run(100, &[]);
    assert!(!pico.state().is_enabled);
    polls("noise at the full rate of the line", pico.polls());
}
