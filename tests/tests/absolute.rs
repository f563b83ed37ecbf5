//! Headings, positions and poses from outside, in simulation: statistics, outliers, late ones.
#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]

use std::path::Path;

use sonarfix::aim::Policy;
use sonarfix_map::{
    AbsoluteSensors, CLASSROOM, HeadingSensor, PAPER, PositionSensor, Sampling, Scenario,
};
use sonarfix_sim::monte_carlo;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::statistics::Summary;

use crate::consistency::assert_efficient_and_consistent;

const DEGREE: f64 = std::f64::consts::PI / 180.0;

fn scenario(text: &str, absolute: AbsoluteSensors) -> Scenario {
    let mut scenario = Scenario::parse(text, "test.toml", Path::new("")).unwrap();
    scenario.robot.localizer.policy = Policy::Informative;
    scenario.absolute = absolute;
    scenario
}

fn compass(outliers: f64) -> AbsoluteSensors {
    let sampling = Sampling { period: 700_000, delay: 20_000, outliers };
    let heading = Some(HeadingSensor { sampling, deviation: 2.0 * DEGREE });
    AbsoluteSensors { heading, position: None }
}

fn camera(outliers: f64) -> AbsoluteSensors {
    let sampling = Sampling { period: 1_100_000, delay: 20_000, outliers };
    let heading_deviation = Some(2.0 * DEGREE);
    let position = Some(PositionSensor { sampling, deviation: 0.02, heading_deviation });
    AbsoluteSensors { heading: None, position }
}

/// RMS over bound and NEES, with few runs and limits widened by four sampling errors.
#[test]
fn headings_and_poses_are_used_efficiently_and_consistently() {
    const RUNS: u32 = 30;
    for (sensors, seed) in [(compass(0.0), 30_000), (camera(0.0), 31_000)] {
        let mut scenario = scenario(PAPER, sensors);
        scenario.let_truth_walk_as_assumed();
        let simulation = Simulation::new(scenario);
        let results = monte_carlo::results(&simulation, seed, RUNS, &|| ()).unwrap();
        assert!(results.iter().all(|result| result.absolute.accepted > 1_000));
        let summary = Summary::of(&results);
        assert_efficient_and_consistent(&summary);
        assert!((summary.nis_mean - 1.0).abs() < 0.05, "{}", summary.nis_mean);
    }
}

/// One measurement of five is an outlier: it is gated, and the run is as good as without.
#[test]
fn outliers_are_gated() {
    for sensors in [compass(0.2), camera(0.2)] {
        let simulation = Simulation::new(scenario(CLASSROOM, sensors)).shortened(200.0);
        let result = simulation.run(7, &mut ()).unwrap();
        assert!(!result.lost);
        let counts = result.absolute;
        let measured = counts.accepted + counts.gated;
        assert!(measured > 170, "{counts:?}");
        assert!(counts.gated * 8 > measured && counts.gated * 3 < measured, "{counts:?}");
    }
}

/// A measurement that arrives more than a tick late is refused, and has no effect.
#[test]
fn what_arrives_too_late_is_refused() {
    let mut sensors = compass(0.0);
    let run = |sensors| {
        Simulation::new(scenario(CLASSROOM, sensors)).shortened(60.0).run(3, &mut ()).unwrap()
    };
    let on_time = run(sensors);
    assert_eq!((on_time.absolute.refused, on_time.absolute.gated), (0, 0));
    sensors.heading.as_mut().unwrap().sampling.delay = 500_000;
    let late = run(sensors);
    assert_eq!((late.absolute.accepted, late.absolute.gated), (0, 0));
    assert!(late.absolute.refused > 80, "{:?}", late.absolute);
}
