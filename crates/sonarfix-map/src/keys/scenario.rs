//! The keys of map and scenario files.

use super::robot::number;
use super::{Key, Section, Value, depends, optional};
use crate::absolute_file::{self, AbsoluteSensors, HeadingSensor, PositionSensor};
use crate::faults::FaultKeys;
use crate::fidelity::{self, Fidelity, Follow, HeadingSlip, ServoName, Upset, Upsets};
use crate::quantity::{
    ANGLE, FRACTION, LENGTH, LENGTH_PER_LENGTH, LENGTH_WALK, NUMBER, SCALE_WALK, SPEED,
    TEMPERATURE, TIME, TURN_RATE,
};
use crate::scenario::{self, Drive, GyroTruth, Run, Start, Truth, whole};
use crate::sonar_model::SonarName;

/// A key whose table reads it together with others.
const fn other<T: Copy>(name: &'static str, must: &'static str, doc: &'static str) -> Key<T> {
    depends(Key::new(name, Value::Own(must, |_, _| {}, |_| None), doc))
}

#[rustfmt::skip]
pub(crate) static SCENARIO: Section<Fidelity> = Section { name: "scenario", usual: Fidelity::default, keys: &[
    other("name", "a text", "name of the scenario"),
    other("description", "a text", "what the scenario demonstrates"),
    optional(Key::new("fidelity", Value::Word(&["ideal", "pins"], |f| usize::from(*f == Fidelity::Pins), |f, word| {
        *f = if word == 0 { Fidelity::Ideal } else { Fidelity::Pins };
    }), "travel and ranges are passed directly and on time, or through simulated pins, with the drivers and the loop of a robot")),
    other("map", "a table, or a name", "the `[map]` table as in a map file, or the name of one: `map = \"map.toml\"`"),
    other("robot", "tables, or a name", "the robot file's tables, as `[robot.drive]` and so on, or the name of one: `robot = \"robot.toml\"`"),
    other("path", "a table", "[the path](#path)"),
    other("start", "a table, or `\"unknown\"`", "[the initial estimate](#start)"),
    other("truth", "a table", "[the true parameters](#truth)"),
    optional(other("sensor", "a table", "[the simulated sonar](#sensor)")),
    optional(other("servo", "a table", "[the simulated servo](#servo)")),
    optional(other("world", "a table", "[air and obstacles](#world)")),
    optional(other("absolute", "a table", "[sensors that measure from outside](#absolute)")),
    optional(other("faults", "tables", "[faults of the hardware](#faults)")),
    other("run", "a table", "[how many runs](#run)"),
] };

#[rustfmt::skip]
pub(crate) static MAP: Section<()> = Section { name: "map", usual: || (), keys: &[
    other("unit", "`\"m\"`, `\"cm\"` or `\"mm\"`", "unit of the coordinates"),
    other("wall", "at least one table", "the walls. `[[map.wall]]` tables are equivalent"),
] };

#[rustfmt::skip]
pub(crate) static WALL: Section<Option<f64>> = Section { name: "wall", usual: || None, keys: &[
    other("name", "unique", "name of the wall"),
    other("from", "within 8 km of the origin", "one end of the wall"),
    other("to", "the same", "the other end, at least 0.1 mm away"),
    optional(Key::new("accuracy", Value::Number(&LENGTH, ("0.1 mm", "255 mm"), |accuracy| accuracy),
        "standard deviation of its place, in whole millimetres, instead of `map_accuracy` of the [robot file](#robot). `sonarfix survey` writes it")),
] };

