//! The table of typical values. Each row is a key, a quantity, its usual interval, and where the interval comes from.

use super::facts::{Fact, Facts};
use super::rule::{Cause, Measure, Reading, Rule, cause};
use crate::error::Mistake;
use crate::quantity::{
    ANGLE, ANGLE_WALK, FRACTION, LENGTH, LENGTH_PER_LENGTH, LENGTH_WALK, NUMBER, SCALE_WALK, SPEED,
    TEMPERATURE, TIME, TURN_RATE, TURN_RATE_WALK,
};

const INCHES: Cause = cause("the number looks like inches", |r| 0.0254 * r.number);
const FEET: Cause = cause("the number looks like feet", |r| 0.3048 * r.number);
const RADIUS: Cause = cause("that looks like the radius", |r| 2.0 * r.si);
const DIAMETER: Cause = cause("that looks like the diameter", |r| 0.5 * r.si);
const HALF: Cause =
    cause("that looks like half of it: write the whole distance from wheel to wheel", |r| {
        2.0 * r.si
    });
const DOUBLE: Cause = cause("that looks like twice the value", |r| 0.5 * r.si);
const FULL_CONE: Cause =
    cause("that looks like the full angle; the key is half of it", |r| 0.5 * r.si);
const FAHRENHEIT: Cause =
    cause("the number looks like degrees Fahrenheit", |r| (r.number - 32.0) / 1.8);
const KELVIN: Cause = cause("the number looks like kelvin", |r| r.number - 273.15);
const PERCENT: Cause = cause("the number looks like per cent", |r| 0.01 * r.si);
const FRACTION_OF_ONE: Cause = cause("the number looks like a fraction of 1", |r| 100.0 * r.si);
const KMH: Cause = cause("the number looks like km/h", |r| r.number / 3.6);
const QUADRUPLE: Cause =
    cause("that looks like the lines of the encoder: each has four edges", |r| 4.0 * r.si);
const QUARTER: Cause = cause("the factor 4 seems to be counted twice", |r| 0.25 * r.si);
const GEAR: Cause = Cause {
    why: "an encoder on the motor shaft has lines x 4 x gear ratio: a factor seems to be missing, or the gear ratio is inverted",
    undo: |r| if r.number < 5e5 { 50.0 * r.si.max(4.0) } else { f64::NAN },
    is_exact: false,
};
const NO_GEAR: Cause = Cause {
    why: "lines x 4 x gear ratio: a factor seems to be counted twice",
    undo: |r| r.si / 50.0,
    is_exact: false,
};
const PROBABILITY: Cause = Cause {
    why: "the key is a number of standard deviations, 2 or 3, not a probability",
    undo: |_| 2.0,
    is_exact: false,
};
const SERVO_ANGLES: Cause = Cause {
    why: "the angles look like those of the servo, from 0 to 180; a bearing is 0 ahead and positive to the left, so \
          that the servo turns from -90 deg to 90 deg",
    undo: |_| 0.0,
    is_exact: false,
};

const HARDWARE: &str = "docs/hardware.md";
const HOBBY: &str = "wheels of robot kits 19 mm to 125 mm, of carriers to 500 mm";

/// Whether the servo has its pulses in reality, and the robot only one sonar.
fn has_hobby_servo(facts: &Facts) -> bool {
    facts.word("sonar.servo_timing").is_some_and(|timing| timing != "instant")
        && facts.with("sonar.mount[0]").count() == 1
}

fn pulse(facts: &Facts, fact: &Fact) -> Option<(f64, f64)> {
    let other = facts.with("sonar.servo_pulses.bearing").find(|other| other.table != fact.table)?;
    let width = |fact: &Fact| facts.beside(fact, "sonar.servo_pulses.width")?.value(&TIME);
    let (one, two) = (fact.value(&ANGLE)?, other.value(&ANGLE)?);
    let (first, second) = (width(fact)?, width(other)?);
    (has_hobby_servo(facts) && first < second).then_some((second - first, two - one))
}

fn turn_per_millisecond(facts: &Facts, fact: &Fact) -> Option<f64> {
    let (width, turn) = pulse(facts, fact)?;
    Some(1e-3 * turn.abs() / width)
}

