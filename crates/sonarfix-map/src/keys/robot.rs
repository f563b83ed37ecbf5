//! The keys of robot files.

use std::collections::HashMap;

use sonarfix::aim::Policy;
use sonarfix::config::{Config, LightBeam, Ranging, ServoTiming};
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::{Duration, Metres, Radians};
use sonarfix::sensor::gyro::GyroParameters;
use sonarfix_hal::config::{RobotConfig, StartPose};
use sonarfix_hal::ranger::PulseTiming;
use sonarfix_hal::servo::MeasuredPulse;
use sonarfix_search::search::Region;

use super::{Key, Section, Value, depends, optional};
use crate::quantity::{
    ANGLE, ANGLE_WALK, Dimension, FRACTION, LENGTH, LENGTH_PER_LENGTH, LENGTH_WALK, Limits, NUMBER,
    Number, SCALE_WALK, SPEED, TEMPERATURE, TIME, TURN_RATE, TURN_RATE_WALK,
};
use crate::ranger_file::{self, RangerKeys};
use crate::robot_file::{self as file, Ranger, Wheel};

pub(super) const fn number<T: Copy>(
    name: &'static str,
    dimension: &'static Dimension,
    limits: Limits,
    field: fn(&mut T) -> &mut dyn Number,
    doc: &'static str,
) -> Key<T> {
    Key::new(name, Value::Number(dimension, limits, field), doc)
}

/// A robot with common parts, whose keys of its own a file replaces.
pub(crate) fn usual() -> RobotConfig {
    RobotConfig::with_common_parts(Config::for_track_width(Metres(0.16)))
}

#[rustfmt::skip]
pub(crate) static ROBOT: Section<RobotConfig> = Section { name: "robot", usual, keys: &[
    optional(Key::new("start", Value::Word(&["known", "unknown"], |c| usize::from(c.start.is_unknown()), |c, word| {
        c.start = if word == 0 { StartPose::Known } else { StartPose::Unknown { region: None } };
    }), "whether the pose is set before the start. If not, or when it is lost, the robot \
        [searches](search.md#in-the-robots-loop) for it. A robot with a known start stays lost")),
    optional(Key::new("start_region", Value::Own("a table of `from` and `to`", file::read_region, |c| c.start.region().map(|region| REGION.inline(&region))),
        "where on the map a robot without a pose starts, with `start = \"unknown\"`. Anywhere without this key")),
    Key::new("drive", Value::Table(&DRIVE), "wheels and encoders"),
    Key::new("sonar", Value::Tables(file::read_sonars, file::sonars_text), "ranger and servo"),
    Key::new("prior", Value::Table(&PRIOR), "how wrong the calibration may be"),
    Key::new("gating", Value::Table(&GATING), "which ranges and walls are used"),
    optional(Key::new("echo", Value::Table(&ECHO), "what a ping returns besides the range of its wall")),
    Key::new("schedule", Value::Table(&SCHEDULE), "which wall is measured next"),
    optional(Key::new("motors", Value::Table(&MOTORS), "when the motors are enabled")),
    optional(Key::new("gyro", Value::Tables(|node, c| c.localizer.gyro = Some(GYRO.read(node, (GYRO.usual)())), |c| {
        c.localizer.gyro.map_or_else(String::new, |gyro| format!("\n[gyro]\n{}", GYRO.lines(&gyro)))
    }), "a gyro that measures the yaw rate")),
] };

#[rustfmt::skip]
pub(crate) static REGION: Section<Region> = Section {
    name: "start_region", usual: || Region { from: Point::new(0.0, 0.0), to: Point::new(0.0, 0.0) }, keys: &[
    Key::new("from", Value::Pair(&LENGTH, ("-8000 m", "8000 m"), |r| [&mut r.from.x.0, &mut r.from.y.0]),
        "the corner with the smaller coordinates, on the map"),
    Key::new("to", Value::Pair(&LENGTH, ("-8000 m", "8000 m"), |r| [&mut r.to.x.0, &mut r.to.y.0]), "the corner with the larger ones"),
] };