#[rustfmt::skip]
pub(crate) static PATH: Section<Drive> = Section { name: "path", usual: Drive::default, keys: &[
    other("unit", "`\"m\"`, `\"cm\"` or `\"mm\"`", "unit of the coordinates"),
    other("start", "within 8 km of the origin", "start point"),
    other("corners", "at least one, within 8 km of the origin", "the corners, in order. Each is different from the point before"),
    optional(Key::new("laps", Value::Own("1 to 10000", |node, d| d.laps = whole(&node), |d| Some(d.laps.to_string())),
        "number of laps. 1 if the last corner is not the start")),
    number("speed", &SPEED, ("1 mm/s", "100 m/s"), |d| &mut d.speed, "speed on straight legs. Within the robot's `max_wheel_speed`"),
    number("turn_rate", &TURN_RATE, ("0.1 deg/s", "10000 deg/s"), |d| &mut d.turn_rate, "turn rate on the spot. No wheel is faster than `max_wheel_speed`"),
    optional(number("clearance", &LENGTH, ("0 m", "100 m"), |d| &mut d.clearance,
        "minimum distance of the path from walls, such as the robot's radius. A path through a wall is refused in any case")),
    optional(Key::new("follow", Value::Word(&["truth", "estimate"], |d| usize::from(d.follow == Follow::Estimate), |d, word| {
        d.follow = if word == 0 { Follow::Truth } else { Follow::Estimate };
    }), "whether the robot follows its path exactly, regardless of the estimate, or is steered by the estimate. Then the run ends when the path would")),
] };

#[rustfmt::skip]
pub(crate) static START: Section<Start> = Section { name: "start", usual: Start::unknown, keys: &[
    number("position", &LENGTH, ("0 m", "1000 m"), |s| &mut s.position, "deviation of x and of y"),
    number("heading", &ANGLE, ("0 deg", "360 deg"), |s| &mut s.heading, "deviation of the heading"),
    Key::new("drawn", Value::Flag(|s| &mut s.drawn), "whether the initial estimate has a random error with these deviations, or equals the truth"),
] };

#[rustfmt::skip]
pub(crate) static TRUTH: Section<(Truth, Upsets)> = Section { name: "truth", usual: <(Truth, Upsets)>::default, keys: &[
    number("track_width", &LENGTH, ("1 cm", "10 m"), |t| &mut t.0.track_width, "true track width"),
    number("scale_right", &FRACTION, ("-99 %", "1000 %"), |t| &mut t.0.scale_right,
        "scale error of the right wheel, a fraction. It rolls 1 + this times the encoder reading"),
    number("scale_left", &FRACTION, ("-99 %", "1000 %"), |t| &mut t.0.scale_left, "scale error of the left wheel"),
    number("range_scale", &FRACTION, ("-99 %", "1000 %"), |t| &mut t.0.range_scale,
        "scale error of the ranger, a fraction. It reports 1 + this times the distance"),
    number("wheel_noise", &LENGTH_WALK, ("0 m/sqrt(m)", "1 m/sqrt(m)"), |t| &mut t.0.wheel_noise, "true value of the key of `[drive]`"),
    number("scale_walk", &SCALE_WALK, ("0 /sqrt(m)", "1 /sqrt(m)"), |t| &mut t.0.scale_walk, "the same"),
    number("track_width_walk", &LENGTH_WALK, ("0 m/sqrt(m)", "1 m/sqrt(m)"), |t| &mut t.0.track_width_walk, "the same"),
    number("range_noise", &LENGTH, ("0 m", "10 m"), |t| &mut t.0.range_noise, "true value of `noise` of `[sonar]`"),
    number("range_noise_per_metre", &LENGTH_PER_LENGTH, ("0 m/m", "1 m/m"), |t| &mut t.0.range_noise_per_metre, "true value of `noise_per_metre`"),
    number("cone", &ANGLE, ("0.1 deg", "89 deg"), |t| &mut t.0.cone, "half of the cone in which the sonar receives echoes"),
    optional(Key::new("slip", Value::Own("a table of `every` and `by`", |node, t| t.1.slip = UPSET.read(node, Upset::default()), |_| None),
        "random slips: a wheel turns by `by` without rolling")),
    optional(Key::new("bump", Value::Own("a table of `every` and `by`", |node, t| t.1.bump = UPSET.read(node, Upset::default()), |_| None),
        "random bumps that change the travel of a wheel by a normally distributed amount, whose standard deviation is `by`")),
    optional(Key::new("heading_slip", Value::Own("a table of `every`, `least` and `most`", fidelity::read_heading_slip, |_| None),
        "slips of one of the wheels while the robot drives. The wheel spins for 0.5 s, so that the odometry turns by `least` to `most` and the robot does \
        not")),
    optional(Key::new("gyro", Value::Own("a table of `bias` and `scale`", |node, t| t.0.gyro = GYRO.read(node, GyroTruth::default()), |_| None),
        "errors of the gyro")),
] };