fn bearing_in_the_middle(facts: &Facts, fact: &Fact) -> Option<f64> {
    let (width, turn) = pulse(facts, fact)?;
    let at = facts.beside(fact, "sonar.servo_pulses.width")?.value(&TIME)?;
    Some(fact.value(&ANGLE)? + turn * (1.5e-3 - at) / width)
}

/// The bearings of a robot with one sonar on a servo, rightmost first.
fn bearings(facts: &Facts, _: &Fact) -> Option<[f64; 2]> {
    let is_alone = facts.with("sonar.mount[0]").count() == 1;
    let bearing = |id| facts.number(id, &ANGLE).filter(|_| is_alone);
    Some([bearing("sonar.servo[0]")?, bearing("sonar.servo[1]")?])
}

fn track_width(facts: &Facts, _: &Fact) -> Option<f64> {
    facts.number("drive.track_width", &LENGTH)
}

fn half_track(facts: &Facts, fact: &Fact) -> Option<f64> {
    track_width(facts, fact).map(|width| 0.5 * width)
}

fn true_track_width(facts: &Facts, _: &Fact) -> Option<f64> {
    facts.number("truth.track_width", &LENGTH)
}

fn circumference(facts: &Facts, fact: &Fact) -> Option<f64> {
    let side = fact.id.split('.').nth(1)?;
    let diameter = facts.number(&format!("drive.{side}.diameter"), &LENGTH)?;
    Some(std::f64::consts::PI * diameter)
}

fn right_circumference(facts: &Facts, _: &Fact) -> Option<f64> {
    Some(std::f64::consts::PI * facts.number("drive.right_wheel.diameter", &LENGTH)?)
}

/// The reach of a ranger by its datasheet (docs/hardware.md): half cone in radians, shortest and longest range in metres.
fn datasheet(facts: &Facts, fact: &Fact) -> Option<[f64; 3]> {
    let ranger = facts.with("sonar.ranger").find(|other| other.table == fact.table)?;
    let [cone, least, most] = match ranger.text.as_str() {
        "hc_sr04" => [15.0, 0.02, 4.0],
        "lv_maxsonar" => [15.0, 0.15, 6.45],
        "srf02" => [27.0, 0.15, 6.0],
        "srf08" => [27.0, 0.03, 6.0],
        "polaroid_6500" => [10.0, 0.15, 10.7],
        "vl53l1x" => [20.0, 0.04, 4.0],
        "vl53l0x" => [20.0, 0.03, 2.0],
        _ => return None,
    };
    Some([cone * std::f64::consts::PI / 180.0, least, most])
}

fn true_wheel_noise(facts: &Facts, _: &Fact) -> Option<f64> {
    facts.number("truth.wheel_noise", &LENGTH_WALK)
}

fn duration(facts: &Facts, _: &Fact) -> Option<f64> {
    facts.duration
}

fn path_turn_rate(facts: &Facts, _: &Fact) -> Option<f64> {
    facts.number("path.turn_rate", &TURN_RATE)
}

fn robot_temperature(facts: &Facts, _: &Fact) -> Option<f64> {
    Some(273.15 + facts.number("sonar.temperature", &TEMPERATURE)?)
}

