//! The telemetry of a robot, recorded and replayed, gives the same estimates. The robot is simulated
//! at the level of pins, with the shipped drivers and loop.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test should stop")]

use std::fs;
use std::path::{Path, PathBuf};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sonarfix::aim::NoAim;
use sonarfix::filter::ekf::{StandardDeviations, StateEstimate};
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::localizer::{Fix, Localizer, Start};
use sonarfix::map::{Map, WallId};
use sonarfix::sensor::gyro::GyroParameters;
use sonarfix_hal::robot::Report;
use sonarfix_link::message::{Odometry, SkippedPing};
use sonarfix_link::{Ping, Reporter, Sender, Telemetry, frame};
use sonarfix_map::{
    AbsoluteSensors, CLASSROOM, Fault, FaultKind, Fidelity, HeadingSensor, HeadingSlip, PAPER,
    PositionSensor, Sampling, Scenario,
};
use sonarfix_monitor::log_files::LogFiles;
use sonarfix_replay::fault::Complaint;
use sonarfix_replay::{Replay, Summary};
use sonarfix_sim::observe;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::trace::{Estimate, FixRecord, Recorder, Tick, Trace};
use sonarfix_telemetry::recording::{Log, Recording};
use sonarfix_telemetry::{Monitor, Received, view};

/// A robot with telemetry, and its estimates at every encoder tick.
#[derive(Default)]
struct Robot {
    reporter: Option<Reporter>,
    sender: Sender<Telemetry>,
    sent: Vec<Telemetry>,
    frames: Vec<Vec<u8>>,
    estimates: Vec<(u64, Estimate)>,
}

impl Robot {
    /// A run of a scenario.
    fn of(scenario: &Scenario, seed: u64) -> Self {
        let mut robot = Self::default();
        Simulation::new(scenario.clone()).run(seed, &mut robot).unwrap();
        assert!(robot.estimates.len() > 100, "too few estimates");
        robot
    }

    fn send(&mut self, telemetry: &Telemetry) {
        self.sent.push(*telemetry);
        self.frames.push(self.sender.frame(telemetry, &mut frame::EMPTY.clone()).to_vec());
    }
}

impl Recorder for Robot {
    fn tick(&mut self, _: impl FnOnce() -> Tick) {}
    fn fix(&mut self, _: impl FnOnce() -> FixRecord) {}

    fn began(&mut self, localizer: &Localizer) {
        let (reporter, began) = Reporter::begin(localizer);
        self.reporter = Some(reporter);
        self.send(&began);
    }

    fn polled(&mut self, report: &Report, localizer: &Localizer) {
        let mut reporter = self.reporter.unwrap();
        reporter.report(report, localizer, &mut |telemetry: &Telemetry| self.send(telemetry));
        self.reporter = Some(reporter);
        if report.tick.is_some() {
            self.estimates.push((localizer.time().ticks(), observe::estimate(localizer)));
        }
    }
}

/// A scenario at the level of pins, with a path of a length in metres.
fn scenario(text: &str) -> Scenario {
    let mut scenario = Scenario::parse(text, "scenario.toml", Path::new("")).unwrap();
    scenario.fidelity = Fidelity::Pins;
    scenario
}

/// All received messages.
fn received_from(wire: &[u8]) -> (Vec<Received>, Monitor) {
    let mut monitor = Monitor::default();
    let received = wire.iter().filter_map(|&byte| monitor.push(byte)).collect();
    (received, monitor)
}

/// The log of a robot from its start.
fn log(received: &[Received]) -> Vec<u8> {
    let (first, rest) = received.split_first().unwrap();
    let Telemetry::Initialized(began) = first.telemetry else { panic!("{first:?} first") };
    let mut text = Vec::new();
    let mut log = Log::begin(&mut text, &began).unwrap();
    for received in rest {
        log.take(received).unwrap();
    }
    text
}

/// The replay of a log, which must have no malformed line.
fn replay(log: &[u8], scenario: &Scenario) -> (Trace, Summary) {
    let walls = scenario.floor.walls();
    let replay = Replay { robot: &scenario.robot, walls: &walls, strict: true, pings_per_scan: 1 };
    let mut trace = Trace::default();
    let mut report = |complaint: &Complaint| panic!("{complaint}");
    let summary = replay.run(log, None::<&[u8]>, &mut trace, &mut report).unwrap();
    (trace, summary)
}