#[rustfmt::skip]
static UPSET: Section<Upset> = Section { name: "slip", usual: Upset::default, keys: &[
    number("every", &LENGTH, ("1 mm", "1000000 m"), |u| &mut u.every, "mean distance between two of a wheel"),
    number("by", &LENGTH, ("0 m", "10 m"), |u| &mut u.by, "travel of the wheel"),
] };

#[rustfmt::skip]
pub(crate) static HEADING_SLIP: Section<HeadingSlip> = Section { name: "heading_slip", usual: HeadingSlip::default, keys: &[
    number("every", &TIME, ("1 ms", "1000000 s"), |s| &mut s.every, "mean time between two"),
    number("least", &ANGLE, ("0 deg", "360 deg"), |s| &mut s.least, "least turn of the odometry"),
    number("most", &ANGLE, ("0 deg", "360 deg"), |s| &mut s.most, "greatest turn. At least `least`"),
] };

#[rustfmt::skip]
static GYRO: Section<GyroTruth> = Section { name: "gyro_truth", usual: GyroTruth::default, keys: &[
    optional(number("bias", &TURN_RATE, ("-1000 deg/s", "1000 deg/s"), |g| &mut g.bias,
        "bias at the start. Without this key it is drawn with the deviation in `[gyro]`")),
    optional(number("scale", &FRACTION, ("-100 %", "100 %"), |g| &mut g.scale, "scale error")),
] };

#[rustfmt::skip]
pub(crate) static SENSOR: Section<SonarName> = Section { name: "sensor", usual: SonarName::default, keys: &[
    optional(Key::new("model", Value::Own("a simulation of the list above", |node, sonar| scenario::read_sensor(&node, sonar), |_| None),
        "the simulated sonar. `\"ideal\"`, which is usual, always detects the nearest wall in its cone; `\"hc_sr04\"` and `\"nxt\"` are as measured ([the \
        fit](sonar-model.md)), the others by their datasheets")),
] };

#[rustfmt::skip]
pub(crate) static SERVO: Section<ServoName> = Section { name: "servo", usual: ServoName::default, keys: &[
    optional(Key::new("model", Value::Word(&["ideal", "sg90", "mg996r"], |servo| *servo as usize, |servo, word| {
        *servo = [ServoName::Ideal, ServoName::Sg90, ServoName::Mg996r].get(word).copied().unwrap_or_default();
    }), "reaches the commanded bearing at once, or has frame, slew, dead band, ringing and backlash")),
] };

#[rustfmt::skip]
pub(crate) static WORLD: Section<f64> = Section { name: "world", usual: || 20.0, keys: &[
    optional(Key::new("temperature", Value::Number(&TEMPERATURE, ("-40 degC", "85 degC"), |celsius| celsius), "temperature of the air")),
    depends(other("unit", "`\"m\"`, `\"cm\"` or `\"mm\"`", "unit of the coordinates. Required with obstacles")),
    optional(other("obstacle", "tables", "standing or moving obstacles, round or flat")),
] };

/// Radius and `takes` of an obstacle.
#[rustfmt::skip]
pub(crate) static OBSTACLE: Section<(f64, f64)> = Section { name: "obstacle", usual: || (0.0, 0.0), keys: &[
    depends(other("centre", "within 8 km of the origin", "centre of a round one")),
    depends(number("radius", &LENGTH, ("0.1 mm", "1000 m"), |o| &mut o.0, "radius of a round one")),
    depends(other("from", "within 8 km of the origin", "one end of a flat one")),
    depends(other("to", "different from `from`", "the other end")),
    optional(other("walk", "within 8 km", "by what x and y it moves, and back, repeatedly")),
    depends(number("takes", &TIME, ("1 ms", "1000000 s"), |o| &mut o.1, "how long it moves in one direction. Required with `walk`")),
] };

