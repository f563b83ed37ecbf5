//! What the telemetry suggests to check on the robot, in words.

use sonarfix_hal::robot::EncoderFaults;
use sonarfix_link::message::ImageStatus;

use crate::Monitor;

/// Distance in metres after which a wheel that has not rolled is suspicious: half a turn on the spot of most robots.
const ROLLED: f64 = 0.3;
/// Pings without an echo, and ranges gated, after which they are no coincidence.
const SILENT: u16 = 10;
const GATED: u16 = 10;

/// What to check, most important first; empty if nothing is conspicuous.
#[must_use]
pub fn hints(monitor: &Monitor) -> Vec<String> {
    let mut hints = Vec::new();
    link(monitor, &mut hints);
    flash(monitor, &mut hints);
    wheels(monitor, &mut hints);
    sonar(monitor, &mut hints);
    hints.extend(monitor.mismatch().map(|mismatch| format!("robot file: {mismatch}")));
    hints
}

fn link(monitor: &Monitor, hints: &mut Vec<String>) {
    let c = monitor.counters();
    if c.frames == 0 && c.foreign > 0 {
        hints.push(
            "only foreign frames: flash robot and PC with the same version of the link".to_owned(),
        );
    } else if c.frames == 0 && c.skipped() > 0 {
        hints.push("bytes, but no frame: is the baud rate that of the robot?".to_owned());
    }
}

fn flash(monitor: &Monitor, hints: &mut Vec<String>) {
    let Some(hello) = monitor.hello() else { return };
    for (image, name, bake) in [
        (hello.map, "map", "`sonarfix map bake`"),
        (hello.configuration, "configuration", "`sonarfix config bake`"),
    ] {
        let state = match image {
            ImageStatus::Valid(_) => continue,
            ImageStatus::Missing => "no",
            ImageStatus::Corrupt => "a damaged",
            ImageStatus::Version(_) => "an unsupported version of its",
        };
        hints.push(format!("the robot has {state} {name} in its flash: write one with {bake}"));
    }
    if monitor.loop_status().is_some_and(|status| !status.running) {
        hints.push("the loop is stopped: start it".to_owned());
    }
}

fn wheels(monitor: &Monitor, hints: &mut Vec<String>) {
    let [right, left] = monitor.wheels().alone();
    for (name, other, rolled) in [("right", "left", left), ("left", "right", right)] {
        if rolled > ROLLED {
            hints.push(format!(
                "the {name} encoder counts nothing, and the {other} wheel has rolled {rolled:.1} m: check its supply and its lines"
            ));
        }
    }
    let Some(status) = monitor.loop_status() else { return };
    let faults = &status.faults;
    for (name, EncoderFaults { errors, illegal }) in
        [("right", faults.right), ("left", faults.left)]
    {
        if illegal > 0 {
            hints.push(format!(
                "the {name} encoder skipped {illegal} states: noise on its lines, or edges faster than its input"
            ));
        }
        if errors > 0 {
            hints.push(format!("the {name} encoder could not be read {errors} times"));
        }
    }
    if faults.travel > 0 {
        hints.push(format!(
            "{} steps of the wheels were implausible: check ticks per revolution and wheel diameter",
            faults.travel
        ));
    }
    if faults.deadlines > 0 {
        hints.push(format!("{} samples of the encoders were late", faults.deadlines));
    }
}

fn sonar(monitor: &Monitor, hints: &mut Vec<String>) {
    if let Some(status) = monitor.loop_status() {
        let faults = &status.faults;
        for (count, name) in [(faults.ranger, "sonar"), (faults.servo, "servo")] {
            if count > 0 {
                hints.push(format!(
                    "the {name} failed {count} times: check its supply and its lines"
                ));
            }
        }
    }
    let Some(estimate) = monitor.estimate() else { return };
    let health = &estimate.health;
    if health.silent_in_a_row >= SILENT {
        hints.push(format!(
            "no usable range for {} pings: check trigger, echo and supply of the sonar, and that walls are within its range",
            health.silent_in_a_row
        ));
    }
    if health.gated_in_a_row >= GATED {
        hints.push(format!(
            "{} ranges in a row do not fit the map: pose, map, or the mount of sonar and servo is wrong",
            health.gated_in_a_row
        ));
    }
}