/// Asserts that the estimates of replay and robot are equal to the bit at every tick of the robot.
/// The clock of the replay starts with the log.
fn assert_same(robot: &[(u64, Estimate)], trace: &Trace, began: u64) {
    #[expect(clippy::cast_precision_loss, reason = "a run is far below 2^53 µs")]
    let seconds = |micros: u64| micros as f64 * 1e-6;
    let mut replayed = trace.ticks.iter();
    for (at, estimate) in robot {
        let time = seconds(at - began);
        let tick = replayed.find(|tick| tick.time.to_bits() == time.to_bits());
        let tick = tick.unwrap_or_else(|| panic!("nothing replayed at {time} s"));
        assert_eq!(&tick.estimate, estimate, "at {time} s");
    }
}

#[test]
fn a_recording_replays_to_the_bit() {
    for (text, seeds) in [(CLASSROOM, 0..4), (PAPER, 0..1)] {
        let scenario = scenario(text);
        for seed in seeds {
            let robot = Robot::of(&scenario, seed);
            let (received, monitor) = received_from(&robot.frames.concat());
            assert_eq!((monitor.gaps().lost(), monitor.counters().skipped()), (0, 0));
            let (trace, summary) = replay(&log(&received), &scenario);
            assert_same(&robot.estimates, &trace, 0);
            let fixes = summary.fixes.accepted + summary.fixes.gated + summary.fixes.refused;
            assert!(fixes > 500, "too few pings: {fixes}");
            if text == CLASSROOM {
                let skips =
                    robot.sent.iter().filter(|t| matches!(t, Telemetry::SkippedPing(_))).count();
                let (gated, refused) = (summary.fixes.gated, summary.fixes.refused);
                assert!(
                    gated > 0 && refused > 0,
                    "{gated} gated, {refused} refused, {skips} skips"
                );
            }
        }
    }
}

/// A robot with a gyro whose wheels slip, and whose gyro fails for a while.
#[test]
fn the_turns_of_a_gyro_replay_to_the_bit() {
    let mut scenario = scenario(CLASSROOM);
    scenario.robot.localizer.gyro = Some(GyroParameters::MPU_6050);
    scenario.upsets.heading_slip = HeadingSlip { every: 60.0, least: 0.1, most: 0.25 };
    scenario.faults = vec![
        Fault { kind: FaultKind::GyroReadErrors(0.1), from: 100.0, to: 160.0 },
        Fault { kind: FaultKind::GyroReadErrors(1.0), from: 200.0, to: 230.0 },
    ];
    let robot = Robot::of(&scenario, 5);
    let (received, _) = received_from(&robot.frames.concat());
    let is_state = |received: &&Received| matches!(received.telemetry, Telemetry::Gyro(_));
    assert!(received.iter().filter(is_state).count() > 600);
    let log = log(&received);
    let (trace, summary) = replay(&log, &scenario);
    assert_same(&robot.estimates, &trace, 0);
    assert!(summary.fixes.accepted > 500, "{:?}", summary.fixes);
    // Without its turns it is another estimate.
    let text = String::from_utf8(log).unwrap();
    let without: String = text.split_inclusive('\n').filter(|l| !l.starts_with("turn,")).collect();
    let (other, _) = replay(without.as_bytes(), &scenario);
    assert_ne!(other.ticks.last().unwrap().estimate, trace.ticks.last().unwrap().estimate);
}

