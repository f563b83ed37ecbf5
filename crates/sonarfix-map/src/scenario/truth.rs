//! The `[truth]` table of a scenario: the true parameters.

use super::upsets::{self, UPSET, Upset, Upsets};
use crate::keys::{Key, Section, Value, number, optional};
use crate::quantity::{
    ANGLE, FRACTION, LENGTH, LENGTH_PER_LENGTH, LENGTH_WALK, SCALE_WALK, TURN_RATE,
};

/// The true parameters of the robot, which the filter does not receive.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Truth {
    /// Track width, metres.
    pub track_width: f64,
    /// Scale error of the right wheel, dimensionless.
    pub scale_right: f64,
    /// Scale error of the left wheel, dimensionless.
    pub scale_left: f64,
    /// Scale error of the ranger, dimensionless.
    pub range_scale: f64,
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
    /// The gyro; without effect on a robot that has none.
    pub gyro: GyroTruth,
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
    optional(Key::new("heading_slip", Value::Own("a table of `every`, `least` and `most`", |node, t| upsets::read_heading_slip(node, &mut t.1.heading_slip), |_| None),
        "slips of one of the wheels while the robot drives. The wheel spins for 0.5 s, so that the odometry turns by `least` to `most` and the robot does \
        not")),
    optional(Key::new("gyro", Value::Own("a table of `bias` and `scale`", |node, t| t.0.gyro = GYRO.read(node, GyroTruth::default()), |_| None),
        "errors of the gyro")),
] };

#[rustfmt::skip]
pub(crate) static GYRO: Section<GyroTruth> = Section { name: "gyro_truth", usual: GyroTruth::default, keys: &[
    optional(number("bias", &TURN_RATE, ("-1000 deg/s", "1000 deg/s"), |g| &mut g.bias,
        "bias at the start. Without this key it is drawn with the deviation in `[gyro]`")),
    optional(number("scale", &FRACTION, ("-100 %", "100 %"), |g| &mut g.scale, "scale error")),
] };