#[rustfmt::skip]
pub(crate) static FAULT: Section<FaultKeys> = Section { name: "faults", usual: FaultKeys::default, keys: &[
    other("kind", "a fault of the list below", "the fault"),
    number("from", &TIME, ("0 s", "1000000 s"), |f| &mut f.from, "when it begins, from the start of the run"),
    number("to", &TIME, ("0 s", "1000000 s"), |f| &mut f.to, "when it ends. After `from`"),
    depends(Key::new("wheel", Value::Word(&["right", "left"], |f| usize::from(f.is_left), |f, word| f.is_left = word == 1), "the wheel")),
    depends(number("share", &FRACTION, ("0", "1"), |f| &mut f.share, "how many, a fraction")),
    depends(number("times", &NUMBER, ("1", "1000"), |f| &mut f.times, "how many times as long")),
    depends(number("late", &TIME, ("0 s", "100 s"), |f| &mut f.late, "the maximum delay")),
] };

#[rustfmt::skip]
pub(crate) static RUN: Section<Run> = Section { name: "run", usual: || Run { runs: 1, seed: 0 }, keys: &[
    Key::new("runs", Value::Own("a whole number from 1 to 4294967295", |node, r| r.runs = whole(&node), |_| None), "number of Monte-Carlo runs"),
    Key::new("seed", Value::Own("a whole number from 0 to 18446744073709551615", |node, r| r.seed = node.integer(0..=u64::MAX), |_| None),
        "seed of the first run. Each further run uses the next number"),
] };

#[rustfmt::skip]
pub(crate) static ABSOLUTE: Section<AbsoluteSensors> = Section { name: "absolute", usual: AbsoluteSensors::default, keys: &[
    optional(Key::new("heading", Value::Own("a table", |node, a| a.heading = Some(HEADING.read(node, absolute_file::NO_HEADING)), |_| None), "a compass")),
    optional(Key::new("position", Value::Own("a table", |node, a| a.position = Some(POSITION.read(node, absolute_file::NO_POSITION)), |_| None),
        "a beacon. With `heading_deviation` a camera, which measures the pose")),
] };

#[rustfmt::skip]
static HEADING: Section<HeadingSensor> = Section { name: "absolute_heading", usual: || absolute_file::NO_HEADING, keys: &[
    number("deviation", &ANGLE, ("0.0001 deg", "360 deg"), |s| &mut s.deviation,
        "standard deviation of the noise. The robot receives it with the measurement"),
    number("period", &TIME, ("1 ms", "3600 s"), |s| &mut s.sampling.period, "time between two measurements"),
    optional(number("delay", &TIME, ("0 s", "3600 s"), |s| &mut s.sampling.delay, "time until it arrives at the robot")),
    optional(number("outliers", &FRACTION, ("0", "1"), |s| &mut s.sampling.outliers, "how many are an outlier: any heading")),
] };

#[rustfmt::skip]
static POSITION: Section<PositionSensor> = Section { name: "absolute_position", usual: || absolute_file::NO_POSITION, keys: &[
    number("deviation", &LENGTH, ("0.001 mm", "1000 m"), |s| &mut s.deviation, "standard deviation of the noise, of x and of y each"),
    optional(number("heading_deviation", &ANGLE, ("0.0001 deg", "360 deg"), |s| &mut s.heading_deviation, "standard deviation of the heading")),
    number("period", &TIME, ("1 ms", "3600 s"), |s| &mut s.sampling.period, "time between two measurements"),
    optional(number("delay", &TIME, ("0 s", "3600 s"), |s| &mut s.sampling.delay, "time until it arrives at the robot")),
    optional(number("outliers", &FRACTION, ("0", "1"), |s| &mut s.sampling.outliers,
        "how many are an outlier: up to 5 m away along x and y")),
] };

/// The tables of `docs/formats.md`.
pub(crate) fn rows() -> Vec<(&'static str, String)> {
    vec![
        SCENARIO.rows(),
        MAP.rows(),
        WALL.rows(),
        PATH.rows(),
        START.rows(),
        TRUTH.rows(),
        UPSET.rows(),
        HEADING_SLIP.rows(),
        GYRO.rows(),
        SENSOR.rows(),
        SERVO.rows(),
        WORLD.rows(),
        OBSTACLE.rows(),
        FAULT.rows(),
        RUN.rows(),
        ABSOLUTE.rows(),
        HEADING.rows(),
        POSITION.rows(),
    ]
}