#[rustfmt::skip]
static DRIVE: Section<RobotConfig> = Section { name: "drive", usual, keys: &[
    number("track_width", &LENGTH, ("1 cm", "10 m"), |c| &mut c.localizer.drive.track_width.0,
        "distance between the wheels' points of contact, as measured"),
    number("wheel_noise", &LENGTH_WALK, ("0.001 mm/sqrt(m)", "1 m/sqrt(m)"), |c| &mut c.localizer.drive.wheel_noise.0.0,
        "white noise of each wheel's travel: 0.5 mm/√m on a hard floor, up to 20 on a bad one"),
    number("scale_walk", &SCALE_WALK, ("0 /sqrt(m)", "1 /sqrt(m)"), |c| &mut c.localizer.drive.scale_walk.0, "random walk of each wheel's scale error"),
    number("track_width_walk", &LENGTH_WALK, ("0 m/sqrt(m)", "1 m/sqrt(m)"), |c| &mut c.localizer.drive.track_width_walk.0.0,
        "random walk of the track width"),
    number("max_wheel_speed", &SPEED, ("1 mm/s", "100 m/s"), |c| &mut c.localizer.max_wheel_speed.0,
        "upper limit of the speed of a wheel. A reading above it is treated as an encoder fault"),
    number("encoder_period", &TIME, ("1 ms", "1 s"), |c| &mut c.encoder_period, "period of the encoder samples"),
    Key::new("right_wheel", Value::Own("a table", |node, c| c.right_wheel = file::read_wheel(node), |c| Some(file::wheel_text(c.right_wheel))),
        "the right wheel and its encoder"),
    Key::new("left_wheel", Value::Own("a table", |node, c| c.left_wheel = file::read_wheel(node), |c| Some(file::wheel_text(c.left_wheel))),
        "the left wheel and its encoder"),
] };

