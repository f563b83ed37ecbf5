//! The `[truth]` table of a scenario: the true parameters.

use sonarfix::geometry::units::Radians;
use sonarfix_hal::config::{RobotConfig, WheelConfig};
use sonarfix_hal::servo::MeasuredPulse;

use super::upsets::{self, UPSET, Upset, Upsets};
use crate::document::Node;
use crate::keys::{Key, Section, Value, depends, number, optional};
use crate::quantity::{
    ANGLE, FRACTION, LENGTH, LENGTH_PER_LENGTH, LENGTH_WALK, SCALE_WALK, TURN_RATE,
};
use crate::robot_file::drive::read_wheel;
use crate::robot_file::sonar::read_pulses;

/// The true parameters of the robot, which the filter does not receive.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Truth {
    /// Track width, metres.
    pub track_width: f64,
    /// Scale error of the right wheel, dimensionless; −2 for an encoder that counts in the other direction than in the robot file.
    pub scale_right: f64,
    /// Scale error of the left wheel, dimensionless.
    pub scale_left: f64,
    /// Scale error of the ranger, dimensionless.
    pub range_scale: f64,
    /// Added to each range, metres.
    pub range_offset: f64,
    /// White noise of each wheel's travel, m/√m.
    pub wheel_noise: f64,
    /// Random walk of the wheels' scale errors, 1/√m.
    pub scale_walk: f64,
    /// Random walk of the track width, m/√m.
    pub track_width_walk: f64,
    /// Standard deviation of a range, at range zero, metres.
    pub range_noise: f64,
    /// Standard deviation of a range per metre of range, dimensionless.
    pub range_noise_per_metre: f64,
    /// Half of the sonar's cone, radians.
    pub cone: f64,
    /// Where the first ranger is mounted, ahead and to the left, metres; `None` for the place in the robot file.
    pub mount: [Option<f64>; 2],
    /// Two pulses of the first servo with the bearings of the ranger; `None` for those of the robot file.
    pub servo_pulses: Option<[MeasuredPulse; 2]>,
    /// Bearing of the first ranger where the robot file states 0, radians.
    pub servo_zero: f64,
    /// Scale error of the first servo, dimensionless: it turns 1 + this times the angle from 0 that the robot file states.
    pub servo_scale: f64,
    /// The gyro; without effect on a robot that has none.
    pub gyro: GyroTruth,
}

impl Truth {
    /// The robot with the true mount and servo of its first ranger.
    #[must_use]
    pub fn robot(&self, robot: &RobotConfig) -> RobotConfig {
        let mut built = *robot;
        let mount = &mut built.localizer.rangers.first.mount;
        for (assumed, built) in [&mut mount.x.0, &mut mount.y.0].into_iter().zip(self.mount) {
            #[expect(clippy::cast_possible_truncation, reason = "as in the robot file")]
            let built = built.map(|built| built as f32);
            *assumed = built.unwrap_or(*assumed);
        }
        let pulses = &mut built.rangers.first.servo_pulses;
        *pulses = self.servo_pulses.unwrap_or(*pulses);
        for pulse in pulses {
            let bearing = (1.0 + self.servo_scale) * f64::from(pulse.bearing.0) + self.servo_zero;
            #[expect(clippy::cast_possible_truncation, reason = "as in the robot file")]
            let bearing = Radians(bearing as f32);
            pulse.bearing = bearing;
        }
        built
    }
}

/// The errors of a servo, instead of its pulses.
const BY_ERROR: [&str; 2] = ["servo_zero", "servo_scale"];
/// The keys of a sonar on a servo.
const OF_SERVO: [&str; 3] = ["servo_pulses", BY_ERROR[0], BY_ERROR[1]];

/// The table as it is written: a wheel by its scale error, or as somebody has measured it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Stated {
    truth: Truth,
    upsets: Upsets,
    right_wheel: Option<WheelConfig>,
    left_wheel: Option<WheelConfig>,
}

/// The true parameters of a gyro.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct GyroTruth {
    /// Bias at the start, rad/s; without this key it is drawn with the deviation that the robot assumes.
    pub bias: Option<f64>,
    /// Scale error, dimensionless.
    pub scale: f64,
}

