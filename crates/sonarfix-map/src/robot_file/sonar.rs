//! The `[sonar]` tables of a robot file: ranger and servo.

use sonarfix::config::{MAX_RANGERS, PingSchedule, RangerId, Ranging, ServoTiming};
use sonarfix::geometry::units::{Duration, Radians};
use sonarfix_hal::config::{RangerConfig, RobotConfig};
use sonarfix_hal::servo::MeasuredPulse;

use super::ranger::{self, BEAM, Ranger};
use crate::devices::SERVOS;
use crate::document::{Node, Table};
use crate::keys::{Key, Section, Value, depends, number, optional};
use crate::quantity::{ANGLE, LENGTH, LENGTH_PER_LENGTH, Number, TEMPERATURE, TIME};
use crate::spelling::alternatives;

/// The fix period of a sonar that pings as fast as possible.
const AS_FAST_AS_POSSIBLE: &str = "as fast as possible";

/// The keys that all sonars of a robot share, so that the first has them.
const SHARED: [&str; 2] = ["fix_period", "temperature"];

/// The keys of a sonar on a servo.
const OF_SERVO: [&str; 3] = ["servo", "servo_pulses", "servo_timing"];

#[rustfmt::skip]
pub(crate) static SONAR: Section<Ranger> = Section { name: "sonar", usual: Ranger::usual, keys: &[
    Key::new("mount", Value::Pair(&LENGTH, ("-10 m", "10 m"), |r| [&mut r.sonar.mount.x.0, &mut r.sonar.mount.y.0]),
        "position of the sonar's axis: ahead and to the left of the midpoint between the wheels"),
    depends(number("bearing", &ANGLE, ("-180 deg", "180 deg"), |r| &mut r.bearing,
        "bearing of a sonar that is fixed to the robot, instead of `servo`, `servo_pulses` and `servo_timing`. A wall is measured while it is in the \
        cone there ([model.md](model.md#a-sonar-at-a-fixed-bearing))")),
    depends(Key::new("servo", Value::Pair(&ANGLE, ("-180 deg", "180 deg"), |r| [&mut r.sonar.servo.0.0, &mut r.sonar.servo.1.0]),
        "bearings that the servo may turn to: the rightmost, then the leftmost. Ahead is 0. A wall is measured only if the bearing perpendicular to it is within these limits, so a \
        robot that drives along walls needs a few degrees more than 90")),
    depends(Key::new("servo_pulses", Value::Own("two tables of `width` and `bearing`", |node, r| r.driver.servo_pulses = read_pulses(&node), |r| Some(pulses_text(r))),
        "two pulses and the measured bearing of the sonar at each. The farther apart, the more accurate. The pulses at both limits of `servo` must fit \
        into the frame and be supported by the [board](firmware.md#what-a-board-can-do)")),
    depends(Key::new("servo_timing", Value::Own("`\"instant\"`, `\"sg90\"`, `\"mg996r\"` or a table of times", read_timing, |r| Some(SERVO_TIMING.inline(&r.sonar.timing.servo))),
        "timing model of the servo. `\"instant\"` takes no time except a frame of 1 ms")),
    number("cone", &ANGLE, ("0.1 deg", "89 deg"), |r| &mut r.sonar.cone.0,
        "half of the cone in which the perpendicular echo of a wall is received. Of light the largest angle of incidence, at most 75°"),
    number("min_range", &LENGTH, ("0 m", "100 m"), |r| &mut r.sonar.min_range.0, "the shortest range that the ranger reports"),
    number("max_range", &LENGTH, ("1 mm", "1000 m"), |r| &mut r.sonar.max_range.0, "the longest range that the ranger reports. Above `min_range`"),
    number("noise", &LENGTH, ("0.001 mm", "10 m"), |r| &mut r.sonar.noise.floor.0, "noise of a range, the part that does not depend on the range"),
    number("noise_per_metre", &LENGTH_PER_LENGTH, ("0 mm/m", "1 m/m"), |r| &mut r.sonar.noise.per_metre,
        "noise proportional to the range. The variances add up"),
    depends(Key::new("fix_period", Value::Own("1 us to 3600 s, or `\"as fast as possible\"`", |node, r| read_schedule(&node, r), schedule_text),
        "period of the pings. `\"as fast as possible\"`: as soon as the servo has settled and the last echo has decayed")),
    Key::new("ranger", Value::Own("a driver of the list above, or a table of its settings", ranger::read_kind, |r| Some(ranger::kind_text(r))),
        "the ranger, by its name or by a table with the settings that differ from those of its kind. `\"custom\"`: a driver of one's own"),
    optional(Key::new("beam", Value::Own("a table of `spot` and `pointing`", ranger::read_beam, |r| match r.sonar.ranging {
        Ranging::Sound => None,
        Ranging::Light(beam) => Some(BEAM.inline(&beam)),
    }), "beam of a time-of-flight ranger, that of the `ranger` without this key. A custom ranger with a `beam` measures with light")),
    optional(number("temperature", &TEMPERATURE, ("-40 degC", "85 degC"), |r| &mut r.driver.temperature.0,
        "temperature of the air, with which the driver computes ranges")),
    depends(number("cycle", &TIME, ("0 s", "60 s"), |r| &mut r.sonar.timing.cycle,
        "minimum time between pings, so that late echoes of a ping are not assigned to the next one. Without this key that of the `ranger`; required for a \
        custom one")),
] };