#[rustfmt::skip]
pub(super) static RULES: &[Rule] = &[
    // Wheels.
    Rule::new("drive.right_wheel.diameter", "the diameter of a wheel", &LENGTH, ("8 mm", "60 cm"), HOBBY).because(&[INCHES, RADIUS]),
    Rule::new("drive.left_wheel.diameter", "the diameter of a wheel", &LENGTH, ("8 mm", "60 cm"), HOBBY).because(&[INCHES, RADIUS]),
    Rule::new("drive.left_wheel.diameter", "the diameter of a wheel", &LENGTH, ("0.93", "1.07"), "both wheels are of one type")
        .per("that of the right wheel", |f, _| f.number("drive.right_wheel.diameter", &LENGTH)).because(&[RADIUS, DIAMETER, INCHES]),
    Rule::new("drive.right_wheel.edges_per_revolution", "the number of edges in a revolution of the wheel", &NUMBER, ("4", "1000000"), HARDWARE).because(&[GEAR]),
    Rule::new("drive.left_wheel.edges_per_revolution", "the number of edges in a revolution of the wheel", &NUMBER, ("4", "1000000"), HARDWARE).because(&[GEAR]),
    Rule::new("drive.left_wheel.edges_per_revolution", "the number of edges in a revolution of the wheel", &NUMBER, ("0.93", "1.07"), "both encoders are of one type; is a factor missing or doubled in lines x 4 x gear ratio?")
        .per("that of the right wheel", |f, _| f.number("drive.right_wheel.edges_per_revolution", &NUMBER))
        .because(&[QUADRUPLE, QUARTER, cause("that looks like twice the number", |r| 0.5 * r.si), cause("that looks like half of the number", |r| 2.0 * r.si), GEAR, NO_GEAR]),
    Rule::new("drive.right_wheel.edges_per_revolution", "the number of edges in a revolution of the wheel", &NUMBER, ("330", "1500000"), "an edge of 1 µm to 3 mm")
        .per("the circumference in metres", circumference).because(&[GEAR, NO_GEAR]),
    Rule::new("drive.left_wheel.edges_per_revolution", "the number of edges in a revolution of the wheel", &NUMBER, ("330", "1500000"), "an edge of 1 µm to 3 mm")
        .per("the circumference in metres", circumference).because(&[GEAR, NO_GEAR]),
    Rule::new("drive.right_wheel.travel_per_edge", "the travel of a wheel per edge", &LENGTH, ("0.001 mm", "6 mm"), HARDWARE)
        .because(&[cause("one over the travel: edges per millimetre", |r| 1e-3 / r.number), cause("that looks like the travel of a revolution", |r| r.si / 360.0)]),
    Rule::new("drive.left_wheel.travel_per_edge", "the travel of a wheel per edge", &LENGTH, ("0.001 mm", "6 mm"), HARDWARE)
        .because(&[cause("one over the travel: edges per millimetre", |r| 1e-3 / r.number), cause("that looks like the travel of a revolution", |r| r.si / 360.0)]),
    Rule::new("drive.left_wheel.travel_per_edge", "the travel of a wheel per edge", &LENGTH, ("0.93", "1.07"), "both wheels are of one type")
        .per("that of the right wheel", |f, _| f.number("drive.right_wheel.travel_per_edge", &LENGTH))
        .because(&[cause("that looks like the travel per line: a line has four edges", |r| 0.25 * r.si), QUADRUPLE, DOUBLE, cause("that looks like half of it", |r| 2.0 * r.si)]),
    // Chassis.
    Rule::new("drive.track_width", "the distance between the wheels", &LENGTH, ("25 mm", "2.5 m"), "kits 65 mm to 350 mm, carriers to 1.5 m").because(&[INCHES, FEET]),
    Rule::new("drive.track_width", "the distance between the wheels", &LENGTH, ("0.8", "1.25"), "the truth of the same scenario")
        .per("the true one in [truth]", true_track_width).because(&[HALF, DOUBLE, INCHES]),
    Rule::new("drive.track_width", "the distance between the wheels", &LENGTH, ("0.15", "16"), "a robot is as wide as 1 to 8 of its wheels")
        .per("the circumference of a wheel over π", |f, a| right_circumference(f, a).map(|c| c / std::f64::consts::PI)).because(&[INCHES, HALF]),
    Rule::new("drive.max_wheel_speed", "the largest speed of a wheel", &SPEED, ("3 cm/s", "6 m/s"), "gear motors of kits: 0.2 m/s to 2 m/s").because(&[KMH]),
    Rule::new("drive.max_wheel_speed", "the largest speed of a wheel", &SPEED, ("0.1", "60"), "gear motors turn at 20 to 1,000 rpm")
        .per("a revolution of the wheel per second", right_circumference).because(&[KMH]),
    Rule::new("drive.encoder_period", "the period of the encoder samples", &TIME, ("1 ms", "300 ms"), "the loop samples at 5 Hz to 200 Hz")
        .because(&[cause("the number looks like a rate in hertz", |r| 1.0 / r.number)]),
    Rule::new("drive.wheel_noise", "the noise of a wheel's travel", &LENGTH_WALK, ("0.03 mm/sqrt(m)", "40 mm/sqrt(m)"), "0.5 mm/√m on a hard floor, up to 20 mm/√m on a bad one"),
    Rule::new("drive.wheel_noise", "the noise of a wheel's travel", &LENGTH_WALK, ("0.1", "30"), "the truth of the same scenario")
        .per("the true one in [truth]", true_wheel_noise),
    Rule::new("drive.scale_walk", "the walk of a wheel's scale error", &SCALE_WALK, ("1e-7 /sqrt(m)", "5e-3 /sqrt(m)"), "0.1 % in 100 m is 1e-4 /√m").or_zero().because(&[PERCENT]),
    Rule::new("drive.track_width_walk", "the walk of the track width", &LENGTH_WALK, ("0.0001 mm/sqrt(m)", "2 mm/sqrt(m)"), "0.2 mm in 100 m is 0.02 mm/√m").or_zero(),
    // Ranger.
    Rule::new("sonar.mount[0]", "the place of the sonar ahead of the axle", &LENGTH, ("-2.5", "2.5"), "the sonar is on the robot")
        .per("the track width", track_width).because(&[INCHES]),
    Rule::new("sonar.mount[1]", "the place of the sonar to the left of the middle", &LENGTH, ("-1.2", "1.2"), "the sonar is on the robot")
        .per("the track width", track_width).because(&[INCHES]),
    Rule::new("sonar.servo[0]", "a bearing", &ANGLE, ("-180 deg", "180 deg"), "half a turn"),
    Rule::new("sonar.servo[1]", "a bearing", &ANGLE, ("-180 deg", "180 deg"), "half a turn"),
    Rule::new("sonar.bearing", "a bearing", &ANGLE, ("-180 deg", "180 deg"), "half a turn"),
    Rule::new("sonar.servo[0]", "the range of the servo's bearings", &ANGLE, ("20 deg", "360 deg"), "hobby servos turn by 120° to 270°")
        .computed(|f, a| bearings(f, a).map(|[right, left]| left - right).filter(|range| *range > 0.0))
        .because(&[cause("the numbers look like radians", |r| r.si.to_degrees())]),
    Rule::new("sonar.servo[0]", "the middle of the servo's bearings", &ANGLE, ("-60 deg", "60 deg"), "the servo looks ahead")
        .computed(|f, a| bearings(f, a).map(|[right, left]| 0.5 * (left + right))).because(&[SERVO_ANGLES]),
    Rule::new("sonar.servo_pulses.width", "the pulse of a servo", &TIME, ("400 us", "2.7 ms"), "hobby servos take 0.5 ms to 2.5 ms").when(has_hobby_servo),
    Rule::new("sonar.servo_pulses.bearing", "the turn of the servo with a millisecond of pulse", &ANGLE, ("50 deg", "160 deg"), "hobby servos turn by 90° with a millisecond of pulse, those for 270° by 135°")
        .computed(turn_per_millisecond)
        .because(&[cause("the bearings look like radians", |r| r.si.to_degrees()), Cause { why: "a hobby servo turns by 90 degrees from 1000 us to 2000 us, and by 180 degrees from 500 us to 2500 us; measure the bearings", undo: |_| 1.5, is_exact: false }]),
    Rule::new("sonar.servo_pulses.bearing", "the bearing with a pulse of 1.5 ms", &ANGLE, ("-50 deg", "50 deg"), "1.5 ms is the middle of a servo, which is ahead")
        .computed(bearing_in_the_middle).because(&[SERVO_ANGLES]),
    Rule::new("sonar.servo_timing.sixty_degrees", "the time of a servo for 60°", &TIME, ("10 ms", "1 s"), "datasheets: 0.07 s to 0.25 s").or_zero(),
    Rule::new("sonar.servo_timing.frame", "the period of the pulses", &TIME, ("1 ms", "40 ms"), "analogue servos 20 ms, digital ones 3 ms").or_zero()
        .because(&[cause("the number looks like a rate in hertz", |r| 1.0 / r.number)]),
    Rule::new("sonar.servo_timing.settle", "the time in which a servo settles", &TIME, ("1 ms", "1 s"), HARDWARE).or_zero(),
    Rule::new("sonar.cone", "half of the cone of a ranger", &ANGLE, ("1 deg", "60 deg"), "datasheets: 7° to 30°"),
    Rule::new("sonar.cone", "half of the cone of a ranger", &ANGLE, ("0.2", "1.9"), "datasheet of the ranger")
        .per("that of its datasheet", |f, a| datasheet(f, a).map(|d| d[0])).because(&[FULL_CONE]),
    Rule::new("sonar.min_range", "the shortest range of a ranger", &LENGTH, ("1 mm", "60 cm"), "datasheets: 2 cm to 45 cm").or_zero().because(&[INCHES]),
    Rule::new("sonar.max_range", "the longest range of a ranger", &LENGTH, ("15 cm", "25 m"), "datasheets: 1.2 m to 10.7 m").because(&[FEET]),
    Rule::new("sonar.max_range", "the longest range of the ranger", &LENGTH, ("0.1", "1.3"), "datasheet of the ranger")
        .per("that of its datasheet", |f, a| datasheet(f, a).map(|d| d[2])).because(&[FEET]),
    Rule::new("sonar.min_range", "the shortest range of the ranger", &LENGTH, ("0.15", "15"), "datasheet of the ranger").or_zero()
        .per("that of its datasheet", |f, a| datasheet(f, a).map(|d| d[1])),
    Rule::new("sonar.noise", "the noise of a range", &LENGTH, ("0.1 mm", "50 mm"), "sonars 2 mm to 25 mm (docs/sonar-model.md)"),
    Rule::new("sonar.noise_per_metre", "the noise of a range per metre", &LENGTH_PER_LENGTH, ("0.05 mm/m", "50 mm/m"), "sonars 1 mm/m to 20 mm/m").or_zero().because(&[PERCENT]),
    Rule::new("sonar.fix_period", "the period of the pings", &TIME, ("15 ms", "20 s"), "an echo from 4 m takes 23 ms")
        .because(&[cause("the number looks like a rate in hertz", |r| 1.0 / r.number)]),
    Rule::new("sonar.temperature", "the temperature of the air", &TEMPERATURE, ("-30 degC", "50 degC"), "rooms and halls").because(&[FAHRENHEIT, KELVIN]),
    Rule::new("sonar.cycle", "the minimum time between pings", &TIME, ("2 ms", "1 s"), "datasheets: 33 ms to 110 ms").or_zero(),
    Rule::new("sonar.ranger.trigger", "the trigger pulse", &TIME, ("1 us", "1 ms"), "HC-SR04: 10 µs"),
    Rule::new("sonar.ranger.longest", "the longest echo pulse", &TIME, ("2 ms", "200 ms"), "an echo from 4 m takes 23 ms"),
    Rule::new("sonar.ranger.silence", "the pulse without an echo", &TIME, ("2 ms", "500 ms"), "HC-SR04: 38 ms to 200 ms"),
    Rule::new("sonar.ranger.listen", "the time after which a ranger does not answer", &TIME, ("2 ms", "1 s"), HARDWARE),
    Rule::new("sonar.beam.spot", "half of the inner cone of light", &ANGLE, ("0.1 deg", "15 deg"), "VL53L1X: 6.9°, a quarter of its 27°"),
    // Prior and filter.
    Rule::new("prior.scale_right", "the deviation of a wheel's scale", &FRACTION, ("0.02 %", "15 %"), "a calliper measures a wheel to 1 %").or_zero().because(&[FRACTION_OF_ONE, PERCENT]),
    Rule::new("prior.scale_left", "the deviation of a wheel's scale", &FRACTION, ("0.02 %", "15 %"), "a calliper measures a wheel to 1 %").or_zero().because(&[FRACTION_OF_ONE, PERCENT]),
    Rule::new("prior.scale_difference", "the deviation of the difference of the wheels", &FRACTION, ("0.005 %", "15 %"), "wheels of one type: 0.5 %").because(&[FRACTION_OF_ONE, PERCENT]),
    Rule::new("prior.range_scale", "the deviation of the ranges' scale", &FRACTION, ("0.02 %", "12 %"), "0.18 % per °C").or_zero().because(&[FRACTION_OF_ONE, PERCENT]),
    Rule::new("prior.mount", "the deviation of the sonar's place", &LENGTH, ("0.5 mm", "30 mm"), "a ruler measures it to 5 mm").or_zero(),
    Rule::new("prior.track_width", "the deviation of the track width", &LENGTH, ("0.0005", "0.2"), "a tape measures it to 1 % to 5 %").or_zero()
        .per("the track width", track_width),
    Rule::new("gating.confidence", "the confidence of the gate", &NUMBER, ("1", "10"), "2 to 3 standard deviations").or_zero().because(&[PROBABILITY]),
    Rule::new("gating.inflation", "the inflation by a contradiction", &LENGTH, ("1 mm", "3 m"), "a tenth of a room").or_zero(),
    Rule::new("gating.max_distance_without_fix", "the travel without a range", &LENGTH, ("10 cm", "500 m"), "metres"),
    Rule::new("gating.max_position_deviation", "the deviation of a degraded pose", &LENGTH, ("1 cm", "20 m"), "a few decimetres"),
    Rule::new("echo.missed", "the share of missed echoes", &FRACTION, ("0", "0.6"), HARDWARE).because(&[PERCENT]),
    Rule::new("echo.short", "the share of short echoes", &FRACTION, ("0", "0.5"), HARDWARE).because(&[PERCENT]),
    Rule::new("echo.long", "the share of long echoes", &FRACTION, ("0", "0.5"), HARDWARE).because(&[PERCENT]),
    Rule::new("echo.free_path", "the range at which every second beam meets an object", &LENGTH, ("30 cm", "2000 m"), "rooms: 3 m to 30 m").or_zero(),
    Rule::new("echo.map_accuracy", "the accuracy of the map", &LENGTH, ("0.1 mm", "40 cm"), "a measured room 5 mm, a SLAM map 60 mm").or_zero(),
    Rule::new("echo.late", "how late an echo is", &LENGTH, ("0.01 mm", "6 cm"), HARDWARE).or_zero(),
    Rule::new("echo.half_angle", "the angle at which every second echo returns", &ANGLE, ("2 deg", "80 deg"), "NXT: 32°").or_zero(),
    Rule::new("gyro.range", "the largest rate of the gyro", &TURN_RATE, ("50 deg/s", "2000 deg/s"), "MPU-6050: 250 °/s to 2000 °/s"),
    Rule::new("gyro.range", "the largest rate of the gyro", &TURN_RATE, ("1.05", "1000"), "the robot turns no faster than its gyro measures")
        .per("the turn rate of the path", path_turn_rate),
    Rule::new("gyro.noise", "the noise of the gyro", &ANGLE_WALK, ("0.0005 deg/sqrt(s)", "0.2 deg/sqrt(s)"), "MPU-6050: 0.005 °/√s"),
    Rule::new("gyro.bias", "the deviation of the gyro's bias", &TURN_RATE, ("0.005 deg/s", "40 deg/s"), "MPU-6050: 20 °/s before, 0.1 °/s after a rest"),
    Rule::new("gyro.bias_walk", "the walk of the gyro's bias", &TURN_RATE_WALK, ("0.000001 deg/s/sqrt(s)", "0.2 deg/s/sqrt(s)"), "MPU-6050: 0.001 °/s/√s").or_zero(),
    Rule::new("gyro.scale", "the deviation of the gyro's scale", &FRACTION, ("0.05 %", "10 %"), "MPU-6050: 3 %").or_zero().because(&[FRACTION_OF_ONE, PERCENT]),
    Rule::new("motors.link_timeout", "the time without a frame", &TIME, ("50 ms", "300 s"), "a few seconds"),
    // Scenario.
    Rule::new("path.speed", "the speed of a robot", &SPEED, ("8 mm/s", "4 m/s"), "kits 0.1 m/s to 0.6 m/s, carriers to 2 m/s").because(&[KMH]),
    Rule::new("path.turn_rate", "the turn rate of a robot on the spot", &TURN_RATE, ("3 deg/s", "720 deg/s"), "kits 30 °/s to 180 °/s"),
    Rule::new("path.clearance", "the clearance of the path", &LENGTH, ("0.8", "100"), "half of the robot is at each side of its path").or_zero()
        .per("half the track width", half_track),
    Rule::new("start.position", "the deviation of the start", &LENGTH, ("0.1 mm", "1 m"), "placed by hand: 1 cm to 5 cm").or_zero(),
    Rule::new("start.heading", "the deviation of the heading at the start", &ANGLE, ("0.04 deg", "45 deg"), "placed by hand: 1° to 5°").or_zero(),
    Rule::new("truth.track_width", "the distance between the wheels", &LENGTH, ("25 mm", "2.5 m"), "kits 65 mm to 350 mm, carriers to 1.5 m").because(&[INCHES]),
    Rule::new("truth.scale_right", "the scale error of a wheel", &FRACTION, ("-15 %", "15 %"), "a few per cent").because(&[PERCENT, SCALE_FACTOR]),
    Rule::new("truth.scale_left", "the scale error of a wheel", &FRACTION, ("-15 %", "15 %"), "a few per cent").because(&[PERCENT, SCALE_FACTOR]),
    Rule::new("truth.range_scale", "the scale error of the ranger", &FRACTION, ("-15 %", "15 %"), "0.18 % per °C").because(&[PERCENT, SCALE_FACTOR]),
    Rule::new("truth.range_offset", "what is added to each range", &LENGTH, ("-10 cm", "10 cm"), "a few centimetres").because(&[INCHES]),
    Rule::new("truth.servo_zero", "the error of a servo's zero", &ANGLE, ("-30 deg", "30 deg"), "mounted by a tooth of the horn: 15°"),
    Rule::new("truth.servo_scale", "the scale error of a servo", &FRACTION, ("-25 %", "25 %"), "a few per cent").because(&[PERCENT, SCALE_FACTOR]),
    Rule::new("truth.wheel_noise", "the noise of a wheel's travel", &LENGTH_WALK, ("0.01 mm/sqrt(m)", "40 mm/sqrt(m)"), "0.5 mm/√m on a hard floor").or_zero(),
    Rule::new("truth.scale_walk", "the walk of a wheel's scale error", &SCALE_WALK, ("1e-7 /sqrt(m)", "5e-3 /sqrt(m)"), "0.1 % in 100 m is 1e-4 /√m").or_zero().because(&[PERCENT]),
    Rule::new("truth.track_width_walk", "the walk of the track width", &LENGTH_WALK, ("0.0001 mm/sqrt(m)", "2 mm/sqrt(m)"), "0.2 mm in 100 m is 0.02 mm/√m").or_zero(),
    Rule::new("truth.range_noise", "the noise of a range", &LENGTH, ("0.05 mm", "50 mm"), "sonars 2 mm to 25 mm").or_zero(),
    Rule::new("truth.range_noise_per_metre", "the noise of a range per metre", &LENGTH_PER_LENGTH, ("0.01 mm/m", "50 mm/m"), "sonars 1 mm/m to 20 mm/m").or_zero(),
    Rule::new("truth.cone", "half of the cone of a ranger", &ANGLE, ("1 deg", "60 deg"), "datasheets: 7° to 30°"),
    Rule::new("truth.slip.every", "the distance between two slips", &LENGTH, ("10 cm", "10000 m"), "metres"),
    Rule::new("truth.slip.by", "the travel of a slip", &LENGTH, ("0.05 mm", "20 cm"), "millimetres").or_zero(),
    Rule::new("truth.bump.every", "the distance between two bumps", &LENGTH, ("10 cm", "10000 m"), "metres"),
    Rule::new("truth.bump.by", "the travel of a bump", &LENGTH, ("0.05 mm", "20 cm"), "millimetres").or_zero(),
    Rule::new("truth.gyro.bias", "the bias of a gyro", &TURN_RATE, ("-40 deg/s", "40 deg/s"), "MPU-6050: 20 °/s"),
    Rule::new("truth.gyro.scale", "the scale error of a gyro", &FRACTION, ("-15 %", "15 %"), "MPU-6050: 3 %").because(&[PERCENT, SCALE_FACTOR]),
    Rule::new("world.temperature", "the temperature of the air", &TEMPERATURE, ("-30 degC", "50 degC"), "rooms and halls").because(&[FAHRENHEIT, KELVIN]),
    Rule::new("world.temperature", "the temperature of the air", &TEMPERATURE, ("-0.16", "0.16"), "the robot knows its air to 40 °C")
        .per("the absolute one that the robot assumes", robot_temperature).or_zero().because(&[FAHRENHEIT]),
    Rule::new("world.obstacle.radius", "the radius of an obstacle", &LENGTH, ("2 mm", "3 m"), "a chair's leg 1 cm, a person 20 cm").because(&[DIAMETER]),
    Rule::new("world.obstacle.takes", "how long an obstacle moves", &TIME, ("200 ms", "3600 s"), "a person walks 1 m/s"),
    Rule::new("absolute.heading.deviation", "the noise of a compass", &ANGLE, ("0.05 deg", "40 deg"), "1° to 10°"),
    Rule::new("absolute.position.deviation", "the noise of a position", &LENGTH, ("0.5 mm", "10 m"), "a camera 1 cm, a beacon 10 cm"),
    Rule::new("absolute.position.heading_deviation", "the noise of a camera's heading", &ANGLE, ("0.02 deg", "40 deg"), "1°"),
    Rule::new("absolute.heading.period", "the period of a sensor from outside", &TIME, ("5 ms", "600 s"), "0.1 s to 10 s"),
    Rule::new("absolute.position.period", "the period of a sensor from outside", &TIME, ("5 ms", "600 s"), "0.1 s to 10 s"),
    Rule::new("absolute.heading.delay", "the delay of a sensor from outside", &TIME, ("0 s", "3 s"), "milliseconds"),
    Rule::new("absolute.position.delay", "the delay of a sensor from outside", &TIME, ("0 s", "3 s"), "milliseconds"),
    Rule::new("absolute.heading.outliers", "the share of outliers", &FRACTION, ("0", "0.5"), "few").because(&[PERCENT]),
    Rule::new("absolute.position.outliers", "the share of outliers", &FRACTION, ("0", "0.5"), "few").because(&[PERCENT]),
    Rule::new("faults.from", "the time at which a fault begins", &TIME, ("0", "1"), "a fault is within the run").per("the duration of the run", duration),
    Rule::new("faults.late", "the delay of a poll", &TIME, ("1 us", "5 s"), "milliseconds").or_zero(),
];

