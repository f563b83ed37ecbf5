//! What a robot tells over the link, recorded and replayed: the same estimates. The robot is a
//! simulated one, down to its pins, with the shipped drivers and loop.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test should stop")]

use std::fs;
use std::path::{Path, PathBuf};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sonarfix::aim::NoAim;
use sonarfix::ekf::State;
use sonarfix::localizer::{Fix, Localizer};
use sonarfix::map::WallId;
use sonarfix::units::Instant;
use sonarfix_hal::robot::Report;
use sonarfix_link::message::{Skip, Step};
use sonarfix_link::{Reporter, Sender, Telemetry, frame};
use sonarfix_map::{CLASSROOM, Fidelity, PAPER, Scenario};
use sonarfix_sim::monitor::recording::{Log, Recording};
use sonarfix_sim::monitor::{Monitor, Said};
use sonarfix_sim::observe;
use sonarfix_sim::replay::fault::Complaint;
use sonarfix_sim::replay::{Replay, Summary};
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::trace::{Estimate, FixRecord, Recorder, Tick, Trace};

/// A robot that tells over the link, and what it believed at every encoder tick.
#[derive(Default)]
struct Robot {
    reporter: Option<Reporter>,
    sender: Sender<Telemetry>,
    sent: Vec<Telemetry>,
    frames: Vec<Vec<u8>>,
    believed: Vec<(u64, Estimate)>,
}

impl Robot {
    /// A run of a scenario.
    fn of(scenario: &Scenario, seed: u64) -> Self {
        let mut robot = Self::default();
        Simulation::new(scenario.clone()).run(seed, &mut robot).unwrap();
        assert!(robot.believed.len() > 100, "a run worth the name");
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
        reporter.report(report, localizer, |telemetry| self.send(telemetry));
        self.reporter = Some(reporter);
        if report.tick.is_some() {
            self.believed.push((localizer.time().ticks(), observe::estimate(localizer)));
        }
    }
}

/// A scenario down to its pins, so many metres of path long.
fn scenario(text: &str) -> Scenario {
    let mut scenario = Scenario::parse(text, "scenario.toml", Path::new("")).unwrap();
    scenario.fidelity = Fidelity::Pins;
    scenario
}

/// Everything that comes through.
fn heard(wire: &[u8]) -> (Vec<Said>, Monitor) {
    let mut monitor = Monitor::default();
    let said = wire.iter().filter_map(|&byte| monitor.push(byte)).collect();
    (said, monitor)
}

/// The log of a robot that has just begun.
fn log(said: &[Said]) -> Vec<u8> {
    let (first, rest) = said.split_first().unwrap();
    let Telemetry::Began(began) = first.telemetry else { panic!("{first:?} first") };
    let mut text = Vec::new();
    let mut log = Log::begin(&mut text, &began).unwrap();
    for said in rest {
        log.take(said).unwrap();
    }
    text
}

/// The replay of a log, which must have nothing wrong with it.
fn replay(log: &[u8], scenario: &Scenario) -> (Trace, Summary) {
    let walls = scenario.floor.walls();
    let replay = Replay { robot: &scenario.robot, walls: &walls, strict: true };
    let mut trace = Trace::default();
    let mut report = |complaint: &Complaint| panic!("{complaint}");
    let summary = replay.run(log, None::<&[u8]>, &mut trace, &mut report).unwrap();
    (trace, summary)
}

/// Whether the replay believes at every one of the robot's ticks what the robot did, to the bit.
/// Its clock starts with the log.
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
            let (said, monitor) = heard(&robot.frames.concat());
            assert_eq!((monitor.gaps().lost(), monitor.counters().skipped()), (0, 0));
            let (trace, summary) = replay(&log(&said), &scenario);
            assert_same(&robot.believed, &trace, 0);
            let fixes = summary.fixes.accepted + summary.fixes.gated + summary.fixes.refused;
            assert!(fixes > 500, "a run worth the name: {fixes} looks");
            if text == CLASSROOM {
                let skips = robot.sent.iter().filter(|t| matches!(t, Telemetry::Skip(_))).count();
                let (gated, refused) = (summary.fixes.gated, summary.fixes.refused);
                assert!(
                    gated > 0 && refused > 0,
                    "{gated} gated, {refused} refused, {skips} skips"
                );
            }
        }
    }
}

/// The first look of a run, taken for one at a wall that no map has, and ten turns without any:
/// asked for itself, the replay would find the wall, and nothing to skip.
#[test]
fn the_robots_walls_and_skips_are_taken_and_not_the_replays_own() {
    let scenario = scenario(CLASSROOM);
    let mut robot = Robot::of(&scenario, 0);
    let first = robot.sent.iter().position(|t| matches!(t, Telemetry::Look(_))).unwrap();
    let next = robot.sent.iter().skip(first).find(|t| matches!(t, Telemetry::Step(_)));
    let next = *next.unwrap();
    robot.sent.truncate(first + 1);
    let Some(Telemetry::Look(look)) = robot.sent.last_mut() else { panic!("a look") };
    assert!(matches!(look.fix, Fix::Accepted(_)));
    look.aim.wall = WallId(9_999);
    let skip = Telemetry::Skip(Skip { at: look.at, reason: NoAim::NoWall });
    robot.sent.extend([skip; 10]);
    robot.sent.push(next);
    let said: Vec<_> = robot.sent.iter().map(|&telemetry| Said { lost: 0, telemetry }).collect();
    let (_, summary) = replay(&log(&said), &scenario);
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
    let (said, monitor) = heard(&wire);
    assert!(monitor.counters().skipped() > 1_000);
    assert_eq!(said.iter().map(|said| said.telemetry).collect::<Vec<_>>(), robot.sent);
    assert_same(&robot.believed, &replay(&log(&said), &scenario).0, 0);
}