#[rustfmt::skip]
pub(crate) static PULSE: Section<MeasuredPulse> = Section {
    name: "servo_pulses", usual: || MeasuredPulse { width: Duration::from_ticks(0), bearing: Radians(0.0) }, keys: &[
    number("width", &TIME, ("1 us", "100 ms"), |p| &mut p.width, "width of the pulse"),
    number("bearing", &ANGLE, ("-360 deg", "360 deg"), |p| &mut p.bearing.0, "measured bearing of the sonar with it"),
] };

#[rustfmt::skip]
pub(crate) static SERVO_TIMING: Section<ServoTiming> = Section { name: "servo_timing", usual: || ServoTiming::INSTANT, keys: &[
    number("frame", &TIME, ("0 s", "10 s"), |t| &mut t.frame, "period of the pulses"),
    number("sixty_degrees", &TIME, ("0 s", "10 s"), |t| &mut t.sixty_degrees, "time for a turn of 60°"),
    number("settle", &TIME, ("0 s", "10 s"), |t| &mut t.settle, "time from arrival until the oscillation has decayed"),
] };

/// A table for each sonar: `[sonar]`, or several of `[[sonar]]`.
pub(crate) fn nodes(node: Node<'_>) -> Vec<Node<'_>> {
    if node.is_array() { node.items() } else { vec![node] }
}

/// Reads `sonar`: the tables of all sonars.
pub(crate) fn read(node: Node<'_>, config: &mut RobotConfig) {
    let count = if node.is_array() { node.items().len() } else { 1 };
    if !(1..=MAX_RANGERS).contains(&count) {
        node.report(format!("must be 1 to {MAX_RANGERS} tables"));
    }
    for (index, node) in nodes(node).into_iter().enumerate() {
        let table = node.table(&SONAR.names());
        if index == 0 {
            table.require("fix_period");
            let Ranger { sonar, driver, .. } = read_sonar(&table, Ranger::usual());
            (config.localizer.rangers.first, config.rangers.first) = (sonar, driver);
            continue;
        }
        for node in SHARED.iter().filter_map(|key| table.get(key)) {
            node.report("is one for all sonars: write it in the first only");
        }
        let first = Ranger {
            sonar: config.localizer.rangers.first,
            driver: config.rangers.first,
            bearing: None,
        };
        let Ranger { sonar, driver, .. } = read_sonar(&table, first);
        // Too many are a mistake that has been reported.
        _ = config.localizer.rangers.push(sonar);
        _ = config.rangers.push(driver);
    }
}

/// Reads a sonar, which is on a servo or at a bearing.
fn read_sonar(table: &Table<'_>, usual: Ranger) -> Ranger {
    let mut ranger = SONAR.read_from(table, usual);
    ranger::require_cycle(table, &ranger);
    let bearing = ranger.bearing.map(Radians);
    for key in OF_SERVO {
        if let (Some(_), Some(node)) = (bearing, table.get(key)) {
            node.report(
                "is of a sonar on a servo, and `bearing` of one without: remove one of them",
            );
        } else if bearing.is_none() {
            table.require(key);
        }
    }
    if let Some(bearing) = bearing {
        ranger.sonar.servo = (bearing, bearing);
        ranger.sonar.timing.servo = ServoTiming::INSTANT;
        ranger.driver.servo_pulses = RangerConfig::NO_PULSES;
    } else if ranger.sonar.fixed_bearing().is_some() {
        table.report_at(
            "servo",
            "must be a rightmost below a leftmost bearing: a sonar without a servo has `bearing`",
        );
    }
    ranger
}

/// The tables of all sonars; the first has what they share.
pub(crate) fn text(config: &RobotConfig) -> String {
    let header = if config.localizer.rangers.are_several() { "[[sonar]]" } else { "[sonar]" };
    let tables = config.localizer.rangers.iter().filter_map(|(id, _)| {
        let (&sonar, &driver) = config.ranger_of(id)?;
        let bearing = sonar.fixed_bearing().map(|bearing| bearing.0);
        let shared: &[&str] = if id == RangerId::FIRST { &[] } else { &SHARED };
        let of_servo: &[&str] = if bearing.is_some() { &OF_SERVO } else { &[] };
        let is_written = |line: &&str| {
            let key = line.split(" = ").next().unwrap_or_default();
            !shared.contains(&key) && !of_servo.contains(&key)
        };
        let lines = SONAR.lines(&Ranger { sonar, driver, bearing });
        let lines: String = lines.split_inclusive('\n').filter(is_written).collect();
        Some(format!("\n{header}\n{lines}"))
    });
    tables.collect()
}

fn read_schedule(node: &Node<'_>, ranger: &mut Ranger) {
    ranger.sonar.timing.schedule = if node.as_text() == Some(AS_FAST_AS_POSSIBLE) {
        PingSchedule::AsFastAsPossible
    } else {
        let mut period = Duration::from_ticks(0);
        period.set(node.within(&TIME, ("1 us", "3600 s"), "period of the pings"));
        PingSchedule::Every(period)
    };
}

fn schedule_text(ranger: &Ranger) -> Option<String> {
    match ranger.sonar.timing.schedule {
        PingSchedule::Every(period) => TIME.text(&period),
        PingSchedule::AsFastAsPossible => Some(format!("\"{AS_FAST_AS_POSSIBLE}\"")),
    }
}

/// A servo by its name, or by its times.
fn read_timing(node: Node<'_>, ranger: &mut Ranger) {
    let timing = &mut ranger.sonar.timing.servo;
    let Some(name) = node.as_text() else {
        *timing = SERVO_TIMING.read(node, *timing);
        return;
    };
    if let Some((_, named)) = SERVOS.iter().find(|(known, _)| *known == name) {
        *timing = *named;
    } else {
        let known = alternatives(name, &SERVOS.map(|(known, _)| known));
        node.report(format!("must be {known}, or a table of its times"));
    }
}

pub(crate) fn read_pulses(node: &Node<'_>) -> [MeasuredPulse; 2] {
    node.pair().map(|node| PULSE.read(node, (PULSE.usual)()))
}

fn pulses_text(ranger: &Ranger) -> String {
    let pulses = ranger.driver.servo_pulses.map(|pulse| PULSE.inline(&pulse));
    format!("[{}]", pulses.join(", "))
}
