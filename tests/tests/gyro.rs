//! A gyro beside the wheels, in simulation: statistics, slips, bias, faults.
#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]

use std::path::Path;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sonarfix::aim::Policy;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Duration, Instant, Metres, Radians};
use sonarfix::localizer::{GyroStatus, Localizer, Start};
use sonarfix::map::Map;
use sonarfix::sensor::gyro::{GyroParameters, MeasuredTurn};
use sonarfix_hal::robot::Report;
use sonarfix_map::{CLASSROOM, Fault, FaultKind, GyroTruth, HeadingSlip, PAPER, Scenario};
use sonarfix_sim::monte_carlo;
use sonarfix_sim::plant::gyro::Gyro;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::statistics::Summary;
use sonarfix_sim::trace::{FixRecord, Recorder, Tick};

use crate::consistency::assert_efficient_and_consistent;

/// One degree, rad.
const DEGREE: f64 = std::f64::consts::PI / 180.0;

fn with_gyro(text: &str) -> Scenario {
    let mut scenario = Scenario::parse(text, "test.toml", Path::new("")).unwrap();
    scenario.robot.localizer.policy = Policy::Informative;
    scenario.robot.localizer.gyro = Some(GyroParameters::MPU_6050);
    scenario
}

fn many(scenario: Scenario, seed: u64, runs: u32) -> Summary {
    Summary::of(&monte_carlo::results(&Simulation::new(scenario), seed, runs, &|| ()).unwrap())
}

/// RMS over bound and NEES, with few runs and limits widened by four sampling errors.
#[test]
fn a_gyro_is_used_efficiently_and_consistently() {
    const RUNS: u32 = 50;
    let mut scenario = with_gyro(PAPER);
    scenario.let_truth_walk_as_assumed();
    let summary = many(scenario, 20_000, RUNS);
    assert_efficient_and_consistent(&summary);
    // Without a gyro the bound of the heading is 0.13°.
    let heading = summary.states.iter().find(|state| state.name == "heading").unwrap();
    assert!(heading.bound < 0.08 * DEGREE, "{}", heading.bound);
}

/// Once a minute a wheel slips by 5° to 15°: most runs without a gyro end lost.
#[test]
fn slips_of_a_wheel_do_not_lose_a_robot_with_a_gyro() {
    let mut scenario = with_gyro(PAPER);
    scenario.upsets.heading_slip =
        HeadingSlip { every: 60.0, least: 5.0 * DEGREE, most: 15.0 * DEGREE };
    let with = many(scenario.clone(), 0, 10);
    scenario.robot.localizer.gyro = None;
    let without = many(scenario, 0, 10);
    assert_eq!(with.lost_runs, 0);
    assert!(without.lost_runs >= 5, "{}", without.lost_runs);
    assert!(with.rms_path.heading < 0.2 * DEGREE, "{}", with.rms_path.heading);
}

/// The gyro at the end of every tick: time, status.
#[derive(Default)]
struct Statuses(Vec<(f64, GyroStatus)>);

impl Recorder for Statuses {
    fn tick(&mut self, _: impl FnOnce() -> Tick) {}

    fn fix(&mut self, _: impl FnOnce() -> FixRecord) {}

    fn polled(&mut self, report: &Report, localizer: &Localizer) {
        if report.tick.is_some() {
            let time = sonarfix_sim::time::seconds(localizer.time().ticks());
            self.0.push((time, localizer.gyro().unwrap()));
        }
    }
}

/// Through pins, driver and loop, a bias of 1°/s is found to 0.02°/s (RMS) within 60 s of driving, and with the deviation
/// that is reported.
#[test]
fn the_bias_is_found_within_a_minute_of_driving() {
    const RUNS: u32 = 20;
    let mut scenario = with_gyro(CLASSROOM);
    scenario.truth.gyro.bias = Some(DEGREE);
    let simulation = Simulation::new(scenario).shortened(60.0);
    let mut squares = 0.0;
    for seed in 0..RUNS {
        let mut statuses = Statuses::default();
        simulation.run(seed.into(), &mut statuses).unwrap();
        let (_, status) = statuses.0.last().unwrap();
        let error = f64::from(status.bias.to_degrees()) - 1.0;
        assert!(error.abs() < 4.0 * f64::from(status.deviation.to_degrees()), "{seed}: {error}");
        squares += error * error / f64::from(RUNS);
    }
    println!("bias after 60 s: {} deg/s", squares.sqrt());
    assert!(squares.sqrt() < 0.02, "{}", squares.sqrt());
}

/// Standing wheels: a bias of 1°/s is found to 0.02°/s (RMS) within 5 s, with the deviation that is reported.
#[test]
fn the_bias_is_found_within_five_seconds_of_standing() {
    const RUNS: u32 = 200;
    let scenario = with_gyro(CLASSROOM);
    let (config, walls) = (scenario.robot.localizer, scenario.floor.walls());
    let truth = GyroTruth { bias: Some(DEGREE), scale: 0.0 };
    let start = Start {
        pose: Pose::new(1.5, 1.5, Radians(0.0)),
        position_deviation: Metres(0.02),
        heading_deviation: Radians(0.03),
    };
    let mut squares = 0.0;
    for seed in 0..RUNS {
        let mut rng = ChaCha8Rng::seed_from_u64(seed.into());
        let mut gyro = Gyro::new(&truth, &GyroParameters::MPU_6050, &mut rng);
        let at = |tick: u64| Instant::from_ticks(100_000 * tick);
        let mut localizer = Localizer::new(config, Map::new(&walls), start, at(0)).unwrap();
        for tick in 1..=50 {
            let angle = Radians(gyro.integral(0.0, 0.1, &mut rng) as f32);
            let turn = MeasuredTurn { angle, duration: Duration::from_ticks(100_000) };
            let standing = WheelTravel::new(0.0, 0.0);
            localizer.odometry_with_turn(at(tick), standing, Some(turn)).unwrap();
        }
        let status = localizer.gyro().unwrap();
        let error = f64::from(status.bias.to_degrees()) - 1.0;
        assert!(error.abs() < 5.0 * f64::from(status.deviation.to_degrees()), "{seed}: {error}");
        squares += error * error / f64::from(RUNS);
    }
    println!("bias after 5 s of standing: {} deg/s", squares.sqrt());
    assert!(squares.sqrt() < 0.02, "{}", squares.sqrt());
}

/// A gyro that fails is counted, and the robot continues.
#[test]
fn a_failing_gyro_is_counted_and_the_robot_goes_on() {
    let kinds = [
        (FaultKind::StuckGyro, 2_000),
        (FaultKind::SaturatedGyro, 2_000),
        (FaultKind::GarbledGyro(0.1), 2_000),
        (FaultKind::GarbledGyro(1.0), 2_000),
        (FaultKind::GyroReadErrors(1.0), 2_000),
        (FaultKind::GyroReadErrors(0.1), 200),
    ];
    for (kind, least) in kinds {
        let mut scenario = with_gyro(CLASSROOM);
        scenario.faults = vec![Fault { kind, from: 60.0, to: 90.0 }];
        let result = Simulation::new(scenario).shortened(150.0).run(3, &mut ()).unwrap();
        assert!(result.faults.gyro >= least, "{kind:?}: {}", result.faults.gyro);
        assert!(!result.lost, "{kind:?}");
    }
}
