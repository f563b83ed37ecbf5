//! A robot with two sonars, the first of which fails: it measures as often as a robot that has the second one alone.

use std::path::Path;

use sonarfix_map::{Fault, FaultKind, Scenario};
use sonarfix_sim::monte_carlo;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::statistics::Summary;

const TWO: &str = include_str!("../scenarios/classroom-two-servos.toml");
const RUNS: u32 = 3;

fn summary(scenario: Scenario) -> Summary {
    let results = monte_carlo::results(&Simulation::new(scenario), 41, RUNS, &|| ()).unwrap();
    Summary::of(&results)
}

fn scenario() -> Scenario {
    Scenario::parse(TWO, "classroom-two-servos.toml", Path::new("")).unwrap()
}

/// The robot with the second sonar alone.
fn alone() -> Scenario {
    let first = "mount = [\"60 mm\", \"0 mm\"]";
    let second = "mount = [\"-40 mm\", \"0 mm\"]";
    let (head, rest) = TWO.split_once("[[robot.sonar]]").unwrap();
    let (sonar, rest) = rest.split_once("[[robot.sonar]]").unwrap();
    let (_, tail) = rest.split_once("[robot.prior]").unwrap();
    let sonar = sonar.replace(first, second);
    let text = format!("{head}[[robot.sonar]]{sonar}[robot.prior]{tail}");
    Scenario::parse(&text, "alone.toml", Path::new("")).unwrap()
}

#[test]
fn a_ranger_that_fails_does_not_take_the_other_one_along() {
    let alone = summary(alone());
    for kind in [
        FaultKind::DeadSonar,
        FaultKind::StuckEcho,
        FaultKind::LostEchoes(1.0),
        FaultKind::FalseRanges(1.0),
    ] {
        let mut scenario = scenario();
        scenario.faults = vec![Fault { kind, from: 1.0, to: 700.0 }];
        let failed = summary(scenario);
        assert_eq!(failed.lost_runs, 0, "{kind:?}");
        assert!(
            failed.fixes.accepted as f64 >= 0.95 * alone.fixes.accepted as f64,
            "{kind:?}: {} ranges accepted, {} by the other sonar alone",
            failed.fixes.accepted,
            alone.fixes.accepted
        );
    }
}

/// It is used again after it has recovered.
#[test]
fn a_ranger_that_recovers_is_used_again() {
    let healthy = summary(scenario());
    let mut scenario = scenario();
    scenario.faults = vec![Fault { kind: FaultKind::DeadSonar, from: 100.0, to: 130.0 }];
    let interrupted = summary(scenario);
    assert_eq!(interrupted.lost_runs, 0);
    assert!(interrupted.fixes.accepted as f64 >= 0.95 * healthy.fixes.accepted as f64);
}