#[rustfmt::skip]
pub(crate) static TRUTH: Section<Stated> = Section { name: "truth", usual: Stated::default, keys: &[
    number("track_width", &LENGTH, ("1 cm", "10 m"), |t| &mut t.truth.track_width, "true track width"),
    depends(number("scale_right", &FRACTION, ("-99 %", "1000 %"), |t| &mut t.truth.scale_right,
        "scale error of the right wheel, a fraction. It rolls 1 + this times the encoder reading")),
    depends(number("scale_left", &FRACTION, ("-99 %", "1000 %"), |t| &mut t.truth.scale_left, "scale error of the left wheel")),
    depends(Key::new("right_wheel", Value::Own("a table as in `[drive]`", |node, t| t.right_wheel = Some(read_wheel(node)), |_| None),
        "instead of `scale_right`: the right wheel and its encoder as they are")),
    depends(Key::new("left_wheel", Value::Own("a table as in `[drive]`", |node, t| t.left_wheel = Some(read_wheel(node)), |_| None),
        "instead of `scale_left`: the left wheel and its encoder as they are")),
    optional(Key::new("mount", Value::Pair(&LENGTH, ("-10 m", "10 m"), |t| { let [x, y] = &mut t.truth.mount; [x, y] }),
        "place of the first sonar, by default that of the robot file")),
    optional(Key::new("servo_pulses", Value::Own("two tables of `width` and `bearing`", |node, t| t.truth.servo_pulses = Some(read_pulses(&node)), |_| None),
        "two pulses of the first servo and the true bearing of the sonar at each, by default those of the robot file")),
    optional(number("servo_zero", &ANGLE, ("-90 deg", "90 deg"), |t| &mut t.truth.servo_zero,
        "instead of `servo_pulses`: bearing of the first sonar where the robot file states 0")),
    optional(number("servo_scale", &FRACTION, ("-50 %", "50 %"), |t| &mut t.truth.servo_scale,
        "instead of `servo_pulses`: scale error of the first servo. It turns 1 + this times the angle from 0 that the robot file states")),
    number("range_scale", &FRACTION, ("-99 %", "1000 %"), |t| &mut t.truth.range_scale,
        "scale error of the ranger, a fraction. It reports 1 + this times the distance"),
    optional(number("range_offset", &LENGTH, ("-1 m", "1 m"), |t| &mut t.truth.range_offset, "added to each range")),
    number("wheel_noise", &LENGTH_WALK, ("0 m/sqrt(m)", "1 m/sqrt(m)"), |t| &mut t.truth.wheel_noise, "true value of the key of `[drive]`"),
    number("scale_walk", &SCALE_WALK, ("0 /sqrt(m)", "1 /sqrt(m)"), |t| &mut t.truth.scale_walk, "the same"),
    number("track_width_walk", &LENGTH_WALK, ("0 m/sqrt(m)", "1 m/sqrt(m)"), |t| &mut t.truth.track_width_walk, "the same"),
    number("range_noise", &LENGTH, ("0 m", "10 m"), |t| &mut t.truth.range_noise, "true value of `noise` of `[sonar]`"),
    number("range_noise_per_metre", &LENGTH_PER_LENGTH, ("0 m/m", "1 m/m"), |t| &mut t.truth.range_noise_per_metre, "true value of `noise_per_metre`"),
    number("cone", &ANGLE, ("0.1 deg", "89 deg"), |t| &mut t.truth.cone, "half of the cone in which the sonar receives echoes"),
    optional(Key::new("slip", Value::Own("a table of `every` and `by`", |node, t| t.upsets.slip = UPSET.read(node, Upset::default()), |_| None),
        "random slips: a wheel turns by `by` without rolling")),
    optional(Key::new("bump", Value::Own("a table of `every` and `by`", |node, t| t.upsets.bump = UPSET.read(node, Upset::default()), |_| None),
        "random bumps that change the travel of a wheel by a normally distributed amount, whose standard deviation is `by`")),
    optional(Key::new("heading_slip", Value::Own("a table of `every`, `least` and `most`", |node, t| upsets::read_heading_slip(node, &mut t.upsets.heading_slip), |_| None),
        "slips of one of the wheels while the robot drives. The wheel spins for 0.5 s, so that the odometry turns by `least` to `most` and the robot does \
        not")),
    optional(Key::new("gyro", Value::Own("a table of `bias` and `scale`", |node, t| t.truth.gyro = GYRO.read(node, GyroTruth::default()), |_| None),
        "errors of the gyro")),
] };

/// Reads the table of a scenario with this robot.
pub(crate) fn read(node: Node<'_>, robot: Option<&RobotConfig>) -> (Truth, Upsets) {
    let table = node.table(&TRUTH.names());
    let Stated { mut truth, upsets, right_wheel, left_wheel } =
        TRUTH.read_from(&table, Stated::default());
    let wheels = [
        (&mut truth.scale_right, ["scale_right", "right_wheel"], right_wheel),
        (&mut truth.scale_left, ["scale_left", "left_wheel"], left_wheel),
    ];
    let assumed = robot.map_or([None; 2], |robot| [robot.right_wheel, robot.left_wheel].map(Some));
    for ((scale, [by_scale, by_wheel], wheel), assumed) in wheels.into_iter().zip(assumed) {
        match (table.get(by_scale), table.get(by_wheel)) {
            (None, None) => drop(table.require(by_scale)),
            (Some(_), Some(node)) => {
                node.report(format!("contradicts {by_scale}: remove one of them"));
            }
            _ => {}
        }
        if let (Some(wheel), Some(assumed)) = (wheel, assumed) {
            let [wheel, assumed] = [wheel, assumed].map(|it| f64::from(it.signed_travel().0));
            *scale = wheel / assumed - 1.0;
        }
    }
    let is_fixed =
        robot.is_some_and(|robot| robot.localizer.rangers.first.fixed_bearing().is_some());
    for name in OF_SERVO {
        if let Some(node) = table.get(name).filter(|_| is_fixed) {
            node.report("is of a sonar on a servo, and that of the robot file has none");
        }
    }
    for name in BY_ERROR {
        if let Some(node) = table.get(name).filter(|_| table.get("servo_pulses").is_some()) {
            node.report("contradicts servo_pulses: remove one of them");
        }
    }
    (truth, upsets)
}

#[rustfmt::skip]
pub(crate) static GYRO: Section<GyroTruth> = Section { name: "gyro_truth", usual: GyroTruth::default, keys: &[
    optional(number("bias", &TURN_RATE, ("-1000 deg/s", "1000 deg/s"), |g| &mut g.bias,
        "bias at the start. Without this key it is drawn with the deviation in `[gyro]`")),
    optional(number("scale", &FRACTION, ("-100 %", "100 %"), |g| &mut g.scale, "scale error")),
] };