#[test]
fn a_bad_line_costs_frames_and_no_truth() {
    let scenario = scenario(CLASSROOM);
    for seed in 0..3 {
        let robot = Robot::of(&scenario, seed);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        // The first frame comes through, so that the log has a start; of the others one byte in
        // 2,000 is another, and one in 5,000 is missing.
        let (first, rest) = robot.frames.split_first().unwrap();
        let mut wire = first.clone();
        for byte in rest.concat() {
            if rng.random_ratio(1, 2_000) {
                wire.push(rng.random());
            } else if !rng.random_ratio(1, 5_000) {
                wire.push(byte);
            }
        }
        let (said, monitor) = heard(&wire);
        let lost = robot.sent.len() - said.len();
        assert!(lost > 100, "{lost} frames lost");
        // Lost at the very end, a frame leaves no gap.
        assert!(lost - monitor.gaps().lost() as usize <= 3, "{lost}, {:?}", monitor.gaps());
        // What came through is what was sent, in its order.
        let mut sent = robot.sent.iter();
        assert!(said.iter().all(|said| sent.any(|telemetry| *telemetry == said.telemetry)));

        let log = log(&said);
        let notes = log.split(|&byte| byte == b'\n').filter(|line| line.starts_with(b"# "));
        assert!(notes.count() > 50);
        // No way is lost with a step, so the replay stays near: it lacks a look now and then.
        let (trace, _) = replay(&log, &scenario);
        let (at, believed) = robot.believed.last().unwrap();
        let tick = trace.ticks.last().unwrap();
        let off =
            (tick.estimate.pose.x - believed.pose.x).hypot(tick.estimate.pose.y - believed.pose.y);
        assert!(off < 0.05, "{off} m off at {at} µs");
    }
}

/// A folder of its own, and the log in it.
fn folder() -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let log = dir.path().join("run.csv");
    (dir, log)
}

#[test]
fn a_robot_that_begins_anew_begins_another_log() {
    let mut scenario = scenario(CLASSROOM);
    let fault = r#"faults = [{ kind = "brown_out", from = "60 s", to = "62 s" }]"#;
    let text = CLASSROOM.replacen("[map]", &format!("{fault}\n[map]"), 1);
    scenario.faults = Scenario::parse(&text, "scenario.toml", Path::new("")).unwrap().faults;
    let robot = Robot::of(&scenario, 0);
    let (dir, path) = folder();
    let mut recording = Recording::new(path.clone());
    let (said, _) = heard(&robot.frames.concat());
    for said in &said {
        recording.take(said).unwrap();
    }
    assert_eq!(recording.logs(), 2);
    let began = 62_000_000;
    let (first, second): (Vec<_>, Vec<_>) = robot.believed.iter().partition(|(at, _)| *at < began);
    assert!(first.len() > 100 && second.len() > 100);
    assert_same(&first, &replay(&fs::read(path).unwrap(), &scenario).0, 0);
    let second_log = fs::read(dir.path().join("run-2.csv")).unwrap();
    assert_same(&second, &replay(&second_log, &scenario).0, began);
}

#[test]
fn a_restart_whose_first_frames_are_lost_begins_another_log() {
    let (_dir, path) = folder();
    let mut recording = Recording::new(path);
    let at = |seconds: u64| Instant::from_ticks(seconds * 1_000_000);
    let step =
        |seconds| Telemetry::Step(Step { at: at(seconds), right_metres: 1.0, left_metres: 1.0 });
    let (_, began) = Reporter::resume(at(10), State::default(), State::default());
    let Telemetry::Began(began) = began else { panic!("{began:?}") };
    let estimate = sonarfix_link::Estimate { at: at(2), ..began };
    let told = [Telemetry::Began(began), step(11), step(2), Telemetry::Estimate(estimate), step(3)];
    for telemetry in told {
        recording.take(&Said { lost: 0, telemetry }).unwrap();
    }
    assert_eq!(recording.logs(), 2);
}

#[test]
fn a_monitor_that_comes_late_records_from_an_estimate() {
    let scenario = scenario(CLASSROOM);
    let robot = Robot::of(&scenario, 1);
    let (_dir, path) = folder();
    let mut recording = Recording::new(path.clone());
    let (_, late) = robot.frames.split_at(robot.frames.len() / 2);
    let (said, _) = heard(&late.concat());
    for said in &said {
        recording.take(said).unwrap();
    }
    assert_eq!(recording.logs(), 1);
    let log = fs::read(path).unwrap();
    assert!(String::from_utf8_lossy(&log).contains("# joined under way"));
    let (trace, _) = replay(&log, &scenario);
    let (believed, replayed) =
        (&robot.believed.last().unwrap().1, &trace.ticks.last().unwrap().estimate);
    let off = (replayed.pose.x - believed.pose.x).hypot(replayed.pose.y - believed.pose.y);
    assert!(off < 0.05, "{off} m off");
}