const SCALE_FACTOR: Cause =
    cause("that looks like the scale; the key is its error, the scale less 1", |r: Reading| {
        r.si - 1.0
    });

/// Angles of which a file has the number in radians.
pub(super) const ANGLES: [&str; 5] = [
    "sonar.servo[0]",
    "sonar.servo[1]",
    "sonar.servo_pulses.bearing",
    "sonar.bearing",
    "sonar.cone",
];

/// What a value that its reader refuses was probably meant to be, as it is written in a file.
pub(crate) fn meant(key: &str, text: &str, is_number: bool) -> Option<String> {
    let fact = Fact::refused(key, text, is_number);
    RULES.iter().filter(|rule| rule.key == fact.id).find_map(|rule| rule.suggestion(&fact))
}

/// The improbable values of a file with mistakes, besides them: one of them may be the cause of a mistake.
pub(crate) fn suspects(text: &str, name: &str, mistakes: &[Mistake]) -> Vec<Mistake> {
    if mistakes.is_empty() {
        return Vec::new();
    }
    let is_known =
        |warning: &Mistake| mistakes.iter().any(|mistake| mistake.key().starts_with(warning.key()));
    let warnings = of_facts(&Facts::of_one(text, name)).into_iter();
    warnings.filter(|warning| !is_known(warning)).map(Mistake::suspected).collect()
}

