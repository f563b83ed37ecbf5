//! The `[absolute]` table of a scenario: sensors that measure heading, position or pose from outside.

use crate::keys::{Key, Section, Value, number, optional};
use crate::quantity::{ANGLE, FRACTION, LENGTH, TIME};

/// When a sensor measures, and how often it is wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampling {
    /// Time between two measurements, µs.
    pub period: u64,
    /// Time from a measurement to its arrival, µs.
    pub delay: u64,
    /// Probability that a measurement is an outlier.
    pub outliers: f64,
}

impl Sampling {
    /// Every 0.73 s, between the samples of the encoders, and 20 ms late.
    pub const EXAMPLE: Self = Self { period: 730_000, delay: 20_000, outliers: 0.0 };
}

/// A sensor of the heading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadingSensor {
    /// When it measures.
    pub sampling: Sampling,
    /// Standard deviation of its noise, radians.
    pub deviation: f64,
}

impl HeadingSensor {
    /// A calibrated compass that its surroundings disturb little: 2°, every 0.73 s and 20 ms late.
    pub const COMPASS: Self =
        Self { sampling: Sampling::EXAMPLE, deviation: 2.0 * std::f64::consts::PI / 180.0 };
}

/// A sensor of the position, or of the pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionSensor {
    /// When it measures.
    pub sampling: Sampling,
    /// Standard deviation of the noise of x and of y, metres.
    pub deviation: f64,
    /// Standard deviation of the heading, radians; `None` if it does not measure it.
    pub heading_deviation: Option<f64>,
}

/// The sensors that measure from outside.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AbsoluteSensors {
    /// A compass.
    pub heading: Option<HeadingSensor>,
    /// A beacon or a camera.
    pub position: Option<PositionSensor>,
}

const NO_SAMPLING: Sampling = Sampling { period: 0, delay: 0, outliers: 0.0 };

/// A sensor of the heading before its keys are read.
const NO_HEADING: HeadingSensor = HeadingSensor { sampling: NO_SAMPLING, deviation: 0.0 };

/// A sensor of the position before its keys are read.
const NO_POSITION: PositionSensor =
    PositionSensor { sampling: NO_SAMPLING, deviation: 0.0, heading_deviation: None };

#[rustfmt::skip]
pub(crate) static ABSOLUTE: Section<AbsoluteSensors> = Section { name: "absolute", usual: AbsoluteSensors::default, keys: &[
    optional(Key::new("heading", Value::Own("a table", |node, a| a.heading = Some(HEADING.read(node, NO_HEADING)), |_| None), "a compass")),
    optional(Key::new("position", Value::Own("a table", |node, a| a.position = Some(POSITION.read(node, NO_POSITION)), |_| None),
        "a beacon. With `heading_deviation` a camera, which measures the pose")),
] };

#[rustfmt::skip]
pub(crate) static HEADING: Section<HeadingSensor> = Section { name: "absolute_heading", usual: || NO_HEADING, keys: &[
    number("deviation", &ANGLE, ("0.0001 deg", "360 deg"), |s| &mut s.deviation,
        "standard deviation of the noise. The robot receives it with the measurement"),
    number("period", &TIME, ("1 ms", "3600 s"), |s| &mut s.sampling.period, "time between two measurements"),
    optional(number("delay", &TIME, ("0 s", "3600 s"), |s| &mut s.sampling.delay, "time until it arrives at the robot")),
    optional(number("outliers", &FRACTION, ("0", "1"), |s| &mut s.sampling.outliers, "how many are an outlier: any heading")),
] };

#[rustfmt::skip]
pub(crate) static POSITION: Section<PositionSensor> = Section { name: "absolute_position", usual: || NO_POSITION, keys: &[
    number("deviation", &LENGTH, ("0.001 mm", "1000 m"), |s| &mut s.deviation, "standard deviation of the noise, of x and of y each"),
    optional(number("heading_deviation", &ANGLE, ("0.0001 deg", "360 deg"), |s| &mut s.heading_deviation, "standard deviation of the heading")),
    number("period", &TIME, ("1 ms", "3600 s"), |s| &mut s.sampling.period, "time between two measurements"),
    optional(number("delay", &TIME, ("0 s", "3600 s"), |s| &mut s.sampling.delay, "time until it arrives at the robot")),
    optional(number("outliers", &FRACTION, ("0", "1"), |s| &mut s.sampling.outliers,
        "how many are an outlier: up to 5 m away along x and y")),
] };