/// A localizer whose pose is replaced twice while it runs, between pings: one log, which replays to the bit.
#[test]
fn a_pose_that_is_set_while_running_replays_to_the_bit() {
    let scenario = scenario(CLASSROOM);
    let walls = scenario.floor.walls();
    let start = Start {
        pose: Pose::new(1.5, 1.5, Radians(0.1)),
        position_deviation: Metres(0.02),
        heading_deviation: Radians(0.03),
    };
    let (config, map) = (scenario.robot.localizer, Map::new(&walls));
    let mut localizer = Localizer::new(config, map, start, Instant::from_ticks(0)).unwrap();
    let (reporter, began) = Reporter::begin(&localizer);
    let mut robot = Robot::default();
    robot.send(&began);
    let (mut right_metres, mut left_metres) = (0.0, 0.0);
    for tick in 1..=120_u16 {
        let at = Instant::from_ticks(u64::from(tick) * 100_000);
        let travel = WheelTravel::new(0.02, 0.0197 + 1e-5 * f32::from(tick % 7));
        localizer.odometry(at, travel).unwrap();
        right_metres += f64::from(travel.right.0);
        left_metres += f64::from(travel.left.0);
        robot.send(&Telemetry::Odometry(Odometry { at, right_metres, left_metres }));
        if tick % 5 == 0
            && let Ok(aim) = localizer.aim()
        {
            let range = aim.range + Metres(0.004);
            let fix = localizer.fix(&aim, Some(range));
            let outcome = Ok(sonarfix_hal::ranger::Echo { sent: at, heard: at, range });
            robot.send(&Telemetry::Ping(Ping { at, aim, outcome, fix }));
        }
        if tick == 40 || tick == 75 {
            let moved = localizer.pose();
            let (x, y) = (moved.x.0 + 0.031, moved.y.0 - 0.017);
            let pose = Pose::new(x, y, moved.heading.radians());
            localizer.set_pose(&Start { pose, ..start }).unwrap();
            robot.send(&reporter.pose_set(&localizer));
        }
        // A replay records the tick before the pings at its time.
        if tick % 5 != 0 {
            robot.estimates.push((at.ticks(), observe::estimate(&localizer)));
        }
    }
    let (received, _) = received_from(&robot.frames.concat());
    let (dir, path) = folder();
    let mut recording = Recording::new(LogFiles::new(path.clone(), false));
    for received in &received {
        recording.take(received).unwrap();
    }
    assert_eq!(recording.end().unwrap(), 1);
    let text = fs::read_to_string(path).unwrap();
    assert_eq!(text.lines().filter(|line| line.starts_with("pose,")).count(), 2);
    let (trace, summary) = replay(text.as_bytes(), &scenario);
    assert!(summary.fixes.accepted > 10, "{:?}", summary.fixes);
    assert_same(&robot.estimates, &trace, 0);
    drop(dir);
}

