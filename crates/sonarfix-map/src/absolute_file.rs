//! The `[absolute]` table of a scenario: sensors that measure heading, position or pose from outside.

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
pub(crate) const NO_HEADING: HeadingSensor =
    HeadingSensor { sampling: NO_SAMPLING, deviation: 0.0 };

/// A sensor of the position before its keys are read.
pub(crate) const NO_POSITION: PositionSensor =
    PositionSensor { sampling: NO_SAMPLING, deviation: 0.0, heading_deviation: None };
