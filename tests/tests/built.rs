//! A scenario that states its robot as it is: a wrong robot file fails in the simulation.
#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]

use std::path::Path;

use sonarfix_map::{CLASSROOM, Scenario};
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::trace::{Tick, Trace};

const WHEEL: &str = "right_wheel = { travel_per_edge = \"0.4887 mm\" }";
const SERVO: &str = "servo_pulses = [{ width = \"500 us\", bearing = \"-100 deg\" }, { width = \"2500 us\", bearing = \"100 deg\" }]";

/// The classroom with its robot as it is instead of scale errors, and an edit of its robot file.
fn stated(old: &str, new: &str) -> Scenario {
    let text = CLASSROOM
        .replace("scale_right = \"1 %\"\nscale_left = \"-1 %\"", &truth())
        .replace("laps = 7 ", "laps = 2 ");
    assert!(text.contains(old), "{old}");
    Scenario::parse(&text.replacen(old, new, 1), "test.toml", Path::new("")).unwrap()
}

fn truth() -> String {
    format!(
        "right_wheel = {{ travel_per_edge = \"0.493587 mm\" }}\n\
         left_wheel = {{ travel_per_edge = \"0.483813 mm\" }}\n\
         mount = [\"60 mm\", \"0 mm\"]\n{SERVO}"
    )
}

/// Whether one of five runs is lost or its pose is once 20 cm wrong, and the true calibration at the end of the last.
fn run(scenario: Scenario) -> (bool, [f64; 2]) {
    let simulation = Simulation::new(scenario);
    let is_off = |tick: &Tick| {
        let (truth, estimate) = (tick.truth.unwrap().pose, tick.estimate.pose);
        (truth.x - estimate.x).hypot(truth.y - estimate.y) > 0.2
    };
    let (mut is_wrong, mut last) = (false, None);
    for seed in 0..5 {
        let mut trace = Trace::default();
        let result = simulation.run(seed, &mut trace).unwrap();
        is_wrong |= result.lost || trace.ticks.iter().any(is_off);
        last = trace.ticks.last().unwrap().truth.unwrap().calibration;
    }
    let last = last.unwrap();
    (is_wrong, [last.scale_right, last.scale_left])
}

#[test]
fn wheels_as_they_are_have_the_scale_errors_that_follow() {
    let (is_wrong, scales) = run(stated(WHEEL, WHEEL));
    assert!(!is_wrong);
    for (scale, expected) in scales.into_iter().zip([0.01, -0.01]) {
        assert!((scale - expected).abs() < 1e-6, "{scale}");
    }
}

#[test]
fn a_wrong_robot_file_fails() {
    let mistakes = [
        (WHEEL, "right_wheel = { travel_per_edge = \"0.12 mm\" }"),
        (WHEEL, "right_wheel = { travel_per_edge = \"0.4887 mm\", mirrored = true }"),
        ("mount = [\"60 mm\", \"0 mm\"]", "mount = [\"-300 mm\", \"0 mm\"]"),
        (
            SERVO,
            "servo_pulses = [{ width = \"500 us\", bearing = \"100 deg\" }, { width = \"2500 us\", bearing = \"-100 deg\" }]",
        ),
        (
            SERVO,
            "servo_pulses = [{ width = \"500 us\", bearing = \"-145 deg\" }, { width = \"2500 us\", bearing = \"55 deg\" }]",
        ),
    ];
    for (right, wrong) in mistakes {
        assert!(run(stated(right, wrong)).0, "{wrong}");
    }
}

/// At the ideal fidelity, too, where bearings are not sent as pulses.
#[test]
fn a_wrong_servo_fails_without_pins() {
    let ideal = |wrong: &str| {
        let mut scenario = stated(SERVO, wrong);
        scenario.fidelity = sonarfix_map::Fidelity::Ideal;
        scenario
    };
    assert!(!run(ideal(SERVO)).0);
    let mirrored = "servo_pulses = [{ width = \"500 us\", bearing = \"100 deg\" }, { width = \"2500 us\", bearing = \"-100 deg\" }]";
    assert!(run(ideal(mirrored)).0);
}