/// Encoders that cannot be read for 4 s: the replay has the estimates of the robot to the bit, and between the samples the
/// growth of its deviations and its verdicts.
#[test]
fn failed_encoder_samples_replay_to_the_bit() {
    let kind = r#"kind = "read_errors", wheel = "right", share = "100 %""#;
    let faults = format!(r#"{{ {kind}, from = "90 s", to = "94 s" }}"#);
    let mut scenario = scenario(CLASSROOM);
    let text = CLASSROOM.replacen("[map]", &format!("faults = [{faults}]\n[map]"), 1);
    scenario.faults = Scenario::parse(&text, "scenario.toml", Path::new("")).unwrap().faults;
    let mut robot = Robot::of(&scenario, 3);
    let grown = robot.estimates.iter().rfind(|(at, _)| *at < 94_000_000).unwrap().1;
    // The estimates at failed samples have the time of the last one that was taken.
    let mut last = None;
    robot.estimates.retain(|(at, _)| last.replace(*at) != Some(*at));
    let (received, _) = received_from(&robot.frames.concat());
    let (trace, summary) = replay(&log(&received), &scenario);
    assert_same(&robot.estimates, &trace, 0);
    let is_during = |tick: &&Tick| (90.0..94.0).contains(&tick.time);
    let replayed: Vec<&Tick> = trace.ticks.iter().filter(is_during).collect();
    assert!(replayed.len() >= 39, "{} samples", replayed.len());
    assert_eq!(replayed.last().unwrap().estimate, grown);
    assert!(grown.deviation[0] > 1.0, "{grown:?}");
    let lost_at = summary.health.lost_at.unwrap();
    assert!((lost_at - 93.0).abs() < 0.3, "{lost_at}");
}

/// The first ping of a run, changed to a wall that is not in the map, and ten cycles without a
/// wall: by itself the replay would choose the right wall and would not skip a cycle.
#[test]
fn the_replay_uses_the_recorded_walls_and_skips() {
    let scenario = scenario(CLASSROOM);
    let mut robot = Robot::of(&scenario, 0);
    let first = robot.sent.iter().position(|t| matches!(t, Telemetry::Ping(_))).unwrap();
    let next = robot.sent.iter().skip(first).find(|t| matches!(t, Telemetry::Odometry(_)));
    let next = *next.unwrap();
    robot.sent.truncate(first + 1);
    let Some(Telemetry::Ping(ping)) = robot.sent.last_mut() else { panic!("no ping") };
    assert!(matches!(ping.fix, Fix::Accepted(_)));
    ping.aim.wall = WallId(9_999);
    let skip = Telemetry::SkippedPing(SkippedPing { at: ping.at, reason: NoAim::NoWall });
    robot.sent.extend([skip; 10]);
    robot.sent.push(next);
    let received: Vec<_> =
        robot.sent.iter().map(|&telemetry| Received { lost: 0, telemetry }).collect();
    let (_, summary) = replay(&log(&received), &scenario);
    assert_eq!((summary.fixes.accepted, summary.fixes.refused), (0, 11));
    assert!(summary.health.degraded_at.is_some(), "ten turns without a range");
}

#[test]
fn garbage_between_frames_costs_nothing() {
    let scenario = scenario(CLASSROOM);
    let robot = Robot::of(&scenario, 7);
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut wire = Vec::new();
    for frame in &robot.frames {
        let length = rng.random_range(0..30);
        wire.extend((0..length).map(|_| rng.random::<u8>()));
        wire.extend(frame);
    }
    let (received, monitor) = received_from(&wire);
    assert!(monitor.counters().skipped() > 1_000);
    assert_eq!(received.iter().map(|received| received.telemetry).collect::<Vec<_>>(), robot.sent);
    assert_same(&robot.estimates, &replay(&log(&received), &scenario).0, 0);
}

#[test]
fn line_noise_loses_frames_but_corrupts_none() {
    let scenario = scenario(CLASSROOM);
    for seed in 0..3 {
        let robot = Robot::of(&scenario, seed);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        // The first frame is intact, so that the log has a start; of the others one byte in 2,000
        // is changed, and one in 5,000 is missing.
        let (first, rest) = robot.frames.split_first().unwrap();
        let mut wire = first.clone();
        for byte in rest.concat() {
            if rng.random_ratio(1, 2_000) {
                wire.push(rng.random());
            } else if !rng.random_ratio(1, 5_000) {
                wire.push(byte);
            }
        }
        let (received, monitor) = received_from(&wire);
        let lost = robot.sent.len() - received.len();
        assert!(lost > 100, "{lost} frames lost");
        // A frame lost at the very end leaves no gap.
        assert!(lost - monitor.gaps().lost() as usize <= 3, "{lost}, {:?}", monitor.gaps());
        // The received messages are a subsequence of those sent.
        let mut sent = robot.sent.iter();
        assert!(
            received.iter().all(|received| sent.any(|telemetry| *telemetry == received.telemetry))
        );

        let log = log(&received);
        let notes = log.split(|&byte| byte == b'\n').filter(|line| line.starts_with(b"# "));
        assert!(notes.count() > 50);
        // Lost odometry frames lose no travel, so the replay stays close: it lacks a few pings.
        let (trace, _) = replay(&log, &scenario);
        let (at, estimates) = robot.estimates.last().unwrap();
        let tick = trace.ticks.last().unwrap();
        let off = (tick.estimate.pose.x - estimates.pose.x)
            .hypot(tick.estimate.pose.y - estimates.pose.y);
        assert!(off < 0.05, "{off} m off at {at} µs");
    }
}

/// A temporary folder, and the log in it.
fn folder() -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let log = dir.path().join("run.csv");
    (dir, log)
}

#[test]
fn a_restart_begins_another_log() {
    let mut scenario = scenario(CLASSROOM);
    let fault = r#"faults = [{ kind = "brown_out", from = "60 s", to = "62 s" }]"#;
    let text = CLASSROOM.replacen("[map]", &format!("{fault}\n[map]"), 1);
    scenario.faults = Scenario::parse(&text, "scenario.toml", Path::new("")).unwrap().faults;
    let robot = Robot::of(&scenario, 0);
    let (dir, path) = folder();
    let other = dir.path().join("run-2.csv");
    fs::write(&other, "a recording of another day").unwrap();
    let mut recording = Recording::new(LogFiles::new(path.clone(), false));
    let (received, _) = received_from(&robot.frames.concat());
    for received in &received {
        recording.take(received).unwrap();
    }
    assert_eq!(recording.end().unwrap(), 2);
    let began = 62_000_000;
    let (first, second): (Vec<_>, Vec<_>) = robot.estimates.iter().partition(|(at, _)| *at < began);
    assert!(first.len() > 100 && second.len() > 100);
    assert_same(&first, &replay(&fs::read(path).unwrap(), &scenario).0, 0);
    assert_eq!(fs::read(other).unwrap(), b"a recording of another day");
    let second_log = fs::read(dir.path().join("run-3.csv")).unwrap();
    assert_same(&second, &replay(&second_log, &scenario).0, began);
}