#[rustfmt::skip]
pub(crate) static WHEEL: Section<Wheel> = Section { name: "wheel", usual: Wheel::default, keys: &[
    depends(number("diameter", &LENGTH, ("1 mm", "10 m"), |w| &mut w.diameter, "diameter of the wheel")),
    depends(number("edges_per_revolution", &NUMBER, ("1", "10000000"), |w| &mut w.edges,
        "encoder counts per revolution of the wheel, with all edges of both channels")),
    depends(number("travel_per_edge", &LENGTH, ("0.00001 mm", "1 m"), |w| &mut w.travel,
        "instead of both: the travel per edge. Drive a long distance, and divide it by the number of edges")),
    optional(Key::new("mirrored", Value::Flag(|w| &mut w.is_mirrored), "whether the encoder counts down when the robot drives forwards")),
] };

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
    depends(Key::new("servo_pulses", Value::Own("two tables of `width` and `bearing`", |node, r| file::read_pulses(&node, r), |r| Some(file::pulses_text(r))),
        "two pulses and the measured bearing of the sonar at each. The farther apart, the more accurate. The pulses at both limits of `servo` must fit \
        into the frame and be supported by the [board](firmware.md#what-a-board-can-do)")),
    depends(Key::new("servo_timing", Value::Own("`\"instant\"`, `\"sg90\"`, `\"mg996r\"` or a table of times", file::read_timing, |r| Some(SERVO_TIMING.inline(&r.sonar.timing.servo))),
        "timing model of the servo. `\"instant\"` takes no time except a frame of 1 ms")),
    number("cone", &ANGLE, ("0.1 deg", "89 deg"), |r| &mut r.sonar.cone.0,
        "half of the cone in which the perpendicular echo of a wall is received. Of light the largest angle of incidence, at most 75°"),
    number("min_range", &LENGTH, ("0 m", "100 m"), |r| &mut r.sonar.min_range.0, "the shortest range that the ranger reports"),
    number("max_range", &LENGTH, ("1 mm", "1000 m"), |r| &mut r.sonar.max_range.0, "the longest range that the ranger reports. Above `min_range`"),
    number("noise", &LENGTH, ("0.001 mm", "10 m"), |r| &mut r.sonar.noise.floor.0, "noise of a range, the part that does not depend on the range"),
    number("noise_per_metre", &LENGTH_PER_LENGTH, ("0 mm/m", "1 m/m"), |r| &mut r.sonar.noise.per_metre,
        "noise proportional to the range. The variances add up"),
    depends(Key::new("fix_period", Value::Own("1 us to 3600 s, or `\"as fast as possible\"`", |node, r| file::read_schedule(&node, r), file::schedule_text),
        "period of the pings. `\"as fast as possible\"`: as soon as the servo has settled and the last echo has decayed")),
    Key::new("ranger", Value::Own("a driver of the list above, or a table of its settings", ranger_file::read_kind, |r| Some(ranger_file::kind_text(r))),
        "the ranger, by its name or by a table with the settings that differ from those of its kind. `\"custom\"`: a driver of one's own"),
    optional(Key::new("beam", Value::Own("a table of `spot` and `pointing`", ranger_file::read_beam, |r| match r.sonar.ranging {
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

#[rustfmt::skip]
pub(crate) static BEAM: Section<LightBeam> = Section { name: "beam", usual: || LightBeam::VL53L1X, keys: &[
    depends(number("spot", &ANGLE, ("0.01 deg", "20 deg"), |b| &mut b.spot.0, "half of the cone that it lights")),
    depends(number("pointing", &ANGLE, ("0 deg", "45 deg"), |b| &mut b.pointing.0,
        "standard deviation of its direction: of servo and mount")),
] };

#[rustfmt::skip]
pub(crate) static RANGER: Section<RangerKeys> = Section { name: "ranger", usual: || RangerKeys { timing: PulseTiming::HC_SR04, address: None }, keys: &[
    depends(Key::new("kind", Value::Own("a driver of the list above", |_, _| {}, |_| None), "the kind of ranger")),
    depends(Key::new("address", Value::Own("0x08 to 0x77", |node, r| ranger_file::read_address(&node, r), |_| None),
        "address on the bus of an SRF, a VL53L1X or a VL53L0X. The other settings are those of an HC-SR04 and an LV-MaxSonar")),
    depends(number("trigger", &TIME, ("0 s", "10 s"), |r| &mut r.timing.trigger, "width of the trigger pulse")),
    depends(number("blanking", &TIME, ("0 s", "10 s"), |r| &mut r.timing.blanking, "time after the trigger in which the echo line is ignored")),
    depends(number("longest", &TIME, ("0 s", "10 s"), |r| &mut r.timing.longest, "the longest echo pulse that is a range")),
    depends(number("silence", &TIME, ("0 s", "10 s"), |r| &mut r.timing.silence, "pulses from this length on mean that there was no echo")),
    depends(number("listen", &TIME, ("0 s", "10 s"), |r| &mut r.timing.listen, "time after which the ranger is taken not to answer")),
    depends(number("stuck", &TIME, ("0 s", "10 s"), |r| &mut r.timing.stuck, "time after which the echo line is taken to be stuck")),
] };

#[rustfmt::skip]
static PRIOR: Section<RobotConfig> = Section { name: "prior", usual, keys: &[
    number("scale_right", &FRACTION, ("0 %", "100 %"), |c| &mut c.localizer.prior.scale_right, "scale error of the right wheel's diameter, a fraction"),
    number("scale_left", &FRACTION, ("0 %", "100 %"), |c| &mut c.localizer.prior.scale_left, "scale error of the left wheel's diameter"),
    optional(number("scale_difference", &FRACTION, ("0.0001 %", "100 %"), |c| &mut c.localizer.prior.scale_difference,
        "scale error of the right wheel less that of the left. Wheels of one type are alike, however wrong their nominal diameter is. Limited to what the \
        two above permit ([model.md](model.md#motion), eq. 48); without it their errors are independent")),
    number("track_width", &LENGTH, ("0 m", "5 m"), |c| &mut c.localizer.prior.track_width.0, "error of the track width. Below half the track width"),
    number("range_scale", &FRACTION, ("0 %", "100 %"), |c| &mut c.localizer.prior.range_scale,
        "scale error of the ranges: the speed of sound changes by 0.18 %/°C. Zero: not estimated"),
] };

#[rustfmt::skip]
static GATING: Section<RobotConfig> = Section { name: "gating", usual, keys: &[
    number("confidence", &NUMBER, ("0", "100"), |c| &mut c.localizer.gating.confidence,
        "standard deviations of position and heading by which no other wall may return an earlier echo. A wall is measured only then; if no wall passes, \
        the margins are ignored"),
    optional(number("inflation", &LENGTH, ("0 m", "100 m"), |c| &mut c.localizer.gating.inflation.0,
        "standard deviation that each independent contradiction adds to the position of a lost robot. Up to ten times that, and in radians to its heading, up \
        to 0.26. 0: none")),
    optional(number("max_distance_without_fix", &LENGTH, ("1 mm", "10000 m"), |c| &mut c.localizer.gating.max_distance_without_fix.0,
        "travel without a used range after which the verdict is `Degraded`")),
    optional(number("max_position_deviation", &LENGTH, ("1 mm", "1000 m"), |c| &mut c.localizer.gating.max_position_deviation.0,
        "position deviation in any direction above which the verdict is `Degraded`")),
] };

#[rustfmt::skip]
static ECHO: Section<RobotConfig> = Section { name: "echo", usual, keys: &[
    optional(Key::new("sensor", Value::Own("an echo model of the list above", |node, c| ranger_file::read_echo_sensor(&node, c), |_| None),
        "default of the other keys. Only the NXT's is from recordings; `\"ideal\"`: no clutter, exact map")),
    optional(number("missed", &FRACTION, ("0", "1"), |c| &mut c.localizer.echo.missed,
        "probability that a wall within range and square to the beam returns no echo. Below 1 together with `short` and `long`")),
    optional(number("short", &FRACTION, ("0", "1"), |c| &mut c.localizer.echo.short, "probability of a spurious range that is shorter than the wall's")),
    optional(number("long", &FRACTION, ("0", "1"), |c| &mut c.localizer.echo.long, "probability of a spurious range that is longer")),
    optional(number("free_path", &LENGTH, ("0 m", "10000 m"), |c| &mut c.localizer.echo.free_path.0,
        "range at which every second beam meets an object that is not in the map. 0: there are no such objects")),
    optional(number("map_accuracy", &LENGTH, ("0 m", "10 m"), |c| &mut c.localizer.echo.map_accuracy.0,
        "standard deviation of the place of a wall without an `accuracy` of its own: 5 mm in a measured room, 60 mm in a SLAM map. It is common to ranges to \
        one wall from one place, so that repeated pings do not average it away")),
    optional(number("late", &LENGTH, ("0 m", "1 m"), |c| &mut c.localizer.echo.late.0,
        "mean by which an echo from the normal is reported too far, by missed cycles and the threshold of the detector")),
    optional(number("late_per_radian", &LENGTH, ("0 m", "1 m"), |c| &mut c.localizer.echo.late_per_radian.0,
        "by how much more per radian between the axis of the sonar and the normal of the wall")),
    optional(number("half_angle", &ANGLE, ("0 deg", "90 deg"), |c| &mut c.localizer.echo.half_angle.0,
        "angle between the axis of the sonar and the normal of a wall at which it hears half of the echoes: it explains echoes, and `cone` chooses walls. \
        0: the `cone` is taken")),
    optional(number("rim", &ANGLE, ("0 deg", "90 deg"), |c| &mut c.localizer.echo.rim.0,
        "standard deviation of that angle from ping to ping")),
] };

#[rustfmt::skip]
static SCHEDULE: Section<RobotConfig> = Section { name: "schedule", usual, keys: &[
    Key::new("policy", Value::Word(&["nearest", "informative"], |c| usize::from(c.localizer.policy == Policy::Informative), |c, word| {
        c.localizer.policy = if word == 0 { Policy::Nearest } else { Policy::Informative };
    }), "measures the nearest wall, or the one with the highest expected information gain on the position per time"),
    optional(number("heading_weight", &LENGTH, ("0 m", "1000 m"), |c| &mut c.localizer.weights.heading.0,
        "weight of the heading in the gain, in metres of position per radian: a lever arm")),
    optional(number("wheels_weight", &LENGTH, ("0 m", "1000 m"), |c| &mut c.localizer.weights.wheels.0,
        "weight of a wheel's scale error in the gain, in metres of position per 100 %")),
] };

#[rustfmt::skip]
pub(crate) static GYRO: Section<GyroParameters> = Section { name: "gyro", usual: || GyroParameters::MPU_6050, keys: &[
    Key::new("sensor", Value::Word(&["mpu6050"], |_| 0, |_, _| {}), "the sensor. Also for an MPU-6500 or MPU-9250"),
    optional(number("range", &TURN_RATE, ("1 deg/s", "2000 deg/s"), |g| &mut g.range.0,
        "largest rate. The driver sets the smallest range of the sensor that includes it")),
    optional(number("noise", &ANGLE_WALK, ("0.000001 deg/sqrt(s)", "100 deg/sqrt(s)"), |g| &mut g.noise.0.0,
        "white noise of the rate, as the angle after one second")),
    optional(number("bias", &TURN_RATE, ("0.00001 deg/s", "1000 deg/s"), |g| &mut g.bias.0, "standard deviation of the bias at the start")),
    optional(number("bias_walk", &TURN_RATE_WALK, ("0 deg/s/sqrt(s)", "100 deg/s/sqrt(s)"), |g| &mut g.bias_walk.0.0,
        "random walk of the bias in one second")),
    optional(number("scale", &FRACTION, ("0 %", "50 %"), |g| &mut g.scale, "standard deviation of its scale error")),
    optional(number("period", &TIME, ("1 ms", "50 ms"), |g| &mut g.period, "time from one sample to the next")),
    optional(Key::new("inverted", Value::Flag(|g| &mut g.is_inverted), "whether it is mounted upside down")),
] };

const ON_OFF: &[&str] = &["off", "on"];

#[rustfmt::skip]
static MOTORS: Section<RobotConfig> = Section { name: "motors", usual, keys: &[
    optional(Key::new("lost", Value::Word(ON_OFF, |c| usize::from(c.motors.lost), |c, word| c.motors.lost = word == 1),
        "while the verdict is `Lost`. On, because a robot that searches for its pose drives meanwhile: needed with `start = \"unknown\"`")),
    optional(Key::new("dead_encoder", Value::Word(ON_OFF, |c| usize::from(c.motors.dead_encoder), |c, word| c.motors.dead_encoder = word == 1),
        "once the localizer has had no odometry for 0.5 s")),
    optional(Key::new("lost_link", Value::Word(ON_OFF, |c| usize::from(c.motors.lost_link), |c, word| c.motors.lost_link = word == 1),
        "once the robot has received no valid frame of a command for `link_timeout`. With `\"off\"`, the program that drives the robot must send a command \
        regularly, for example `MapChecksum`")),
    optional(number("link_timeout", &TIME, ("1 ms", "3600 s"), |c| &mut c.motors.link_timeout, "time without a frame after which the link counts as lost")),
] };

/// The tables of `docs/formats.md`.
pub(crate) fn rows() -> Vec<(&'static str, String)> {
    let main = [&ROBOT, &DRIVE, &PRIOR, &GATING, &ECHO, &SCHEDULE, &MOTORS].map(Section::rows);
    let others = [
        REGION.rows(),
        WHEEL.rows(),
        SONAR.rows(),
        PULSE.rows(),
        SERVO_TIMING.rows(),
        RANGER.rows(),
        BEAM.rows(),
        GYRO.rows(),
    ];
    main.into_iter().chain(others).collect()
}

/// The explanation of each key of a table.
pub(crate) fn notes() -> HashMap<String, &'static str> {
    let tables = [&ROBOT, &DRIVE, &PRIOR, &GATING, &ECHO, &SCHEDULE, &MOTORS];
    let notes = tables.into_iter().flat_map(Section::notes);
    notes.chain(SONAR.notes()).chain(GYRO.notes()).collect()
}
