//! A scenario that states its robot as it is: a wrong robot file fails in the simulation.
#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]

use std::path::Path;

use sonarfix_map::{CLASSROOM, Fidelity, Scenario, SonarName};
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
        scenario.fidelity = Fidelity::Ideal;
        scenario
    };
    assert!(!run(ideal(SERVO)).0);
    let mirrored = "servo_pulses = [{ width = \"500 us\", bearing = \"100 deg\" }, { width = \"2500 us\", bearing = \"-100 deg\" }]";
    assert!(run(ideal(mirrored)).0);
}

/// The classroom with true errors instead of its scale error of the ranger.
fn with_errors(errors: &str) -> Scenario {
    let text =
        CLASSROOM.replace("laps = 7 ", "laps = 1 ").replace("range_scale = \"0 %\" ", errors);
    Scenario::parse(&text, "test.toml", Path::new("")).unwrap()
}

fn traced(scenario: Scenario) -> Trace {
    let mut trace = Trace::default();
    Simulation::new(scenario).run(0, &mut trace).unwrap();
    trace
}

/// Without noise each range of a wall is that from the true mount, with scale and offset.
#[test]
fn the_sonar_is_where_the_truth_says() {
    let errors = "mount = [\"75 mm\", \"-9 mm\"]\nrange_offset = \"13 mm\"\nrange_scale = \"2 %\"";
    let mut scenario = with_errors(errors);
    scenario.fidelity = Fidelity::Ideal;
    scenario.hardware.sonar = SonarName::Ideal;
    (scenario.truth.range_noise, scenario.truth.range_noise_per_metre) = (0.0, 0.0);
    scenario.surroundings.temperature = scenario.robot.rangers.first.temperature.0.into();
    scenario.surroundings.obstacles.clear();
    let trace = traced(scenario);
    let mut compared = 0;
    for fix in &trace.fixes {
        let Some(range) = fix.range else { continue };
        let tick = trace.ticks.iter().find(|tick| (tick.time - fix.time).abs() < 1e-9).unwrap();
        let pose = tick.truth.unwrap().pose;
        let (sin, cos) = pose.heading.sin_cos();
        let sonar = [pose.x + 0.075 * cos + 0.009 * sin, pose.y + 0.075 * sin - 0.009 * cos];
        // The room is 6 m × 8 m.
        let distances = [sonar[0], 6.0 - sonar[0], sonar[1], 8.0 - sonar[1]];
        let error = distances.map(|distance| (1.02 * distance + 0.013 - range).abs());
        assert!(error.iter().any(|error| *error < 1e-6), "{fix:?}: {error:?}");
        compared += 1;
    }
    assert!(compared > 50, "{compared}");
}

/// A servo stated by its errors turns as one stated by the pulses that follow, at both fidelities.
#[test]
fn a_servo_is_stated_by_its_errors_or_by_its_pulses() {
    let by_errors = "servo_zero = \"4 deg\"\nservo_scale = \"-2.5 %\"\nrange_scale = \"0 %\"";
    let by_pulses = "range_scale = \"0 %\"\nservo_pulses = [{ width = \"500 us\", bearing = \"-93.5 deg\" }, \
        { width = \"2500 us\", bearing = \"101.5 deg\" }]";
    for fidelity in [Fidelity::Ideal, Fidelity::Pins] {
        let [by_errors, by_pulses, right] =
            [by_errors, by_pulses, "range_scale = \"0 %\""].map(|errors| {
                let scenario = with_errors(errors);
                traced(Scenario { fidelity, ..scenario })
            });
        // The bearings of both differ in the last bit of single precision.
        let ranges = |trace: &Trace| -> Vec<Option<i64>> {
            let millimetres = |range: f64| (1e3 * range).round() as i64;
            trace.fixes.iter().take(60).map(|fix| fix.range.map(millimetres)).collect()
        };
        assert_eq!(ranges(&by_errors), ranges(&by_pulses), "{fidelity:?}");
        assert_ne!(ranges(&by_errors), ranges(&right), "{fidelity:?}");
    }
}