/// The warnings about the numbers of a file.
pub(super) fn of_facts(facts: &Facts) -> Vec<Mistake> {
    let mut warnings = Vec::new();
    let mut warn = |fact: &Fact, message: String| {
        if fact.report() {
            warnings.push(fact.warn(message));
        }
    };
    for fact in ANGLES.iter().flat_map(|id| facts.with(id)) {
        if let Some(message) = radians(fact) {
            warn(fact, message);
        }
    }
    // A value that is wrong by itself is not compared with others.
    let is_first = |rule: &&Rule| matches!(rule.measure, Measure::Value);
    let (first, second): (Vec<&Rule>, Vec<&Rule>) = RULES.iter().partition(is_first);
    for rule in first.into_iter().chain(second) {
        for fact in facts.with(rule.key) {
            if let Some(message) = rule.judge(facts, fact) {
                warn(fact, message);
            }
        }
    }
    warnings
}

/// The message for an angle in degrees whose number is a usual one in radians: a multiple of 15° with two decimals.
fn radians(fact: &Fact) -> Option<String> {
    let (number, unit) = ANGLE.split(&fact.text)?;
    let steps = number.to_degrees() / 15.0;
    let decimals = fact.text.split('.').nth(1)?.chars().take_while(char::is_ascii_digit).count();
    let precision = 0.6 * 10_f64.powi(-i32::try_from(decimals).ok()?);
    let distance = ((steps.round() * 15.0).to_radians() - number).abs();
    let is_radians = unit == "deg" && decimals >= 2 && steps.round().abs() >= 1.0;
    (is_radians && number.abs() < 3.2 && distance < precision).then(|| {
        let degrees = 15.0 * steps.round();
        format!(
            "{} is {degrees} degrees in radians; did you mean {}?",
            fact.quoted(),
            fact.quoted_as(&format!("{degrees} deg"))
        )
    })
}
