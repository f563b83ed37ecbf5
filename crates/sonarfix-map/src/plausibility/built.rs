//! A robot file that differs from the true robot of a scenario by more than a measurement with a ruler does.

use super::facts::{Fact, Facts};
use super::rule::short;
use crate::error::Mistake;
use crate::geometry::wrap;
use crate::scenario::Scenario;
use crate::servo::{bearing_of, width_of};

/// The usual ratio of the true travel of a wheel to that of the robot file.
const USUAL_RATIO: (f64, f64) = (0.85, 1.15);
/// The usual distance from the true mount, metres.
const MOUNT: f64 = 0.03;
/// The usual error of a bearing, radians: 15°.
const BEARING: f64 = 0.26;

/// The warnings about the robot file of a scenario that has the true wheels, mount or servo.
pub(super) fn of_scenario(facts: &Facts, scenario: &Scenario) -> Vec<Mistake> {
    let truth = &scenario.truth;
    let wheels = [("right_wheel", truth.scale_right), ("left_wheel", truth.scale_left)];
    let wheels = wheels.into_iter().filter_map(|(side, scale)| wheel(facts, side, 1.0 + scale));
    wheels.chain(mount(facts, scenario)).chain(servo(facts, scenario)).collect()
}

fn wheel(facts: &Facts, side: &str, ratio: f64) -> Option<Mistake> {
    let of = |table: &str| {
        let key = |name: &&str| facts.with(&format!("{table}.{side}.{name}")).next();
        ["diameter", "travel_per_edge"].iter().find_map(key)
    };
    let (fact, truth) = (of("drive")?, of("truth")?);
    let message = if ratio < 0.0 {
        format!(
            "counts in the other direction than truth.{side}: one of the two has a wrong `mirrored`"
        )
    } else if (USUAL_RATIO.0..=USUAL_RATIO.1).contains(&ratio) {
        return None;
    } else {
        format!(
            "{} is that of a wheel that rolls {} times as far per edge as truth.{side} with {}: correct the one that is wrong",
            fact.quoted(),
            short(1.0 / ratio),
            truth.quoted()
        )
    };
    fact.report().then(|| fact.warn(message))
}

fn mount(facts: &Facts, scenario: &Scenario) -> Option<Mistake> {
    let fact = facts.with("sonar.mount[0]").next()?;
    let assumed = scenario.robot.localizer.rangers.first.mount;
    let built = scenario.truth.robot(&scenario.robot).localizer.rangers.first.mount;
    let off = (built.x - assumed.x).0.hypot((built.y - assumed.y).0);
    let is_off = f64::from(off) > MOUNT && fact.report();
    is_off.then(|| {
        fact.warn(format!(
            "the mount is {} cm from truth.mount: correct the one that is wrong",
            short(100.0 * f64::from(off))
        ))
    })
}

fn servo(facts: &Facts, scenario: &Scenario) -> Option<Mistake> {
    let assumed = scenario.robot.rangers.first.servo_pulses;
    let truth = &scenario.truth;
    let [by_pulses, by_error] = [
        truth.servo_pulses.is_some(),
        truth.servo_zero.abs() > 0.0 || truth.servo_scale.abs() > 0.0,
    ];
    let built =
        (by_pulses || by_error).then(|| truth.robot(&scenario.robot).rangers.first.servo_pulses)?;
    let errors = built.map(|pulse| {
        let bearing = f64::from(pulse.bearing.0);
        wrap(bearing - bearing_of(assumed, width_of(built, bearing)))
    });
    let worst = errors.into_iter().max_by(|a, b| a.abs().total_cmp(&b.abs()))?;
    let fact: &Fact = facts.with("sonar.servo_pulses.bearing").next()?;
    let is_off = worst.abs() > BEARING && fact.report();
    is_off.then(|| {
        fact.warn(format!(
            "the bearings of servo_pulses are up to {}° from those of {}: correct the ones that are wrong",
            short(worst.abs().to_degrees()),
            if by_pulses { "truth.servo_pulses" } else { "truth.servo_zero and truth.servo_scale" }
        ))
    })
}