#[test]
fn a_restart_whose_first_frames_are_lost_begins_another_log() {
    let (_dir, path) = folder();
    let mut recording = Recording::new(LogFiles::new(path, false));
    let at = |seconds: u64| Instant::from_ticks(seconds * 1_000_000);
    let step = |seconds| {
        Telemetry::Odometry(Odometry { at: at(seconds), right_metres: 1.0, left_metres: 1.0 })
    };
    let (_, began) =
        Reporter::resume(at(10), StateEstimate::default(), StandardDeviations::default());
    let Telemetry::Initialized(began) = began else { panic!("{began:?}") };
    let estimate = sonarfix_link::Estimate { at: at(2), ..began };
    let nonzero =
        [Telemetry::Initialized(began), step(11), step(2), Telemetry::Estimate(estimate), step(3)];
    for telemetry in nonzero {
        recording.take(&Received { lost: 0, telemetry }).unwrap();
    }
    assert_eq!(recording.end().unwrap(), 2);
}

#[test]
fn a_monitor_that_connects_late_records_from_an_estimate() {
    let scenario = scenario(CLASSROOM);
    let robot = Robot::of(&scenario, 1);
    let (_dir, path) = folder();
    let mut recording = Recording::new(LogFiles::new(path.clone(), false));
    let (_, late) = robot.frames.split_at(robot.frames.len() / 2);
    let (received, _) = received_from(&late.concat());
    for received in &received {
        recording.take(received).unwrap();
    }
    assert_eq!(recording.end().unwrap(), 1);
    let log = fs::read(path).unwrap();
    assert!(String::from_utf8_lossy(&log).contains("# recorded from the middle of a run"));
    let (trace, _) = replay(&log, &scenario);
    let (estimates, replayed) =
        (&robot.estimates.last().unwrap().1, &trace.ticks.last().unwrap().estimate);
    let off = (replayed.pose.x - estimates.pose.x).hypot(replayed.pose.y - estimates.pose.y);
    assert!(off < 0.05, "{off} m off");
}

/// Headings and positions from outside, of which some come late, between ticks and with outliers.
#[test]
fn measurements_from_outside_replay_to_the_bit() {
    let mut scenario = scenario(CLASSROOM);
    scenario.robot.localizer.gyro = Some(GyroParameters::MPU_6050);
    let sampling = |period, delay| Sampling { period, delay, outliers: 0.1 };
    let heading = HeadingSensor { sampling: sampling(110_000, 30_000), deviation: 0.05 };
    let position = PositionSensor {
        sampling: sampling(370_000, 70_000),
        deviation: 0.05,
        heading_deviation: None,
    };
    let with_pose = PositionSensor { heading_deviation: Some(0.05), ..position };
    for (seed, position) in [(5, position), (6, with_pose)] {
        scenario.absolute = AbsoluteSensors { heading: Some(heading), position: Some(position) };
        let robot = Robot::of(&scenario, seed);
        let (received, monitor) = received_from(&robot.frames.concat());
        assert!(view::page(&monitor, &[]).contains("outside"));
        let log = log(&received);
        let (trace, summary) = replay(&log, &scenario);
        assert_same(&robot.estimates, &trace, 0);
        let counts = summary.absolute;
        assert!(counts.accepted > 3_000 && counts.gated > 300, "{counts:?}");
        // Without them it is another estimate.
        let text = String::from_utf8(log).unwrap();
        let is_range = |line: &&str| !line.starts_with("heading,");
        let without: String = text.split_inclusive('\n').filter(is_range).collect();
        let (other, _) = replay(without.as_bytes(), &scenario);
        assert_ne!(other.ticks.last().unwrap().estimate, trace.ticks.last().unwrap().estimate);
    }
}
